//! Any scene under any sky.

use serde::Serialize;
use spectral_core::color_checker;
use spectral_core::display::Display;
use spectral_prt::figures::{Figure, GRID};
use spectral_prt::{
    Albedo, BounceSettings, Palette, Projection, RelitScene, SceneTransfer, Surface, TransferSettings,
};
use spectral_scene::{Camera, Scene};

use super::environment::Environment;
use super::gloss::{self, Shine, base_color};
use super::stage::{Lit, Taken, bounced, pictures};
use super::{PrtArgs, background};
use crate::backend::{self, RELIT};
use crate::choices::Basis;
use crate::error::CliError;
use crate::output::exr::ExrImage;
use crate::output::png;
use crate::progress::Progress;
use crate::stats::{Stopwatch, json};
use crate::targets::{self, ImageFormat};
use crate::values::Gloss;
use crate::{messages, scene_argument};

#[derive(Serialize)]
struct SceneStats<'a> {
    command: &'static str,
    version: &'static str,
    scene: &'a str,
    basis: Basis,
    coefficients: u32,
    bands: u8,
    bounces: u32,
    /// Of a PNG.
    display: Display,
    /// Functions of the wavelength that its transfer has.
    functions: usize,
    /// Objects with a lobe.
    glossy_objects: usize,
    vertices: usize,
    output: String,
    warnings: &'a [String],
    backend: String,
    backend_reason: String,
    device: String,
    driver: String,
    frame_ms: f64,
    /// Pixels whose Y is below zero: light of few bands rings. EXR files keep them, others show them black.
    ringing_pixels: usize,
    times_ms: serde_json::Map<String, serde_json::Value>,
}

pub(super) fn run(args: &PrtArgs, name: &str) -> Result<(), CliError> {
    let (file, format) = targets::picture(&args.output)?;
    let stats_file = targets::stats(args.stats.as_deref(), &file)?;
    let bands = args.bands()?;
    let environment = Environment::open(args.environment.as_deref(), bands)?;
    let mut times = Stopwatch::start();
    let opened = scene_argument::open(name)?;
    let mut warnings = opened.warnings;
    let (matt, mut shine) = painted(&opened.scene, name, args.gloss, &mut warnings)?;
    times.did("open_scene");

    let (direct, gloss) = gloss::transfers(&matt, shine.as_mut(), bands, &mut warnings)?;
    let bounced = match args.bounces {
        0 => None,
        bounces => {
            let settings = BounceSettings { rays: matt.rays, bounces };
            Some(bounced(&matt.surfaces, &direct, &matt.reflectances, &settings)?)
        }
    };
    let gloss = match (gloss, &bounced) {
        (Some(gloss), Some(bounced)) => {
            let bar = Progress::bar("gloss");
            let all = gloss.with_bounces(&matt.surfaces, bounced, matt.rays, &mut |done| bar.set(done));
            Some(all.map_err(CliError::failed)?)
        }
        (gloss, _) => gloss,
    };
    times.did("transfer");
    // What is thrown on another surface has the colours of both.
    let products = |r: &Vec<f64>| {
        matt.reflectances
            .iter()
            .map(|s| r.iter().zip(s).map(|(r, s)| r * s).collect())
            .collect::<Vec<Vec<f64>>>()
    };
    // A scene of greys alone has three coefficients; with the chart there are more for any scene, and for its sky.
    let mut training = color_checker::sampled(&GRID);
    training.extend(matt.reflectances.iter().cloned());
    training.extend(shine.iter().flat_map(|shine| shine.reflectances().iter().cloned()));
    if bounced.is_some() {
        let lobes = shine.iter().flat_map(|shine| shine.reflectances());
        training.extend(matt.reflectances.iter().chain(lobes).flat_map(products));
    }
    let basis = args.basis(&training, &environment.training())?;
    let (projection, transfer) = match &bounced {
        None => (Projection::Spectral(&basis), SceneTransfer::Direct(&direct)),
        Some(bounced) => (Projection::Bounced(&basis, bounced), SceneTransfer::Bounced(bounced)),
    };
    let mut palette = Palette::new(&projection, &matt.reflectances);
    if let Some(shine) = &shine {
        palette = shine.on(palette, &projection);
    }
    let relit = RelitScene { gloss: gloss.as_ref(), ..matt.scene(transfer, &palette) };
    let (sky, balance) = (environment.sky.projected(&projection), environment.balance());
    let backend::Chosen { mut executor, reason } = backend::choose(&args.device, &RELIT)?;
    let lit = [Lit { sky: &sky, balance }];
    let (mut taken, frame_ms) = pictures(executor.as_mut(), &relit, &matt.camera, args.picture_size(), &lit)?;
    let Taken { mut picture, uncovered } = taken.pop().expect("one light, one picture");
    // The sky is shown as the surfaces are, however bright it is.
    let display = args.toned(picture.display(args.exposure));
    background::fill(&mut picture, &uncovered, &matt.camera, &environment);
    times.did("picture");

    let ringing_pixels = picture.xyz.iter().filter(|xyz| xyz[1] < 0.0).count();
    if ringing_pixels > 0 {
        let kept = match format {
            ImageFormat::Exr => "kept",
            ImageFormat::Png => "shown black",
        };
        let problem = format!(
            "{ringing_pixels} pixels are below zero and {kept}: {} bands ring where light is strong; more ring less",
            args.bands
        );
        messages::warn_and_keep(&mut warnings, problem);
    }
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
    let info = executor.info().clone();
    let stats = SceneStats {
        command: "prt",
        version: env!("CARGO_PKG_VERSION"),
        scene: &opened.scene.name,
        basis: args.basis,
        coefficients: args.coefficients(),
        bands: args.bands,
        bounces: args.bounces,
        display,
        functions: projection.functions(),
        glossy_objects: shine.as_ref().map_or(0, Shine::count),
        vertices: matt.surfaces.iter().map(|s| s.positions().len()).sum(),
        output: args.output.display().to_string(),
        warnings: &warnings,
        backend: info.executor,
        backend_reason: reason,
        device: info.device,
        driver: info.driver,
        frame_ms,
        ringing_pixels,
        times_ms: times.finish(),
    };
    targets::write_json(&stats_file, &json(&stats)?)
}

/// What transfer can light of a scene, with the smooth spectra of its colours, and what of it shines, if that is asked for. What is left out
/// is warned about.
///
/// # Errors
/// A scene without such objects, without anything to look from, or with a mesh that cannot be lit.
pub(super) fn painted(
    scene: &Scene,
    name: &str,
    gloss: Option<Gloss>,
    warnings: &mut Vec<String>,
) -> Result<(Figure, Option<Shine>), CliError> {
    let (mut surfaces, mut reflectances, mut shine) = (Vec::new(), Vec::new(), Shine::default());
    for (i, object) in scene.objects.iter().enumerate() {
        let material = &scene.materials[object.material];
        if material.is_refractor() || (material.is_metal() && gloss.is_none()) {
            let way_out = if material.is_metal() { ", metals shine with --gloss" } else { "" };
            let problem =
                format!("`{}` is left out: transfer knows matt surfaces only{way_out}", object.name);
            messages::warn_and_keep(warnings, problem);
            continue;
        }
        let surface = Surface::of_object(scene, i).map_err(CliError::failed)?;
        if surface.degenerate_triangles() > 0 {
            let problem = format!(
                "`{}`: {} triangles have no area and are left out",
                object.name,
                surface.degenerate_triangles()
            );
            messages::warn_and_keep(warnings, problem);
        }
        surfaces.push(surface);
        reflectances.push(match gloss {
            None => base_color(material),
            Some(gloss) => shine.add(&object.name, material, gloss),
        });
    }
    if surfaces.is_empty() {
        return Err(CliError::Failed(format!(
            "{name}: the scene has no matt object that transfer could light"
        )));
    }
    let Some(camera) = scene.cameras.first().cloned().or_else(|| Camera::framing(scene)) else {
        return Err(CliError::Failed(format!("{name}: the scene has nothing to look at")));
    };
    if gloss.is_some() && shine.count() == 0 {
        return Err(CliError::usage(format!(
            "--gloss: with roughness 1 nothing in {name} shines, since nothing is metal; --gloss=0.5 makes all of it shine"
        )));
    }
    let albedos = (0..surfaces.len() as u32).map(Albedo::Entry).collect();
    let rays = TransferSettings::default().rays;
    let figure = Figure { surfaces, reflectances, index_maps: Vec::new(), albedos, camera, rays };
    Ok((figure, gloss.map(|_| shine)))
}
