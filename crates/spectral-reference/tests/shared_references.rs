//! Agreement with two programs that share nothing with this project: an f64 tracer in NumPy and Mitsuba 3; see
//! tests/golden/README.md. Bakes are 64 x 64, where the references' own noise is below 0.2 %.

mod stage;

use std::path::Path;

use spectral_core::dispersion::Dispersion;
use spectral_core::light::LightSpectrum;
use spectral_reference::{BakeSettings, Effort};
use spectral_scene::{Scene, bundled};
use stage::*;

/// A layer of a golden file, row-major from v = 0.
fn golden(name: &str, layer: &str) -> Vec<[f64; 3]> {
    use exr::prelude::*;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../tests/golden/{name}_64.exr"));
    let image = read_first_flat_layer_from_file(path).expect("the golden file is readable");
    let channel = |axis: &str| -> Vec<f32> {
        let name = format!("{layer}.{axis}");
        let channels = &image.layer_data.channel_data.list;
        let found =
            channels.iter().find(|c| c.name.to_string() == name).expect("the golden file has the channel");
        found.sample_data.values_as_f32().collect()
    };
    let (x, y, z) = (channel("X"), channel("Y"), channel("Z"));
    (0..x.len()).map(|i| [x[i], y[i], z[i]].map(f64::from)).collect()
}

/// What the shared references ask for.
struct Bounds {
    /// Of the total flux, relative, in every channel.
    flux: f64,
    /// Of Y at 64 x 64: RMS of the difference over RMS of the reference.
    rms: f64,
}

/// The first thing that is out of bounds.
fn disagreement(
    scene: &Scene,
    golden_name: &str,
    settings: &BakeSettings,
    bounds: &Bounds,
) -> Option<String> {
    let receiver = scene.receiver("receiver").expect("the scene has a receiver");
    let bake = baked(scene, receiver, settings);
    for (name, layer) in [("direct", &bake.direct), ("refracted", &bake.refracted)] {
        let reference = golden(golden_name, name);
        for channel in 0..3 {
            let ratio = mean(layer, channel) / mean(&reference, channel);
            if (ratio - 1.0).abs() > bounds.flux {
                return Some(format!("{name} flux of channel {channel} is {ratio} of the reference"));
            }
        }
        let rms = relative_rms(layer, &reference);
        if rms > bounds.rms {
            return Some(format!("{name} differs by RMS {rms}"));
        }
    }
    None
}

fn effort(photons: u64) -> BakeSettings {
    BakeSettings {
        size: [64, 64],
        effort: Effort::Photons(photons),
        direct_samples: 512,
        ..BakeSettings::default()
    }
}

fn assert_agrees(scene: &str, golden_name: &str, photons: u64, bounds: &Bounds) {
    let scene = bundled(scene).expect("the scene is bundled");
    assert_eq!(disagreement(&scene, golden_name, &effort(photons), bounds), None);
}

#[test]
fn the_sphere_of_5120_faces_agrees() {
    assert_agrees("sphere", "sphere", 1_000_000, &Bounds { flux: 0.003, rms: 0.02 });
}

#[test]
fn the_fine_sphere_agrees() {
    assert_agrees("sphere-fine", "sphere", 3_000_000, &Bounds { flux: 0.002, rms: 0.005 });
}

const GEM: Bounds = Bounds { flux: 0.002, rms: 0.01 };

#[test]
fn the_gem_agrees() {
    assert_agrees("gem", "gem", 2_000_000, &GEM);
}

/// The same comparison must fail for the wrong glass and for one bounce too few.
#[test]
fn the_wrong_gem_does_not_agree() {
    let gem = bundled("gem").unwrap();
    let fewer = BakeSettings { bounces: 1, ..effort(500_000) };
    assert!(disagreement(&gem, "gem", &fewer, &GEM).is_some());
    let mut heavier = gem.clone();
    for material in heavier.materials.iter_mut().filter(|m| m.is_refractor()) {
        material.dispersion = Dispersion::Cauchy { a: 2.3818 + 0.02, b_um2: 0.0121, c_um4: 0.0 };
    }
    assert!(disagreement(&heavier, "gem", &effort(2_000_000), &GEM).is_some());
}

/// The light that the gem and the sphere throw on an endless floor at one wavelength: refracted by number of internal
/// reflections, and reflected outside, in watts under 1 W/m^2. From `fluxes.json` of the shared references
/// (flux_floor_k0_W to flux_floor_k3_W and flux_floor_ext_W).
const FLOOR_FLUXES: [(&str, f64, [f64; 4], f64); 4] = [
    ("gem", 440.0, [3.745195e-04, 1.657351e-04, 2.460370e-03, 5.524383e-05], 9.588142e-05),
    ("gem", 580.0, [4.004742e-04, 2.026779e-04, 2.429304e-03, 5.802079e-05], 9.569717e-05),
    ("gem", 700.0, [4.063066e-04, 2.098936e-04, 2.429533e-03, 5.841305e-05], 9.561682e-05),
    ("sphere-fine", 580.0, [6.476282e-03, 0.000000e+00, 4.010900e-05, 1.571767e-05], 5.600665e-04),
];

#[test]
fn every_number_of_reflections_has_its_flux() {
    for (name, lambda_nm, by_reflections, outside) in FLOOR_FLUXES {
        let mut scene = bundled(name).unwrap();
        scene.lights[0].spectrum = LightSpectrum::line(lambda_nm).unwrap();
        let receiver = scene.receiver("receiver").expect("the scene has a receiver");
        let half = 500.0;
        scene.meshes[scene.objects[receiver].mesh] = square();
        scene.objects[receiver].world_from_mesh = placed([0.0; 3], [half; 3]);
        let bake = baked(&scene, receiver, &settings(1, 100_000));
        let area = 4.0 * half * half;
        let refracted = bake.refracted[0][1] * area;
        let total: f64 = by_reflections.iter().sum();
        for (share, expected) in bake.ledger.reflections_share.iter().zip(by_reflections) {
            let off = (share * refracted - expected).abs() / total;
            assert!(off < 2e-3, "{name} at {lambda_nm} nm: {} W, expected {expected} W", share * refracted);
        }
        assert_close(refracted, total, 2e-3, name);
        assert_close(bake.reflected[0][1] * area, outside, 1e-2, name);
    }
}
