//! Irradiance on one receiver.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spectral_core::observer::Observer;
use spectral_scene::{IrradianceMaps, Scene};

use crate::direct;
use crate::error::{ReferenceError, check_bounces, check_setting, check_size, check_step};
use crate::film::{Coarse, ReceiverFilm};
use crate::lamp::{Bundle, Lamp};
use crate::ledger::{Ledger, Tally};
use crate::shoot::{REPLICATES, Shooter};
use crate::sobol::{Sequence, mix};
use crate::texels::Texels;
use crate::trace::{Layer, Limits};
use crate::tree::Pending;
use crate::world::{GeometryCounts, World};

/// How much work to do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Effort {
    /// So many photons (paths of one wavelength), rounded up to what the lights can be given evenly.
    Photons(u64),
    /// Until the standard error of Y at 64 x 64 is below this share of the signal's RMS, in the refracted layer and in
    /// the sum of the direct and the refracted one; where there are mirrors likewise for the reflected layer. What glass
    /// alone reflects gets its share of the photons afterwards, and its error, alone and within the total, is stated
    /// apart in [`StandardError`]. The number of photons grows towards what the error so far calls for.
    Noise {
        /// Such as 0.0014.
        relative: f64,
        /// Stop here even if the target is not reached.
        max_photons: u64,
        /// Or when so many rays have been traced: that is what takes time. Where there are both glass and mirrors,
        /// either layer has half of them.
        max_rays: u64,
    },
}

impl Effort {
    /// The end if nothing else is said.
    pub const MAX_PHOTONS: u64 = 1 << 32;

    /// A noise target, however long it takes, up to [`Effort::MAX_PHOTONS`].
    pub fn noise(relative: f64) -> Self {
        Self::Noise { relative, max_photons: Self::MAX_PHOTONS, max_rays: u64::MAX }
    }
}

impl Default for Effort {
    /// A standard error of 0.14 %: the difference from an equally noisy bake is then 0.2 %. As many rays as two cores
    /// trace in 6 minutes, where scenes are large, end it earlier.
    fn default() -> Self {
        Self::Noise { relative: 0.0014, max_photons: Self::MAX_PHOTONS, max_rays: 500_000_000 }
    }
}

/// What to bake and how.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakeSettings {
    /// Texels in u and v.
    pub size: [u32; 2],
    /// Internal reflections followed; see [`crate::bake`].
    pub bounces: u32,
    /// When to stop.
    pub effort: Effort,
    /// Another seed gives another, equally good result; the same seed gives the same bits on any number of threads.
    pub seed: u64,
    /// Threads; `None` for one per core.
    pub threads: Option<usize>,
    /// Whose colour-matching functions.
    pub observer: Observer,
    /// Width of the cells of 380 to 780 nm within which light and eye are taken as constant, 1 to 5 nm. Refraction
    /// sees continuous wavelengths.
    pub step_nm: f64,
    /// Shadow rays per texel.
    pub direct_samples: u32,
}

impl Default for BakeSettings {
    fn default() -> Self {
        Self {
            size: [256, 256],
            bounces: 3,
            effort: Effort::default(),
            seed: 0,
            threads: None,
            observer: Observer::default(),
            step_nm: 1.0,
            direct_samples: 256,
        }
    }
}

impl BakeSettings {
    fn check(&self) -> Result<(), ReferenceError> {
        check_size(self.size)?;
        check_bounces(self.bounces)?;
        check_step(self.step_nm)?;
        check_setting(
            self.direct_samples >= 1,
            "direct_samples",
            f64::from(self.direct_samples),
            "at least 1",
        )?;
        match self.effort {
            Effort::Photons(photons) => check_setting(photons >= 1, "photons", photons as f64, "at least 1"),
            Effort::Noise { relative, .. } => {
                check_setting(relative > 0.0 && relative < 1.0, "noise", relative, "above 0 and below 1")
            }
        }
    }
}

/// Standard errors of Y at 64 x 64: RMS of the error over RMS of the layer, 0 for a dark layer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StandardError {
    /// The sum of all layers.
    pub total: f64,
    /// Unblocked light.
    pub direct: f64,
    /// Light that has been in glass.
    pub refracted: f64,
    /// Light reflected by mirrors and the outside of glass.
    pub reflected: f64,
}

/// A baked receiver.
#[derive(Clone, Debug)]
pub struct Bake {
    /// Texel means in f32, as the other methods give them.
    pub maps: IrradianceMaps,
    /// Unblocked light, XYZ with Y in lux, f64, in the order of `maps`.
    pub direct: Vec<[f64; 3]>,
    /// Light that has entered glass, likewise.
    pub refracted: Vec<[f64; 3]>,
    /// Light that met mirrors, and glass only from outside, likewise.
    pub reflected: Vec<[f64; 3]>,
    /// From independent randomisations of the same sampling.
    pub standard_error: StandardError,
    /// Paths of one wavelength that were sent and are in the ledger. Where there is glass the layer `reflected` has paths of
    /// its own.
    pub photons: u64,
    /// Paths of one wavelength that were sent for the layer `reflected` alone: 0 without glass.
    pub reflection_photons: u64,
    /// Where their light went.
    pub ledger: Ledger,
    /// What the meshes were like.
    pub geometry: GeometryCounts,
}

/// Bakes the irradiance on an object of the scene: XYZ, Y in lux, texel means over its UV square.
///
/// * `direct` comes from shadow rays: light that meets nothing, glass and mirrors included.
/// * `refracted` has entered glass and left it after at most `bounces` reflections inside, or has landed inside.
/// * `reflected` was reflected by mirrors or at the outside of glass and has never entered any.
///
/// Light reaches a receiver on its front, the side of its geometric normal, in every layer; the back absorbs, whether the
/// material is double-sided or not, and what arrives there is counted in the ledger as landed elsewhere. Matt objects absorb what they block: nothing is reflected from one to another.
/// [`crate`] says how glass and mirrors are treated. `progress` hears shares of the work, 0 to 1, from any thread, in order.
///
/// # Errors
/// For scenes that break [`Scene::validate`]'s rules, objects that are no receivers, and settings out of range.
pub fn bake(
    scene: &Scene,
    receiver: usize,
    settings: &BakeSettings,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Bake, ReferenceError> {
    settings.check()?;
    check_receiver(scene, receiver)?;
    scene.validate()?;
    pool(settings.threads)?.install(|| Ok(baked(scene, receiver, settings, progress)))
}

fn check_receiver(scene: &Scene, receiver: usize) -> Result<(), ReferenceError> {
    let Some(object) = scene.objects.get(receiver) else {
        return Err(ReferenceError::UnknownObject { object: receiver, count: scene.objects.len() });
    };
    let name = || object.name.clone();
    if scene.materials.get(object.material).is_some_and(spectral_scene::Material::is_refractor) {
        return Err(ReferenceError::ReceiverRefracts { name: name() });
    }
    if scene.materials.get(object.material).is_some_and(spectral_scene::Material::is_mirror) {
        return Err(ReferenceError::ReceiverMirrors { name: name() });
    }
    if scene.meshes.get(object.mesh).is_some_and(|m| m.uvs.is_empty()) {
        return Err(ReferenceError::ReceiverHasNoUvs { name: name() });
    }
    Ok(())
}

/// A thread pool of our own, so that callers' pools keep their size.
pub(crate) fn pool(threads: Option<usize>) -> Result<rayon::ThreadPool, ReferenceError> {
    let threads = threads.unwrap_or(0);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|source| ReferenceError::Threads { threads, source })
}

/// Shares of the progress that shadow rays and paths through glass get.
const DIRECT_PROGRESS: f64 = 0.05;
const MAIN_PROGRESS: f64 = 0.75;

/// Share of the paths that goes everywhere alike.
const EVEN_SHARE: f64 = 0.2;

/// Photons from which on paths are sent where they count.
const AIMED_FROM: u64 = 1 << 21;

/// Paths for light reflected outside per path of all light: they are short, and reflections spread thinly.
const REFLECTION_SHARE: u64 = 2;

fn baked(scene: &Scene, receiver: usize, settings: &BakeSettings, progress: &(dyn Fn(f64) + Sync)) -> Bake {
    progress(0.0);
    let world = World::new(scene);
    let lamps = Lamp::all(scene, settings.observer, settings.step_nm, &world);
    let texels = Texels::new(scene, &world, receiver, settings.size);
    let (direct, direct_coarse) = direct_layer(&world, &lamps, &texels, settings);
    progress(DIRECT_PROGRESS);

    let bundles = Bundle::all(scene, &world, &lamps);
    let glass = bundles.iter().any(|b| world.medium(Some(b.target)).is_some());
    let mirrors = bundles.iter().any(|b| world.mirrors[b.target as usize].is_some());
    let film = |layer: Layer| ReceiverFilm::new(&world, &texels, layer);
    let effort = match settings.effort {
        // Both layers have a target of their own.
        Effort::Noise { relative, max_photons, max_rays } if glass && mirrors => {
            Effort::Noise { relative, max_photons, max_rays: max_rays / 2 }
        }
        effort => effort,
    };

    // All light is in the books, that of one layer in its map.
    let limits = Limits::of_light(settings.bounces);
    let shooter = Shooter::new(&world, &lamps, bundles.clone(), limits, settings.seed);
    let layer = if glass { Layer::Refracted } else { Layer::Reflected };
    let main_end = if glass { DIRECT_PROGRESS + MAIN_PROGRESS } else { 1.0 };
    let report = |share: f64| progress(DIRECT_PROGRESS + (main_end - DIRECT_PROGRESS) * share);
    let scouts = scouts(&shooter, effort);
    let main = fill(film(layer), shooter, effort, scouts, &direct_coarse, &report);
    progress(main_end);
    let (photons, ledger) = (main.photons, main.tally.ledger(main.scale));

    let (refracted, reflected) = match glass {
        false => (Filled::dark(film(Layer::Refracted)), main),
        true => {
            let limits = Limits::of_outside_reflections(settings.bounces);
            let shooter = Shooter::new(&world, &lamps, bundles, limits, mix(settings.seed ^ 0x3ef1ec7));
            let (effort, scouts) = match effort {
                Effort::Noise { .. } if mirrors => (effort, NOISE_SCOUTS),
                _ => (Effort::Photons(REFLECTION_SHARE * photons), REFLECTION_SHARE * main.units),
            };
            let report = |share: f64| progress(1.0 - (1.0 - main_end) * (1.0 - share));
            let film = film(Layer::Reflected);
            (main, fill(film, shooter, effort, Some(scouts), &direct_coarse, &report))
        }
    };
    progress(1.0);

    let [of_direct, of_refracted, of_reflected] =
        [(&direct_coarse, 1.0), refracted.coarse(), reflected.coarse()];
    let standard_error = StandardError {
        total: Coarse::relative_error(&[of_direct, of_refracted, of_reflected]),
        direct: Coarse::relative_error(&[of_direct]),
        refracted: Coarse::relative_error(&[of_refracted]),
        reflected: Coarse::relative_error(&[of_reflected]),
    };
    let reflection_photons = if glass { reflected.photons } else { 0 };
    let [refracted, reflected] = [refracted, reflected].map(|layer| layer.film.irradiance(layer.scale));
    let to_f32 = |layer: &Vec<[f64; 3]>| layer.iter().map(|xyz| xyz.map(|v| v as f32)).collect();
    Bake {
        maps: IrradianceMaps {
            width: settings.size[0],
            height: settings.size[1],
            direct: to_f32(&direct),
            refracted: to_f32(&refracted),
            reflected: to_f32(&reflected),
        },
        standard_error,
        photons,
        reflection_photons,
        ledger,
        geometry: world.counts,
        direct,
        refracted,
        reflected,
    }
}

/// A layer's map and what it took.
struct Filled<'a> {
    film: ReceiverFilm<'a>,
    /// What its sums must be multiplied with, and those of one replicate.
    scale: f64,
    replicate_scale: f64,
    units: u64,
    photons: u64,
    tally: Tally,
}

impl<'a> Filled<'a> {
    /// A map that nothing was sent to.
    fn dark(film: ReceiverFilm<'a>) -> Self {
        Self { film, scale: 1.0, replicate_scale: 1.0, units: 0, photons: 0, tally: Tally::new(0) }
    }

    fn coarse(&self) -> (&Coarse, f64) {
        (&self.film.coarse, self.replicate_scale)
    }
}

/// Sends photons until the effort is made: for a noise target, until both the layer and its sum with the direct light
/// reach it. `scouts` paths per bundle find out first where to send the others.
fn fill<'a>(
    mut film: ReceiverFilm<'a>,
    mut shooter: Shooter,
    effort: Effort,
    scouts: Option<u64>,
    direct: &Coarse,
    progress: &dyn Fn(f64),
) -> Filled<'a> {
    if let Some(scouts) = scouts {
        shooter.aim(&film, scouts, EVEN_SHARE);
    }
    let mut tally = shooter.tally();
    let mut schedule = Schedule::new(&shooter, effort);
    while let Some(to) = schedule.next() {
        let base = schedule.progress;
        let span = schedule.expected_share(to);
        let mut report = |share: f64| progress(base + (span - base) * share);
        shooter.shoot(&mut film, &mut tally, (schedule.units, to), &mut report);
        let layer = (&film.coarse, shooter.replicate_scale(to));
        let error = Coarse::relative_error(&[layer]).max(Coarse::relative_error(&[(direct, 1.0), layer]));
        schedule.did(to, error, tally.counts.rays, span);
    }
    let units = schedule.units;
    Filled {
        film,
        scale: shooter.scale(units),
        replicate_scale: shooter.replicate_scale(units),
        units,
        photons: units * shooter.photons_per_unit(),
        tally,
    }
}

/// Paths in advance per bundle where there is a noise target.
const NOISE_SCOUTS: u64 = 1 << 16;

/// Paths per bundle to spend on finding out where light comes from. With few photons that is not worth it: weights that
/// differ make the ledger noisier.
fn scouts(shooter: &Shooter, effort: Effort) -> Option<u64> {
    match effort {
        Effort::Photons(photons) if photons < AIMED_FROM => None,
        Effort::Photons(photons) => Some(photons / shooter.photons_per_unit().max(1) / 4),
        Effort::Noise { .. } => Some(NOISE_SCOUTS),
    }
}

/// Shadow rays: independent low-discrepancy points for each texel and replicate.
fn direct_layer(
    world: &World,
    lamps: &[Lamp],
    texels: &Texels,
    settings: &BakeSettings,
) -> (Vec<[f64; 3]>, Coarse) {
    let per_replicate = settings.direct_samples.div_ceil(REPLICATES as u32);
    let seed = mix(settings.seed ^ 0xd1ec7);
    let ranges: Vec<&[crate::texels::Patch]> = texels.patches.chunk_by(|a, b| a.texel == b.texel).collect();
    let values: Vec<[[f64; 3]; REPLICATES]> = ranges
        .par_iter()
        .map_init(Pending::default, |pending, patches| {
            let texel = patches[0].texel;
            let area = texels.areas[texel as usize];
            std::array::from_fn(|replicate| {
                let sequence = Sequence::new(mix(seed ^ (u64::from(texel) << 8)) ^ replicate as u64);
                let mut mean = [0.0; 3];
                let mut index = 0;
                for patch in *patches {
                    let share = patch.area / area;
                    let count = (share * f64::from(per_replicate)).ceil().max(1.0) as u32;
                    let normal = world.faces[patch.triangle as usize].normal;
                    let square = (index..index + count).map(|i| sequence.point::<2>(i));
                    for point in texels.spread(world, patch, square) {
                        let xyz = direct::irradiance(world, lamps, point, normal, patch.triangle, pending);
                        for (sum, value) in mean.iter_mut().zip(xyz) {
                            *sum += value * share / f64::from(count);
                        }
                    }
                    index += count;
                }
                mean
            })
        })
        .collect();
    let mut layer = vec![[0.0; 3]; texels.areas.len()];
    let mut coarse = Coarse::new(texels.width, texels.height);
    for (patches, replicates) in ranges.iter().zip(&values) {
        let texel = patches[0].texel;
        for (replicate, xyz) in replicates.iter().enumerate() {
            coarse.add(replicate, texel, xyz[1]);
            for (sum, value) in layer[texel as usize].iter_mut().zip(xyz) {
                *sum += value / REPLICATES as f64;
            }
        }
    }
    (layer, coarse)
}

/// When to stop shooting, and how far we are.
struct Schedule {
    effort: Effort,
    /// Done so far.
    units: u64,
    per_unit: u64,
    last: u64,
    /// Error and rays of what is done.
    so_far: Option<(f64, u64)>,
    progress: f64,
}

impl Schedule {
    /// Photons of the first round when there is a noise target.
    const FIRST: u64 = 1 << 18;
    /// How fast the error falls with the number of photons at best: between random points (1/2) and a smooth caustic
    /// (about 3/4). The best case is what predictions are made from, so that no step goes too far.
    const RATE: f64 = 0.75;

    fn new(shooter: &Shooter, effort: Effort) -> Self {
        let per_unit = shooter.photons_per_unit();
        let limit = match effort {
            Effort::Photons(photons) => photons.div_ceil(per_unit.max(1)),
            Effort::Noise { max_photons, .. } => max_photons / per_unit.max(1),
        };
        let last = if shooter.is_idle() { 0 } else { limit.clamp(1, shooter.max_units()) };
        Self { effort, units: 0, per_unit, last, so_far: None, progress: 0.0 }
    }

    /// The number of units to go on to.
    fn next(&self) -> Option<u64> {
        if self.units >= self.last {
            return None;
        }
        match (self.effort, self.so_far) {
            (Effort::Photons(_), _) => Some(self.last),
            (Effort::Noise { .. }, None) => {
                Some((Self::FIRST / self.per_unit).next_power_of_two().clamp(1, self.last))
            }
            (Effort::Noise { relative, .. }, Some((error, _))) => {
                // Low-discrepancy points are best in multiples of large powers of two.
                let step = (self.units.next_power_of_two() / 16).max(1);
                let needed = self.units as f64 * (error / relative).powf(1.0 / Self::RATE);
                let to = (needed.min(8.0 * self.units as f64) / step as f64).floor() as u64 * step;
                let to = to.max(self.units + step).min(self.affordable());
                (error > relative && to > self.units).then_some(to)
            }
        }
    }

    /// The most units that limits allow, as far as one can tell.
    fn affordable(&self) -> u64 {
        match (self.effort, self.so_far) {
            (Effort::Noise { max_rays, .. }, Some((_, rays))) => {
                let units = self.units as f64 * max_rays as f64 / rays.max(1) as f64;
                (units as u64).min(self.last)
            }
            _ => self.last,
        }
    }

    /// Share of all photons that will have been sent with so many units, as far as one can tell.
    fn expected_share(&self, to: u64) -> f64 {
        let (Effort::Noise { relative, .. }, Some((error, _))) = (self.effort, self.so_far) else {
            return if matches!(self.effort, Effort::Photons(_)) { 1.0 } else { 0.01 };
        };
        let needed = self.units as f64 * (error / relative).powf(1.0 / (Self::RATE - 0.1));
        (to as f64 / needed.min(self.affordable() as f64)).clamp(self.progress, 1.0)
    }

    fn did(&mut self, to: u64, error: f64, rays: u64, progress: f64) {
        (self.units, self.so_far, self.progress) = (to, Some((error, rays)), progress);
    }
}
