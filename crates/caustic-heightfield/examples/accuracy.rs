//! Errors of `convolution` and `low-rank` against `exact` for the waves of the book's page on the pond, as Markdown.
//!
//! `cargo run --release -p caustic-heightfield --example accuracy`

use std::f64::consts::TAU;

use caustic_heightfield::{
    Convolution, ConvolutionSettings, FloorGrid, Form, HeightField, LowRank, LowRankSettings, Pond,
    PondError, exact, light_tilted_deg, relative_rms,
};

const SIZE: [usize; 2] = [128, 128];

fn main() -> Result<(), PondError> {
    println!(
        "| waves | a | tilt | `convolution` | its paper form | terms for 1 % | for 0.1 % | bound at 0.1 % |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (name, amplitude_m) in [("gentle", 0.004), ("steep", 0.01)] {
        let surface = HeightField::from_fn(SIZE, [1.0, 1.0], |x, y| {
            let second = (TAU * (5.0 * x - 4.0 * y) + 1.0).sin();
            amplitude_m * ((TAU * (3.0 * x + 2.0 * y)).sin() + 0.8 * second)
        })?;
        for scattering in [50.0, 200.0] {
            for tilt_deg in [0.0, 20.0, 40.0, 60.0] {
                let pond =
                    Pond { scattering, light_direction: light_tilted_deg(tilt_deg), ..Pond::default() };
                let paper = Pond { form: Form::Paper, ..pond.clone() };
                let settings = LowRankSettings { target_error: 1e-3, max_terms: 64, ..Default::default() };
                let (one, tenth, bound) =
                    match LowRank::<f64>::new(std::slice::from_ref(&surface), &pond, settings) {
                        Ok(terms) => {
                            let report = terms.report();
                            let one =
                                report.errors_by_terms.iter().position(|&e| e <= 0.01).map_or(0, |i| i + 1);
                            (
                                one.to_string(),
                                report.terms.to_string(),
                                format!("{:.2} %", 100.0 * report.bound),
                            )
                        }
                        Err(error) => ("-".into(), error.to_string(), "-".into()),
                    };
                println!(
                    "| {name} | {scattering} | {tilt_deg} | {:.1} % | {:.1} % | {one} | {tenth} | {bound} |",
                    100.0 * convolution_error(&surface, &pond)?,
                    100.0 * convolution_error(&surface, &paper)?,
                );
            }
        }
    }
    Ok(())
}

/// Relative RMS error of the paper's three convolutions at every eighth sample.
fn convolution_error(surface: &HeightField, pond: &Pond) -> Result<f64, PondError> {
    let reference = exact(surface, pond, FloorGrid::below(surface).every(8))?;
    let method = Convolution::<f64>::new(SIZE, surface.extent_m, pond, ConvolutionSettings::default())?;
    let floor = method.floor(surface)?.irradiance;
    let width = SIZE[0];
    let probes: Vec<f64> =
        floor.chunks(width).step_by(8).flat_map(|row| row.iter().step_by(8).copied()).collect();
    Ok(relative_rms(&probes, &reference.irradiance))
}
