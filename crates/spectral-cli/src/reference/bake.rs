//! The oracle's bakes.

use frame_plan::memory;
use serde::Serialize;
use spectral_reference::{BakeSettings, Effort, GeometryCounts, Ledger};
use spectral_scene::{IrradianceMaps, Scene};

use super::{REASON, check_memory, device, error, step_nm, warn_of_noise};
use crate::args::RunArgs;
use crate::error::CliError;
use crate::progress::Progress;
use crate::stats::{Stopwatch, Work};
use crate::values::Size;

/// What the oracle holds per texel, f64 layers and replicates included, generously.
const BYTES_PER_TEXEL: u64 = 640;

#[derive(Serialize)]
struct Statistics<'a> {
    photons: u64,
    /// Sent for the layer `reflected` alone.
    reflection_photons: u64,
    geometry: GeometryCounts,
    ledger: &'a Ledger,
    /// Largest share, over wavelengths, of the emitted flux that the ledger does not account for.
    imbalance: f64,
}

/// Bake onto `receiver`, an index into the scene's objects.
pub(crate) fn bake(
    scene: &Scene,
    receiver: usize,
    size: Size,
    run: &RunArgs,
    times: &mut Stopwatch,
) -> Result<(IrradianceMaps, Work), CliError> {
    check_memory(size, BYTES_PER_TEXEL, memory::usable_bytes())?;
    let default = BakeSettings::default();
    let settings = BakeSettings {
        size: [size.width, size.height],
        bounces: run.bounces.unwrap_or(default.bounces),
        effort: effort(run, default.effort),
        seed: run.seed,
        threads: run.device.threads,
        step_nm: step_nm(run.wavelengths).unwrap_or(default.step_nm),
        direct_samples: direct_samples(run.photons, size, default.direct_samples),
        ..default
    };
    let progress = Progress::bar("reference");
    let bake =
        spectral_reference::bake(scene, receiver, &settings, &|done| progress.set(done)).map_err(error)?;
    drop(progress);
    times.did("compute");
    let target = match settings.effort {
        Effort::Noise { relative, .. } => Some(relative),
        Effort::Photons(_) => None,
    };
    let cost = format!("{} photons", bake.photons);
    warn_of_noise(target, bake.standard_error.refracted.max(bake.standard_error.total), &cost);
    let statistics = Statistics {
        photons: bake.photons,
        reflection_photons: bake.reflection_photons,
        geometry: bake.geometry,
        ledger: &bake.ledger,
        imbalance: bake.ledger.imbalance(),
    };
    let work = Work::new(device(run)?, REASON.into(), &settings, &statistics, &bake.standard_error)?;
    Ok((bake.maps, work))
}

fn effort(run: &RunArgs, default: Effort) -> Effort {
    match (run.photons, run.noise) {
        (Some(photons), _) => Effort::Photons(photons),
        (None, Some(relative)) => Effort::noise(relative),
        (None, None) => default,
    }
}

/// Fewest shadow rays per texel: its four quarters, for each randomisation.
const MIN_DIRECT_SAMPLES: u64 = 16;

/// Shadow rays per texel: where photons are counted out, as many as there are photons per texel, within limits, so that
/// few photons make a quick bake.
fn direct_samples(photons: Option<u64>, size: Size, default: u32) -> u32 {
    let per_texel = |photons: u64| photons.div_ceil(size.texels()).max(MIN_DIRECT_SAMPLES);
    photons.map_or(default, |photons| per_texel(photons).min(u64::from(default)) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shadow_rays_follow_an_explicit_number_of_photons() {
        let size = Size { width: 256, height: 256 };
        let rays = |photons| direct_samples(photons, size, 256);
        assert_eq!(rays(None), 256);
        assert_eq!([1, 20_000, 65_536 * 40, 1 << 40].map(|p| rays(Some(p))), [16, 16, 40, 256]);
    }
}
