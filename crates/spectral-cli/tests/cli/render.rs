//! `spectral render`: linear EXR, displayed PNG, exposure.

use std::fs;
use std::path::Path;

use exr::prelude::{ReadChannels, ReadLayers, read};
use serde_json::Value;

use crate::program::{files_in, spectral_in};

const OPTIONS: &str = "--size 64x36 --wavelengths 1 --backend cpu";

/// Red, green and blue of each pixel.
fn linear_srgb(path: &Path) -> Vec<[f32; 3]> {
    let image =
        read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = image.from_file(path).expect("a readable EXR");
    assert!(image.attributes.chromaticities.is_some());
    let channels = &image.layer_data.channel_data.list;
    assert_eq!(channels.iter().map(|c| c.name.to_string()).collect::<Vec<_>>(), ["B", "G", "R"]);
    let values = [2, 1, 0].map(|c| channels[c].sample_data.values_as_f32().collect::<Vec<_>>());
    (0..values[0].len()).map(|i| [values[0][i], values[1][i], values[2][i]]).collect()
}

fn srgb8(path: &Path) -> (Vec<u8>, [u32; 2]) {
    let file = std::io::BufReader::new(fs::File::open(path).expect("there"));
    let mut reader = png::Decoder::new(file).read_info().expect("a readable PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("fits")];
    let info = reader.next_frame(&mut pixels).expect("pixels");
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
    (pixels, [info.width, info.height])
}

fn stats(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("stats.json")).expect("written")).expect("JSON")
}

/// Rec. 709 luminance, which is Y.
fn luminance([r, g, b]: [f32; 3]) -> f64 {
    0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
}

#[test]
fn auto_exposure_is_one_over_the_99th_percentile_and_stated() {
    let folder = tempfile::tempdir().expect("folder");
    spectral_in(folder.path(), &format!("render sphere -o out.exr {OPTIONS} --stats stats.json")).done();
    let pixels = linear_srgb(&folder.path().join("out.exr"));
    assert_eq!(pixels.len(), 64 * 36);
    assert!(pixels.as_flattened().iter().all(|v| v.is_finite()));
    let mut y: Vec<f64> = pixels.iter().map(|&rgb| luminance(rgb)).collect();
    y.sort_by(f64::total_cmp);
    let percentile = y[(0.99 * (y.len() - 1) as f64).round() as usize];
    assert!(percentile > 0.0, "the picture is dark");
    let stats = stats(folder.path());
    let exposure = stats["display"]["exposure"].as_f64().expect("an exposure");
    assert!((exposure * percentile - 1.0).abs() < 1e-3, "{exposure} {percentile}");
    assert_eq!((&stats["command"], &stats["target"]), (&"render".into(), &"camera".into()));
    assert_eq!(files_in(folder.path()), ["out.exr", "stats.json"]);
}

/// An EXR holds the scene, whatever the exposure; a PNG what a screen shows of it.
#[test]
fn exposure_scales_the_png_and_not_the_exr() {
    let folder = tempfile::tempdir().expect("folder");
    let render = |file: &str, exposure: &str| {
        let run = format!("render sphere -o {file} {OPTIONS} --exposure {exposure} --stats stats.json");
        spectral_in(folder.path(), &run).done();
        assert_eq!(stats(folder.path())["display"]["exposure"], exposure.parse::<f64>().expect("a number"));
        folder.path().join(file)
    };
    assert_eq!(linear_srgb(&render("dim.exr", "0.5")), linear_srgb(&render("bright.exr", "2")));
    let [(dim, size), (bright, _)] = [render("dim.png", "0.5"), render("bright.png", "2")].map(|p| srgb8(&p));
    assert_eq!(size, [64, 36]);
    assert!(dim.iter().zip(&bright).all(|(d, b)| d <= b) && dim != bright);
    assert!(dim.iter().any(|&v| v > 0));
    // Black stays black and a grey inside the gamut is its own sRGB code.
    let linear = linear_srgb(&folder.path().join("dim.exr"));
    for (rgb, shown) in linear.iter().zip(dim.chunks_exact(3)) {
        let scaled = rgb.map(|v| 0.5 * v);
        if scaled.iter().all(|v| (0.0..=1.0).contains(v)) {
            for (v, shown) in scaled.iter().zip(shown) {
                let code = if *v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
                assert!((code * 255.0 - f32::from(*shown)).abs() <= 0.51, "{v} became {shown}");
            }
        }
    }
}

#[test]
fn a_scene_without_a_camera_file_still_has_one() {
    let folder = tempfile::tempdir().expect("folder");
    let mut scene = spectral_scene::bundled("gem").expect("a bundled scene");
    scene.cameras.clear();
    fs::write(folder.path().join("blind.glb"), spectral_scene::to_glb(&scene).expect("valid"))
        .expect("written");
    let run = spectral_in(folder.path(), &format!("render blind.glb -o out.png {OPTIONS}")).done();
    assert!(run.stderr.starts_with("warning: ") && run.stderr.contains("camera"), "{}", run.stderr);
    assert!(srgb8(&folder.path().join("out.png")).0.iter().any(|&v| v > 0));
}

#[test]
fn unwritable_pictures_are_failures() {
    let folder = tempfile::tempdir().expect("folder");
    fs::write(folder.path().join("out.png"), "older").expect("written");
    spectral_in(folder.path(), "render sphere -o missing/out.png").failed(&["missing/out.png", "no folder"]);
    spectral_in(folder.path(), "render nothing -o out.png").bad_usage(&["nothing"]);
    assert_eq!(fs::read_to_string(folder.path().join("out.png")).expect("there"), "older");
    assert_eq!(files_in(folder.path()), ["out.png"]);
}

#[test]
fn reference_renders_with_its_standard_error() {
    let folder = tempfile::tempdir().expect("folder");
    let render = |file: &str, options: &str| {
        let run = format!(
            "render gem -o {file} --size 32x18 --method reference --bounces 2 --wavelengths 80 {options} \
             --stats stats.json"
        );
        spectral_in(folder.path(), &run).done();
        (linear_srgb(&folder.path().join(file)), stats(folder.path()))
    };
    let (first, stats) = render("first.exr", "--photons 2e4 --seed 3 --threads 2");
    assert!(first.as_flattened().iter().all(|v| v.is_finite()));
    assert!(first.iter().any(|&rgb| luminance(rgb) > 0.0), "the picture is dark");
    assert!(stats["standard_error"]["total"].as_f64().expect("an error") > 0.0);
    assert!(stats["statistics"]["photons"].as_u64().expect("photons") >= 20_000);
    assert_eq!((&stats["settings"]["seed"], &stats["settings"]["bounces"]), (&3.into(), &2.into()));
    assert_eq!(first, render("again.exr", "--photons 2e4 --seed 3 --threads 1").0);
    assert_ne!(first, render("other.exr", "--photons 2e4 --seed 4").0);
}

/// Nothing but direct light: the error falls ever more slowly, and no photons are counted.
#[test]
fn a_noise_target_out_of_reach_ends_with_a_warning() {
    let folder = tempfile::tempdir().expect("folder");
    let mut scene = spectral_scene::bundled("gem").expect("a bundled scene");
    let refractors: Vec<usize> = scene.refractors().collect();
    scene.objects = (0..scene.objects.len())
        .filter(|i| !refractors.contains(i))
        .map(|i| scene.objects[i].clone())
        .collect();
    fs::write(folder.path().join("plain.glb"), spectral_scene::to_glb(&scene).expect("valid"))
        .expect("written");
    let run = "render plain.glb -o out.exr --size 8x8 --method reference --noise 1e-9 --threads 1 --stats stats.json";
    let run = spectral_in(folder.path(), run).done();
    assert!(run.stderr.contains("warning: noise 0.000000001 is not reached"), "{}", run.stderr);
    let stats = stats(folder.path());
    assert_eq!(stats["statistics"]["photons"], 0);
    assert_eq!(stats["statistics"]["replicates"], 4096);
    assert!(linear_srgb(&folder.path().join("out.exr")).iter().any(|&rgb| luminance(rgb) > 0.0));
}
