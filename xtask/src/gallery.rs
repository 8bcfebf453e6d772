//! `cargo xtask gallery`: the book's pictures and their page, made anew.

use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};
use asm_core::{GapFilling, Method, Settings};
use frame_plan::Executor;
use frame_plan::cpu::CpuExecutor;
use spectral_cli::output::atomic_file::AtomicFile;
use spectral_cli::output::png;
use spectral_cli::values::Size;
use spectral_core::display::{Display, ToneMap};
use spectral_reference::{BakeSettings, Effort, RenderSettings};
use spectral_scene::IrradianceMaps;
use xtask::executors;
use xtask::metrics::{Map, exposure};
use xtask::subject::Subject;

use crate::paths;

/// Make the pictures of the book anew: every scene by adaptive spectral mapping, with gaps filled and not, and by the oracle;
/// about ten minutes on 2 cores.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Only this scene. May be repeated.
    #[arg(long = "scene", value_name = "SCENE")]
    scenes: Vec<String>,
}

/// Texels across and down of a receiver, and pixels of a camera's picture, as shown.
const RECEIVER: [usize; 2] = [160, 160];
const CAMERA: [usize; 2] = [284, 160];
/// Each is computed so many times larger and averaged: edges are smooth, and the oracle's noise is halved.
const OVERSAMPLING: usize = 2;
/// Between tiles, pixels.
const GAP: usize = 4;

/// Photons of the oracle for each bake and each picture.
const PHOTONS: u64 = 1 << 20;
/// Eye paths of the oracle per computed pixel and lamp.
const SAMPLES: u32 = 2;

/// Caustics are many times brighter than the floor around them: so many times white they become white, not before.
const TONE_MAP: ToneMap = ToneMap::Reinhard { white: 6.0 };

/// A spectrum on black without anything white beside it: its own colours are in the gamut only when dark, and the camera
/// sees the sunlit plate with the slit more than anything else.
const SPECTRUM_ALONE: &str = "prism";
/// Exposure of that scene's receiver, as a share of what others get.
const SPECTRUM_EXPOSURE: f64 = 0.6;

/// Scenes of the picture in the README.
const OVERVIEW: [&str; 4] = ["prism", "sphere", "ring", "gem"];

/// What there is to see, in the order of the page.
const CAPTIONS: [(&str, &str); 13] = [
    (
        "prism",
        "White light through a slit and a prism of dense flint. Seven wavelengths draw seven lines, gap filling joins them; the oracle draws the spectrum.",
    ),
    ("sphere", "5,120 faces with smooth normals under equal-energy light, which is pinkish on a D65 screen."),
    ("sphere-fine", "The same with 327,680 faces."),
    ("ring", "A glass ring in a box, with the cusps of its caustic inside the hole."),
    (
        "gem",
        "24 flat faces under equal-energy light. Most light leaves after internal reflections, which image space does not follow.",
    ),
    (
        "diamond",
        "A brilliant cut. As with the gem, two refractions in image space give a quarter of the caustic.",
    ),
    ("glass", "A drinking glass with walls of real thickness: four interfaces where image space knows two."),
    ("organic", "A closed smooth shape of 137,780 faces."),
    ("water", "One interface above a floor: nothing for image space to guess."),
    (
        "metal-ring",
        "A gold ring in slanting light: what its inside throws onto the table is a nephroid, with its cusp half a radius from the axis.",
    ),
    ("underwater", "On the floor of a pool, among stones, with the eye under water too."),
    ("lamps", "Sun, a warm spot and a blue point light over a glass ball, a green prism and a mirror ball."),
    ("bunny-glass", "A file from other people's tools, on its own floor."),
];

/// A picture as numbers, XYZ per pixel, or as a screen shows it.
type Xyz = Vec<[f32; 3]>;
type Srgb = Vec<[u8; 3]>;

/// One scene's tiles, ready for a screen, from above: gaps as they are and gaps filled, if there are any to fill, then the oracle.
struct Tiles {
    name: &'static str,
    /// Light that has been in glass or in a mirror, on the receiver, at one exposure.
    receivers: Vec<Srgb>,
    /// Camera likewise; empty where there is none to show.
    cameras: Vec<Srgb>,
}

/// Render, write `docs/src/pictures` and `docs/src/gallery.md`.
///
/// # Errors
/// If a scene does not open or render, or a file cannot be written.
pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let book = paths::workspace_root().join("docs/src");
    let pictures = book.join("pictures");
    for name in &args.scenes {
        anyhow::ensure!(CAPTIONS.iter().any(|c| c.0 == name), "--scene {name}: no scene of the gallery");
    }
    let mut executor = CpuExecutor::new(asm_core::PASSES, None)?;
    let mut all = Vec::new();
    for (name, _) in CAPTIONS {
        if args.scenes.is_empty() || args.scenes.iter().any(|scene| scene == name) {
            eprintln!("{name}");
            let tiles = tiles(name, &mut executor).with_context(|| name)?;
            let row = |i: usize| {
                let receiver = Some((RECEIVER, tiles.receivers[i].as_slice()));
                let camera = tiles.cameras.get(i).map(|camera| (CAMERA, camera.as_slice()));
                receiver.into_iter().chain(camera).collect()
            };
            let rows: Vec<_> = (0..tiles.receivers.len()).map(row).collect();
            write_png(&pictures.join(format!("{name}.png")), &rows)?;
            all.push(tiles);
        }
    }
    let overview: Vec<_> = OVERVIEW.iter().filter_map(|name| all.iter().find(|t| t.name == *name)).collect();
    if overview.len() == OVERVIEW.len() {
        // Filled gaps, and the oracle.
        let rows = [2, 1].map(|from_below| {
            let receivers = overview.iter().map(|tiles| &tiles.receivers[tiles.receivers.len() - from_below]);
            receivers.map(|tile| (RECEIVER, tile.as_slice())).collect::<Vec<_>>()
        });
        write_png(&pictures.join("overview.png"), &rows)?;
    }
    write(&book.join("gallery.md"), page().as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

fn tiles(name: &'static str, executor: &mut dyn Executor) -> Result<Tiles> {
    let subject = Subject::open(name, &paths::workspace_root())?;
    let scene = &subject.scene;
    let quiet = |_: f64| ();
    let filled = Settings::of(Method::Asm);
    let limits = executor.limits();

    let size = RECEIVER.map(|n| (n * OVERSAMPLING) as u32);
    let bake = |settings: &Settings| asm_core::bake_plan(scene, subject.receiver, size, settings, &limits);
    let fills = bake(&filled)?.plan.decisions.iter().any(|d| d.pass == "gap_fill" && d.kept);
    let open = Settings { gap_filling: Some(GapFilling::None), ..filled.clone() };
    let ways = if fills { vec![open, filled] } else { vec![filled] };
    let mut receivers = Vec::new();
    for settings in &ways {
        receivers.push(caustics(&executors::bake(&bake(settings)?, executor)?.0));
    }
    let oracle = BakeSettings { size, effort: Effort::Photons(PHOTONS), ..BakeSettings::default() };
    receivers.push(caustics(&spectral_reference::bake(scene, subject.receiver, &oracle, &quiet)?.maps));
    let share = if name == SPECTRUM_ALONE { SPECTRUM_EXPOSURE } else { 1.0 };

    let mut cameras = Vec::new();
    if !scene.cameras.is_empty() && name != SPECTRUM_ALONE {
        let size = CAMERA.map(|n| (n * OVERSAMPLING) as u32);
        for settings in &ways {
            let plan = asm_core::render_plan(scene, 0, size, settings, &limits)?;
            cameras.push(executors::render(&plan, executor)?);
        }
        let oracle = RenderSettings {
            size,
            samples_per_pixel: SAMPLES,
            photons: PHOTONS,
            ..RenderSettings::default()
        };
        cameras.push(spectral_reference::render(scene, &oracle, &quiet)?.xyz);
    }
    Ok(Tiles { name, receivers: shown(RECEIVER, receivers, share), cameras: shown(CAMERA, cameras, 1.0) })
}

/// What lands on the receiver by way of glass and mirrors.
fn caustics(maps: &IrradianceMaps) -> Xyz {
    let texels = maps.refracted.iter().zip(&maps.reflected);
    texels.map(|(a, b)| std::array::from_fn(|c| a[c] + b[c])).collect()
}

/// All of them as a screen shows them, at a share of the exposure of the last, 1 / its 99th percentile of Y.
fn shown(size: [usize; 2], pictures: Vec<Xyz>, share: f64) -> Vec<Srgb> {
    let pictures: Vec<_> = pictures.iter().map(|xyz| averaged(size, xyz)).collect();
    let exposure = pictures.last().and_then(|xyz| exposure(&Map { size, xyz })).unwrap_or(1.0);
    let display = Display { exposure: share * exposure, tone_map: TONE_MAP };
    let srgb =
        |xyz: &Xyz| xyz.iter().map(|xyz| display.srgb8_from_xyz(xyz.map(f64::from)).map(coarse)).collect();
    pictures.iter().map(srgb).collect()
}

/// Six bits of eight, black and white as they are: noise in the last bits is most of a file and nothing to the eye.
const fn coarse(v: u8) -> u8 {
    v & 0xfc | v >> 6
}

/// Means over blocks of [`OVERSAMPLING`] x [`OVERSAMPLING`], down to `size`.
fn averaged([width, height]: [usize; 2], xyz: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let mut means = vec![[0.0; 3]; width * height];
    let share = 1.0 / (OVERSAMPLING * OVERSAMPLING) as f32;
    for (i, xyz) in xyz.iter().enumerate() {
        let (x, y) = (i % (width * OVERSAMPLING), i / (width * OVERSAMPLING));
        let mean = &mut means[y / OVERSAMPLING * width + x / OVERSAMPLING];
        mean.iter_mut().zip(xyz).for_each(|(m, v)| *m += share * v);
    }
    means
}

/// A picture and its size.
type Tile<'a> = ([usize; 2], &'a [[u8; 3]]);

/// Rows of tiles on white, all rows of equal sizes.
fn write_png(path: &Path, rows: &[Vec<Tile<'_>>]) -> Result<()> {
    let across = |row: &Vec<Tile>| row.iter().map(|tile| tile.0[0] + GAP).sum::<usize>() - GAP;
    let down = |row: &Vec<Tile>| row.iter().map(|tile| tile.0[1]).max().unwrap_or(0);
    let width = rows.iter().map(across).max().unwrap_or(0);
    let height = rows.iter().map(|row| down(row) + GAP).sum::<usize>() - GAP;
    let mut pixels = vec![[255; 3]; width * height];
    let mut top = 0;
    for row in rows {
        let mut left = 0;
        for ([tile_width, _], tile) in row {
            for (y, line) in tile.chunks_exact(*tile_width).enumerate() {
                let begin = (top + y) * width + left;
                pixels[begin..begin + tile_width].copy_from_slice(line);
            }
            left += tile_width + GAP;
        }
        top += down(row) + GAP;
    }
    write(path, &png::bytes(Size { width: width as u32, height: height as u32 }, &pixels)?)
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    AtomicFile::new(path)
        .and_then(|file| file.write(|content| content.write_all(bytes)))
        .with_context(|| format!("cannot write {}", path.display()))
}

fn page() -> String {
    let mut page = format!(
        "# Gallery\n\n\
         Made by `cargo xtask gallery`. From above: adaptive spectral mapping (`asm`, seven wavelengths, 512 x 512 photons) on the CPU executor \
         without gap filling; with it (one row where a scene splits no light); the oracle with {PHOTONS} photons. Left: light on the receiver that \
         has been in glass or in a mirror, in its UV space; right: the scene's camera. All of a column share one exposure, 1 / the oracle's 99th percentile of Y (0.6 of it for the prism, \
         whose colours a screen has only when dark), and one tone map, Reinhard with white at 6.\n",
    );
    for (name, caption) in CAPTIONS {
        write!(page, "\n## {name}\n\n{caption}\n\n![{name}: adaptive spectral mapping, gaps as they are and filled, above the oracle](pictures/{name}.png)\n")
            .expect("a String takes everything");
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_has_its_place() {
        assert!(Subject::names().eq(CAPTIONS.map(|c| c.0)), "{:?}", Subject::names().collect::<Vec<_>>());
        assert!(OVERVIEW.iter().all(|name| CAPTIONS.iter().any(|c| c.0 == *name)));
    }

    #[test]
    fn averages_are_those_of_blocks() {
        let xyz: Vec<_> = (0..16).map(|i| [i as f32, 0.0, 2.0]).collect();
        let expected = [2.5, 4.5, 10.5, 12.5].map(|mean| [mean, 0.0, 2.0]);
        assert_eq!(averaged([2, 2], &xyz), expected);
    }
}
