//! Files appear whole or not at all, and hold what was put in.

use std::fs;
use std::io;

use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
use spectral_cli::output::atomic_file::AtomicFile;
use spectral_cli::output::exr::ExrImage;
use spectral_cli::output::png;
use spectral_cli::values::Size;
use spectral_scene::IrradianceMaps;

const SIZE: Size = Size { width: 3, height: 2 };

fn maps() -> IrradianceMaps {
    let ramp = |scale: f32| (0..6).map(|i| [0.5, 1.0, 1.5].map(|c| c * scale * i as f32)).collect();
    IrradianceMaps { width: 3, height: 2, direct: ramp(1.0), refracted: ramp(16.0), reflected: ramp(256.0) }
}

fn files_in(folder: &tempfile::TempDir) -> Vec<String> {
    let names = fs::read_dir(folder.path())
        .expect("folder is there")
        .map(|entry| entry.expect("entry is readable").file_name().into_string().expect("name is UTF-8"));
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

#[test]
fn a_failed_write_leaves_the_older_file_and_nothing_else() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("out.bin");
    fs::write(&path, "older").expect("older file");
    let file = AtomicFile::new(&path).expect("writable");
    let result = file.write(|content| {
        content.write_all(b"half of the new")?;
        Err(io::Error::other("the second half is missing"))
    });
    assert!(result.is_err());
    assert_eq!(fs::read_to_string(&path).expect("still there"), "older");
    assert_eq!(files_in(&folder), ["out.bin"]);

    file.write(|content| content.write_all(b"whole")).expect("written");
    assert_eq!(fs::read_to_string(&path).expect("there"), "whole");
    assert_eq!(files_in(&folder), ["out.bin"]);
}

#[test]
fn choosing_a_target_leaves_nothing_behind() {
    let folder = tempfile::tempdir().expect("folder");
    AtomicFile::new(&folder.path().join("new.exr")).expect("writable");
    assert!(files_in(&folder).is_empty());
}

#[test]
fn targets_that_cannot_be_written_are_refused_when_chosen() {
    let folder = tempfile::tempdir().expect("folder");
    let file = folder.path().join("file");
    fs::write(&file, "").expect("file");
    let refused = |path: &std::path::Path| AtomicFile::new(path).expect_err("refused").kind();
    assert_eq!(refused(folder.path()), io::ErrorKind::IsADirectory);
    assert_eq!(refused(&folder.path().join("missing/out.exr")), io::ErrorKind::NotFound);
    assert_eq!(refused(&file.join("out.exr")), io::ErrorKind::NotADirectory);
    assert_eq!(refused("".as_ref()), io::ErrorKind::InvalidInput);

    let mut permissions = fs::metadata(&file).expect("file").permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&file, permissions).expect("permissions");
    assert_eq!(refused(&file), io::ErrorKind::PermissionDenied);
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link_and_new_files_have_ordinary_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("folder");
    let (target, link) = (folder.path().join("target"), folder.path().join("link"));
    fs::write(&target, "older").expect("file");
    std::os::unix::fs::symlink(&target, &link).expect("link");
    AtomicFile::new(&link).expect("writable").write(|content| content.write_all(b"newer")).expect("written");
    assert!(fs::symlink_metadata(&link).expect("link").is_symlink());
    assert_eq!(fs::read_to_string(&target).expect("there"), "newer");

    let plain = folder.path().join("plain");
    fs::write(&plain, "").expect("file");
    let mode = |path| fs::metadata(path).expect("there").permissions().mode();
    assert_eq!(mode(&target), mode(&plain));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_device_is_an_error_and_stays_a_device() {
    let file = AtomicFile::new("/dev/full".as_ref()).expect("can be opened");
    assert!(file.is_device());
    let error = file.write(|content| content.write_all(b"content")).expect_err("full");
    assert_eq!(error.kind(), io::ErrorKind::StorageFull);
    assert!(!fs::metadata("/dev/full").expect("still there").is_file());
}

#[test]
fn irradiance_is_one_part_with_a_total_and_three_layers() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("bake.exr");
    ExrImage::from_irradiance(&maps()).write(&AtomicFile::new(&path).expect("writable")).expect("written");

    let image = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let image = image.from_file(&path).expect("readable");
    assert_eq!(image.layer_data.len(), 1);
    let layer = &image.layer_data[0];
    assert_eq!((layer.size.0, layer.size.1), (3, 2));
    let names: Vec<String> = layer.channel_data.list.iter().map(|c| c.name.to_string()).collect();
    let expected =
        ["X", "Y", "Z", "direct.X", "direct.Y", "direct.Z", "reflected.X", "reflected.Y", "reflected.Z"];
    assert_eq!(names[..9], expected);
    assert_eq!(names[9..], ["refracted.X", "refracted.Y", "refracted.Z"]);
    let samples = |name: &str| {
        let channel = layer.channel_data.list.iter().find(|c| c.name.to_string() == name).expect("channel");
        match &channel.sample_data {
            FlatSamples::F32(samples) => samples.clone(),
            other => panic!("{name} holds {other:?}"),
        }
    };
    for (c, name) in ["X", "Y", "Z"].into_iter().enumerate() {
        let m = maps();
        let column = |layer: &[[f32; 3]]| layer.iter().map(|v| v[c]).collect::<Vec<_>>();
        assert_eq!(samples(&format!("direct.{name}")), column(&m.direct));
        assert_eq!(samples(&format!("refracted.{name}")), column(&m.refracted));
        assert_eq!(samples(&format!("reflected.{name}")), column(&m.reflected));
        // The ramp's sums are exact in f32.
        assert_eq!(samples(name), column(&m.direct).iter().map(|v| v * 273.0).collect::<Vec<_>>());
    }
}

#[test]
fn pictures_keep_colours_outside_the_gamut_and_say_their_primaries() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("picture.exr");
    let pixels: Vec<[f32; 3]> = (0..6).map(|i| [-0.25 * i as f32, 1.0, 4096.0]).collect();
    ExrImage::from_linear_srgb(SIZE, &pixels)
        .write(&AtomicFile::new(&path).expect("writable"))
        .expect("written");

    let image =
        read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = image.from_file(&path).expect("readable");
    let white = image.attributes.chromaticities.expect("chromaticities").white;
    assert!((white.0 - 0.3127).abs() < 1e-4 && (white.1 - 0.3290).abs() < 1e-4, "{white:?}");
    let values: Vec<Vec<f32>> =
        image.layer_data.channel_data.list.iter().map(|c| c.sample_data.values_as_f32().collect()).collect();
    for (k, c) in [2, 1, 0].into_iter().enumerate() {
        assert_eq!(values[k], pixels.iter().map(|p| p[c]).collect::<Vec<_>>(), "channel {k} of B, G, R");
    }
}

#[test]
fn equal_images_make_equal_files() {
    let folder = tempfile::tempdir().expect("folder");
    let texels = 200 * 200;
    let layer: Vec<[f32; 3]> = (0..texels).map(|i| [(i as f32).sin(), i as f32, 0.0]).collect();
    let maps = IrradianceMaps {
        width: 200,
        height: 200,
        direct: layer.clone(),
        refracted: layer.clone(),
        reflected: layer,
    };
    let bytes = ["a.exr", "b.exr"].map(|name| {
        let path = folder.path().join(name);
        ExrImage::from_irradiance(&maps).write(&AtomicFile::new(&path).expect("writable")).expect("written");
        fs::read(path).expect("readable")
    });
    assert!(bytes[0] == bytes[1]);
}

#[test]
fn png_decodes_to_what_went_in() {
    let pixels: Vec<[u8; 3]> = (0..6).map(|i| [i * 40, 255 - i, i]).collect();
    let bytes = png::bytes(SIZE, &pixels).expect("encoded");
    let mut reader = ::png::Decoder::new(io::Cursor::new(&bytes)).read_info().expect("header");
    let mut decoded = vec![0; reader.output_buffer_size().expect("fits")];
    let info = reader.next_frame(&mut decoded).expect("decoded");
    assert_eq!((info.width, info.height), (3, 2));
    assert_eq!(decoded, pixels.as_flattened());
    assert!(reader.info().srgb.is_some());
    assert!(png::bytes(SIZE, &pixels[1..]).is_err());
}

#[test]
fn maps_that_are_not_finite_are_not_written() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("out.exr");
    fs::write(&path, "older").expect("older file");
    let file = AtomicFile::new(&path).expect("writable");
    for bad in [f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
        let mut maps = maps();
        maps.refracted[4][1] = bad;
        let error = ExrImage::from_irradiance(&maps).write(&file).expect_err("refused").to_string();
        assert!(error.contains("not finite"), "{error}");
    }
    // Each layer is finite and their sum is not.
    let mut maps = maps();
    (maps.direct[2][0], maps.refracted[2][0]) = (3e38, 3e38);
    let error = ExrImage::from_irradiance(&maps).write(&file).expect_err("refused").to_string();
    assert!(error.contains("channel X"), "{error}");
    assert_eq!(fs::read_to_string(&path).expect("still there"), "older");
    assert_eq!(files_in(&folder), ["out.exr"]);
}
