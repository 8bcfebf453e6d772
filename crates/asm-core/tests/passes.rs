//! Passes against their WGSL, through naga.

use asm_core::PASSES;
use asm_core::display::{DISPLAY_WGSL, DisplayParams};
use asm_core::passes::coverage_mip::{COVERAGE_MIP, CoverageMip};
use asm_core::passes::deferred_refraction::{DEFERRED_REFRACTION, DeferredRefraction, ViewBand};
use asm_core::passes::footprint_queue::{FOOTPRINT_QUEUE, FootprintQueue};
use asm_core::passes::footprint_splat::{FOOTPRINT_SPLAT, FootprintSplat};
use asm_core::passes::footprint_split::{FOOTPRINT_SPLIT, FootprintSplit};
use asm_core::passes::gap_fill::{GAP_FILL, GapFill};
use asm_core::passes::gap_mask::{GAP_MASK, GapMask};
use asm_core::passes::gap_reach::{GAP_REACH, GapReach};
use asm_core::passes::map_fit::{MAP_FIT, MapFit};
use asm_core::passes::map_resolve::{MAP_RESOLVE, MapResolve};
use asm_core::passes::path_trace::{PATH_TRACE, PathTrace};
use asm_core::passes::photon_path::{PHOTON_PATH, PhotonPath};
use asm_core::passes::photon_refine::{PHOTON_REFINE, PhotonRefine};
use asm_core::passes::photon_trace::{PHOTON_TRACE, PhotonTrace};
use asm_core::passes::receiver_bake::{RECEIVER_BAKE, ReceiverBake};
use asm_core::passes::shade::{SHADE, Shade, Surface};
use asm_core::passes::uv_visibility::{UV_VISIBILITY, UvVisibility};
use asm_core::passes::visibility::{VISIBILITY, Visibility};
use asm_core::shared::bvh::BvhNode;
use asm_core::shared::footprint::{PathEnds, PathLanding};
use asm_core::shared::footprint_cells::FootprintCells;
use asm_core::shared::footprint_light::{FootprintLight, RunningBand};
use asm_core::shared::irradiance::Light;
use asm_core::shared::optics::Optics;
use asm_core::shared::photons::{Band, Photons};
use asm_core::shared::triangle::Triangle;
use asm_core::shared::view::View;
use frame_plan::reflect::{HostLayout, check_layout, check_pass};
use frame_plan::{Binding, BindingKind, PassInfo, layout};

#[test]
fn every_pass_matches_its_wgsl() {
    for pass in PASSES.0 {
        check_pass(pass).unwrap();
    }
}

fn view() -> HostLayout {
    layout!(View as "View" {
        eye, perspective, right, near, up, far, forward, reserved, slope_center, slope_half, size, texel_slope,
    })
}

fn triangle() -> HostLayout {
    layout!(Triangle as "Triangle" { p0, material, p1, object, p2, flags, n0, face, n1, reserved1, n2, reserved2 })
}

fn path_landing() -> HostLayout {
    layout!(PathLanding as "PathLanding" { texel, length, part, way, end, place, medium })
}

fn photons() -> HostLayout {
    layout!(Photons as "Photons" {
        emission_view, landing_view, landing_faces, map_view, first_band, materials, first_ledger, emission,
        sample_stride, max_groups, path, casters, rule, landing_iterations, landing_update, splat_taps,
        landing_center, range, spot_axis, spot_scale, spot_offset, splat_sigma, splat_share, guard_texels,
        splat_spacing, reserved0, reserved1,
    })
}

fn light() -> HostLayout {
    layout!(Light as "Light" {
        xyz, metres_per_unit, spot_axis, spot_scale, spot_offset, range, landing_from, direct_view, direct_faces,
        landing_view, landing_faces, emission_view, emits, reflected_faces, first_reflected, map_view, receiver_map,
        reserved0, reserved1, reserved2,
    })
}

#[test]
fn every_struct_has_the_layout_of_its_wgsl() {
    let checks = [
        (&VISIBILITY, layout!(Visibility as "Visibility" { view, first_triangle, faces, from_distance })),
        (&VISIBILITY, view()),
        (&VISIBILITY, triangle()),
        (
            &UV_VISIBILITY,
            layout!(UvVisibility as "UvVisibility" { first_triangle, reserved0, reserved1, reserved2 }),
        ),
        (
            &PHOTON_TRACE,
            layout!(PhotonTrace as "PhotonTrace" {
                photons, interfaces, exit_iterations, exit_reach, reserved0,
            }),
        ),
        (&PHOTON_TRACE, photons()),
        (
            &PHOTON_PATH,
            layout!(PhotonPath as "PhotonPath" { photons, orders, reserved0, reserved1, reserved2 }),
        ),
        (
            &PATH_TRACE,
            layout!(PathTrace as "PathTrace" {
                emission_view, landing_view, landing_faces, nodes, orders, bins, materials, first_optics, queue,
                first_place, parent_row, max_groups, path, casters, rule, range, keeps_bounds, asides,
                lattice, tolerance,
            }),
        ),
        (&PHOTON_PATH, photons()),
        (&PATH_TRACE, layout!(BvhNode as "BvhNode" { low, first, high, count })),
        (&PATH_TRACE, path_landing()),
        (&PATH_TRACE, layout!(PathEnds as "PathEnds" { end, reflected, absorbed, kept_inside })),
        (
            &FOOTPRINT_SPLIT,
            layout!(FootprintSplit as "FootprintSplit" {
                cells, most_level, most_edge_level, silhouette_view, first_caster, end_caster, reserved0, reserved1,
                reserved2,
            }),
        ),
        (&FOOTPRINT_SPLIT, path_landing()),
        (&FOOTPRINT_QUEUE, layout!(FootprintQueue as "FootprintQueue" { cells })),
        (
            &FOOTPRINT_QUEUE,
            layout!(FootprintCells as "FootprintCells" {
                emission_view, landing_view, map_view, nodes, orders, materials, first_optics, bins, queue,
                first_place, splits, next, capacity, max_groups, tile, tile_stride,
            }),
        ),
        (
            &FOOTPRINT_SPLAT,
            layout!(FootprintLight as "FootprintLight" {
                spot_axis, spot_scale, spot_offset, first_band, first_ledger, reserved0,
            }),
        ),
        (&FOOTPRINT_SPLAT, layout!(FootprintSplat as "FootprintSplat" { cells, light })),
        (&FOOTPRINT_SPLAT, layout!(RunningBand as "RunningBand" { weight, reserved0, moment, reserved1 })),
        (&FOOTPRINT_SPLAT, path_landing()),
        (&COVERAGE_MIP, layout!(CoverageMip as "CoverageMip" { level, casters, size })),
        (
            &GAP_MASK,
            layout!(GapMask as "GapMask" { size, rows, rule, threshold, offsets, landing_view, map_view }),
        ),
        (&GAP_REACH, layout!(GapReach as "GapReach" { size, rows, offsets })),
        (
            &GAP_FILL,
            layout!(GapFill as "GapFill" {
                size, rows, rule, samples, threshold, offsets, share, first_row, reserved0, reserved1, reserved2,
            }),
        ),
        (
            &PHOTON_REFINE,
            layout!(PhotonRefine as "PhotonRefine" {
                cells, whole_level, finest, next_depth, next_per_group, max_groups, reserved0,
            }),
        ),
        (&PHOTON_TRACE, layout!(Band as "Band" { weight, reserved })),
        (&PHOTON_TRACE, layout!(Optics as "Optics" { index, absorption, surface, reserved })),
        (
            &MAP_RESOLVE,
            layout!(MapResolve as "MapResolve" {
                view, faces, scale, power, first_texel, scale_view, reserved0, reserved1,
            }),
        ),
        (
            &MAP_FIT,
            layout!(MapFit as "MapFit" { landing_view, map_view, faces, cells, least, margin, spread }),
        ),
        (&RECEIVER_BAKE, layout!(ReceiverBake as "ReceiverBake" { light, size, samples, first_triangle })),
        (&RECEIVER_BAKE, light()),
        (
            &SHADE,
            layout!(Shade as "Shade" {
                light, size, samples, camera_view, linear_srgb_from_x, first_surface, linear_srgb_from_y, reserved0,
                linear_srgb_from_z, reserved1, xyz_from_r, reserved2, xyz_from_g, reserved3, xyz_from_b, reserved4,
            }),
        ),
        (
            &DEFERRED_REFRACTION,
            layout!(DeferredRefraction as "DeferredRefraction" {
                size, samples, camera_view, wavelengths, materials, exit_iterations, background_iterations, exit_reach,
                bounces, rule, mirrors, mirror_reach, eye_object, eye_material, reserved0,
            }),
        ),
        (
            &DEFERRED_REFRACTION,
            layout!(ViewBand as "ViewBand" { from_x, reserved0, from_y, reserved1, from_z, reserved2 }),
        ),
        (&DEFERRED_REFRACTION, layout!(Optics as "Optics" { index, absorption, surface, reserved })),
        (&SHADE, layout!(Surface as "Surface" { reflected, index, tint, reserved0, absorption, reserved1 })),
    ];
    for (pass, layout) in checks {
        check_layout(pass, &layout).unwrap();
    }
}

#[test]
fn the_display_has_the_layout_of_its_wgsl() {
    let display = PassInfo {
        name: "display",
        wgsl: &[DISPLAY_WGSL],
        params_struct: "DisplayParams",
        params_bytes: size_of::<DisplayParams>() as u32,
        bindings: &[Binding { name: "picture", kind: BindingKind::Read }],
        ..UV_VISIBILITY
    };
    let layout = layout!(DisplayParams as "DisplayParams" {
        picture_size, target_size, exposure, reinhard_white, encode, sigmoid_contrast, linear_srgb_from_x, linear_srgb_from_y,
        linear_srgb_from_z, white_xyz,
    });
    check_layout(&display, &layout).unwrap();
}
