//! Command lines that make no sense: status 2, one or two lines, nothing written.

use crate::program::{files_in, spectral, spectral_in};

#[test]
fn help_and_version_are_not_errors() {
    for args in ["--help", "bake --help", "--version"] {
        let run = spectral(args).done();
        assert!(run.stdout.contains("spectral"), "{}", run.stdout);
        assert_eq!(run.stderr, "");
    }
    assert_eq!(spectral("").status, Some(2));
}

#[test]
fn what_is_not_there_is_refused() {
    spectral("bogus").bad_usage(&["bogus", "--help"]);
    // Commands of the design that are not built.
    for command in ["pond", "prt", "view"] {
        spectral(command).bad_usage(&[command]);
    }
    spectral("matrices --bogus").bad_usage(&["--bogus", "spectral matrices --help"]);
    spectral("bake sphere").bad_usage(&["--output"]);
    spectral("bake -o out.exr").bad_usage(&["SCENE"]);
    spectral("export sphere").bad_usage(&["--output"]);
}

#[test]
fn methods_and_backends_that_are_not_built_say_what_there_is() {
    spectral("bake sphere -o out.exr --method footprint").bad_usage(&[
        "footprint",
        "not built yet",
        "reference",
        "caustics-map",
        "acm",
        "asm",
    ]);
    spectral("bake sphere -o out.exr --method bogus").bad_usage(&["bogus", "reference", "caustics-map"]);
    spectral("bake sphere -o out.exr --backend bogus").bad_usage(&["bogus", "auto", "cpu", "wgpu", "vulkan"]);
    spectral("plan sphere --method footprint").bad_usage(&["not built yet", "caustics-map"]);
    spectral("plan sphere --method reference").bad_usage(&["reference", "caustics-map"]);
}

#[test]
fn values_out_of_range_are_refused_by_the_options_name() {
    let folder = tempfile::tempdir().expect("folder");
    let bad = [
        "--size 0x10",
        "--size 1000000x1000000",
        "--size -1x5",
        "--size 256",
        "--wavelengths 0",
        "--wavelengths -3",
        "--wavelengths 1000000",
        "--bounces -1",
        "--levels -1",
        "--levels 9",
        "--gap-radius 0",
        "--gap-radius 16",
        "--gap-samples 65",
        "--gap-threshold 0",
        "--bounces 1000000000",
        "--threads 0",
        "--threads 1000000",
        "--seed -1",
        "--photons 0 --method reference",
        "--photons -5 --method reference",
        "--photons 1e300 --method reference",
        "--noise NaN --method reference",
        "--noise 0 --method reference",
        "--noise -0.1 --method reference",
    ];
    for options in bad {
        let option = options.split_whitespace().next().expect("an option");
        for command in ["bake", "render"] {
            spectral_in(folder.path(), &format!("{command} sphere -o out.exr {options}"))
                .bad_usage(&[option]);
        }
    }
    for exposure in ["NaN", "inf", "0", "-1", "-inf", "bright"] {
        spectral_in(folder.path(), &format!("render sphere -o out.png --exposure {exposure}"))
            .bad_usage(&["--exposure"]);
    }
    assert!(files_in(folder.path()).is_empty());
}

#[test]
fn options_that_a_method_lacks_are_refused() {
    let bake = |options: &str| spectral(&format!("bake sphere -o out.exr {options}"));
    bake("--method caustics-map --photons 10").bad_usage(&["--photons", "reference"]);
    bake("--method caustics-map --noise 0.1").bad_usage(&["--noise", "reference"]);
    bake("--method caustics-map --refraction traced").bad_usage(&["traced", "image-space"]);
    bake("--method caustics-map --bounces 2").bad_usage(&["--bounces", "reference"]);
    bake("--method reference --refraction image-space").bad_usage(&["image-space", "traced"]);
    bake("--method reference --backend wgpu").bad_usage(&["--backend wgpu", "CPU"]);
    bake("--method reference --backend vulkan").bad_usage(&["--backend vulkan", "CPU"]);
    bake("--method reference --adapter x").bad_usage(&["--adapter", "CPU"]);
    bake("--method reference --photons 10 --noise 0.1").bad_usage(&["--photons", "--noise"]);
    bake("--method asm --bounces 2").bad_usage(&["--bounces", "asm"]);
    bake("--method reference --levels 3").bad_usage(&["--levels", "asm"]);
    bake("--method reference --gap-filling paper").bad_usage(&["--gap-filling", "asm"]);
    bake("--method reference --rule glsl").bad_usage(&["--rule", "asm"]);
    bake("--rule bogus").bad_usage(&["bogus", "fresnel", "glsl"]);
    bake("--glass bogus").bad_usage(&["bogus", "straight", "deferred"]);
    bake("--gap-filling bogus").bad_usage(&["bogus", "none", "paper", "paper-literal", "disc"]);
    bake("--backend cpu --adapter x").bad_usage(&["--adapter", "--backend"]);
    bake("--refraction bogus").bad_usage(&["bogus", "image-space", "traced"]);
}

#[test]
fn outputs_of_an_unknown_format_are_refused() {
    spectral("bake sphere -o out.png").bad_usage(&["out.png", ".exr"]);
    spectral("bake sphere -o out").bad_usage(&[".exr"]);
    spectral("render sphere -o out.jpg").bad_usage(&["out.jpg", ".exr or .png"]);
    spectral("export sphere -o out.obj").bad_usage(&["out.obj", ".glb"]);
    spectral("bake sphere -o out.exr --stats out.exr").bad_usage(&["--stats", "out.exr"]);
}
