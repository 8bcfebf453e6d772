//! `cargo xtask bench --peers`: time to equal error against other people's renderers, on the same cores.
//!
//! The scene is the glass ball of the bundled `sphere`. Peers trace the ball itself, in a beam that is just as wide, so that no photon of
//! theirs misses it; we trace its mesh. Everybody is held against the light of an exact sphere ([`exact`]) on the receiver.

mod budgets;
mod exact;
mod install;
mod ours;
mod report;

use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use glam::{DVec2, DVec3};
use serde::Serialize;
use spectral_core::observer::{Observer, VISIBLE_NM};
use spectral_core::wavelengths::{Scheme, WavelengthSet};
use spectral_scene::{LightShape, Scene, bundled};

use budgets::Peer;
use exact::Setting;
use install::Peers;
use report::{Race, Truth};

use super::Args;

/// Errors to reach: RMS of the difference of Y, by the mean of Y.
const TARGETS: [f64; 3] = [0.05, 0.02, 0.01];

/// Texels of the receiver along each side.
const SIZE: usize = 256;

/// The ball as meshes: with the faces of the paper's sphere, and finer.
const SCENES: [&str; 2] = ["sphere", "sphere-fine"];

/// Rings of rays of each half of the exact light.
const RINGS: usize = 768;

/// Wavelengths that peers render one by one, at quantiles of x + y + z.
const WAVELENGTHS: usize = 41;

/// The scripts: what both share, and one per peer, with the photons of each wavelength in its first budget.
const PROTOCOL: (&str, &str) = ("protocol.py", include_str!("protocol.py"));
const SCRIPTS: [(&str, &str, u64); 2] = [
    ("mitsuba_peer.py", include_str!("mitsuba_peer.py"), 6 * (SIZE * SIZE) as u64),
    ("luxcore_peer.py", include_str!("luxcore_peer.py"), (SIZE * SIZE) as u64),
];

/// What the scripts are told; lengths in millimetres, since Mitsuba moves rays off surfaces by a fixed part of a unit.
#[derive(Serialize)]
struct Job {
    center: DVec3,
    radius: f64,
    direction: DVec3,
    /// x and z of its middle.
    window: DVec2,
    half: f64,
    size: usize,
    threads: usize,
    wavelengths: Vec<JobWavelength>,
}

#[derive(Serialize)]
struct JobWavelength {
    ior: f64,
    xyz: [f64; 3],
}

/// Install the peers, race, write `peers.json` and `peers.md`, print the table.
///
/// # Errors
/// No Python, pip or network; a peer that fails on the way; an unwritable folder.
pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let peers = Peers::install()?;
    let threads = std::thread::available_parallelism()?.get();
    let setting = setting(&bundled(SCENES[1]).context("the ball is bundled")?)?;
    eprintln!("the light of an exact sphere");
    let halves = [0, 1].map(|seed| setting.irradiance(RINGS, seed));
    let truth = Truth::of(&halves);
    let folder = args.out.join("peers");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let job = folder.join("job.json");
    std::fs::write(&job, serde_json::to_string_pretty(&job_of(&setting, threads)?)?)?;
    std::fs::write(folder.join(PROTOCOL.0), PROTOCOL.1)?;
    let mut race = Race::new(&truth, threads, args);
    race.ours = ours::measure(&truth, args)?;
    for (name, text, first_photons) in SCRIPTS {
        let script = folder.join(name);
        std::fs::write(&script, text)?;
        let mut peer = Peer::start(peers.command(&script).arg(&job), &folder).context(name)?;
        race.peers.push(peer.race(&truth, first_photons, args.peer_seconds).context(name)?);
    }
    println!("{}", race.write(&args.out)?);
    Ok(ExitCode::SUCCESS)
}

/// The ball and what surrounds it, out of its scene.
fn setting(scene: &Scene) -> Result<Setting> {
    let ball = scene.refractors().next().context("a ball")?;
    let object = &scene.objects[ball];
    let center = object.world_from_mesh.transform_point3(DVec3::ZERO);
    let radius = scene.world_mesh(ball).positions.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
    let glass = &scene.materials[object.material];
    let light = scene.lights.first().context("a lamp")?;
    let LightShape::Directional { direction } = light.shape else { anyhow::bail!("a sun") };
    let (low, high) = scene.bounds([scene.receiver("receiver")?]).context("a receiver")?;
    let extent = high - low;
    ensure!(extent.y.abs() < 1e-9 && low.y.abs() < 1e-9, "the receiver lies in y = 0");
    ensure!((extent.x - extent.z).abs() < 1e-6, "the receiver is a square");
    Ok(Setting {
        center,
        radius,
        dispersion: glass.dispersion.clone(),
        direction: direction.normalize(),
        spectrum: light.spectrum.clone(),
        window: DVec2::new(low.x + high.x, low.z + high.z) * 0.5,
        half: extent.x * 0.5,
        size: SIZE,
    })
}

fn job_of(setting: &Setting, threads: usize) -> Result<Job> {
    const MM: f64 = 1e3;
    let set = WavelengthSet::new(Scheme::EqualEnergy, WAVELENGTHS, VISIBLE_NM, Observer::Cie1931)?;
    let weights = set.light_weights(&setting.spectrum);
    let wavelength = |(&lambda_nm, xyz)| JobWavelength { ior: setting.dispersion.ior(lambda_nm), xyz };
    Ok(Job {
        center: setting.center * MM,
        radius: setting.radius * MM,
        direction: setting.direction,
        window: setting.window * MM,
        half: setting.half * MM,
        size: setting.size,
        threads,
        wavelengths: set.wavelengths_nm.iter().zip(weights).map(wavelength).collect(),
    })
}
