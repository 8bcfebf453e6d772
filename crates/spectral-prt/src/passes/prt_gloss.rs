//! What glossy surfaces send to the camera: see [`crate::GlossTransfer`]. Twin of `shaders/prt_gloss.wgsl`.

use asm_core::shared::view::View;
use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{binding, wgsl};
use crate::shared::harmonics::{MOST_HARMONICS, harmonics};

/// Uniform of the pass; mirrors `PrtGloss` in `shaders/prt_gloss.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PrtGloss {
    /// How many there are.
    pub vertices: u32,
    /// Workgroups in x.
    pub groups_per_row: u32,
    /// Vertices that shine.
    pub rows: u32,
    /// Index of the camera's view.
    pub camera_view: u32,
    /// Bands of light, 1 to 5.
    pub bands: u32,
    /// Blocks of four spectral coefficients.
    pub blocks: u32,
    /// All blocks of a vertex.
    pub vertex_blocks: u32,
    /// Padding.
    pub reserved: u32,
}

/// A vertex that may shine; mirrors `PrtGlossPoint`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PrtGlossPoint {
    /// Working units.
    pub position: Vec3,
    /// In `matrices`, or [`MATT`].
    pub row: u32,
    /// Unit.
    pub normal: Vec3,
    /// Its first factor in `lobes`.
    pub lobe: u32,
}

/// The row of a vertex that does not shine.
pub const MATT: u32 = u32::MAX;

/// Vertices of a workgroup.
pub(crate) const PER_GROUP: u32 = 64;

/// All that an executor needs to build and run `prt_gloss`.
pub const PRT_GLOSS: PassInfo = PassInfo {
    name: "prt_gloss",
    wgsl: wgsl::PRT_GLOSS,
    params_struct: "PrtGloss",
    params_bytes: size_of::<PrtGloss>() as u32,
    bindings: &[
        binding("points", BindingKind::Read),
        binding("views", BindingKind::Read),
        binding("matrices", BindingKind::Read),
        binding("lobes", BindingKind::Read),
        binding("light", BindingKind::Read),
        binding("irradiance", BindingKind::Write),
    ],
    kind: PassKind::Compute {
        workgroup: [PER_GROUP, 1, 1],
        mirror: |args| {
            let inputs = Inputs {
                params: args.params(),
                points: args.read("points"),
                views: args.read("views"),
                matrices: args.read("matrices"),
                lobes: args.read("lobes"),
                light: args.read("light"),
            };
            prt_gloss(&inputs, args.groups()[2], args.write("irradiance"));
        },
    },
};

/// What the pass reads.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The uniform.
    pub params: PrtGloss,
    /// Of every vertex of the scene.
    pub points: &'a [PrtGlossPoint],
    /// The camera's among them.
    pub views: &'a [View],
    /// Function after function, entry after entry, vertex after vertex.
    pub matrices: &'a [f32],
    /// Of each lobe a factor per degree, times pi.
    pub lobes: &'a [f32],
    /// Block after block, harmonic after harmonic.
    pub light: &'a [Vec4],
}

/// CPU mirror: `functions` of the wavelength.
pub fn prt_gloss(inputs: &Inputs<'_>, functions: u32, irradiance: &mut [Vec4]) {
    let PrtGloss { vertices, bands, blocks, vertex_blocks, .. } = inputs.params;
    let (count, blocks) = ((bands * bands) as usize, blocks as usize);
    let first = vertex_blocks as usize - functions as usize * blocks;
    let of_vertices = irradiance.par_chunks_exact_mut(vertex_blocks as usize);
    of_vertices.take(vertices as usize).zip(inputs.points).for_each(|(of_vertex, at)| {
        for (function, out) in of_vertex[first..].chunks_exact_mut(blocks).enumerate() {
            let transfer = inputs.transfer(at, function);
            for (out, light) in out.iter_mut().zip(inputs.light.chunks_exact(count)) {
                *out = transfer.iter().zip(light).fold(Vec4::ZERO, |sum, (t, l)| sum + *t * *l);
            }
        }
    });
}

impl Inputs<'_> {
    /// Of one vertex towards the camera.
    fn transfer(&self, at: &PrtGlossPoint, function: usize) -> [f32; MOST_HARMONICS] {
        let PrtGloss { bands, rows, camera_view, .. } = self.params;
        let mut transfer = [0.0; MOST_HARMONICS];
        let view = &self.views[camera_view as usize];
        // Who looks from the vertex itself looks in no direction.
        if at.row == MATT || at.position == view.eye {
            return transfer;
        }
        let ray = view.ray_through(at.position);
        let (bands, rows) = (bands as usize, rows as usize);
        let mut lobe = harmonics(bands, ray.direction.reflect(at.normal));
        for l in 0..bands {
            let factor = self.lobes[at.lobe as usize + l];
            lobe[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|y| *y *= factor);
        }
        let count = bands * bands;
        let mut entries =
            self.matrices[function * count * count * rows + at.row as usize..].iter().step_by(rows);
        for out in &mut transfer[..count] {
            *out = lobe[..count].iter().zip(&mut entries).map(|(y, m)| m * y).sum();
        }
        transfer
    }
}
