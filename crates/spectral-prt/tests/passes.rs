//! Passes against their WGSL, through naga.

use frame_plan::layout;
use frame_plan::reflect::{check_layout, check_pass};
use spectral_prt::PASSES;
use spectral_prt::passes::prt_gloss::{PRT_GLOSS, PrtGloss, PrtGlossPoint};
use spectral_prt::passes::prt_light::{PRT_LIGHT, PrtLight};
use spectral_prt::passes::prt_shade::PRT_SHADE;
use spectral_prt::passes::prt_shade_maps::PRT_SHADE_MAPS;
use spectral_prt::passes::prt_vertex::{PRT_VERTEX, PrtVertex};
use spectral_prt::shared::prt_picture::{PrtAlbedo, PrtCorners, PrtPicture};

#[test]
fn every_pass_matches_its_wgsl() {
    for pass in PASSES.0 {
        check_pass(pass).unwrap();
    }
}

#[test]
fn every_struct_has_the_layout_of_its_wgsl() {
    let light = layout!(PrtLight as "PrtLight" { bands, blocks, reserved0, reserved1 });
    check_layout(&PRT_LIGHT, &light).unwrap();
    let vertex = layout!(PrtVertex as "PrtVertex" {
        vertices, groups_per_row, harmonics, blocks, vertex_blocks, reserved0, reserved1, reserved2,
    });
    check_layout(&PRT_VERTEX, &vertex).unwrap();
    for layout in [
        layout!(PrtGloss as "PrtGloss" {
            vertices, groups_per_row, rows, camera_view, bands, blocks, vertex_blocks, reserved,
        }),
        layout!(PrtGlossPoint as "PrtGlossPoint" { position, row, normal, lobe }),
    ] {
        check_layout(&PRT_GLOSS, &layout).unwrap();
    }
    for pass in [&PRT_SHADE, &PRT_SHADE_MAPS] {
        for layout in [
            layout!(PrtPicture as "PrtPicture" {
                shown_from_x, blocks, shown_from_y, samples, shown_from_z, camera_view, size, reserved,
            }),
            layout!(PrtCorners as "PrtCorners" { vertices, albedo, uv0, uv1, uv2, reserved }),
            layout!(PrtAlbedo as "PrtAlbedo" { map_size, first, spectral }),
        ] {
            check_layout(pass, &layout).unwrap();
        }
    }
}

/// Each pass is compiled for Vulkan under its own name.
#[cfg(feature = "spirv")]
#[test]
fn every_pass_has_its_modules() {
    let passes = spectral_prt::SPIRV_PASSES;
    for entry_point in PASSES.0.iter().flat_map(|pass| pass.entry_points()) {
        assert!(passes.module(&entry_point).is_some(), "{entry_point}");
    }
}
