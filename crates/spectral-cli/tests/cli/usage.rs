//! Command lines that make no sense: status 2, one or two lines, nothing written.

use std::process::Command;

use crate::program::{files_in, run, spectral, spectral_in};

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
    for command in ["pond", "prt"] {
        spectral(command).bad_usage(&[command]);
    }
    spectral("matrices --bogus").bad_usage(&["--bogus", "spectral matrices --help"]);
    spectral("bake sphere").bad_usage(&["--output"]);
    spectral("bake -o out.exr").bad_usage(&["SCENE"]);
    spectral("export sphere").bad_usage(&["--output"]);
}

#[test]
fn methods_and_backends_that_there_are_not_say_what_there_is() {
    spectral("bake sphere -o out.exr --method bogus").bad_usage(&[
        "bogus",
        "reference",
        "caustics-map",
        "acm",
        "asm",
        "footprint",
    ]);
    spectral("bake sphere -o out.exr --backend bogus").bad_usage(&["bogus", "auto", "cpu", "wgpu", "vulkan"]);
    spectral("plan sphere --method bogus").bad_usage(&["bogus", "caustics-map", "footprint"]);
    spectral("plan sphere --method reference").bad_usage(&["reference", "caustics-map"]);
}

#[test]
fn what_the_price_list_chooses_cannot_be_given_too() {
    for wish in ["--budget-ms 5", "--target-de 1"] {
        let option = wish.split(' ').next().expect("a word");
        for given in ["--method asm", "--wavelengths 7", "--levels 3", "--gap-filling none", "--noise 0.1"] {
            let name = given.split(' ').next().expect("a word");
            spectral(&format!("bake sphere -o out.exr {wish} {given}")).bad_usage(&[option, name]);
        }
        spectral(&format!("bake sphere -o out.exr {option} 0")).bad_usage(&[option, "above 0"]);
        spectral(&format!("render sphere -o out.png {option} nan")).bad_usage(&[option, "above 0"]);
    }
    let both = "bake sphere -o out.exr --budget-ms 5 --target-de 1";
    spectral(both).bad_usage(&["--budget-ms", "--target-de"]);
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
    bake("--method reference --backend wgpu").bad_usage(&["--backend wgpu", "CPU"]);
    bake("--method reference --backend vulkan").bad_usage(&["--backend vulkan", "CPU"]);
    bake("--method reference --adapter x").bad_usage(&["--adapter", "CPU"]);
    bake("--method reference --photons 10 --noise 0.1").bad_usage(&["--photons", "--noise"]);
    bake("--method asm --wavelengths 401").bad_usage(&["--wavelengths 401", "asm", "1 to 400"]);
    bake("--method reference --levels 3").bad_usage(&["--levels", "asm"]);
    bake("--method reference --gap-filling paper").bad_usage(&["--gap-filling", "asm"]);
    bake("--method reference --map-fit landings").bad_usage(&["--map-fit", "asm"]);
    bake("--method reference --rule glsl").bad_usage(&["--rule", "asm"]);
    bake("--rule bogus").bad_usage(&["bogus", "fresnel", "glsl"]);
    bake("--glass bogus").bad_usage(&["bogus", "straight", "deferred"]);
    bake("--map-fit bogus").bad_usage(&["bogus", "receivers", "landings"]);
    bake("--gap-filling bogus").bad_usage(&["bogus", "none", "paper", "paper-literal", "disc"]);
    bake("--backend cpu --adapter x").bad_usage(&["--adapter", "--backend"]);
    bake("--refraction bogus").bad_usage(&["bogus", "image-space", "traced"]);
}

/// What the command line offers to every method and one cannot do is a failure, not bad usage.
#[test]
fn refraction_that_a_method_lacks_names_what_there_is() {
    for command in ["bake", "render"] {
        for method in ["reference", "footprint"] {
            let run = format!(
                "{command} sphere -o out.exr --size 16x16 --method {method} --refraction image-space"
            );
            spectral(&run).failed(&["image-space", method, "take traced", "caustics-map, acm or asm"]);
        }
    }
    let plan = spectral("plan sphere --method footprint --refraction image-space").done().stdout;
    assert!(plan.contains("no plan for a bake: refraction is image-space, it must be traced"), "{plan}");
    let plan = spectral("plan gem --method asm --refraction traced").done().stdout;
    assert!(plan.contains("3 reflections inside the first glass"), "{plan}");
}

/// Options for every method count where they mean something, and a warning says where they do not.
#[test]
fn options_without_effect_are_accepted_with_a_warning() {
    let folder = tempfile::tempdir().expect("folder");
    let run = |options: &str| {
        let run = format!("bake gem -o out.exr --size 8x8 --backend cpu {options}");
        spectral_in(folder.path(), &run).done().stderr
    };
    for (options, words) in [
        ("--method caustics-map --wavelengths 1 --bounces 2", ["--bounces 2", "caustics-map"]),
        ("--method acm --wavelengths 1 --bounces 1", ["--bounces 1", "acm"]),
        ("--method asm --wavelengths 1 --bounces 3 --seed 7", ["--bounces 3", "asm"]),
        ("--method caustics-map --wavelengths 1 --photons 10", ["--photons", "caustics-map"]),
        ("--method caustics-map --wavelengths 1 --noise 0.1", ["--noise", "caustics-map"]),
        ("--method reference --photons 1000 --wavelengths 7", ["--wavelengths 7", "80 are used"]),
        ("--method reference --photons 1000 --wavelengths 1000", ["--wavelengths 1000", "400 are used"]),
    ] {
        let stderr = run(options);
        assert_eq!(stderr.lines().count(), 1, "{options}: {stderr}");
        assert!(stderr.starts_with("warning: "), "{options}: {stderr}");
        assert!(words.iter().all(|word| stderr.contains(word)), "{options}: {stderr}");
    }
    for options in [
        "--method asm --wavelengths 1 --bounces 0 --seed 7",
        "--method asm --wavelengths 1 --refraction traced --bounces 2",
        "--method reference --photons 1000 --wavelengths 80 --bounces 2",
    ] {
        assert_eq!(run(options), "", "{options}");
    }
}

#[test]
fn an_adapter_has_a_name() {
    for name in ["", "  "] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_spectral"));
        run(command.args(["bake", "sphere", "-o", "out.exr", "--adapter", name]))
            .bad_usage(&["--adapter", "devices"]);
    }
}

#[test]
fn outputs_of_an_unknown_format_are_refused() {
    spectral("bake sphere -o out.png").bad_usage(&["out.png", ".exr"]);
    spectral("bake sphere -o out").bad_usage(&[".exr"]);
    spectral("render sphere -o out.jpg").bad_usage(&["out.jpg", ".exr or .png"]);
    spectral("export sphere -o out.obj").bad_usage(&["out.obj", ".glb"]);
    spectral("bake sphere -o out.exr --stats out.exr").bad_usage(&["--stats", "out.exr"]);
}
