//! Skies of pictures with spectra: what comes back from a file, the furnace of an even one, and what is refused.

use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer, LayerAttributes, SmallVec,
    Text, WritableImage,
};
use glam::DVec3;
use spectral_core::basis::{Optimal, SpectralBasis, Training};
use spectral_core::color_checker;
use spectral_core::grid::SpectralGrid;
use spectral_core::illuminant::Illuminant;
use spectral_core::observer::Observer;
use spectral_prt::{
    Bands, Projection, Sky, SpectralPanorama, SpectralPanoramaError, SpectralSky, Surface, Transfer,
    TransferSettings, precompute, shape_of_bands,
};

const GRID: SpectralGrid = SpectralGrid::SCHWENK_2010;
const OBSERVER: Observer = Observer::Cie1931;
const SIZE: [usize; 2] = [12, 6];
const LAYOUT: [(&str, &str); 2] = [("spectralLayoutVersion", "1.0"), ("emissiveUnits", "W.m^-2.sr^-1")];

fn power(illuminant: Illuminant) -> Vec<f64> {
    GRID.sample(|l| illuminant.relative_power(l))
}

/// An EXR file with these channels and attributes.
fn write(path: &Path, channels: &[(String, Vec<f32>)], attributes: &[(&str, &str)]) {
    let list: SmallVec<[AnyChannel<FlatSamples>; 4]> = channels
        .iter()
        .map(|(name, samples)| AnyChannel::new(&**name, FlatSamples::F32(samples.clone())))
        .collect();
    let mut own = LayerAttributes::default();
    for (name, value) in attributes {
        own.other.insert(Text::from(*name), AttributeValue::Text(Text::from(*value)));
    }
    let layer = Layer::new((SIZE[0], SIZE[1]), own, Encoding::UNCOMPRESSED, AnyChannels::sort(list));
    Image::from_layer(layer).write().to_file(path).expect("written");
}

fn channel(lambda_nm: f64) -> String {
    format!("S0.{}nm", lambda_nm.to_string().replace('.', ","))
}

/// The same spectrum everywhere, at these wavelengths.
fn even(wavelengths_nm: &[f64], spectrum: impl Fn(f64) -> f64) -> Vec<(String, Vec<f32>)> {
    let texels = |l: f64| vec![spectrum(l) as f32; SIZE[0] * SIZE[1]];
    wavelengths_nm.iter().map(|&l| (channel(l), texels(l))).collect()
}

fn grid_nm() -> Vec<f64> {
    (0..GRID.samples()).map(|i| GRID.lambda_nm(i)).collect()
}

/// An octahedron, smooth: its vertices look outwards.
fn transfer() -> Transfer {
    let corners = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let triangles = [0, 1, 2, 3].map(|i| (i, (i + 1) % 4)).map(|(a, b)| [[a, b, 4], [b, a, 5]]).concat();
    let surface = Surface::new(&corners, &corners, &triangles).expect("a body");
    precompute(&[surface], &TransferSettings::default(), &mut |_| {}).expect("transfer")
}

fn basis() -> SpectralBasis {
    let lights: Vec<Vec<f64>> = Illuminant::ALL.map(power).to_vec();
    let reflectances = color_checker::sampled(&GRID);
    let training = Training { grid: GRID, observer: OBSERVER, reflectances: &reflectances, lights: &lights };
    training.optimal(5, Optimal::default()).expect("a basis")
}

/// Largest difference of X, Y or Z over Y between what two skies show of a patch.
fn difference(transfer: &Transfer, albedo: &[[f64; 3]], a: &Sky, b: &Sky) -> f64 {
    let (a, b) = (a.radiance_xyz(transfer, 0, albedo), b.radiance_xyz(transfer, 0, albedo));
    let worst =
        |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (a[c] - b[c]).abs() / a[1]).fold(0.0, f64::max);
    a.iter().zip(&b).map(worst).fold(0.0, f64::max)
}

#[test]
fn a_file_comes_back_with_its_wavelengths_in_order() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("sky.exr");
    // By name 1000 comes before 400.
    let wavelengths_nm = [390.0, 414.2857, 550.5, 1000.0];
    let texels = |i: usize| (0..SIZE[0] * SIZE[1]).map(|t| (t + 100 * i) as f32).collect::<Vec<_>>();
    let mut channels: Vec<_> =
        wavelengths_nm.iter().enumerate().map(|(i, &l)| (channel(l), texels(i))).collect();
    channels.push(("R".into(), texels(7)));
    channels.push(("S1.550,5nm".into(), vec![-1.0; 72]));
    channels.push(("T.550,5nm".into(), vec![9.0; 72]));
    write(&path, &channels, &LAYOUT);
    assert!(SpectralPanorama::is_in(&path));
    let panorama = SpectralPanorama::from_exr(&path).expect("a sky");
    assert_eq!((panorama.size(), panorama.wavelengths_nm()), (SIZE, &wavelengths_nm[..]));
    for (i, channel) in panorama.channels().iter().enumerate() {
        assert_eq!(channel, &texels(i));
    }
}

/// An even sky of an illuminant from a file is that illuminant; others are not.
#[test]
fn an_even_spectral_picture_is_an_even_sky() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("sky.exr");
    let (transfer, basis) = (transfer(), basis());
    let projection = Projection::Spectral(&basis);
    let patches = color_checker::sampled(&GRID);
    let of_file = |channels: &[(String, Vec<f32>)]| {
        write(&path, channels, &LAYOUT);
        let panorama = SpectralPanorama::from_exr(&path).expect("a sky");
        SpectralSky::from_spectral_panorama(Bands::default(), GRID, &panorama).expect("all wavelengths")
    };
    let mut worst: f64 = 0.0;
    for illuminant in Illuminant::ALL {
        let sky = of_file(&even(&grid_nm(), |l| illuminant.relative_power(l)));
        let expected = Sky::even(Bands::default(), &basis.light_coefficients(&power(illuminant)));
        for patch in &patches {
            let albedo = basis.albedo_coefficients(patch);
            worst = worst.max(difference(&transfer, &albedo, &expected, &sky.projected(&projection)));
        }
    }
    println!("even spectral pictures: largest error of X, Y, Z over Y {worst:.1e}");
    assert!(worst < 1e-5, "{worst}");

    // Finer wavelengths of the same spectrum are averaged over the grid's tents, whose variance is 25/6 nm^2: half of that times
    // the curvature, which for A is below 1e-4 / nm^2.
    let fine: Vec<f64> = (390..=710).map(f64::from).collect();
    let sky = of_file(&even(&fine, |l| Illuminant::A.relative_power(l)));
    let expected = Sky::even(Bands::default(), &basis.light_coefficients(&power(Illuminant::A)));
    let white = basis.albedo_coefficients(&GRID.sample(|_| 1.0));
    let error = difference(&transfer, &white, &expected, &sky.projected(&projection));
    assert!(error < 25.0 / 12.0 * 1e-4, "by 1 nm: {error}");

    // Controls: another illuminant; a channel that has moved by 5 nm; a picture with one dark column.
    let d65 = even(&grid_nm(), |l| Illuminant::D65.relative_power(l));
    let error = difference(&transfer, &white, &expected, &of_file(&d65).projected(&projection));
    assert!(error > 0.1, "another illuminant: {error}");
    let moved = even(&grid_nm(), |l| Illuminant::A.relative_power(l + 5.0));
    let error = difference(&transfer, &white, &expected, &of_file(&moved).projected(&projection));
    assert!(error > 1e-3, "moved: {error}");
    let mut uneven = even(&grid_nm(), |l| Illuminant::A.relative_power(l));
    uneven.iter_mut().for_each(|(_, texels)| (0..SIZE[1]).for_each(|row| texels[row * SIZE[0]] = 0.0));
    let error = difference(&transfer, &white, &expected, &of_file(&uneven).projected(&projection));
    assert!(error > 0.01, "uneven: {error}");
}

#[test]
fn files_that_light_nothing_say_why() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("sky.exr");
    let refused = |channels: &[(String, Vec<f32>)], attributes: &[(&str, &str)]| {
        write(&path, channels, attributes);
        assert!(SpectralPanorama::is_in(&path));
        SpectralPanorama::from_exr(&path).expect_err("no light").to_string()
    };
    let good = even(&[400.0, 700.0], |_| 1.0);
    let with = |name: &str| vec![(name.to_owned(), vec![1.0; 72])];
    let reflective = refused(&with("T.550nm"), &LAYOUT);
    assert!(reflective.contains("`T.550nm`") && reflective.contains("S0.<nm>nm"), "{reflective}");
    assert!(refused(&with("Y"), &LAYOUT).contains("no channel named S0.<nm>nm"));
    assert!(refused(&good, &LAYOUT[1..]).contains("spectralLayoutVersion is missing; 1.0 can be read"));
    assert!(refused(&good, &LAYOUT[..1]).contains("emissiveUnits are missing"));
    let lux = refused(&good, &[LAYOUT[0], ("emissiveUnits", "lx")]);
    assert!(lux.contains("emissiveUnits are lx") && lux.contains("W.m^-2.sr^-1.nm^-1"), "{lux}");
    assert!(refused(&with("S0.550.5nm"), &LAYOUT).contains("`S0.550.5nm` names no wavelength"));
    let twice = [with("S0.550nm"), with("S0.550,0nm"), good.clone()].concat();
    assert_eq!(refused(&twice, &LAYOUT), "550 nm after 550 nm; wavelengths ascend");
    let mut bad = good.clone();
    bad[1].1[14] = f32::NAN;
    let place = "the texel in column 2, row 1 is NaN at 700 nm; radiance is finite and not negative";
    assert_eq!(refused(&bad, &LAYOUT), place);
    assert!(matches!(
        SpectralPanorama::from_exr(Path::new("no-such-sky.exr")),
        Err(SpectralPanoramaError::File { .. })
    ));

    // Wavelengths that end too early are seen where a grid asks for more.
    write(&path, &even(&[420.0, 500.0, 700.0], |_| 1.0), &LAYOUT);
    let panorama = SpectralPanorama::from_exr(&path).expect("light");
    let short =
        SpectralSky::from_spectral_panorama(Bands::default(), GRID, &panorama).expect_err("too short");
    assert_eq!(short.to_string(), "wavelengths from 420 to 700 nm; 400 to 700 nm are needed");
}

/// Lights of two spectra from two sides: each vertex has the colour of the side that it looks to, and the mean is that of both.
#[test]
fn lights_add_up_and_keep_their_sides() {
    let [a, d65] = [Illuminant::A, Illuminant::D65].map(power);
    let side = |z: f64| shape_of_bands(Bands::default(), &[vec![1.0], vec![0.0, z, 0.0]]).expect("a shape");
    let sky = |shape: &[f64], light: &[f64]| SpectralSky::of_shape(Bands::default(), GRID, shape, light);
    let both = sky(&side(0.5), &a).plus(&sky(&side(-0.5), &d65));
    let redness = |spectrum: &[f64]| spectrum[60] / spectrum[0];
    let [front, back] = [DVec3::Z, DVec3::NEG_Z].map(|direction| redness(&both.radiance(direction)));
    assert!(redness(&a) > front && front > redness(&both.mean()), "{front}");
    assert!(redness(&d65) < back && back < redness(&both.mean()), "{back}");

    // In one light only luminance is left of that, and the luminance of the mean is what it was.
    let grey = both.in_light(OBSERVER, &power(Illuminant::E));
    let y = |light: &[f64]| spectral_core::patch::light_xyz(&GRID, OBSERVER, light)[1];
    let spectrum = grey.radiance(DVec3::Z);
    assert!((redness(&spectrum) - 1.0).abs() < 1e-12);
    for direction in [DVec3::Z, DVec3::X, DVec3::new(0.6, 0.0, -0.8)] {
        let (before, after) = (y(&both.radiance(direction)), y(&grey.radiance(direction)));
        assert!((before / after - 1.0).abs() < 1e-9, "{before} {after}");
    }
}

#[test]
fn shapes_that_are_none_are_refused_with_the_numbers() {
    let refused = |bands: &[&[f64]]| {
        let bands: Vec<Vec<f64>> = bands.iter().map(|band| band.to_vec()).collect();
        shape_of_bands(Bands::default(), &bands).expect_err("no shape").to_string()
    };
    assert_eq!(refused(&[]), "0 bands of harmonics; 1 to 10 are possible");
    assert_eq!(refused(&[&[1.0], &[0.5]]), "band 1 has 1 coefficients; it has 3, of the orders -1 to 1");
    assert_eq!(refused(&[&[1.0], &[0.5, f64::NAN, 0.0]]), "coefficient 1 of band 1 is NaN; it is finite");
    assert_eq!(
        refused(&[&[-1.0]]),
        "the coefficient of band 0, the mean over all directions, is -1; light has one above 0"
    );
    let long: Vec<Vec<f64>> = (0..10).map(|l| vec![1.0; 2 * l + 1]).collect();
    assert_eq!(shape_of_bands(Bands::default(), &long).map(|shape| shape.len()), Ok(25));
}

/// The sampling that bases are compared with: flat patches to rounding.
#[test]
fn sampling_has_the_colours_of_its_spectra() {
    let projection = Projection::Sampled(GRID, OBSERVER);
    assert_eq!(projection.coefficients(), 61);
    for patch in color_checker::sampled(&GRID) {
        let light = power(Illuminant::Fl11);
        let expected = spectral_core::patch::sampled_xyz(&GRID, OBSERVER, &patch, &light);
        let seen = projection.seen(&patch, &light);
        assert!((0..3).all(|c| (seen[c] - expected[c]).abs() < 1e-9 * expected[1]), "{seen:?} {expected:?}");
    }
}
