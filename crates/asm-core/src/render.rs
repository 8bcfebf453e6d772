//! Plans that make a camera's picture.

use frame_plan::{Bound, ExecuteError, Executor, Limits, Plan, ResourceId, Step, TextureFormat};
use glam::{DVec3, UVec2, Vec3, Vec4};
use serde::{Deserialize, Serialize};
use spectral_core::rgb::RgbSpace;
use spectral_scene::{Camera, Effects, Material, Scene};

use crate::bake::{DEFAULT_MAP_SIZES, check_size};
use crate::caustics::Caustics;
use crate::decisions::{CameraGlass, Output};
use crate::glass_view::{BACKGROUND_BYTES, CameraBuffers};
use crate::lights::{Purpose, Receivers};
use crate::passes::shade::{Shade, Surface};
use crate::passes::visibility::{VISIBILITY_ALL_FACES, VISIBILITY_BACK_FACES, Visibility};
use crate::planner::GeometryCache;
use crate::statistics::{Books, Statistics};
use crate::update::{structure_change, update, write_changes};
use crate::{GlassView, PlanError, Settings, UpdateError, WorkingSpace};

/// What a camera sees: XYZ radiance, Y in cd/m^2 where lights are in lux and candela.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row-major from the top left; pixel means.
    pub xyz: Vec<[f32; 3]>,
}

/// A plan whose frame is a picture, and what is needed to read it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderPlan {
    /// What an executor runs.
    pub plan: Plan,
    /// Pixels.
    pub size: [u32; 2],
    picture: ResourceId,
    books: Books,
}

/// Absorption that leaves nothing over any length that f32 tells from 0.
const OPAQUE_PER_UNIT: f64 = 1e20;

/// A plan that renders what `camera`, an index into [`Scene::cameras`], sees, `size` pixels wide and high.
///
/// Opaque surfaces are matt, lit by direct, refracted and reflected light; their base colour is a reflectance at every
/// wavelength. Glass tints what is straight behind it, or bends the view: see [`GlassView`]. Mirrors show what the picture shows
/// where they lead. An eye in a refractor sees through what that lets pass.
///
/// # Errors
/// [`PlanError`], before anything is allocated on a device.
pub fn render_plan(
    scene: &Scene,
    camera: usize,
    size: [u32; 2],
    settings: &Settings,
    limits: &Limits,
) -> Result<RenderPlan, PlanError> {
    plan(&mut GeometryCache::default(), scene, camera, size, settings, limits)
}

/// As [`render_plan`], with what `cache` has kept.
pub(crate) fn plan(
    cache: &mut GeometryCache,
    scene: &Scene,
    camera: usize,
    size: [u32; 2],
    settings: &Settings,
    limits: &Limits,
) -> Result<RenderPlan, PlanError> {
    scene.validate()?;
    settings.check()?;
    check_size(size)?;
    let Some(seen_by) = scene.cameras.get(camera) else {
        return Err(PlanError::NoSuch { what: "camera", index: camera, count: scene.cameras.len() });
    };
    // Fewer samples where the textures that hold them would be too large.
    let fitting = limits.max_texture_size / size[0].max(size[1]);
    let mut samples = settings.picture_samples.min(fitting.max(1));
    let effects = Effects::required_by(scene);
    let glass = effects.deferred_refraction.on || !settings.prune;
    let mut seen = CameraGlass {
        drawn: glass,
        backs: false,
        bends: glass && settings.glass_view() == GlassView::Deferred,
        mirrors: effects.mirror_images.on || !settings.prune,
        inside: if effects.immersion.on { refractor_around(scene, seen_by) } else { None },
    };
    let background_bytes =
        |samples: u32| BACKGROUND_BYTES * u64::from(size[0]) * u64::from(size[1]) * u64::from(samples).pow(2);
    let most_bytes = limits.max_storage_binding_bytes.min(limits.max_buffer_bytes);
    while seen.goes_on() && samples > 1 && background_bytes(samples) > most_bytes {
        samples -= 1;
    }
    let sampled = size.map(|s| s * samples);
    let space = WorkingSpace::of(scene);
    let purpose = Purpose {
        name: format!("picture of {} by `{}`", scene.name, seen_by.name),
        receivers: Receivers::Opaque,
        map_size: settings.map_size.unwrap_or(DEFAULT_MAP_SIZES.0),
        most_zoom: f64::INFINITY,
        texels: None,
        camera: Some(space.camera_view(seen_by, UVec2::from(sampled))),
    };
    let mut caustics = Caustics::new(cache, scene, settings, limits, &purpose)?;
    if caustics.lights() == 0 {
        seen = CameraGlass { bends: false, mirrors: false, inside: None, ..seen };
    }
    seen.backs = glass && (seen.bends || effects.absorption.on || !settings.prune);
    caustics.decide(&Output::Picture(seen));

    let remedy = "the picture's size";
    let nothing = caustics.resources.nothing();
    let mut visibility = |needed: bool, name: &str| {
        if needed {
            caustics.resources.texture(name, TextureFormat::R32Uint, sampled, 1, remedy)
        } else {
            Ok(nothing)
        }
    };
    let opaque_visible = visibility(true, "camera")?;
    let glass_visible = visibility(glass, "camera glass")?;
    let back_visible = visibility(seen.backs, "camera glass backs")?;
    let depth =
        caustics.resources.texture("camera depth", TextureFormat::Depth32Float, sampled, 1, remedy)?;
    let by_light = |reflected: &[[f64; 3]]| {
        let materials = scene.materials.iter().zip(reflected);
        materials.map(|(m, &xyz)| surface(m, xyz, space.metres_per_unit)).collect::<Vec<Surface>>()
    };
    let surfaces: Vec<Surface> = caustics.reflected_xyz().flat_map(by_light).collect();
    let surfaces = caustics.resources.filled("surfaces", &surfaces)?;
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    let picture = caustics.resources.buffer("picture", 16 * pixels, "the picture's size")?;
    caustics.resources.make_readable(picture);
    let view = if seen.goes_on() { Some(caustics.glass_view(&effects, sampled)?) } else { None };
    // Where rays go on, the picture is made from what the samples show first.
    let (shaded, shaded_size, shaded_samples) =
        view.as_ref().map_or((picture, size, samples), |view| (view.background, sampled, 1));
    let groups = caustics.resources.groups(shaded_size, 1, "the picture's size")?;

    caustics.begin();
    caustics.resources.plan.steps.push(Step::ClearBuffer { buffer: shaded });
    let camera_index = caustics.camera_view();
    let (opaque, all) = (caustics.geometry.opaque, caustics.geometry.triangles.len() as u32);
    if caustics.lights() > 0 {
        let draws = [
            (true, "camera", opaque_visible, 0..opaque, VISIBILITY_ALL_FACES),
            (glass, "camera, glass", glass_visible, opaque..all, VISIBILITY_ALL_FACES),
            (seen.backs, "camera, backs of glass", back_visible, opaque..all, VISIBILITY_BACK_FACES),
        ];
        for (_, label, texture, triangles, faces) in draws.into_iter().filter(|(kept, ..)| *kept) {
            let params =
                Visibility { view: camera_index, first_triangle: triangles.start, faces, from_distance: 0.0 };
            caustics.draw_visibility(label.into(), params, triangles.len() as u32, texture, depth, 0);
        }
    }
    for i in 0..caustics.lights() {
        let light = caustics.light(i)?;
        let [x, y, z] = columns(RgbSpace::SRGB.rgb_from_xyz());
        let [r, g, b] = columns(RgbSpace::SRGB.xyz_from_rgb());
        let params = Shade {
            light: light.params,
            size: UVec2::from(shaded_size),
            samples: shaded_samples,
            camera_view: camera_index,
            first_surface: light.light * scene.materials.len() as u32,
            linear_srgb_from_x: x,
            linear_srgb_from_y: y,
            linear_srgb_from_z: z,
            xyz_from_r: r,
            xyz_from_g: g,
            xyz_from_b: b,
            ..bytemuck::Zeroable::zeroed()
        };
        let bindings = [
            caustics.triangles,
            caustics.views,
            surfaces,
            light.caustic,
            opaque_visible,
            if seen.bends { nothing } else { glass_visible },
            if seen.bends { nothing } else { back_visible },
            light.direct,
            light.landing,
            light.reflected,
            light.entry,
            shaded,
        ];
        caustics.dispatch("shade", &light.label, &params, bindings.map(Bound::from).to_vec(), groups);
    }
    let mut books = caustics.books();
    if let Some(view) = &view {
        let camera = CameraBuffers {
            size: UVec2::from(size),
            samples,
            opaque: opaque_visible,
            glass: if seen.bends { glass_visible } else { nothing },
            backs: if seen.bends { back_visible } else { nothing },
            picture,
        };
        caustics.refract_view(view, &camera, &seen)?;
        books.view_counts = Some(view.counts);
    }
    Ok(RenderPlan { plan: caustics.resources.plan, size, picture, books })
}

/// The innermost refractor that a camera's eye is in.
fn refractor_around(scene: &Scene, camera: &Camera) -> Option<usize> {
    scene.refractors_around(camera.world_from_camera.w_axis.truncate()).first().copied()
}

fn surface(material: &Material, reflected_xyz: [f64; 3], metres_per_unit: f64) -> Surface {
    let matt = Surface {
        reflected: DVec3::from(reflected_xyz).as_vec3(),
        index: 1.0,
        tint: Vec3::ONE,
        reserved0: 0,
        absorption: Vec3::ZERO,
        reserved1: 0,
    };
    if !material.is_refractor() {
        return matt;
    }
    let color = DVec3::from(material.base_color);
    let absorption = material.attenuation.map_or(DVec3::ZERO, |a| {
        let per_unit =
            a.color.map(|c| (-c.ln() * metres_per_unit / a.distance_m).clamp(0.0, OPAQUE_PER_UNIT));
        DVec3::from(per_unit)
    });
    Surface {
        index: material.dispersion.n_d() as f32,
        tint: (material.transmission * color).as_vec3(),
        absorption: absorption.as_vec3(),
        ..matt
    }
}

fn columns(rows: [[f64; 3]; 3]) -> [Vec3; 3] {
    std::array::from_fn(|c| DVec3::new(rows[0][c], rows[1][c], rows[2][c]).as_vec3())
}

impl RenderPlan {
    /// Brings an executor that has this plan prepared to `next`, made from the scene with its lights, cameras or objects moved,
    /// or its materials' numbers changed: parameters and buffer contents that differ are written, nothing is allocated or
    /// compiled on the device.
    ///
    /// # Errors
    /// [`UpdateError::StructureChanged`] where the plans differ in more than numbers, before anything is written.
    pub fn update(&mut self, executor: &mut dyn Executor, next: Self) -> Result<(), UpdateError> {
        update(executor, &mut self.plan, next.plan)?;
        self.books = next.books;
        Ok(())
    }

    /// Whether [`RenderPlan::update`] can bring this plan to `next`.
    pub(crate) fn has_structure_of(&self, next: &Self) -> bool {
        structure_change(&self.plan, &next.plan).is_none()
    }

    /// As [`RenderPlan::update`], to a plan of this one's structure.
    pub(crate) fn write_changes(
        &mut self,
        executor: &mut dyn Executor,
        next: Self,
    ) -> Result<(), ExecuteError> {
        write_changes(executor, &mut self.plan, next.plan)?;
        self.books = next.books;
        Ok(())
    }

    /// The buffer that a frame leaves the picture in: XYZ and padding per pixel, f32, rows from the top.
    #[must_use]
    pub const fn picture(&self) -> ResourceId {
        self.picture
    }

    /// From the next frame on, have the statistics come to the host with each frame, for [`RenderPlan::latest_statistics`].
    ///
    /// # Errors
    /// Those of [`Executor::watch`].
    pub fn watch_statistics(&self, executor: &mut dyn Executor) -> Result<(), ExecuteError> {
        self.books.watch(executor)
    }

    /// Statistics of the last frame that is known to have finished, a frame late or more; none if there is none yet. Never waits.
    pub fn latest_statistics(&self, executor: &mut dyn Executor) -> Option<Statistics> {
        self.books.latest(executor)
    }

    /// What the last frame of `executor`, which runs this plan, left behind.
    ///
    /// # Errors
    /// Those of [`Executor::read`].
    pub fn read(&self, executor: &mut dyn Executor) -> Result<(Picture, Statistics), ExecuteError> {
        let bytes = executor.read(self.picture)?;
        let pixel = |bytes: &[u8]| bytemuck::pod_read_unaligned::<Vec4>(bytes).truncate().to_array();
        let xyz = bytes.chunks_exact(16).map(pixel).collect();
        let picture = Picture { width: self.size[0], height: self.size[1], xyz };
        Ok((picture, self.books.read(executor)?))
    }
}
