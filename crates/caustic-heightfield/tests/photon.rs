//! Water as a refractor: closed answers, and the integral in the limit of water that scatters nothing.

use std::f64::consts::TAU;

use caustic_heightfield::*;
use frame_plan::Limits;
use frame_plan::cpu::CpuExecutor;
use spectral_core::light::LightSpectrum;
use spectral_core::optics::fresnel_dielectric;
use spectral_core::rgb::D65_WHITE_XYZ;

fn waves(size: [usize; 2], amplitude_m: f64) -> HeightField {
    HeightField::from_fn(size, [1.0, 1.0], |x, y| {
        let second = (TAU * (5.0 * x - 4.0 * y) + 1.0).sin();
        amplitude_m * ((TAU * (3.0 * x + 2.0 * y)).sin() + 0.8 * second)
    })
    .expect("finite waves")
}

fn pond(tilt_deg: f64) -> Pond {
    Pond { light_direction: light_tilted_deg(tilt_deg), ..Pond::default() }
}

fn cpu() -> CpuExecutor {
    CpuExecutor::new(asm_core::PASSES, Some(2)).expect("a CPU")
}

fn lit(surface: &HeightField, pond: &Pond, floor: FloorGrid, settings: PhotonSettings) -> PhotonFloor {
    let mut photon = Photon::new(pond, settings).expect("a pond of its kind");
    photon.floor(surface, floor, &mut cpu()).expect("a frame")
}

/// Irradiance below level water, and by how much the light's edge is shifted.
fn level(pond: &Pond, tilt_deg: f64) -> (f64, f64) {
    let cos_i = tilt_deg.to_radians().cos();
    let fresnel = fresnel_dielectric(cos_i, pond.eta());
    let absorbed = (-pond.extinction_per_m * pond.depth_m / fresnel.cos_t).exp();
    let tan_t = (1.0 - fresnel.cos_t * fresnel.cos_t).sqrt() / fresnel.cos_t;
    (cos_i * fresnel.transmitted * absorbed, pond.depth_m * tan_t)
}

/// Level water: what passes times its cosine, evenly, but for a dark strip as wide as the water bends light aside.
#[test]
fn level_water_moves_the_edge_of_its_light() {
    let flat = HeightField::flat([40, 30], [1.0, 1.0]).unwrap();
    for tilt in [0.0, 20.0, 40.0, 70.0] {
        let water = pond(tilt);
        let floor = lit(&flat, &water, FloorGrid::below(&flat), PhotonSettings::default());
        let (even, shift_m) = level(&water, tilt);
        for (i, e) in floor.light.irradiance.iter().enumerate() {
            let (column, row) = (i % 40, i / 40);
            let covered = ((column + 1) as f64 - 40.0 * shift_m).clamp(0.0, 1.0);
            let at_edge = covered < 1.0 || column as f64 <= 40.0 * shift_m + 1.0;
            let bound = if at_edge || column == 39 || row == 0 || row == 29 { 0.04 } else { 2e-5 };
            assert!((e / even - covered).abs() < bound, "{tilt}, ({column}, {row}): {} {covered}", e / even);
        }
        let ratio = floor.light.flux() / (even * (1.0 - shift_m));
        // The pond's edges: a twentieth of a cell of the light's view each.
        assert!((ratio - 1.0).abs() < 2.5e-3, "{tilt}: {ratio}");
        assert_eq!(floor.light.report.surface.samples, 1200);
    }
}

/// Water that goes on for ever has no edge; without a step of the index its waves are not seen at all.
#[test]
fn endless_and_unbending_water_is_even() {
    let surface = waves([32, 32], 0.004);
    let flat = HeightField::flat([32, 32], [1.0, 1.0]).unwrap();
    for tilt in [0.0, 50.0] {
        let endless = Pond { outside: Outside::Periodic, ..pond(tilt) };
        let unbending = Pond { ior_above: 1.333, extinction_per_m: 0.0, ..endless.clone() };
        for (surface, water, bound) in [(&flat, &endless, 3e-5), (&surface, &unbending, 3e-5)] {
            let floor = lit(surface, water, FloorGrid::below(surface), PhotonSettings::default());
            let (even, _) = level(water, tilt);
            let worst = floor.light.irradiance.iter().map(|e| (e / even - 1.0).abs()).fold(0.0, f64::max);
            assert!(worst < bound, "{tilt}: {worst}");
        }
    }
}

/// All that passes the surface lands on a floor that is large enough.
#[test]
fn flux_arrives() {
    for (tilt, amplitude) in [(0.0, 0.01), (45.0, 0.004)] {
        let surface = waves([48, 48], amplitude);
        let water = Pond { extinction_per_m: 0.0, ..pond(tilt) };
        let wide = FloorGrid { size: [48, 48], corner_m: [-0.5, -0.5], extent_m: [2.0, 2.0] };
        let floor = lit(&surface, &water, wide, PhotonSettings::default());
        // The report's surface has the grid's own normals; the one that is lit is smoother.
        let fine = SurfaceLight::new(&surface.supersampled(8, Outside::Dark).unwrap(), &water).unwrap();
        let ratio = floor.light.flux() / fine.report.transmitted_flux;
        assert!((ratio - 1.0).abs() < 2e-3, "{tilt}: {ratio}");
    }
}

/// A window of the floor away from the edges of the light, 8 texels of a grid of 48 on a side.
fn window(texels: usize) -> FloorGrid {
    FloorGrid { size: [texels; 2], corner_m: [0.4, 0.3], extent_m: [1.0 / 6.0; 2] }
}

/// The narrower the lobe, the nearer is its integral to light that is not scattered: in texel means, over facets that resolve it.
#[test]
fn photons_are_the_limit_of_clear_water() {
    for (tilt, amplitude, bound, finer_bound) in
        [(0.0, 0.004, 0.004, 0.0015), (30.0, 0.004, 0.005, 0.002), (30.0, 0.01, 0.022, 0.016)]
    {
        let surface = waves([48, 48], amplitude);
        let water = pond(tilt);
        let integral = |scattering: f64| {
            let scattering = Pond { scattering, ..water.clone() };
            exact_over_facets(&surface, &scattering, window(8), 2.0).unwrap().irradiance
        };
        let by = |water: &Pond, settings| lit(&surface, water, window(8), settings).light.irradiance;
        let limit = integral(3e4);
        let error = relative_rms(&by(&water, PhotonSettings::default()), &limit);
        assert!(error < bound, "{tilt} {amplitude}: {error}");
        // Smaller facets and more cells come nearer, and so do narrower lobes.
        let footprints = asm_core::Settings { emission_size: 256, ..Default::default() };
        let finer = PhotonSettings { facets_per_sample: Some(4), footprints, ..Default::default() };
        let photon = by(&water, finer);
        let errors = [integral(1e3), integral(4e3), limit.clone()].map(|wide| relative_rms(&photon, &wide));
        assert!(errors[2] < finer_bound && errors[2] < error, "{tilt} {amplitude}: {errors:?}");
        assert!(errors[0] > 3.0 * errors[1] && errors[1] > 3.0 * errors[2], "{tilt} {amplitude}: {errors:?}");
        // Controls: what is not this pond is not this floor.
        for wrong in [
            Pond { ior_below: 1.36, ..water.clone() },
            Pond { depth_m: 0.31, ..water.clone() },
            Pond { extinction_per_m: 0.4, ..water.clone() },
            pond(tilt + 1.0),
        ] {
            let error = relative_rms(&by(&wrong, PhotonSettings::default()), &limit);
            assert!(error > 1.5 * bound, "{tilt} {amplitude}: {wrong:?}: {error}");
        }
    }
}

/// Facets that are larger than the floor's texels show: by themselves they are made no larger than half of one.
#[test]
fn facets_are_smaller_than_texels() {
    let (surface, water) = (waves([24, 24], 0.004), pond(30.0));
    let truth =
        exact_over_facets(&surface, &Pond { scattering: 3e4, ..water.clone() }, window(16), 2.0).unwrap();
    let error = |facets_per_sample| {
        let settings = PhotonSettings { facets_per_sample, ..Default::default() };
        relative_rms(&lit(&surface, &water, window(16), settings).light.irradiance, &truth.irradiance)
    };
    let limits = Limits::default();
    let plan = |floor| Photon::new(&water, PhotonSettings::default()).unwrap().plan(&surface, floor, &limits);
    assert_eq!(plan(window(16)).unwrap().facets_per_sample, 8);
    assert_eq!(plan(FloorGrid::below(&surface)).unwrap().facets_per_sample, 2);
    let (small, large) = (error(None), error(Some(1)));
    assert!(small < 0.01 && large > 5.0 * small, "{small} {large}");
}

/// The formula of the pond's water is its index, whatever that is scaled to.
#[test]
fn waters_formula_is_its_index() {
    for (ior_below, ior_above) in [(1.333, 1.0), (1.3334, 1.0), (1.5, 1.0), (1.5, 1.2), (1.02, 1.0)] {
        let water = Pond { ior_below, ior_above, ..Pond::default() };
        let formula = water_dispersion(&water).unwrap();
        for nm in 380..=780 {
            let nm = f64::from(nm);
            let expected = ior_below_at(&water, nm).unwrap() / ior_above;
            assert!((formula.ior(nm) - expected).abs() < 1e-6, "{ior_below} {ior_above} {nm}");
        }
    }
    assert!(water_dispersion(&Pond { ior_above: 1.5, ..Pond::default() }).is_err());
}

/// Three wavelengths, and all colours between them: what many indices one by one give.
#[test]
fn footprints_have_all_colours() {
    // Deep water and a low sun: red and violet land texels apart.
    let surface = waves([32, 32], 0.002);
    let water = Pond { depth_m: 1.0, ..pond(60.0) };
    let grid = FloorGrid { size: [48, 6], corner_m: [0.75, 0.3], extent_m: [1.0, 0.125] };
    let settings = PhotonSettings { dispersion: true, ..Default::default() };
    let floor = lit(&surface, &water, grid, settings);
    let bands = Bands::of_water(&water, &LightSpectrum::default(), 16).unwrap();
    let ponds: Vec<Pond> = bands.ponds(&water).collect();
    let (mut photon, mut executor) = (Photon::new(&water, PhotonSettings::default()).unwrap(), cpu());
    let color = bands.color(|band| -> Result<FloorLight, PondError> {
        photon.set_pond(&ponds[band])?;
        Ok(photon.floor(&surface, grid, &mut executor)?.light)
    });
    let color = color.unwrap().xyz;
    let grey = lit(&surface, &water, grid, PhotonSettings::default()).light.irradiance;
    let channel = |xyz: &[[f64; 3]], c: usize| -> Vec<f64> { xyz.iter().map(|xyz| xyz[c]).collect() };
    let bounds = [0.02, 0.01, 0.04];
    for c in 0..3 {
        let error = relative_rms(&channel(&floor.xyz, c), &channel(&color, c));
        let without: Vec<f64> = grey.iter().map(|y| D65_WHITE_XYZ[c] * y).collect();
        let one_index = relative_rms(&without, &channel(&color, c));
        assert!(error < bounds[c] && one_index > 3.0 * error, "{c}: {error} {one_index}");
    }
    assert_eq!(channel(&floor.xyz, 1), floor.light.irradiance);
}

/// A frame after another is the frame by itself, to the bit.
#[test]
fn surfaces_follow_each_other() {
    let (first, second) = (waves([24, 20], 0.004), waves([24, 20], 0.01));
    let other_size = waves([20, 20], 0.004);
    let water = pond(25.0);
    let (mut moving, mut executor) = (Photon::new(&water, PhotonSettings::default()).unwrap(), cpu());
    for surface in [&first, &second, &other_size, &first] {
        let grid = FloorGrid::below(surface);
        let moved = moving.floor(surface, grid, &mut executor).unwrap();
        assert_eq!(moved.xyz, lit(surface, &water, grid, PhotonSettings::default()).xyz);
    }
}

#[test]
fn other_ponds_are_refused() {
    let flat = HeightField::flat([4, 4], [1.0, 1.0]).unwrap();
    let refused = |pond: Pond, settings: PhotonSettings, words: &str| {
        let floor = FloorGrid::below(&flat);
        let plan = Photon::new(&pond, settings).and_then(|mut p| p.plan(&flat, floor, &Limits::default()));
        let error = plan.expect_err(words).to_string();
        assert!(error.contains(words), "{error}");
    };
    let ok = PhotonSettings::default;
    refused(Pond { form: Form::Paper, ..pond(0.0) }, ok(), "paper's form");
    refused(Pond { illumination: Illumination::Map(vec![1.0; 16]), ..pond(0.0) }, ok(), "varies");
    refused(Pond { ior_above: 1.5, ..pond(0.0) }, ok(), "dense to the thin");
    refused(Pond { depth_m: 0.0, ..pond(0.0) }, ok(), "above the floor");
    refused(Pond { depth_m: f64::NAN, ..pond(0.0) }, ok(), "depth");
    refused(pond(0.0), PhotonSettings { facets_per_sample: Some(0), ..ok() }, "facets");
    let deep = Pond {
        depth_m: 20_000.0,
        light_direction: [1.0, 1.0, -1.0],
        outside: Outside::Periodic,
        ..pond(0.0)
    };
    refused(deep, ok(), "shallower water");
}
