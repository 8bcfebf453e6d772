//! The floor under slanting light by every method, beside the integral: a picture, and a Markdown table of what each is off by.
//!
//! `cargo run --release -p caustic-heightfield --example oblique -- docs/src/pictures/pond-oblique.png`

use std::error::Error;
use std::f64::consts::TAU;
use std::fs::File;
use std::io::BufWriter;

use caustic_heightfield::{
    Convolution, ConvolutionSettings, FloorGrid, HeightField, LowRank, LowRankSettings, Photon,
    PhotonSettings, Pond, exact, exact_over_facets, light_tilted_deg, relative_rms,
};
use frame_plan::cpu::CpuExecutor;

const SIDE: usize = 96;
/// Pixels along each side of a texel.
const ZOOM: usize = 2;
/// Between tiles, pixels.
const GAP: usize = 4;
const TILTS_DEG: [f64; 2] = [20.0, 40.0];
/// Of the lobe that the three sums have in common, and of the one that stands for none.
const SCATTERING: [f64; 2] = [200.0, 4e4];
/// What is shown as white, in means of the row's first floor.
const WHITE: f64 = 2.5;

/// A row of tiles: the integral, convolution and low-rank; the integral of clear water and photons.
type Row = [Vec<f64>; 5];

fn main() -> Result<(), Box<dyn Error>> {
    println!("| tilt, degrees | `exact` | `convolution` | `low-rank` | `exact`, clear | `photon` |");
    println!("|---|---|---|---|---|---|");
    let mut rows = Vec::new();
    for tilt_deg in TILTS_DEG {
        let row = floors(tilt_deg)?;
        let error = |tile: usize, reference: usize| 100.0 * relative_rms(&row[tile], &row[reference]);
        println!(
            "| {tilt_deg} | - | {:.1} % | {:.2} % | - | {:.1} % |",
            error(1, 0),
            error(2, 0),
            error(4, 3)
        );
        rows.push(row);
    }
    match std::env::args().nth(1) {
        Some(file) => write(&file, &rows),
        None => Ok(()),
    }
}

fn floors(tilt_deg: f64) -> Result<Row, Box<dyn Error>> {
    let surface = HeightField::from_fn([SIDE; 2], [1.0, 1.0], |x, y| {
        let second = (TAU * (5.0 * x - 4.0 * y) + 1.0).sin();
        0.01 * ((TAU * (3.0 * x + 2.0 * y)).sin() + 0.8 * second)
    })?;
    let [pond, clear] = SCATTERING.map(|scattering| Pond {
        scattering,
        light_direction: light_tilted_deg(tilt_deg),
        ..Pond::default()
    });
    let grid = FloorGrid::below(&surface);
    let paper =
        Convolution::<f64>::new(surface.size, surface.extent_m, &pond, ConvolutionSettings::default())?;
    let terms = LowRank::<f64>::new(std::slice::from_ref(&surface), &pond, LowRankSettings::default())?;
    let mut photon = Photon::new(&clear, PhotonSettings::default())?;
    let mut executor = CpuExecutor::new(asm_core::PASSES, None)?;
    Ok([
        exact(&surface, &pond, grid)?.irradiance,
        paper.floor(&surface)?.irradiance,
        terms.floor(&surface)?.light.irradiance,
        exact_over_facets(&surface, &clear, grid, 2.0)?.irradiance,
        photon.floor(&surface, grid, &mut executor)?.light.irradiance,
    ])
}

/// Rows of tiles in grey, sRGB-encoded; y upwards.
fn write(file: &str, rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let columns = rows.first().map_or(0, |row| row.len());
    const TILE: usize = SIDE * ZOOM;
    let [width, height] = [columns, rows.len()].map(|tiles| tiles * (TILE + GAP) - GAP);
    let mut pixels = vec![255_u8; width * height];
    for (j, row) in rows.iter().enumerate() {
        let mean = row[0].iter().sum::<f64>() / row[0].len() as f64;
        for (i, tile) in row.iter().enumerate() {
            for n in 0..TILE * TILE {
                let [x, y] = [n % TILE, n / TILE];
                let e = tile[y / ZOOM * SIDE + x / ZOOM];
                let line = j * (TILE + GAP) + TILE - 1 - y;
                pixels[line * width + i * (TILE + GAP) + x] = srgb8(e / (WHITE * mean));
            }
        }
    }
    let mut encoder = png::Encoder::new(BufWriter::new(File::create(file)?), width as u32, height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    Ok(writer.finish()?)
}

/// The transfer function of sRGB.
fn srgb8(linear: f64) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded).round() as u8
}
