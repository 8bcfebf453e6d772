//! What passes the surface: normals, Gamma N, L_s cos T, direction and power (passes 1 to 4 of the paper). Twin of
//! `shaders/pond_surface.wgsl`.

use std::sync::atomic::AtomicU32;

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use rayon::prelude::*;

use super::pond_relief::relief_of;
use super::report::{
    GROUNDED, INCIDENT, PAST_45_DEGREES, SELF_SHADOWED, TOTALLY_REFLECTED, TRANSMITTED, TURNED_AWAY, Tally,
};
use super::{PondGrid, binding, outside, wgsl};
use crate::normals::slopes_at;
use crate::pond::Normals;
use crate::refraction_table::RefractionTable;
use crate::shadow::March;
use crate::surface_light::{Fate, Sun};

/// Uniform of the pass; mirrors `PondSurface` in `shaders/pond_surface.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PondSurface {
    /// The samples.
    pub grid: PondGrid,
    /// L_i, unit; its z is negative.
    pub light: [f32; 3],
    /// n_t / n_i.
    pub eta: f32,
    /// Samples in x and y per step of a ray towards the light.
    pub step: [f32; 2],
    /// How much that ray rises per step, metres.
    pub rise_m: f32,
    /// How deep a shadow must be, metres.
    pub depth_m: f32,
    /// Rise over run of that ray.
    pub tangent: f32,
    /// Steps that are followed; 0 where the surface is taken not to shade itself.
    pub most_steps: u32,
    /// 1: normals are the paper's; 0: central differences.
    pub one_sided: u32,
    /// 1: the pond goes on outside of its grid.
    pub periodic: u32,
    /// 1: facets have 1 / N_z times the area of a sample.
    pub facets_are_larger: u32,
    /// Entries of the table of Gamma and T; 0 where they are evaluated.
    pub table_entries: u32,
    /// 1: the illumination has a value per sample; 0: one for all.
    pub mapped: u32,
    /// Units of the report per flux.
    pub units_per_flux: f32,
    /// How far the floor is below the water at rest, metres.
    pub floor_m: f32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
    /// Padding.
    pub reserved2: u32,
}

/// All that an executor needs to build and run `pond_surface`.
pub const POND_SURFACE: PassInfo = PassInfo {
    name: "pond_surface",
    wgsl: wgsl::POND_SURFACE,
    params_struct: "PondSurface",
    params_bytes: size_of::<PondSurface>() as u32,
    bindings: &[
        binding("heights", BindingKind::Read),
        binding("illumination", BindingKind::Read),
        binding("refraction_table", BindingKind::Read),
        binding("relief", BindingKind::ReadAtomic),
        binding("beams", BindingKind::Write),
        binding("report", BindingKind::Atomic),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            let surface = SurfaceInputs {
                heights: args.read("heights"),
                illumination: args.read("illumination"),
                refraction_table: args.read("refraction_table"),
                relief: args.atomics("relief"),
            };
            pond_surface(&args.params(), &surface, args.write("beams"), args.atomics("report"));
        },
    },
};

/// What the pass reads.
pub struct SurfaceInputs<'a> {
    /// Metres.
    pub heights: &'a [f32],
    /// L_s, one value or one per sample.
    pub illumination: &'a [f32],
    /// (Gamma, T) by cos(theta_i).
    pub refraction_table: &'a [[f32; 2]],
    /// What `pond_relief` found.
    pub relief: &'a [AtomicU32],
}

/// CPU mirror: L_t, and in the fourth component the flux that has passed.
pub fn pond_surface(
    params: &PondSurface,
    inputs: &SurfaceInputs<'_>,
    beams: &mut [[f32; 4]],
    report: &[AtomicU32],
) {
    let PondGrid { pitch_m, .. } = params.grid;
    let surface = params.grid.heights(inputs.heights, outside(params.periodic));
    let entries = &inputs.refraction_table[..params.table_entries as usize];
    let sun = Sun {
        direction: params.light,
        eta: params.eta,
        cell_m2: pitch_m[0] * pitch_m[1],
        facets_are_larger: params.facets_are_larger == 1,
        table: (!entries.is_empty()).then_some(RefractionTable { entries }),
    };
    let march =
        March { step: params.step, rise_m: params.rise_m, depth_m: params.depth_m, tangent: params.tangent };
    let relief = relief_of(inputs.relief);
    let may_shade = params.most_steps > 0 && march.may_shade(&relief);
    let rule = if params.one_sided == 1 { Normals::OneSided } else { Normals::Central };
    let width = surface.size[0];
    beams[..params.grid.samples()].par_chunks_mut(width).enumerate().for_each(|(j, row)| {
        let mut tally = Tally::default();
        for (i, of_sample) in row.iter_mut().enumerate() {
            if params.floor_m + surface.at(i, j) <= 0.0 {
                tally.add(GROUNDED);
            }
            let slopes = slopes_at(&surface, rule, i, j);
            let steepness = (slopes[0] * slopes[0] + slopes[1] * slopes[1]).sqrt();
            tally.steepness(steepness);
            if steepness > 1.0 {
                tally.add(PAST_45_DEGREES);
            }
            let illumination = inputs.illumination[if params.mapped == 1 { j * width + i } else { 0 }];
            let shadowed =
                || may_shade && march.meets(&surface, relief.highest_m, params.most_steps as usize, [i, j]);
            let beam = sun.beam(slopes, illumination, shadowed);
            match beam.fate {
                Fate::Passed => {}
                Fate::TurnedAway => tally.add(TURNED_AWAY),
                Fate::SelfShadowed => tally.add(SELF_SHADOWED),
                Fate::TotallyReflected => tally.add(TOTALLY_REFLECTED),
            }
            tally.add_flux(INCIDENT, beam.incident, params.units_per_flux);
            tally.add_flux(TRANSMITTED, beam.flux, params.units_per_flux);
            let [x, y, z] = beam.direction;
            *of_sample = [x, y, z, beam.flux];
        }
        tally.flush(report);
    });
}
