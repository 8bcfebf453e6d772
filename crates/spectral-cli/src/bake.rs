//! `spectral bake`: irradiance on a receiver.

use spectral_scene::Scene;

use crate::args::BakeArgs;
use crate::choices::Method;
use crate::error::CliError;
use crate::output::exr::ExrImage;
use crate::stats::{Stats, Stopwatch};
use crate::{caustics, prices, reference, scene_argument, targets};

pub(crate) fn run(args: &BakeArgs) -> Result<(), CliError> {
    let BakeArgs { size, run, .. } = args;
    run.check()?;
    let file = targets::exr(&args.output)?;
    let stats_file = targets::stats(run.stats.as_deref(), &file)?;
    let mut times = Stopwatch::start();
    let opened = scene_argument::open(&args.scene)?;
    let scene = &opened.scene;
    let receiver = receiver(scene, args.receiver.as_deref())?;
    times.did("open_scene");

    let (maps, work) = match run.method {
        Method::Reference => reference::bake(scene, receiver, *size, run, &mut times)?,
        Method::CausticsMap | Method::Acm | Method::Asm | Method::Footprint => {
            caustics::bake(scene, receiver, *size, run, &mut times)?
        }
    };

    ExrImage::from_irradiance(&maps)
        .write(&file)
        .map_err(|error| CliError::failed(format!("cannot write {}: {error}", args.output.display())))?;
    times.did("write");
    let Some(stats_file) = stats_file else { return Ok(()) };
    let method = work.price.as_ref().map_or(run.method, prices::method);
    let stats = Stats {
        command: "bake",
        version: env!("CARGO_PKG_VERSION"),
        scene: &scene.name,
        target: &scene.objects[receiver].name,
        size: *size,
        output: args.output.display().to_string(),
        method,
        refraction: work.price.as_ref().map_or(run.refraction(), |p| p.rung.settings().refraction()),
        backend_asked: run.device.backend,
        warnings: &opened.warnings,
        display: None,
        work,
        times_ms: times.finish(),
    };
    targets::write_json(&stats_file, &stats)
}

/// The object to bake onto, as an index: of that name, or else `receiver`, or else the only one there is.
fn receiver(scene: &Scene, name: Option<&str>) -> Result<usize, CliError> {
    let only = || {
        let mut receivers = scene.receivers();
        receivers.next().filter(|_| receivers.next().is_none())
    };
    match (name, only()) {
        (None, Some(only)) => Ok(only),
        (None, None) if scene.receivers().next().is_none() => Err(CliError::Failed(format!(
            "{}: the scene has no opaque object with texture coordinates to bake onto",
            scene.name
        ))),
        (name, _) => scene.receiver(name.unwrap_or("receiver")).map_err(CliError::usage),
    }
}
