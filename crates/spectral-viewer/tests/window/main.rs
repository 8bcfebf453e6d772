//! The program in a real window under a virtual display: `cargo xtask test` starts one and runs these.
#![cfg(target_os = "linux")]

mod display;
mod pond;
mod relit;

use std::fs::File;
use std::io::BufReader;

use display::{SPACE, Session, difference, is_picture, viewer};

/// Quick on a software driver.
const SMALL: &str = "--emission 128 --map 256";

/// Share of the stage that must change for a change that one is meant to see.
const SEEN: f64 = 0.002;

/// Share of the stage that may differ at silhouettes.
const EDGES: f64 = 0.01;

fn use_it(backend: &str) {
    let mut window = Session::open(&format!("sphere --method asm --backend {backend} {SMALL}"));
    let begun = window.settled();
    let orbited = window.drag((1, [120, 30]), "the view to turn", &begun, 10.0 * SEEN);
    let back = window.drag((1, [-120, -30]), "the view to turn back", &orbited, 10.0 * SEEN);
    assert!(difference(&begun, &back) < EDGES, "turned back: {}", difference(&begun, &back));
    let lit = window.drag((3, [30, 0]), "the lamp to move", &back, SEEN);
    // From the method's own number to one: the rainbow goes.
    window.press(u32::from(b'n'));
    let grey = window.changed("the wavelengths to become one", &lit, SEEN);
    window.press(u32::from(b'm'));
    window.changed("the method to become caustics-map", &grey, SEEN);
    window.press(u32::from(b'g'));
    let turned = window.shot().expect("a window").stage();
    window.wait_for("the glass to move", |s| s.shot().filter(|now| difference(&turned, &now.stage()) > SEEN));
    window.press(SPACE);
    window.settled();
    assert!(window.close().success());
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn wgpu_in_the_window() {
    use_it("wgpu");
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn cpu_beside_the_window() {
    use_it("cpu");
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn vulkan_beside_the_window() {
    use_it("vulkan");
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn all_executors_show_the_same_picture() {
    let mut window = Session::open(&format!("sphere --method asm --backend wgpu --exposure 2 {SMALL}"));
    let wgpu = window.settled();
    for executor in ["cpu", "vulkan", "wgpu again"] {
        let panel = window.shot().expect("a window").panel();
        window.press(u32::from(b'e'));
        window.wait_for(executor, |s| s.shot().filter(|now| difference(&panel, &now.panel()) > SEEN));
        let now = window.settled();
        // Rasterisers differ.
        assert!(difference(&wgpu, &now) < EDGES, "{executor}: {}", difference(&wgpu, &now));
    }
    assert!(window.close().success());
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn a_screenshot_shows_the_picture() {
    let file = std::env::temp_dir().join(format!("spectral-viewer-{}.png", std::process::id()));
    let status = viewer(&format!("sphere {SMALL} --backend cpu --frames 2"))
        .arg("--screenshot")
        .arg(&file)
        .status()
        .expect("the viewer starts");
    assert!(status.success(), "{status}");
    let mut reader =
        png::Decoder::new(BufReader::new(File::open(&file).expect("a file"))).read_info().expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut bytes).expect("pixels");
    std::fs::remove_file(&file).expect("removed");
    assert_eq!([info.width, info.height], [640, 360]);
    assert!(is_picture(bytes.as_chunks::<3>().0));
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn a_pond_that_makes_no_sense_opens_no_window() {
    for (arguments, status, says) in [
        ("pond --method asm", 2, "convolution"),
        ("pond --wavelengths 7", 2, "--wavelengths"),
        ("pond --method exact --precision f16", 2, "f64"),
        ("sphere --precision f16", 2, "--precision"),
        ("pond --pond no-such-file.json", 1, "no-such-file.json"),
    ] {
        let output = viewer(arguments).output().expect("it starts");
        let stderr = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!(output.status.code(), Some(status), "{arguments}: {stderr}");
        assert!(stderr.contains(says) && stderr.lines().count() <= 2, "{arguments}: {stderr}");
    }
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn a_picture_that_cannot_be_made_is_an_error_with_numbers() {
    let output =
        viewer("sphere --backend cpu --map 16384 --wavelengths 400 --frames 1").output().expect("it starts");
    let stderr = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.starts_with("error: ") && !stderr.contains("panicked"), "{stderr}");
    assert!(stderr.chars().any(|c| c.is_ascii_digit()), "{stderr}");
}
