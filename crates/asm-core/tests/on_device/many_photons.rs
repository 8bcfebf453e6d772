//! As many photons as counters of 24 bits cannot hold. What counts and adds them up is the shader and the driver's atomics: the CPU's
//! mirror and one executor of each driver include this, which `asm-vulkan` is.

use asm_core::Settings;
use glam::DVec3;

use crate::device;
use crate::hard_cases::bake_on;
use crate::stage::*;

/// A photon per texel of a view of 4096 x 4096. Sums of 32 bits would be full many times over.
#[test]
fn sixteen_million_photons_are_all_accounted_for() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    let scene = plate_over_floor(glass(1.5), 1.0, sun(DVec3::NEG_Y));
    let settings = Settings { wavelengths: Some(1), map_size: Some(64), ..aligned(4096) };
    let (maps, statistics) = bake_on(&mut gpu, &scene, 8, &settings);
    let ledger = &statistics.lights[0].ledgers[0];
    // One row and one column are the rasteriser's to choose.
    let least = 4095_u32.pow(2);
    assert!((least..=1 << 24).contains(&ledger.emitted.photons), "{ledger:?}");
    assert_eq!(ledger.aimed.photons, 1 << 24);
    assert!((f64::from(maps.refracted[27][1]) - 0.96 * 0.96).abs() < 1e-3, "{:?}", maps.refracted[27]);
}
