//! Relit surfaces in the window: the sky, illuminants, coefficients.

use std::thread::sleep;
use std::time::Duration;

use crate::display::{HOME, SPACE, Session, difference, viewer};

/// Of one brightness: what changes is the light. Few bands are quickly precomputed.
const SMALL: &str = "color-checker --environment FL4 --bands 3 --exposure 1";
/// Share of the stage that a change covers that one is meant to see.
const SEEN: f64 = 0.02;
/// Share of the stage that may differ where nothing has changed.
const NOISE: f64 = 1e-3;
const WHILE: Duration = Duration::from_secs(2);

fn use_it(backend: &str) {
    let mut window = Session::open(&format!("{SMALL} --backend {backend}"));
    // Pictures go on being made, and none differs.
    let begun = window.settled();
    sleep(WHILE);
    let later = window.settled();
    assert!(difference(&begun, &later) < NOISE, "nothing changed: {}", difference(&begun, &later));

    // Under FL4 RGB is seen to be wrong.
    window.press(u32::from(b'n'));
    let rgb = window.changed("spectra to become RGB", &begun, SEEN);
    window.press(u32::from(b'n'));
    let again = window.changed("RGB to become spectra", &rgb, SEEN);
    assert!(difference(&begun, &again) < NOISE, "spectra again: {}", difference(&begun, &again));

    let turned = window.drag((1, [80, 0]), "the sky to turn", &again, SEEN);
    // From FL4 by FL5 and FL6 to FL7, which is daylight.
    (0..3).for_each(|_| window.press(u32::from(b'l')));
    let daylight = window.changed("the illuminant to become FL7", &turned, SEEN);
    let seen = window.drag((3, [60, 0]), "the view to turn", &daylight, SEEN);

    window.press(SPACE);
    window.press(HOME);
    let back = window.changed("the beginning", &seen, SEEN);
    assert!(difference(&begun, &back) < NOISE, "not the beginning: {}", difference(&begun, &back));
    assert!(window.close().success());
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn relit_on_wgpu_in_the_window() {
    use_it("wgpu");
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn relit_on_the_cpu_beside_the_window() {
    use_it("cpu");
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn relit_on_vulkan_beside_the_window() {
    use_it("vulkan");
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn what_cannot_be_relit_opens_no_window() {
    for (arguments, status, says) in [
        ("sphere --coefficients 5", 2, "--environment"),
        ("glass --environment moonlight", 2, "moonlight"),
        ("glass --environment D65 --method asm", 2, "--method"),
        ("glass --environment D65 --coefficients 61 --bands 1", 2, "rank"),
    ] {
        let output = viewer(arguments).output().expect("it starts");
        let stderr = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!(output.status.code(), Some(status), "{arguments}: {stderr}");
        assert!(stderr.contains(says) && !stderr.contains("panicked"), "{arguments}: {stderr}");
    }
}
