//! Footprints on every executor.

use asm_core::{Method, Settings};
use workspace_tests::agreement::assert_executors_agree;
use workspace_tests::{executors, subject};
use xtask::checks::Bound;

/// Flat faces and a slit, in tiles; smooth normals; internal reflections; an open surface; mirrors; two lamps with eyes.
const SCENES: [(&str, u32); 6] =
    [("prism", 48), ("sphere", 33), ("gem", 33), ("water", 33), ("metal-ring", 33), ("lamps", 24)];

/// Between executors on different drivers: rounding decides on which side of an edge a path goes, and whether a split is worth it.
const PARITY: Bound = Bound { delta_e_mean: Some(0.1), rms_64: Some(3e-3), total_y: Some(1e-4) };

#[test]
fn footprints_agree_on_every_executor() {
    let mut executors = executors();
    for (name, emission_size) in SCENES {
        let settings = Settings { emission_size, ..Settings::of(Method::Footprint) };
        assert_executors_agree(&mut executors, &subject(name), &settings, PARITY);
    }
}
