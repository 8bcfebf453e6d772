//! White furnace: under an even sky, an open white object has the colour of the light, whatever its spectrum.

use std::f64::consts::PI;

use glam::DVec3;
use spectral_core::basis::{Optimal, SpectralBasis, Training};
use spectral_core::color_checker;
use spectral_core::grid::SpectralGrid;
use spectral_core::illuminant::Illuminant;
use spectral_core::observer::Observer;
use spectral_core::patch::light_xyz;
use spectral_prt::{Bands, Surface, TransferSettings, precompute};

const GRID: SpectralGrid = SpectralGrid::SCHWENK_2010;

/// An octahedron, smooth: its vertices look outwards.
fn open_object() -> Surface {
    let corners = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let triangles = [0, 1, 2, 3].map(|i| (i, (i + 1) % 4)).map(|(a, b)| [[a, b, 4], [b, a, 5]]).concat();
    Surface::new(&corners, &corners, &triangles).expect("a body")
}

#[test]
fn a_white_object_shows_the_illuminant_s_colour() {
    let lights: Vec<Vec<f64>> =
        Illuminant::ALL.iter().map(|i| GRID.sample(|l| i.relative_power(l))).collect();
    let reflectances = color_checker::sampled(&GRID);
    let training =
        Training { grid: GRID, observer: Observer::Cie1931, reflectances: &reflectances, lights: &lights };
    let transfer = precompute(&[open_object()], &TransferSettings::default(), &mut |_| {}).unwrap();
    let mut shown = lights.clone();
    shown.push(GRID.line(546.1).unwrap());
    let mut worst: f64 = 0.0;
    for coefficients in [3, 5, 8] {
        let basis = training.optimal(coefficients, Optimal::default()).unwrap();
        let white = basis.albedo_coefficients(&GRID.sample(|_| 1.0));
        for light in &shown {
            let truth = light_xyz(&GRID, Observer::Cie1931, light);
            // The radiance 1 in every direction has the coefficient 2 sqrt(pi) of Y_00.
            let irradiance: Vec<Vec<f64>> = basis
                .light_coefficients(light)
                .into_iter()
                .map(|l| {
                    let mut sky = vec![0.0; Bands::default().coefficients()];
                    sky[0] = 2.0 * PI.sqrt() * l;
                    transfer.irradiance(0, &sky)
                })
                .collect();
            for vertex in 0..6 {
                let e: Vec<f64> = irradiance.iter().map(|e| e[vertex] / PI).collect();
                let xyz = SpectralBasis::xyz(&white, &e);
                for c in 0..3 {
                    worst = worst.max((xyz[c] - truth[c]).abs() / truth[1]);
                }
            }
        }
    }
    println!("white furnace, largest error of X, Y, Z over Y: {worst:.1e}");
    assert!(worst < 1e-5, "{worst}");
}
