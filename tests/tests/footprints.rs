//! Footprints on every executor.

use asm_core::{Method, Settings};
use workspace_tests::agreement::assert_executors_agree;
use workspace_tests::{executors, subject};
use xtask::checks::Bound;

/// Flat faces and a slit, in tiles; smooth normals; internal reflections; an open surface; mirrors; two lamps with eyes.
const SCENES: [(&str, u32); 6] =
    [("prism", 34), ("sphere", 25), ("gem", 25), ("water", 25), ("metal-ring", 25), ("lamps", 24)];

/// Texels across and down the map: half as many again as the bake has. Footprints are laid texel by texel.
const MAP_SIZE: u32 = 96;

/// Between executors on different drivers: rounding decides on which side of an edge a path goes, and whether a split is worth it.
const PARITY: Bound = Bound { delta_e_mean: Some(0.1), rms_64: Some(3e-3), total_y: Some(1e-4) };

#[test]
fn footprints_agree_on_every_executor() {
    let mut executors = executors();
    for (name, emission_size) in SCENES {
        let settings =
            Settings { emission_size, map_size: Some(MAP_SIZE), ..Settings::of(Method::Footprint) };
        assert_executors_agree(&mut executors, &subject(name), &settings, PARITY);
    }
}
