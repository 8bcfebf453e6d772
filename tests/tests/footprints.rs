//! Footprints on every executor.

use asm_core::{Method, Settings};
use workspace_tests::agreement::assert_executors_agree;
use workspace_tests::subject;
use xtask::checks::Bound;

/// Flat faces and a slit; smooth normals; internal reflections; an open surface; mirrors; two lamps with eyes.
const SCENES: [&str; 6] = ["prism", "sphere", "gem", "water", "metal-ring", "lamps"];

/// Between executors on different drivers: rounding decides on which side of an edge a path goes, and whether a split is worth it.
const PARITY: Bound = Bound { delta_e_mean: Some(0.1), rms_64: Some(3e-3), total_y: Some(1e-4) };

#[test]
fn footprints_agree_on_every_executor() {
    for name in SCENES {
        let settings = Settings { emission_size: 48, ..Settings::of(Method::Footprint) };
        assert_executors_agree(&subject(name), &settings, PARITY);
    }
}
