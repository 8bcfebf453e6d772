//! Passes against their WGSL, through naga.

use caustic_heightfield::PASSES;
use caustic_heightfield::passes::PondGrid;
use caustic_heightfield::passes::pond_coefficients::{POND_COEFFICIENTS, PondCoefficients};
use caustic_heightfield::passes::pond_convolve::{POND_CONVOLVE, PondConvolve};
use caustic_heightfield::passes::pond_crop::{POND_CROP, PondCrop};
use caustic_heightfield::passes::pond_fft::{POND_FFT, PondFft};
use caustic_heightfield::passes::pond_heights::{POND_HEIGHTS, PondHeights, RingSource};
use caustic_heightfield::passes::pond_picture::{POND_PICTURE, PondPicture};
use caustic_heightfield::passes::pond_product::{POND_PRODUCT, PondProduct};
use caustic_heightfield::passes::pond_relief::{POND_RELIEF, PondRelief};
use caustic_heightfield::passes::pond_spectrum::{POND_SPECTRUM, PondSpectrum};
use caustic_heightfield::passes::pond_surface::{POND_SURFACE, PondSurface};
use frame_plan::layout;
use frame_plan::reflect::{check_layout, check_pass};

#[test]
fn every_pass_matches_its_wgsl() {
    for pass in PASSES.0 {
        check_pass(pass).unwrap();
    }
}

#[test]
fn every_struct_has_the_layout_of_its_wgsl() {
    let checks = [
        (&POND_HEIGHTS, layout!(PondGrid as "PondGrid" { size, pitch_m })),
        (
            &POND_HEIGHTS,
            layout!(PondHeights as "PondHeights" {
                grid, first, count, beta_per_m, turns_per_m, level_m, table, reserved0, reserved1,
            }),
        ),
        (
            &POND_HEIGHTS,
            layout!(RingSource as "RingSource" {
                position_m, sample, front_m, amplitude_m, phase_turns, reserved,
            }),
        ),
        (&POND_RELIEF, layout!(PondRelief as "PondRelief" { grid })),
        (
            &POND_SURFACE,
            layout!(PondSurface as "PondSurface" {
                grid, light, eta, step, rise_m, depth_m, tangent, most_steps, one_sided, periodic,
                facets_are_larger, table_entries, mapped, units_per_flux, floor_m, reserved0, reserved1, reserved2,
            }),
        ),
        (
            &POND_PRODUCT,
            layout!(PondProduct as "PondProduct" { samples, groups_per_row, exponent, reserved }),
        ),
        (
            &POND_COEFFICIENTS,
            layout!(PondCoefficients as "PondCoefficients" {
                low, depth_m, high, flat_tolerance, table_size, terms, samples, groups_per_row, reserved0,
                reserved1,
            }),
        ),
        (
            &POND_CONVOLVE,
            layout!(PondConvolve as "PondConvolve" {
                grid, low, window, first, count, terms, periodic, reserved0, reserved1,
            }),
        ),
        (
            &POND_FFT,
            layout!(PondFft as "PondFft" {
                axis, radix, length, span, lines, there, behind, periodic, pitch_in, plane_in, pitch_out,
                plane_out, complex_in, first_in, inverse, twiddles,
            }),
        ),
        (&POND_SPECTRUM, layout!(PondSpectrum as "PondSpectrum" { size, pairs, add })),
        (&POND_CROP, layout!(PondCrop as "PondCrop" { grid, pitch, reserved0, reserved1, reserved2 })),
        (&POND_PICTURE, layout!(PondPicture as "PondPicture" { grid, white_xyz, reserved })),
    ];
    for (pass, layout) in checks {
        check_layout(pass, &layout).unwrap();
    }
}

/// Each pass is compiled for Vulkan under its own name.
#[cfg(feature = "spirv")]
#[test]
fn every_pass_has_a_module() {
    let passes = caustic_heightfield::SPIRV_PASSES;
    assert_eq!(passes.modules.len(), PASSES.0.len());
    for pass in PASSES.0 {
        assert!(passes.module(pass.name).is_some(), "{}", pass.name);
    }
}
