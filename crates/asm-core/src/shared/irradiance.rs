//! Host side of `shaders/shared/irradiance.wgsl`: light of one light at a point of an opaque surface.

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::{MirrorArgs, TextureView};
use glam::{IVec2, UVec2, Vec2, Vec3, Vec4};

use super::emission::spot_falloff;
use super::light_views::{locate, on_map};
use super::triangle::{NOTHING, SAME_SURFACE, Triangle, visible_in_layer};
use super::view::{Ray, View};

/// A light as shading sees it; mirrors `Light` in `shaders/shared/irradiance.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Light {
    /// As it arrives: XYZ lux for parallel rays, XYZ candela for rays from an eye.
    pub xyz: Vec3,
    /// Metres per working unit.
    pub metres_per_unit: f32,
    /// Unit axis of the cone.
    pub spot_axis: Vec3,
    /// Squared clamp(cosine * scale + offset) is the cone's falloff.
    pub spot_scale: f32,
    /// See `spot_scale`.
    pub spot_offset: f32,
    /// Dark beyond, working units; 0 has no end.
    pub range: f32,
    /// Distance of the front of the glass: nothing nearer is in the map.
    pub landing_from: f32,
    /// First of the views of all opaque surfaces.
    pub direct_view: u32,
    /// Number of those views.
    pub direct_faces: u32,
    /// First of the views of opaque surfaces behind the front of the glass.
    pub landing_view: u32,
    /// Number of those views; 0 where no refracted light is mapped.
    pub landing_faces: u32,
    /// View of everything round the glass and the mirrors.
    pub emission_view: u32,
    /// 1 where there is an emission view.
    pub emits: u32,
    /// As many as `landing_faces`, or 0 where no reflected light is mapped.
    pub reflected_faces: u32,
    /// First texel of the map of reflected light, in `caustic`.
    pub first_reflected: u32,
    /// First of the views of the map of refracted light, one per view of where light may land.
    pub map_view: u32,
    /// 1: the maps hold a receiver's texels and what arrives there, lux; 0: they are seen from the light.
    pub receiver_map: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
    /// Padding.
    pub reserved2: u32,
}

/// Light that reaches a point, by light path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Irradiance {
    /// Light that met nothing before, lux per lux or candela of the light.
    pub direct: f32,
    /// Light that came through glass, XYZ of the map: lux, and in pictures of that what the surface reflects.
    pub refracted: Vec3,
    /// Light that a mirror or the outside of glass threw back, as `refracted`.
    pub reflected: Vec3,
}

/// The globals that `irradiance_at` uses.
#[derive(Clone, Copy)]
pub struct Lookup<'a> {
    /// `params.light`.
    pub light: Light,
    /// All triangles.
    pub triangles: &'a [Triangle],
    /// All views.
    pub views: &'a [View],
    /// Opaque surfaces.
    pub direct_visibility: TextureView<'a>,
    /// Opaque surfaces behind the front of the glass.
    pub landing_visibility: TextureView<'a>,
    /// Matt surfaces, where reflected light lands.
    pub reflected_visibility: TextureView<'a>,
    /// Everything, in the emission view.
    pub entry_visibility: TextureView<'a>,
    /// The resolved map.
    pub caustic: &'a [Vec4],
}

/// Share of the way to the middle of its triangle from where a point looks for what blocks its light.
const FARTHER_IN: f32 = 1e-4;

/// A point as a light sees it.
#[derive(Clone, Copy)]
struct Lit {
    position: Vec3,
    /// Its triangle, as visibility buffers count.
    own: u32,
    /// From about the position.
    to_light: Ray,
    /// Along the light's ray.
    distance: f32,
    /// How far towards the light anything could stand.
    clear: f32,
}

/// One of the four texels whose centres surround a point.
fn surrounding_texel(texel: Vec2, size: UVec2, i: u32) -> UVec2 {
    let corner = (texel - 0.5).floor().as_ivec2() + IVec2::new((i & 1) as i32, (i >> 1) as i32);
    corner.clamp(IVec2::ZERO, size.as_ivec2() - 1).as_uvec2()
}

impl<'a> Lookup<'a> {
    /// From a pass that binds them all by their names.
    pub(crate) fn bound(args: &MirrorArgs<'a>, light: Light) -> Self {
        Self {
            light,
            triangles: args.read("triangles"),
            views: args.read("views"),
            direct_visibility: args.texture("direct_visibility"),
            landing_visibility: args.texture("landing_visibility"),
            reflected_visibility: args.texture("reflected_visibility"),
            entry_visibility: args.texture("entry_visibility"),
            caustic: args.read("caustic"),
        }
    }
}

impl Lookup<'_> {
    fn blocks(&self, visible: u32, lit: &Lit) -> bool {
        if visible == NOTHING || visible == lit.own {
            return false;
        }
        let hit = self.triangles[visible as usize - 1].plane_hit(lit.to_light);
        hit.inside() && hit.distance > SAME_SURFACE && hit.distance < lit.clear
    }

    /// What the texel shows is nearer to the light than the point, by more than two texels are wide. Triangles smaller than
    /// texels slip through `blocks`; where all surrounding texels show something nearer, it is taken to be in the way.
    fn shows_nearer(&self, visible: u32, lit: &Lit, view: &View, texel: UVec2) -> bool {
        if visible == NOTHING || visible == lit.own {
            return false;
        }
        let hit = self.triangles[visible as usize - 1].plane_hit(view.ray(texel.as_vec2() + 0.5));
        let depth = if view.perspective == 1 { lit.distance } else { 1.0 };
        let width = view.texel_slope.x.max(view.texel_slope.y) * depth;
        hit.crosses && hit.distance < lit.distance - 2.0 * width
    }

    fn blocked_by_opaque(&self, lit: &Lit) -> bool {
        let at = locate(self.views, self.light.direct_view, self.light.direct_faces, lit.position);
        if !at.found {
            return false;
        }
        let view = &self.views[at.view as usize];
        let mut surrounded = true;
        for i in 0..4 {
            let texel = surrounding_texel(at.texel, view.size, i);
            let visible = visible_in_layer(&self.direct_visibility, texel, at.face);
            if self.blocks(visible, lit) {
                return true;
            }
            surrounded = surrounded && self.shows_nearer(visible, lit, view, texel);
        }
        surrounded
    }

    fn blocked_by_glass(&self, lit: &Lit) -> bool {
        if self.light.emits == 0 {
            return false;
        }
        let view = &self.views[self.light.emission_view as usize];
        let at = view.project(lit.position);
        if !view.holds(&at) {
            return false;
        }
        let mut surrounded = true;
        for i in 0..4 {
            let texel = surrounding_texel(at.texel, view.size, i);
            let visible = self.entry_visibility.load_uint(texel.x, texel.y);
            if self.blocks(visible, lit) {
                return true;
            }
            surrounded = surrounded && self.shows_nearer(visible, lit, view, texel);
        }
        surrounded
    }

    /// The texel of a receiver's own map that holds a point.
    fn received_at(&self, p: Vec3, reflected: bool) -> Vec3 {
        let (faces, first) = if reflected {
            (self.light.reflected_faces, self.light.first_reflected)
        } else {
            (self.light.landing_faces, 0)
        };
        let at = locate(self.views, self.light.landing_view, faces, p);
        if !at.found {
            return Vec3::ZERO;
        }
        let size = self.views[at.view as usize].size;
        let texel = at.texel.as_uvec2().min(size - 1);
        self.caustic[(first + texel.y * size.x + texel.x) as usize].truncate()
    }

    /// The map at a point: bilinear, and only where the point is on the surface that the landing view sees.
    fn caustic_at(&self, lit: &Lit, reflected: bool) -> Vec3 {
        let (faces, first, map_view, shown) = if reflected {
            (
                self.light.reflected_faces,
                self.light.first_reflected,
                self.light.landing_view,
                &self.reflected_visibility,
            )
        } else {
            (self.light.landing_faces, 0, self.light.map_view, &self.landing_visibility)
        };
        if faces == 0 || lit.clear < -SAME_SURFACE {
            return Vec3::ZERO;
        }
        let at = locate(self.views, self.light.landing_view, faces, lit.position);
        if !at.found {
            return Vec3::ZERO;
        }
        let view = &self.views[at.view as usize];
        let mut surrounded = true;
        for i in 0..4 {
            let texel = surrounding_texel(at.texel, view.size, i);
            let visible = visible_in_layer(shown, texel, at.face);
            if self.blocks(visible, lit) {
                return Vec3::ZERO;
            }
            surrounded = surrounded && self.shows_nearer(visible, lit, view, texel);
        }
        let place = on_map(self.views, at, self.light.landing_view, map_view, lit.position);
        if surrounded || !place.found {
            return Vec3::ZERO;
        }
        let share = (place.texel - 0.5) - (place.texel - 0.5).floor();
        let mut sum = Vec3::ZERO;
        for i in 0..4 {
            let texel = surrounding_texel(place.texel, view.size, i);
            let weight = (if i & 1 == 1 { share.x } else { 1.0 - share.x })
                * (if i & 2 == 2 { share.y } else { 1.0 - share.y });
            let index = first + (at.face * view.size.y + texel.y) * view.size.x + texel.x;
            sum += weight * self.caustic[index as usize].truncate();
        }
        sum
    }

    /// Light on a surface at `p` with the unit normal `normal`, part of triangle `own` (as visibility buffers count);
    /// light from behind does not count.
    pub fn irradiance_at(&self, p: Vec3, normal: Vec3, own: u32) -> Irradiance {
        let view = &self.views[self.light.direct_view as usize];
        let light_ray = view.ray_through(p);
        let cosine = -light_ray.direction.dot(normal);
        let mut received = Irradiance::default();
        if self.light.receiver_map == 1 {
            received.refracted = self.received_at(p, false);
            received.reflected = self.received_at(p, true);
        }
        if cosine <= 0.0 {
            return received;
        }
        let distance = (p - light_ray.origin).dot(light_ray.direction);
        let mut spread = cosine;
        let mut clear = 1e30;
        if view.perspective == 1 {
            let metres = distance * self.light.metres_per_unit;
            spread = cosine / (metres * metres);
            clear = distance;
        }
        // In a crease rounding could put the point on the wrong side of the other surface: look from a little farther in.
        let t = &self.triangles[own as usize - 1];
        let inner = p + FARTHER_IN * ((t.p0 + t.p1 + t.p2) / 3.0 - p);
        let to_light = Ray { origin: inner, direction: -light_ray.direction };
        let mut lit = Lit { position: p, own, to_light, distance, clear };
        let in_range = self.light.range == 0.0 || distance <= self.light.range;
        if in_range && !self.blocked_by_opaque(&lit) && !self.blocked_by_glass(&lit) {
            let Light { spot_axis, spot_scale, spot_offset, .. } = self.light;
            received.direct = spread * spot_falloff(light_ray.direction, spot_axis, spot_scale, spot_offset);
        }
        if self.light.receiver_map == 0 {
            received.reflected = spread * self.caustic_at(&lit, true);
            lit.clear = distance - self.light.landing_from;
            received.refracted = spread * self.caustic_at(&lit, false);
        }
        received
    }
}
