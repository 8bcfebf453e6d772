//! Relighting: skies, spectra and albedos may change at any time without another transfer.

use glam::{DMat3, DVec3};
use spectral_core::basis::{Optimal, SpectralBasis, Training};
use spectral_core::color_checker;
use spectral_core::grid::SpectralGrid;
use spectral_core::illuminant::Illuminant;
use spectral_core::observer::Observer;
use spectral_core::patch::{Shown, light_xyz, rgb_albedo, rgb_light, sampled_xyz};
use spectral_core::rgb::D65_WHITE_XYZ;
use spectral_prt::sh::ShRotation;
use spectral_prt::{
    Bands, BounceSettings, Panorama, Projection, Sky, SpectralSky, Surface, Transfer, TransferSettings,
    add_bounces, precompute,
};

const GRID: SpectralGrid = SpectralGrid::SCHWENK_2010;
const OBSERVER: Observer = Observer::Cie1931;

fn lights() -> Vec<Vec<f64>> {
    Illuminant::ALL.iter().map(|i| GRID.sample(|l| i.relative_power(l))).collect()
}

fn basis(coefficients: usize) -> SpectralBasis {
    let (reflectances, lights) = (color_checker::sampled(&GRID), lights());
    let training = Training { grid: GRID, observer: OBSERVER, reflectances: &reflectances, lights: &lights };
    training.optimal(coefficients, Optimal::default()).expect("within the rank")
}

/// An octahedron whose vertices look along the axes, turned.
fn octahedron(turn: DMat3) -> Surface {
    let axes = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z].map(|v| turn * v);
    let triangles = [0, 1, 2, 3].map(|i| (i, (i + 1) % 4)).map(|(a, b)| [[a, b, 4], [b, a, 5]]).concat();
    Surface::new(&axes, &axes, &triangles).expect("a body")
}

fn transfer(surface: Surface) -> Transfer {
    precompute(&[surface], &TransferSettings::default(), &mut |_| {}).expect("good settings")
}

/// The paper's figure 2 without its shading: under an even sky an open object has the colours of flat patches, and the
/// figures of the flat patches come out of transfer, too.
#[test]
fn under_an_even_fl4_sky_rgb_errs_and_five_coefficients_do_not() {
    let fl4 = GRID.sample(|l| Illuminant::Fl4.relative_power(l));
    let shown = Shown::under(light_xyz(&GRID, OBSERVER, &fl4)).unwrap();
    let transfer = transfer(octahedron(DMat3::IDENTITY));
    let spectral = basis(5);
    let sky = Sky::even(Bands::default(), &spectral.light_coefficients(&fl4));
    let rgb_sky = Sky::even(Bands::default(), &rgb_light(&GRID, OBSERVER, &fl4));
    let mut errors = [Vec::new(), Vec::new()];
    for reflectance in color_checker::sampled(&GRID) {
        let reference = sampled_xyz(&GRID, OBSERVER, &reflectance, &fl4);
        let spectral = sky.radiance_xyz(&transfer, 0, &spectral.albedo_coefficients(&reflectance));
        let rgb = rgb_sky.radiance_xyz(&transfer, 0, &rgb_albedo(&GRID, OBSERVER, &reflectance));
        for (errors, xyz) in errors.iter_mut().zip([spectral[3], rgb[3]]) {
            errors.push(shown.delta_e_94(reference, xyz));
        }
    }
    let [(mean, max), (rgb_mean, rgb_max)] =
        errors.map(|e| (e.iter().sum::<f64>() / 24.0, e.iter().copied().fold(0.0, f64::max)));
    println!("transfer under FL4: RGB {rgb_mean:.3} / {rgb_max:.3}, spectral, 5: {mean:.3} / {max:.3}");
    assert!(mean <= 0.1 && max <= 0.5, "{mean} {max}");
    assert!((rgb_mean - 8.2).abs() < 0.1 && (rgb_max - 28.8).abs() < 0.3, "{rgb_mean} {rgb_max}");
}

#[test]
fn a_white_panorama_shows_d65_to_spectra_and_to_rgb() {
    let transfer = transfer(octahedron(DMat3::IDENTITY));
    let panorama = Panorama::new(256, 128, vec![[2.0; 3]; 256 * 128]).unwrap();
    let basis = basis(5);
    let white = GRID.sample(|_| 1.0);
    let d65 = GRID.sample(|l| Illuminant::D65.relative_power(l));
    let on_grid = light_xyz(&GRID, OBSERVER, &d65);
    let spectral = SpectralSky::from_panorama(Bands::default(), GRID, OBSERVER, &panorama);
    let spectral = spectral.projected(&Projection::Spectral(&basis));
    let rgb = Sky::rgb_from_panorama(Bands::default(), &panorama);
    for vertex in 0..6 {
        let a = spectral.radiance_xyz(&transfer, 0, &basis.albedo_coefficients(&white))[vertex];
        let b = rgb.radiance_xyz(&transfer, 0, &rgb_albedo(&GRID, OBSERVER, &white))[vertex];
        for c in 0..3 {
            assert!((a[c] - 2.0 * on_grid[c] / on_grid[1]).abs() < 1e-5, "{a:?}");
            assert!((b[c] - 2.0 * D65_WHITE_XYZ[c]).abs() < 1e-5, "{b:?}");
        }
    }
}

/// One bright texel is a source in its direction, with the harmonics of that direction.
#[test]
fn a_bright_texel_lights_from_where_it_is() {
    let mut texels = vec![[0.0; 3]; 64 * 32];
    // Column 48 of 64 begins at +X, rows 15 and 16 lie on the horizon.
    texels[15 * 64 + 48] = [1000.0; 3];
    let panorama = Panorama::new(64, 32, texels).unwrap();
    let sky = Sky::rgb_from_panorama(Bands::default(), &panorama);
    let transfer = transfer(octahedron(DMat3::IDENTITY));
    let grey = [[0.0, 0.5, 0.0]; 3];
    let y: Vec<f64> = sky.radiance_xyz(&transfer, 0, &grey).iter().map(|xyz| xyz[1]).collect();
    assert!((1..6).all(|v| y[0] > 3.0 * y[v].abs()), "{y:?}");
    // Five bands of a clamped cosine: opposite to the light it rings, and nothing has clamped it.
    assert!(y[2].abs() < 0.1 * y[0] && y[2] != 0.0, "{y:?}");
}

#[test]
fn turning_the_sky_is_turning_the_object_back() {
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 1.1);
    let texels = (0..32 * 16).map(|i| [(i % 32) as f32, (i / 32) as f32, 3.0]).collect();
    let panorama = Panorama::new(32, 16, texels).unwrap();
    let basis = basis(5);
    let sky = SpectralSky::from_panorama(Bands::default(), GRID, OBSERVER, &panorama);
    let sky = sky.projected(&Projection::Spectral(&basis));
    let albedo = basis.albedo_coefficients(&color_checker::sampled(&GRID)[14]);
    let still = sky.radiance_xyz(&transfer(octahedron(DMat3::IDENTITY)), 0, &albedo);
    let rotation = ShRotation::new(Bands::default(), turn).unwrap();
    let turned = sky.rotated(&rotation).radiance_xyz(&transfer(octahedron(turn)), 0, &albedo);
    for (a, b) in still.iter().zip(&turned) {
        for c in 0..3 {
            assert!((a[c] - b[c]).abs() < 1e-5 * still[0][1].abs(), "{a:?} {b:?}");
        }
    }
    assert!((still[0][1] - still[1][1]).abs() > 0.1 * still[0][1].abs());
}

/// Grey surfaces with interreflection need one function, and without bounces it is plain transfer.
#[test]
fn spectral_transfer_without_bounces_shows_what_transfer_shows() {
    let surface = octahedron(DMat3::IDENTITY);
    let direct = transfer(surface.clone());
    let basis = basis(5);
    let paint = color_checker::sampled(&GRID)[13].clone();
    let settings = BounceSettings { rays: 16, bounces: 0 };
    let spectral =
        add_bounces(&[surface], &direct, GRID, std::slice::from_ref(&paint), &settings, &mut |_| {}).unwrap();
    let sky = Sky::even(Bands::default(), &basis.light_coefficients(&lights()[7]));
    let a = sky.radiance_xyz(&direct, 0, &basis.albedo_coefficients(&paint));
    let b = sky.bounced_radiance_xyz(&spectral, 0, &spectral.albedo_coefficients(&basis, &paint));
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        for c in 0..3 {
            assert!((a[c] - b[c]).abs() < 1e-6 * a[1], "{a:?} {b:?}");
        }
    }
}
