//! Views of lights and cameras, fitted to what they must see.

use glam::{DVec2, DVec3, UVec2, Vec2};
use spectral_scene::{Camera, Light, LightShape};

use crate::geometry::{Geometry, bounds};
use crate::shared::view::View;
use crate::{PlanError, WorkingSpace};

/// Widest cone that one frustum takes; wider needs several views.
pub(crate) const MAX_OPENING_DEG: f64 = 150.0;

/// Farthest light with an eye, in radii of the scene: beyond, f32 positions at the light are coarser than texels.
const MAX_LIGHT_RADII: f64 = 1e4;

/// Near planes of eyes, as a share of the far plane: reversed float depth stays fine.
const NEAR_SHARE: f64 = 1e-4;

/// Faces of a cube of views overlap by this slope, so that no ray falls between two.
const CUBE_OVERLAP: f64 = 1e-5;

/// Where rays start, in working units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Source {
    /// Parallel rays along a unit direction.
    Parallel(DVec3),
    /// Rays from an eye.
    Eye(DVec3),
}

impl Source {
    pub(crate) fn of(light: &Light, space: &WorkingSpace) -> Result<Self, PlanError> {
        let position_m = match light.shape {
            LightShape::Directional { direction } => return Ok(Self::Parallel(direction.normalize())),
            LightShape::Point { position_m, .. } | LightShape::Spot { position_m, .. } => position_m,
        };
        let eye = space.working_from_world(position_m);
        let radii = eye.length();
        if radii > MAX_LIGHT_RADII {
            let light = light.name.clone();
            return Err(PlanError::LightTooFar { light, radii, max_radii: MAX_LIGHT_RADII });
        }
        Ok(Self::Eye(eye))
    }

    /// Distance along rays to the nearest of the points, from the start plane of this light's views or its eye. For eyes
    /// the distance to the points' bounds, since triangles may come nearer than their corners.
    pub(crate) fn nearest(&self, points: impl Iterator<Item = DVec3>, reach: f64) -> f64 {
        match *self {
            Self::Parallel(direction) => {
                points.map(|p| p.dot(direction) + start_depth(reach)).fold(f64::INFINITY, f64::min)
            }
            Self::Eye(eye) => {
                bounds(points).map_or(f64::INFINITY, |(low, high)| eye.distance(eye.clamp(low, high)))
            }
        }
    }
}

/// Depth in front of the origin where parallel rays start: before everything within `reach` of it.
fn start_depth(reach: f64) -> f64 {
    1.5 * reach
}

/// Unit right, up and forward, upright as far as that goes.
fn axes(forward: DVec3) -> [DVec3; 3] {
    let upright = if forward.y.abs() < 0.999 { DVec3::Y } else { DVec3::NEG_Z };
    let right = forward.cross(upright).normalize();
    [right, right.cross(forward), forward]
}

/// One view of the points, or six where a single frustum would be too wide.
pub(crate) fn fit(
    source: Source,
    points: impl Iterator<Item = DVec3> + Clone,
    grid: Grid,
    reach: f64,
) -> Vec<View> {
    match source {
        Source::Parallel(direction) => vec![fit_parallel(direction, points, grid, reach)],
        Source::Eye(eye) => match fit_frustum(eye, points, grid, reach) {
            Ok(view) => vec![view],
            Err(_) => cube(eye, grid, reach),
        },
    }
}

/// The one view of the points that an emission view must be.
pub(crate) fn fit_one(
    source: Source,
    points: impl Iterator<Item = DVec3> + Clone,
    grid: Grid,
    reach: f64,
    light: &str,
) -> Result<View, PlanError> {
    match source {
        Source::Parallel(direction) => Ok(fit_parallel(direction, points, grid, reach)),
        Source::Eye(eye) => fit_frustum(eye, points, grid, reach).map_err(|opening_deg| {
            PlanError::LightTooClose { light: light.into(), opening_deg, max_deg: MAX_OPENING_DEG }
        }),
    }
}

/// A view's texels.
#[derive(Clone, Copy)]
pub(crate) struct Grid {
    size: UVec2,
    /// Texels left free round what the view is fitted to.
    margin: f64,
}

impl Grid {
    /// A margin of `guard` texels and about half a one more: rounding cuts nothing off, and no texel's centre lies exactly on
    /// the edge of what is seen, where rounding would choose.
    pub(crate) fn of(size: UVec2, guard: u32) -> Self {
        Self { size, margin: f64::from(guard) + 0.49 }
    }
}

/// A view's axes and planes in f64.
struct Frame {
    eye: DVec3,
    axes: [DVec3; 3],
    perspective: bool,
    near: f64,
    far: f64,
}

fn view(frame: &Frame, low: DVec2, high: DVec2, grid: Grid) -> View {
    let size = grid.size;
    let texels = size.as_dvec2();
    // At least half of a view shows something.
    let used = (texels - 2.0 * grid.margin).max(0.5 * texels);
    // Something to look at even where all points are in line.
    let half = (0.5 * (high - low)).max(DVec2::splat(1e-6)) * texels / used;
    let [right, up, forward] = frame.axes.map(|a| a.as_vec3());
    View {
        eye: frame.eye.as_vec3(),
        perspective: u32::from(frame.perspective),
        right,
        near: frame.near as f32,
        up,
        far: frame.far as f32,
        forward,
        reserved: 0.0,
        slope_center: (0.5 * (low + high)).as_vec2(),
        slope_half: half.as_vec2(),
        size,
        texel_slope: (2.0 * half / texels).as_vec2(),
    }
}

fn fit_parallel(direction: DVec3, points: impl Iterator<Item = DVec3>, grid: Grid, reach: f64) -> View {
    let axes = axes(direction);
    let across = points.map(|p| DVec3::new(p.dot(axes[0]), p.dot(axes[1]), 0.0));
    let (low, high) = bounds(across).unwrap_or_default();
    let depth = start_depth(reach);
    let frame = Frame {
        eye: -depth * direction,
        axes,
        perspective: false,
        near: depth - 1.1 * reach,
        far: depth + 1.1 * reach,
    };
    view(&frame, low.truncate(), high.truncate(), grid)
}

/// Share of a receiver's size that its corners may lie beside the plane, or its texture beside a rectangle.
const FLAT: f64 = 1e-4;

/// What a receiver's texture sees: a view straight onto its front whose texels are the texture's. `None` where the receiver is not
/// a plane, or its texture does not lie on it as a rectangle.
pub(crate) fn texture_view(geometry: &Geometry, object: usize, texels: UVec2, reach: f64) -> Option<View> {
    let range = geometry.objects[object].clone();
    let triangles = &geometry.triangles[range.start as usize..range.end as usize];
    let corners = triangles.iter().flat_map(|t| [t.p0, t.p1, t.p2]).map(|p| p.as_dvec3());
    let uvs = geometry.corner_uvs.iter().map(|uv| uv.as_dvec2());
    let corners: Vec<(DVec3, DVec2)> = corners.zip(uvs).collect();
    let [(p, uv), (p1, uv1), (p2, uv2)] = corners.first_chunk::<3>()?;
    let (e1, e2, d1, d2) = (p1 - p, p2 - p, uv1 - uv, uv2 - uv);
    let area = d1.perp_dot(d2);
    // Along u and v, per whole texture.
    let along_u = (e1 * d2.y - e2 * d1.y) / area;
    let along_v = (e2 * d1.x - e1 * d2.x) / area;
    let size = along_u.length().min(along_v.length());
    let square = along_u.dot(along_v).abs() <= FLAT * along_u.length() * along_v.length();
    if !(area.is_finite() && size.is_finite() && size > 0.0 && square) {
        return None;
    }
    let origin = p - uv.x * along_u - uv.y * along_v;
    let flat =
        |(p, uv): &(DVec3, DVec2)| (origin + uv.x * along_u + uv.y * along_v - p).length() <= FLAT * size;
    let front = e1.cross(e2).normalize();
    let one_side = triangles.iter().all(|t| t.scaled_normal().as_dvec3().dot(front) > 0.0);
    if !corners.iter().all(flat) || !one_side {
        return None;
    }
    let axes = [along_u.normalize(), -along_v.normalize(), -front];
    let depth = start_depth(reach);
    let center = origin + 0.5 * (along_u + along_v);
    let middle = DVec2::new(center.dot(axes[0]), center.dot(axes[1]));
    let half = 0.5 * DVec2::new(along_u.length(), along_v.length());
    let frame = Frame {
        eye: -depth * axes[2],
        axes,
        perspective: false,
        near: depth - 1.1 * reach,
        far: depth + 1.1 * reach,
    };
    Some(view(&frame, middle - half, middle + half, Grid { size: texels, margin: 0.0 }))
}

/// The opening in degrees as an error where it is too wide.
fn fit_frustum(
    eye: DVec3,
    points: impl Iterator<Item = DVec3> + Clone,
    grid: Grid,
    reach: f64,
) -> Result<View, f64> {
    let (low, high) = bounds(points.clone()).unwrap_or((eye + DVec3::NEG_Y, eye + DVec3::NEG_Y));
    let middle = 0.5 * (low + high);
    let Some(forward) = (middle - eye).try_normalize() else { return Err(360.0) };
    if eye.cmpgt(low).all() && eye.cmplt(high).all() {
        return Err(360.0);
    }
    let widest = points
        .clone()
        .filter_map(|p| (p - eye).try_normalize())
        .map(|d| d.dot(forward).clamp(-1.0, 1.0).acos())
        .fold(0.0, f64::max);
    let opening_deg = 2.0 * widest.to_degrees();
    if opening_deg > MAX_OPENING_DEG {
        return Err(opening_deg);
    }
    let axes = axes(forward);
    let slopes = points.map(|p| {
        let local = p - eye;
        DVec3::new(local.dot(axes[0]), local.dot(axes[1]), 0.0) / local.dot(forward).max(1e-9)
    });
    let (low, high) = bounds(slopes).unwrap_or_default();
    let far = 1.1 * (eye.length() + reach);
    let frame = Frame { eye, axes, perspective: true, near: NEAR_SHARE * far, far };
    Ok(view(&frame, low.truncate(), high.truncate(), grid))
}

/// Six square frusta round an eye.
fn cube(eye: DVec3, grid: Grid, reach: f64) -> Vec<View> {
    let far = 1.1 * (eye.length() + reach);
    let half = DVec2::splat(1.0 + CUBE_OVERLAP);
    [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z]
        .map(|forward| {
            let frame = Frame { eye, axes: axes(forward), perspective: true, near: NEAR_SHARE * far, far };
            view(&frame, -half, half, grid)
        })
        .to_vec()
}

/// A camera's view of a picture of `size` pixels.
pub(crate) fn camera_view(camera: &Camera, size: UVec2, space: &WorkingSpace, reach: f64) -> View {
    let world_from_camera = camera.world_from_camera;
    let [right, up, backward] =
        [world_from_camera.x_axis, world_from_camera.y_axis, world_from_camera.z_axis]
            .map(|a| a.truncate().normalize());
    let eye = space.working_from_world(world_from_camera.w_axis.truncate());
    let tan = (0.5 * camera.yfov_rad).tan();
    let half = DVec2::new(tan * f64::from(size.x) / f64::from(size.y), tan);
    let far = 1.1 * (eye.length() + reach);
    let near = (camera.znear_m / space.metres_per_unit).clamp(1e-6 * far, 0.5 * far);
    View {
        eye: eye.as_vec3(),
        perspective: 1,
        right: right.as_vec3(),
        near: near as f32,
        up: up.as_vec3(),
        far: far as f32,
        forward: -backward.as_vec3(),
        reserved: 0.0,
        slope_center: Vec2::ZERO,
        slope_half: half.as_vec2(),
        size,
        texel_slope: (2.0 * half / size.as_dvec2()).as_vec2(),
    }
}
