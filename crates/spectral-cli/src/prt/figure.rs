//! The paper's figures.

use serde::Serialize;
use spectral_core::color_checker;
use spectral_core::display::Display;
use spectral_core::illuminant::Illuminant;
use spectral_core::patch::{Shown, light_xyz};
use spectral_prt::figures::{self, Figure, GRID, OBSERVER, lamps, power, sky_shape};
use spectral_prt::{Bands, Palette, Projection, SceneTransfer, Sky};

use super::PrtArgs;
use super::differences::{Differences, differences};
use super::panels::{Panels, difference_map, scale};
use super::stage::{Lit, pictures, transfer};
use crate::backend::{self, RELIT};
use crate::choices::Basis;
use crate::error::CliError;
use crate::output::png;
use crate::picture::Picture;
use crate::stats::{Stopwatch, json};
use crate::targets;
use crate::values::Exposure;

/// Lamps of the first figure, from top to bottom.
const METACOW_LAMPS: [Illuminant; 3] = [Illuminant::D65, Illuminant::A, Illuminant::Fl2];
/// The lamp of the second.
const CHART_LAMP: Illuminant = Illuminant::Fl4;

/// What is said about a figure.
#[derive(Serialize)]
struct FigureStats {
    command: &'static str,
    version: &'static str,
    figure: u8,
    basis: Basis,
    coefficients: u32,
    bands: u8,
    display: Display,
    output: String,
    backend: String,
    backend_reason: String,
    device: String,
    driver: String,
    /// Milliseconds of a warm frame of the whole plan, mean of a batch.
    frame_ms: FrameTimes,
    lamps: Vec<LampStats>,
    /// Of the first figure: each colour and its metamer.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pairs: Vec<PairStats>,
    times_ms: serde_json::Map<String, serde_json::Value>,
}

#[derive(Serialize)]
struct FrameTimes {
    sampled: f64,
    spectral: f64,
    rgb: f64,
}

/// CIE94 from sampling every 5 nm, over the pixels that show something.
#[derive(Serialize)]
struct LampStats {
    lamp: Illuminant,
    spectral: Differences,
    rgb: Differences,
}

#[derive(Serialize)]
struct PairStats {
    patch: &'static str,
    /// CIEDE2000 under D65.
    matched: f64,
    /// CIEDE2000 under A.
    shown: f64,
}

/// Pictures under each lamp in three ways.
struct Shown3 {
    sampled: Vec<Picture>,
    spectral: Vec<Picture>,
    rgb: Vec<Picture>,
    frame_ms: FrameTimes,
    backend: [String; 4],
}

/// METACOW under three lamps: in spectra and in RGB.
///
/// # Errors
/// What figures, devices and files say.
pub(super) fn metacow(args: &PrtArgs) -> Result<(), CliError> {
    let mut times = Stopwatch::start();
    let (figure, pairs) = figures::metacow().map_err(CliError::failed)?;
    times.did("metamers");
    let pairs = pairs
        .iter()
        .map(|pair| PairStats {
            patch: color_checker::PATCHES[pair.patch],
            matched: pair.metamer.matched_delta_e,
            shown: pair.metamer.shown_delta_e,
        })
        .collect();
    write(args, &figure, 1, &METACOW_LAMPS, pairs, times, &|shown, display, _| {
        let picture = |picture: &Picture| picture.srgb8(display);
        shown
            .spectral
            .iter()
            .zip(&shown.rgb)
            .map(|(spectral, rgb)| vec![picture(spectral), picture(rgb)])
            .collect()
    })
}

/// The ColorChecker under FL4: sampled, in spectra, in RGB, and what is wrong with the last two.
///
/// # Errors
/// What figures, devices and files say.
pub(super) fn color_checker(args: &PrtArgs) -> Result<(), CliError> {
    let figure = figures::painted_knot();
    let times = Stopwatch::start();
    write(args, &figure, 2, &[CHART_LAMP], Vec::new(), times, &|shown, display, wrong| {
        let pictures = [&shown.sampled[0], &shown.spectral[0], &shown.rgb[0]].map(|p| p.srgb8(display));
        let [spectral, rgb] = &wrong[0];
        vec![pictures.to_vec(), vec![scale(args.panel_size()), difference_map(spectral), difference_map(rgb)]]
    })
}

/// Rows of panels from pictures, display, and the differences of `spectral` and `rgb` from sampling under each lamp.
type Layout<'a> = dyn Fn(&Shown3, &Display, &[[Vec<f64>; 2]]) -> Vec<Vec<Vec<[u8; 3]>>> + 'a;

fn write(
    args: &PrtArgs,
    figure: &Figure,
    number: u8,
    under: &[Illuminant],
    pairs: Vec<PairStats>,
    mut times: Stopwatch,
    layout: &Layout<'_>,
) -> Result<(), CliError> {
    let file = targets::png("--output", &args.output)?;
    let stats_file = targets::stats(args.stats.as_deref(), &file)?;
    let shown = shown(args, figure, under, &mut times)?;
    let display = args.toned(display(&shown.sampled[0], args.exposure));
    let wrong: Vec<[Vec<f64>; 2]> = (0..under.len())
        .map(|i| {
            [&shown.spectral[i], &shown.rgb[i]]
                .map(|p| differences(&shown.sampled[i].xyz, &p.xyz, display.exposure))
        })
        .collect();
    let (size, srgb) = Panels::new(args.panel_size(), layout(&shown, &display, &wrong)).joined();
    png::write(&file, size, &srgb)
        .map_err(|error| CliError::failed(format!("cannot write {}: {error}", args.output.display())))?;
    times.did("write");
    let Some(stats_file) = stats_file else { return Ok(()) };
    let lamps = under
        .iter()
        .zip(&wrong)
        .zip(&shown.sampled)
        .map(|((&lamp, [spectral, rgb]), sampled)| LampStats {
            lamp,
            spectral: Differences::of(&sampled.xyz, spectral),
            rgb: Differences::of(&sampled.xyz, rgb),
        })
        .collect();
    let [backend, backend_reason, device, driver] = shown.backend;
    let stats = FigureStats {
        command: "prt",
        version: env!("CARGO_PKG_VERSION"),
        figure: number,
        basis: args.basis,
        coefficients: args.coefficients(),
        bands: args.bands,
        display,
        output: args.output.display().to_string(),
        backend,
        backend_reason,
        device,
        driver,
        frame_ms: shown.frame_ms,
        lamps,
        pairs,
        times_ms: times.finish(),
    };
    targets::write_json(&stats_file, &json(&stats)?)
}

/// Nothing of a figure is brighter than the screen's white unless a factor says so: colours are what it is about.
fn display(picture: &Picture, exposure: Exposure) -> Display {
    let brightest = picture.xyz.iter().map(|xyz| xyz[1]).fold(0.0, f32::max);
    match exposure {
        Exposure::Auto if brightest > 0.0 => {
            Display { exposure: f64::from(1.0 / brightest), ..Display::default() }
        }
        exposure => picture.display(exposure),
    }
}

/// All pictures of a figure.
fn shown(
    args: &PrtArgs,
    figure: &Figure,
    under: &[Illuminant],
    times: &mut Stopwatch,
) -> Result<Shown3, CliError> {
    let bands = args.bands()?;
    let basis = args.basis(&figure.reflectances, &lamps())?;
    let backend::Chosen { mut executor, reason } = backend::choose(&args.device, &RELIT)?;
    let transfer = transfer(&figure.surfaces, bands, figure.rays)?;
    times.did("transfer");
    let mut all = |palettes: &[Palette], light: &dyn Fn(&[f64]) -> Vec<f64>| {
        let mut in_turn = (Vec::new(), 0.0);
        // Palettes that hold for one lamp only are one each; others hold for all.
        for (palette, lamps) in palettes.iter().zip(under.chunks(under.len() / palettes.len())) {
            let skies: Vec<(Sky, Option<Shown>)> =
                lamps.iter().map(|&lamp| sky(bands, lamp, light)).collect();
            let lit: Vec<Lit<'_>> =
                skies.iter().map(|(sky, balance)| Lit { sky, balance: *balance }).collect();
            let scene = figure.scene(SceneTransfer::Direct(&transfer), palette);
            let (taken, ms) = pictures(executor.as_mut(), &scene, &figure.camera, args.panel_size(), &lit)?;
            in_turn.0.extend(taken.into_iter().map(|taken| taken.picture));
            in_turn.1 = ms;
        }
        Ok::<_, CliError>(in_turn)
    };
    let exact: Vec<Palette> = under
        .iter()
        .map(|&lamp| Palette::sampled(&GRID, OBSERVER, &power(lamp), &figure.reflectances))
        .collect();
    let (sampled, sampled_ms) = all(&exact, &|_| vec![1.0])?;
    let mut by = |projection: Projection<'_>| {
        all(&[Palette::new(&projection, &figure.reflectances)], &|light| projection.light(light))
    };
    let (spectral, spectral_ms) = by(Projection::Spectral(&basis))?;
    let (rgb, rgb_ms) = by(Projection::Rgb(GRID, OBSERVER))?;
    times.did("pictures");
    let info = executor.info().clone();
    Ok(Shown3 {
        sampled,
        spectral,
        rgb,
        frame_ms: FrameTimes { sampled: sampled_ms, spectral: spectral_ms, rgb: rgb_ms },
        backend: [info.executor, reason, info.device, info.driver],
    })
}

/// The figures' sky in a lamp's light, and the lamp's white.
fn sky(bands: Bands, lamp: Illuminant, light: &dyn Fn(&[f64]) -> Vec<f64>) -> (Sky, Option<Shown>) {
    let power = power(lamp);
    let white = Shown::under(light_xyz(&GRID, OBSERVER, &power));
    (Sky::of_shape(bands, &sky_shape(bands), &light(&power)), white)
}
