//! The pond in the window: pebbles, the sun, methods.

use std::thread::sleep;
use std::time::Duration;

use crate::display::{HOME, SPACE, Session, difference};

/// Quick on a software driver, and of one brightness: what changes is the light.
const SMALL: &str = "--map 64 --exposure 1";
/// Share of the stage that a change covers that one is meant to see.
const SEEN: f64 = 0.02;
/// Share of the stage that may differ where nothing has changed.
const NOISE: f64 = 1e-3;
/// A pebble's waves are in the middle of the water by then.
const WHILE: Duration = Duration::from_secs(2);

fn use_it(backend: &str) {
    let mut window = Session::open(&format!("pond --method low-rank --backend {backend} {SMALL}"));
    // Time runs, but nothing moves in water at rest.
    let still = window.settled();
    sleep(WHILE);
    let later = window.settled();
    assert!(difference(&still, &later) < NOISE, "still water: {}", difference(&still, &later));

    // A click makes waves, which travel.
    window.click([0, 0]);
    let waves = |before: Vec<[u8; 3]>| {
        move |s: &Session| s.shot().map(|now| now.stage()).filter(|now| difference(&before, now) > SEEN)
    };
    let begun = window.wait_for("waves", waves(still.clone()));
    window.wait_for("waves to travel", waves(begun));
    window.press(SPACE);
    let paused = window.settled();
    assert!(difference(&still, &paused) > SEEN, "no waves: {}", difference(&still, &paused));

    // The caustic goes where the light goes.
    let under_another_sun = window.drag((3, [60, 20]), "the sun to move", &paused, SEEN);

    // To `photon` by way of `exact`: its water scatters nothing, and there are lines where there were bands.
    (0..2).for_each(|_| window.press(u32::from(b'm')));
    window.changed("the method to become photon", &under_another_sun, SEEN);

    // Round to low-rank again, and back to the beginning: no waves, and the sun where it was.
    (0..2).for_each(|_| window.press(u32::from(b'm')));
    window.press(HOME);
    let again = window.changed("the beginning", &paused, SEEN);
    assert!(difference(&still, &again) < NOISE, "not the beginning: {}", difference(&still, &again));
    assert!(window.close().success());
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn pond_on_wgpu_in_the_window() {
    use_it("wgpu");
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn pond_on_the_cpu_beside_the_window() {
    use_it("cpu");
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn pond_on_vulkan_beside_the_window() {
    use_it("vulkan");
}

#[test]
#[ignore = "needs a display of its own: cargo xtask test"]
fn a_click_beside_the_water_makes_no_wave() {
    let mut window = Session::open(&format!("pond --backend cpu {SMALL}"));
    let still = window.settled();
    // The stage is higher than it is wide here: there is nothing above the pond.
    window.click([0, -170]);
    sleep(WHILE);
    let later = window.settled();
    assert!(difference(&still, &later) < NOISE, "{}", difference(&still, &later));
    assert!(window.close().success());
}
