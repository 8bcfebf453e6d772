//! Dispersion: sums of colours, and where they land.

use caustic_heightfield::*;
use spectral_core::light::LightSpectrum;

fn waves(size: [usize; 2]) -> HeightField {
    HeightField::from_fn(size, [1.0, 1.0], |x, y| 0.006 * (18.0 * x + 7.0 * y).sin()).expect("finite waves")
}

fn color(
    bands: &Bands,
    pond: &Pond,
    floor: impl Fn(&Pond) -> Result<FloorLight, PondError>,
) -> Result<FloorColor, PondError> {
    let ponds: Vec<Pond> = bands.ponds(pond).collect();
    bands.color(|band| floor(&ponds[band]))
}

fn close(got: [f64; 3], expected: [f64; 3], tolerance: f64) {
    assert!((0..3).all(|c| (got[c] - expected[c]).abs() <= tolerance), "{got:?} {expected:?}");
}

/// Where n is constant every wavelength has the achromatic floor, and together they have the light's colour.
#[test]
fn a_constant_index_leaves_no_colour() {
    let surface = waves([24, 24]);
    let pond = Pond { light_direction: light_tilted_deg(40.0), scattering: 30.0, ..Pond::default() };
    let below = |pond: &Pond| exact(&surface, pond, FloorGrid::below(&surface));
    let grey = below(&pond).expect("a valid pond");
    for (light, count) in [
        (LightSpectrum::default(), 1),
        (LightSpectrum::default(), 7),
        (LightSpectrum::default(), 30),
        (LightSpectrum::illuminant("A").expect("known"), 5),
    ] {
        let bands = Bands::new(&light, count, |_| Ok(pond.ior_below)).expect("wavelengths");
        let color = color(&bands, &pond, below).expect("a valid pond");
        let white = light.unit_xyz(spectral_core::observer::Observer::default());
        for (xyz, e) in color.xyz.iter().zip(&grey.irradiance) {
            close(*xyz, white.map(|w| w * e), 1e-12 * e);
        }
        assert!((color.report.floor_flux / grey.report.floor_flux - 1.0).abs() < 1e-12);
    }
    // Without a step of the index there is nothing to disperse.
    let none = Pond { ior_below: 1.0, ..pond.clone() };
    let bands = Bands::of_water(&none, &LightSpectrum::default(), 7).expect("wavelengths");
    assert!(bands.iors_below.iter().all(|n| *n == 1.0));
}

/// All light that passes lands: the floor's XYZ is the sum of what each wavelength lets pass, times its weight.
#[test]
fn the_energy_of_every_colour_arrives() {
    let surface = waves([32, 32]);
    let pond = Pond { light_direction: light_tilted_deg(60.0), extinction_per_m: 0.0, ..Pond::default() };
    let light = LightSpectrum::default();
    let bands = Bands::of_water(&pond, &light, 7).expect("wavelengths");
    let wide = FloorGrid { size: [80, 80], corner_m: [-1.0, -1.5], extent_m: [4.0, 4.0] };
    let color = color(&bands, &pond, |pond| exact(&surface, pond, wide)).expect("a valid pond");
    let mut passed = [0.0; 3];
    for (&ior_below, weight) in bands.iors_below.iter().zip(&bands.weights_xyz) {
        let at = Pond { ior_below, ..pond.clone() };
        let flux = SurfaceLight::new(&surface, &at).expect("a valid pond").report.transmitted_flux;
        (0..3).for_each(|c| passed[c] += weight[c] * flux);
    }
    let landed = [0, 1, 2].map(|c| color.xyz.iter().map(|xyz| xyz[c]).sum::<f64>() * wide.cell_m2());
    close([0, 1, 2].map(|c| landed[c] / passed[c]), [1.0; 3], 1e-3);
    assert!(color.xyz.iter().flatten().all(|v| *v >= 0.0));
}

/// Water's index: the catalogue's at the ends of the band, the pond's own at the d line, brought to it with its Abbe number.
#[test]
fn the_index_is_waters() {
    let water = spectral_core::glass::by_name("water").expect("water");
    let pond = Pond { ior_below: water.n_d(), ..Pond::default() };
    for nm in [400.0, 486.13, 587.56, 656.27, 700.0] {
        let ior = ior_below_at(&pond, nm).expect("an index");
        assert!((ior - water.ior(nm)).abs() < 1e-9, "{nm}: {ior}");
    }
    let other = |nm| ior_below_at(&Pond { ior_below: 1.5, ..Pond::default() }, nm).expect("an index");
    let abbe = (other(587.56) - 1.0) / (other(486.13) - other(656.27));
    assert!((abbe / water.abbe_v_d() - 1.0).abs() < 1e-6, "{abbe}");
}

/// Red lands farther from the point below than violet, by what Snell's law says for the angle, on level water.
#[test]
fn colours_part_as_snell_says() {
    let depth_m = 0.5;
    for tilt_deg in [20.0_f64, 45.0, 70.0] {
        let pond = Pond {
            depth_m,
            scattering: 1e6,
            extinction_per_m: 0.0,
            light_direction: light_tilted_deg(tilt_deg),
            ..Pond::default()
        };
        let facet = HeightField::flat([1, 1], [1e-4, 1e-4]).expect("flat");
        let lands_m = |nm: f64| -> f64 {
            let at = Pond { ior_below: ior_below_at(&pond, nm).expect("an index"), ..pond.clone() };
            let along = FloorGrid { size: [8192, 1], corner_m: [0.0, 0.0], extent_m: [1.0, 1e-4] };
            let floor = exact(&facet, &at, along).expect("a valid pond");
            let power: f64 = floor.irradiance.iter().sum();
            let moment: f64 =
                floor.irradiance.iter().enumerate().map(|(i, e)| (i as f64 + 0.5) / 8192.0 * e).sum();
            moment / power - 0.5e-4
        };
        let snell_m = |nm: f64| {
            let sin_t = tilt_deg.to_radians().sin() / ior_below_at(&pond, nm).expect("an index");
            depth_m * sin_t.asin().tan()
        };
        let [violet, red] = SEEN_NM;
        let (got, expected) = (lands_m(red) - lands_m(violet), snell_m(red) - snell_m(violet));
        assert!(got > 0.0 && (got / expected - 1.0).abs() < 1e-3, "{tilt_deg}: {got} {expected}");

        // The criterion is the same distance in texels.
        let level = HeightField::flat([100, 100], [1.0, 1.0]).expect("flat");
        let spread = Spread::new(&level, &pond).expect("a valid pond");
        assert!((spread.texels / (100.0 * expected) - 1.0).abs() < 1e-9, "{spread:?} {expected}");
        assert_eq!(spread.visible, 100.0 * expected >= VISIBLE_TEXELS);
    }
}

/// The spread grows with the map's size and with the tilt of the light; water seen from straight above shows none.
#[test]
fn dispersion_is_visible_where_texels_are_small() {
    let spread = |size: usize, tilt_deg: f64| {
        let pond = Pond { light_direction: light_tilted_deg(tilt_deg), ..Pond::default() };
        Spread::new(&waves([size, size]), &pond).expect("a valid pond")
    };
    assert!(!spread(64, 20.0).visible && !spread(128, 20.0).visible && spread(512, 60.0).visible);
    let pond = Pond::default();
    let level = HeightField::flat([8, 8], [1.0, 1.0]).expect("flat");
    assert_eq!(Spread::new(&level, &pond).expect("a valid pond").texels, 0.0);
    // Light that does not get through is spread nowhere.
    let inside = Pond { ior_above: 1.5, ior_below: 1.0, light_direction: light_tilted_deg(60.0), ..pond };
    assert_eq!(Spread::new(&level, &inside).expect("a valid pond"), Spread { texels: 0.0, visible: false });
}

#[test]
fn no_wavelengths_are_no_light() {
    let pond = Pond::default();
    let error = Bands::of_water(&pond, &LightSpectrum::default(), 0).expect_err("none").to_string();
    assert!(error.contains("number of wavelengths is 0"), "{error}");
}
