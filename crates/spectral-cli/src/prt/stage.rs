//! Transfer from the cache, and frames of plans on whatever runs them.

use frame_plan::Executor;
use glam::DMat3;
use spectral_core::patch::Shown;
use spectral_prt::figures::GRID;
use spectral_prt::{
    Bands, BounceSettings, Exposure, Relighting, RelightingError, RelightingSettings, RelitScene, Shot, Sky,
    SpectralTransfer, Surface, Transfer, TransferSettings, add_bounces, cache, precompute,
};
use spectral_scene::Camera;

use crate::backend::cache_folder;
use crate::error::CliError;
use crate::frame_time::WarmFrames;
use crate::messages;
use crate::picture::Picture;
use crate::progress::Progress;
use crate::values::Size;

/// Samples per pixel and axis.
const SAMPLES: u32 = 2;

/// Transfer of surfaces, from the user's cache where there is one.
///
/// # Errors
/// What the cache's file system says.
pub(super) fn transfer(surfaces: &[Surface], bands: Bands, rays: u32) -> Result<Transfer, CliError> {
    let settings = TransferSettings { bands, rays };
    let bar = Progress::bar("transfer");
    let progress = &mut |done| bar.set(done);
    match cache_folder() {
        Some(folder) => cache::load_or_precompute(&folder.join("transfer"), surfaces, &settings, progress)
            .map(|cached| mended(cached.transfer, cached.damaged_chunks)),
        None => precompute(surfaces, &settings, progress),
    }
    .map_err(CliError::failed)
}

/// What surfaces throw on each other besides, from the user's cache where there is one.
///
/// # Errors
/// What the cache's file system says.
pub(super) fn bounced(
    surfaces: &[Surface],
    direct: &Transfer,
    reflectances: &[Vec<f64>],
    settings: &BounceSettings,
) -> Result<SpectralTransfer, CliError> {
    let bar = Progress::bar("bounces");
    let progress = &mut |done| bar.set(done);
    match cache_folder() {
        Some(folder) => {
            let folder = folder.join("transfer");
            cache::load_or_add_bounces(&folder, surfaces, direct, GRID, reflectances, settings, progress)
                .map(|cached| mended(cached.transfer, cached.damaged_chunks))
        }
        None => add_bounces(surfaces, direct, GRID, reflectances, settings, progress),
    }
    .map_err(CliError::failed)
}

/// What came from the cache. Chunks that were damaged have been made again, which is said.
fn mended<T>(transfer: T, damaged_chunks: usize) -> T {
    if damaged_chunks > 0 {
        messages::warn(&format!(
            "{damaged_chunks} chunks of the cache were damaged and have been made again"
        ));
    }
    transfer
}

/// A light and how it is shown.
pub(super) struct Lit<'a> {
    pub(super) sky: &'a Sky,
    /// Its white becomes the screen's; none for what is in the screen's already.
    pub(super) balance: Option<Shown>,
}

/// A picture, and of each pixel the share where no surface is.
pub(super) struct Taken {
    pub(super) picture: Picture,
    pub(super) uncovered: Vec<f32>,
}

/// Pictures of a scene under lights, one after the other by one plan, and milliseconds of a warm frame.
///
/// # Errors
/// A scene that does not fit the device; what the executor says.
pub(super) fn pictures(
    executor: &mut dyn Executor,
    scene: &RelitScene<'_>,
    camera: &Camera,
    size: Size,
    lights: &[Lit<'_>],
) -> Result<(Vec<Taken>, f64), CliError> {
    let settings = RelightingSettings { size: [size.width, size.height], samples: SAMPLES };
    let exposure = |lit: &Lit<'_>| Exposure { factor: 1.0, balance: lit.balance };
    let shots: Vec<Shot<'_>> = lights
        .iter()
        .map(|lit| Shot { sky: lit.sky, rotation: DMat3::IDENTITY, camera, exposure: exposure(lit) })
        .collect();
    let Some(first) = shots.first() else { return Ok((Vec::new(), 0.0)) };
    let relighting = Relighting::new(scene, first, &settings, &executor.limits()).map_err(failed)?;
    executor.prepare(&relighting.plan).map_err(CliError::failed)?;
    let mut pictures = Vec::new();
    for shot in &shots {
        relighting.write(executor, shot).map_err(failed)?;
        executor.execute().map_err(CliError::failed)?;
        let (seen, uncovered) = relighting.read_with_uncovered(executor).map_err(CliError::failed)?;
        let picture = Picture { size, xyz: seen.xyz };
        picture.check()?;
        pictures.push(Taken { picture, uncovered });
    }
    let warm = WarmFrames::of(&relighting.plan, executor).map_err(CliError::failed)?;
    Ok((pictures, warm.round_ms(executor).map_err(CliError::failed)?))
}

fn failed(error: RelightingError) -> CliError {
    CliError::failed(error)
}
