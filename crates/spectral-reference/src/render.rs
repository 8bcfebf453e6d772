//! Camera pictures by spectral eye rays.

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spectral_core::observer::Observer;
use spectral_scene::{Camera, Scene};

use crate::bake::pool;
use crate::error::{ReferenceError, check_bounces, check_setting, check_size, check_step};
use crate::lamp::{Bundle, Lamp};
use crate::shade::{EyeSink, LightMaps};
use crate::shoot::Shooter;
use crate::sobol::{Sequence, mix};
use crate::trace::{Emission, Limits, Tracer};
use crate::tree::Pending;
use crate::world::World;

/// What to render and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderSettings {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// `None` for the scene's first camera.
    pub camera: Option<Camera>,
    /// Internal reflections followed, by light and by eye rays; see [`crate`].
    pub bounces: u32,
    /// Eye paths per pixel and lamp.
    pub samples_per_pixel: u32,
    /// Photons for the light that reaches matt surfaces by way of glass and mirrors.
    pub photons: u64,
    /// About how many texels each such surface gets, as columns times rows.
    pub bake_size: [u32; 2],
    /// The same seed gives the same bits on any number of threads.
    pub seed: u64,
    /// Threads; `None` for one per core.
    pub threads: Option<usize>,
    /// Whose colour-matching functions.
    pub observer: Observer,
    /// As in [`crate::BakeSettings`].
    pub step_nm: f64,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            size: [1280, 720],
            camera: None,
            bounces: 3,
            samples_per_pixel: 16,
            photons: 1 << 23,
            bake_size: [256, 256],
            seed: 0,
            threads: None,
            observer: Observer::default(),
            step_nm: 1.0,
        }
    }
}

impl RenderSettings {
    fn check(&self) -> Result<(), ReferenceError> {
        check_size(self.size)?;
        check_size(self.bake_size)?;
        check_bounces(self.bounces)?;
        check_step(self.step_nm)?;
        let samples = f64::from(self.samples_per_pixel);
        check_setting(self.samples_per_pixel >= 1, "samples_per_pixel", samples, "at least 1")?;
        check_setting(self.photons >= 1, "photons", self.photons as f64, "at least 1")
    }
}

/// A camera picture.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row-major from the top left; XYZ with Y in cd/m^2, means over the pixels. The background is black.
    pub xyz: Vec<[f32; 3]>,
    /// Photons that were sent.
    pub photons: u64,
    /// Eye and photon rays traced, shadow rays not included.
    pub rays: u64,
}

/// Renders the scene through a camera.
///
/// Eye rays split at glass and turn at mirrors like light does, with the same limits but a coarser cutoff, so glass and
/// mirrors show reflections and refractions of everything else at every wavelength. Matt surfaces are Lambertian: base
/// colour upsampled, times direct light by shadow rays, plus, on their front, light that came by way of glass and mirrors,
/// from photon maps of `bake_size` texels in 20 bands of wavelengths, interpolated bilinearly. A map lies on the mesh's
/// UVs where those give every point a place of its own, else on a chart per triangle. Light is not reflected from one
/// matt surface to another, and lights themselves are not seen.
///
/// An eye may be inside a refractor, or behind an open one (under a water surface that a ray steeply upwards from it
/// meets): then the way to what it sees is attenuated, and the picture is of the radiance in that medium, n^2 times what
/// the same light would be outside.
///
/// # Errors
/// For scenes that break [`Scene::validate`]'s rules, without a camera, and for settings out of range.
pub fn render(
    scene: &Scene,
    settings: &RenderSettings,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Picture, ReferenceError> {
    settings.check()?;
    scene.validate()?;
    let camera = settings.camera.as_ref().or(scene.cameras.first()).ok_or(ReferenceError::NoCamera)?;
    pool(settings.threads)?.install(|| Ok(rendered(scene, camera, settings, progress)))
}

fn rendered(
    scene: &Scene,
    camera: &Camera,
    settings: &RenderSettings,
    progress: &(dyn Fn(f64) + Sync),
) -> Picture {
    progress(0.0);
    let world = World::new(scene);
    let lamps = Lamp::all(scene, settings.observer, settings.step_nm, &world);
    let limits = Limits::of_light(settings.bounces);
    let shooter = Shooter::new(&world, &lamps, Bundle::all(scene, &world, &lamps), limits, settings.seed);
    let map_size = (!shooter.is_idle()).then_some(settings.bake_size);
    let mut maps = LightMaps::new(scene, &world, &lamps, map_size);
    let mut tally = shooter.tally();
    let mut units = 0;
    if !shooter.is_idle() {
        units = settings.photons.div_ceil(shooter.photons_per_unit()).clamp(1, shooter.max_units());
        shooter.shoot(&mut maps, &mut tally, (0, units), &mut |share| progress(0.5 * share));
        maps.finish(shooter.scale(units));
    }
    let view = View::new(camera, settings.size, &world);
    let [width, height] = settings.size;
    let mut xyz = Vec::with_capacity(width as usize * height as usize);
    let mut rays = tally.counts.rays;
    // A band of rows at a time, to report progress in order.
    const ROWS: u32 = 16;
    for first in (0..height).step_by(ROWS as usize) {
        let last = height.min(first + ROWS);
        let band: Vec<([f32; 3], u64)> = (first * width..last * width)
            .into_par_iter()
            .map(|pixel| view.pixel(pixel, &world, &lamps, &maps, settings))
            .collect();
        xyz.extend(band.iter().map(|(xyz, _)| *xyz));
        rays += band.iter().map(|(_, rays)| rays).sum::<u64>();
        progress(0.5 + 0.5 * f64::from(last) / f64::from(height));
    }
    Picture { width, height, xyz, photons: units * shooter.photons_per_unit(), rays }
}

/// A pinhole camera over a grid of pixels.
struct View {
    eye: DVec3,
    world_from_camera: DMat3,
    /// Half the picture's size at distance 1.
    half: [f64; 2],
    size: [u32; 2],
    znear_m: f64,
    nesting: crate::medium::Nesting,
}

impl View {
    fn new(camera: &Camera, size: [u32; 2], world: &World) -> Self {
        let half_height = (0.5 * camera.yfov_rad).tan();
        let eye = camera.world_from_camera.w_axis.truncate();
        Self {
            eye,
            world_from_camera: DMat3::from_mat4(camera.world_from_camera),
            half: [half_height * f64::from(size[0]) / f64::from(size[1]), half_height],
            size,
            znear_m: camera.znear_m,
            nesting: world.nesting_at(eye, &mut Pending::default()),
        }
    }

    /// XYZ of a pixel, and the rays that it took.
    fn pixel(
        &self,
        pixel: u32,
        world: &World,
        lamps: &[Lamp],
        maps: &LightMaps,
        settings: &RenderSettings,
    ) -> ([f32; 3], u64) {
        let samples = settings.samples_per_pixel;
        let sequence = Sequence::new(mix(settings.seed ^ 0xca3e7a) ^ u64::from(pixel));
        let (column, row) = (f64::from(pixel % self.size[0]), f64::from(pixel / self.size[0]));
        let mut xyz = [0.0; 3];
        let mut rays = 0;
        for (lamp_index, lamp) in lamps.iter().enumerate() {
            let (medium, pending) = (world.medium(self.nesting.medium()), Pending::default());
            let sink = EyeSink { maps, lamp, lamp_index, medium, pending, xyz: [0.0; 3] };
            let mut tracer = Tracer::new(world, Limits::of_eye(settings.bounces), sink);
            // XYZ of the wavelengths drawn for this pixel; by its ratio to the light's, white stays white.
            let mut drawn = [0.0; 3];
            for index in 0..samples {
                let [s, t, w] = sequence.point(index);
                let x = 2.0 * (column + s) / f64::from(self.size[0]) - 1.0;
                let y = 1.0 - 2.0 * (row + t) / f64::from(self.size[1]);
                let through = DVec3::new(x * self.half[0], y * self.half[1], -1.0);
                let through = self.world_from_camera * through;
                let lanes = lamp.spectrum.lanes(w);
                for lane in &lanes.lanes[..lanes.len] {
                    for (sum, value) in drawn.iter_mut().zip(lane.xyz) {
                        *sum += value / f64::from(samples);
                    }
                }
                tracer.trace(&Emission {
                    origin: self.eye + through * self.znear_m,
                    direction: through.normalize(),
                    flux: 1.0 / f64::from(samples),
                    nesting: self.nesting,
                    target: None,
                    range_m: f64::INFINITY,
                    lanes,
                    chance: sequence.chance(index),
                });
            }
            rays += tracer.tally.counts.rays;
            for c in 0..3 {
                if drawn[c] > 0.0 {
                    xyz[c] += tracer.sink.xyz[c] * lamp.unit_xyz[c] / drawn[c];
                }
            }
        }
        (xyz.map(|v| v as f32), rays)
    }
}
