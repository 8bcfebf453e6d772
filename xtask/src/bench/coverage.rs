//! Table 3 of the paper: cost against the share of the light's view that the refractor covers.
//!
//! Here the light's view is fitted to the refractors, so that a sphere alone always covers about pi / 4 of it. Beads of glass on a circle
//! round the sphere widen the view to a chosen size.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use anyhow::{Context, Result};
use asm_core::Emission;
use glam::{DMat4, DVec3};
use serde::Serialize;
use spectral_scene::{LightShape, Object, Scene, bundled};

use super::frames::{self, Frames};
use super::{Args, Turns};

/// Shares of the paper's table, and that of a sphere which fills the view.
const SHARES: [f64; 6] = [0.025, 0.04, 0.07, 0.13, 0.33, FRAC_PI_4];

/// Radius of a bead by the sphere's: all together cover less than a five-hundredth of what the sphere does.
const BEAD: f64 = 0.01;

/// Enough that the square round them is the circle's within two per cent, however the light's view is turned.
const BEADS: u32 = 16;

/// A row.
#[derive(Serialize)]
pub(super) struct CoverageRow {
    /// Adaptive emission, one entry per column.
    pub(super) adaptive: Vec<Frames>,
    /// The fixed grid likewise.
    pub(super) grid: Vec<Frames>,
}

pub(super) fn measure(turns: &mut Turns, args: &Args) -> Result<Vec<CoverageRow>> {
    let mut rows = Vec::new();
    for share in SHARES {
        eprintln!("  {:.1} % of the light's view", 100.0 * share);
        let scene = scene(share).context("the bundled sphere has a sun and a refractor")?;
        rows.push(CoverageRow {
            adaptive: frames::measure(turns, &scene, args, |settings| settings)?,
            grid: frames::measure(turns, &scene, args, |mut settings| {
                settings.emission = Some(Emission::Grid);
                settings
            })?,
        });
    }
    Ok(rows)
}

/// The bundled sphere covering `share` of its light's view.
fn scene(share: f64) -> Option<Scene> {
    let mut scene = bundled("sphere")?;
    let LightShape::Directional { direction } = scene.lights.first()?.shape else { return None };
    let sphere = scene.refractors().next()?;
    let (low, high) = scene.bounds([sphere])?;
    let (middle, radius) =
        (0.5 * (low + high), 0.25 * (high - low).max_element() + 0.25 * (high - low).min_element());
    // Half the side of a square of which the sphere covers that share; where it fills the view no bead is needed.
    let half = 0.5 * (PI / share).sqrt() * radius;
    if half > radius * (1.0 + BEAD) {
        let gem = bundled("gem")?;
        let bead = gem.objects[gem.refractors().next()?].mesh;
        let bead = gem.meshes.into_iter().nth(bead)?;
        let bead_radius = bead.positions.iter().map(|p| glam::Vec3::from(*p).length()).fold(0.0, f32::max);
        let scale = DMat4::from_scale(DVec3::splat(BEAD * radius / f64::from(bead_radius)));
        scene.meshes.push(bead);
        let (right, up) = direction.any_orthonormal_pair();
        for i in 0..BEADS {
            let (sine, cosine) = (TAU * f64::from(i) / f64::from(BEADS)).sin_cos();
            let place = middle + (half - BEAD * radius) * (cosine * right + sine * up);
            let (mesh, material) = (scene.meshes.len() - 1, scene.objects[sphere].material);
            let world_from_mesh = DMat4::from_translation(place) * scale;
            scene.objects.push(Object { name: format!("bead {i}"), mesh, material, world_from_mesh });
        }
    }
    Some(scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use asm_core::{Method, PASSES, Settings, render_plan};
    use frame_plan::Executor;
    use frame_plan::cpu::CpuExecutor;

    #[test]
    fn the_sphere_covers_what_it_should() {
        let mut executor = CpuExecutor::new(PASSES, None).unwrap();
        for share in SHARES {
            let scene = scene(share).unwrap();
            let settings =
                Settings { emission_size: 256, wavelengths: Some(1), ..Settings::of(Method::CausticsMap) };
            let plan = render_plan(&scene, 0, [8, 8], &settings, &executor.limits()).unwrap();
            executor.prepare(&plan.plan).unwrap();
            executor.execute().unwrap();
            let (_, statistics) = plan.read(&mut executor).unwrap();
            let covered = statistics.photons as f64 / 256.0 / 256.0;
            assert!((covered / share - 1.0).abs() < 0.06, "{covered} of {share}");
        }
    }
}
