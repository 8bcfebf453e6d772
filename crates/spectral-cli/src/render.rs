//! `spectral render`: a picture through the scene's first camera.

use crate::args::RenderArgs;
use crate::choices::Method;
use crate::error::CliError;
use crate::output::exr::ExrImage;
use crate::output::png;
use crate::stats::{Stats, Stopwatch, json};
use crate::targets::ImageFormat;
use crate::{caustics, prices, reference, scene_argument, targets};

/// The camera that pictures are taken with.
const CAMERA: usize = 0;

pub(crate) fn run(args: &RenderArgs) -> Result<(), CliError> {
    let RenderArgs { size, run, .. } = args;
    run.check()?;
    let (file, format) = targets::picture(&args.output)?;
    let stats_file = targets::stats(run.stats.as_deref(), &file)?;
    let mut times = Stopwatch::start();
    let opened = scene_argument::open(&args.scene)?;
    let scene = &opened.scene;
    let Some(camera) = scene.cameras.get(CAMERA) else {
        return Err(CliError::Failed(format!("{}: the scene has no camera to render with", args.scene)));
    };
    times.did("open_scene");

    let (picture, work) = match run.method {
        Method::Reference => reference::render(scene, CAMERA, *size, run, &mut times)?,
        Method::CausticsMap | Method::Acm | Method::Asm | Method::Footprint => {
            caustics::render(scene, CAMERA, *size, run, &mut times)?
        }
    };

    picture.check()?;
    let display = picture.display(args.exposure);
    match format {
        ImageFormat::Exr => ExrImage::from_linear_srgb(picture.size, &picture.linear_srgb())
            .write(&file)
            .map_err(|e| e.to_string()),
        ImageFormat::Png => {
            png::write(&file, picture.size, &picture.srgb8(&display)).map_err(|e| e.to_string())
        }
    }
    .map_err(|error| CliError::failed(format!("cannot write {}: {error}", args.output.display())))?;
    times.did("write");
    let Some(stats_file) = stats_file else { return Ok(()) };
    let method = work.price.as_ref().map_or(run.method, prices::method);
    let stats = Stats {
        command: "render",
        version: env!("CARGO_PKG_VERSION"),
        scene: &scene.name,
        target: &camera.name,
        size: *size,
        output: args.output.display().to_string(),
        method,
        refraction: work.price.as_ref().map_or(run.refraction(), |p| p.rung.settings().refraction()),
        backend_asked: run.device.backend,
        warnings: &opened.warnings,
        display: Some(json(&display)?),
        work,
        times_ms: times.finish(),
    };
    targets::write_json(&stats_file, &stats)
}
