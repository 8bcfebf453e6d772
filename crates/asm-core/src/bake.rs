//! Plans that bake irradiance onto a receiver's UV square.

use frame_plan::{
    Bound, ExecuteError, Executor, Limits, PassStep, Plan, ResourceId, Step, Targets, TextureFormat,
};
use glam::{UVec2, Vec4};
use serde::{Deserialize, Serialize};
use spectral_scene::{IrradianceMaps, Scene};

use crate::caustics::Caustics;
use crate::decisions::Output;
use crate::lights::{Purpose, Receivers};
use crate::passes::receiver_bake::ReceiverBake;
use crate::passes::uv_visibility::UvVisibility;
use crate::planner::GeometryCache;
use crate::resources::cleared;
use crate::statistics::{Books, Statistics};
use crate::update::update;
use crate::{Method, PlanError, Settings, UpdateError};

/// A plan whose frame is a bake, and what is needed to read it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakePlan {
    /// What an executor runs.
    pub plan: Plan,
    /// Texels in u and v.
    pub size: [u32; 2],
    irradiance: ResourceId,
    books: Books,
}

/// Size of the map where the settings leave it open: at least the first, at most the second.
pub(crate) const DEFAULT_MAP_SIZES: (u32, u32) = (512, 2048);

/// Samples of a bake, along each side, that a texel of a finer map calls for: fewer would miss what it shows.
const SAMPLES_PER_MAP_TEXEL: f64 = 2.0;

/// Most samples per texel of a bake, along each side, that a fine map calls for: one thread takes all of a texel's.
const MOST_SAMPLES: u32 = 128;

/// A plan that bakes onto `receiver`, an index into [`Scene::objects`], `size` texels in u and v.
///
/// Subsamples count where a triangle covers them in UV space; texels that no sample covers stay 0.
///
/// # Errors
/// [`PlanError`], before anything is allocated on a device.
pub fn bake_plan(
    scene: &Scene,
    receiver: usize,
    size: [u32; 2],
    settings: &Settings,
    limits: &Limits,
) -> Result<BakePlan, PlanError> {
    plan(&mut GeometryCache::default(), scene, receiver, size, settings, limits)
}

/// As [`bake_plan`], with what `cache` has kept.
pub(crate) fn plan(
    cache: &mut GeometryCache,
    scene: &Scene,
    receiver: usize,
    size: [u32; 2],
    settings: &Settings,
    limits: &Limits,
) -> Result<BakePlan, PlanError> {
    scene.validate()?;
    settings.check()?;
    let receiver_name = check_receiver(scene, receiver)?;
    check_size(size)?;
    let (least, most) = DEFAULT_MAP_SIZES;
    let map_size = settings.map_size.unwrap_or(size[0].max(size[1]).clamp(least, most));
    // Texels are means: as fine as the map, lest they miss what lies between. Fewer samples where the texture that holds them
    // would be too large.
    let as_fine = map_size.div_ceil(size[0].min(size[1])).min(MOST_SAMPLES);
    let fitting = limits.max_texture_size / size[0].max(size[1]);
    let samples = settings.bake_samples.max(as_fine).min(fitting.max(1));
    let purpose = Purpose {
        name: format!("bake `{receiver_name}` of {}", scene.name),
        receivers: Receivers::Object(receiver),
        map_size,
        most_zoom: f64::from(samples * size[0].min(size[1])) / (SAMPLES_PER_MAP_TEXEL * f64::from(map_size)),
        texels: (settings.method == Method::Footprint).then_some(UVec2::from(size)),
        camera: None,
    };
    let mut caustics = Caustics::new(cache, scene, settings, limits, &purpose)?;
    caustics.decide(&Output::Bake { receiver: &receiver_name });
    let texels = u64::from(size[0]) * u64::from(size[1]);
    let sampled = size.map(|s| s * samples);
    let uv_visible =
        caustics.resources.texture("uv", TextureFormat::R32Uint, sampled, 1, "the bake's size")?;
    let corner_uvs = caustics.resources.filled("corner uvs", &caustics.geometry.corner_uvs)?;
    let layers = if caustics.reflects() { 3 } else { 2 };
    let irradiance = caustics.resources.buffer("irradiance", 16 * layers * texels, "the bake's size")?;
    caustics.resources.make_readable(irradiance);
    let groups = caustics.resources.groups(size, 1, "the bake's size")?;

    let triangles = caustics.geometry.objects[receiver].clone();
    caustics.begin();
    caustics.resources.plan.steps.push(Step::ClearBuffer { buffer: irradiance });
    let params = UvVisibility { first_triangle: triangles.start, reserved0: 0, reserved1: 0, reserved2: 0 };
    let params = caustics.resources.plan.add_params("uv_visibility", &params);
    if caustics.lights() > 0 {
        caustics.resources.plan.steps.push(Step::Draw {
            pass: PassStep {
                pass: "uv_visibility".into(),
                label: receiver_name,
                params: Some(params),
                bindings: vec![corner_uvs.into()],
            },
            targets: Targets { color: vec![cleared(uv_visible, 0)], depth: None },
            vertices: 3 * triangles.len() as u32,
            instances: 1,
        });
    }
    for i in 0..caustics.lights() {
        let light = caustics.light(i)?;
        let params = ReceiverBake {
            light: light.params,
            size: UVec2::from(size),
            samples,
            first_triangle: triangles.start,
        };
        let bindings = [
            caustics.triangles,
            caustics.views,
            corner_uvs,
            light.caustic,
            uv_visible,
            light.direct,
            light.landing,
            light.reflected,
            light.entry,
            irradiance,
        ];
        caustics.dispatch("receiver_bake", &light.label, &params, bindings.map(Bound::from).to_vec(), groups);
    }
    let books = caustics.books();
    Ok(BakePlan { plan: caustics.resources.plan, size, irradiance, books })
}

pub(crate) fn check_size(size: [u32; 2]) -> Result<(), PlanError> {
    if !size.contains(&0) {
        return Ok(());
    }
    Err(PlanError::Setting {
        setting: "size",
        got: format!("{}x{}", size[0], size[1]),
        expected: "at least 1x1".into(),
    })
}

fn check_receiver(scene: &Scene, receiver: usize) -> Result<String, PlanError> {
    let Some(object) = scene.objects.get(receiver) else {
        return Err(PlanError::NoSuch { what: "object", index: receiver, count: scene.objects.len() });
    };
    let name = object.name.clone();
    if scene.material_of(receiver).is_refractor() {
        return Err(PlanError::NotAReceiver { object: name, reason: "light passes through it" });
    }
    if scene.material_of(receiver).is_mirror() {
        return Err(PlanError::NotAReceiver {
            object: name,
            reason: "it is a mirror, light does not land on it",
        });
    }
    if scene.meshes[object.mesh].uvs.is_empty() {
        return Err(PlanError::NotAReceiver { object: name, reason: "it has no texture coordinates" });
    }
    Ok(name)
}

impl BakePlan {
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

    /// What the last frame of `executor`, which runs this plan, left behind.
    ///
    /// # Errors
    /// Those of [`Executor::read`].
    pub fn read(&self, executor: &mut dyn Executor) -> Result<(IrradianceMaps, Statistics), ExecuteError> {
        let bytes = executor.read(self.irradiance)?;
        let texels: Vec<Vec4> = bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect();
        let layer = |texels: &[Vec4]| texels.iter().map(|t| t.truncate().to_array()).collect::<Vec<_>>();
        let (direct, others) = texels.split_at(self.size[0] as usize * self.size[1] as usize);
        let (refracted, reflected) = others.split_at(direct.len());
        let maps = IrradianceMaps {
            width: self.size[0],
            height: self.size[1],
            direct: layer(direct),
            refracted: layer(refracted),
            reflected: if reflected.is_empty() { vec![[0.0; 3]; direct.len()] } else { layer(reflected) },
        };
        Ok((maps, self.books.read(executor)?))
    }
}
