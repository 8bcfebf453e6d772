//! The map's 64-bit fixed point as floats. Twin of `shaders/map_resolve.wgsl`.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{UVec2, Vec4};
use rayon::prelude::*;

use super::{VIEW_WGSL, binding};
use crate::shared::view::View;

/// Uniform of the pass; mirrors `MapResolve` in `shaders/map_resolve.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MapResolve {
    /// The map's first view.
    pub view: u32,
    /// Number of views.
    pub faces: u32,
    /// Light per unit of flux in a texel as large as `scale_view`'s: XYZ lux for parallel rays, candela for an eye's.
    pub scale: f32,
    /// Shah's artistic exponent; 1 keeps energy.
    pub power: f32,
    /// First texel of this path, in `caustic`.
    pub first_texel: u32,
    /// First of as many views.
    pub scale_view: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
}

/// All that an executor needs to build and run `map_resolve`.
pub const MAP_RESOLVE: PassInfo = PassInfo {
    name: "map_resolve",
    wgsl: &[VIEW_WGSL, include_str!("../../../../shaders/map_resolve.wgsl")],
    params_struct: "MapResolve",
    params_bytes: size_of::<MapResolve>() as u32,
    bindings: &[
        binding("views", BindingKind::Read),
        binding("map", BindingKind::ReadAtomic),
        binding("caustic", BindingKind::Write),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            map_resolve(&args.params(), args.read("views"), args.atomics("map"), args.write("caustic"));
        },
    },
};

/// CPU mirror.
pub fn map_resolve(params: &MapResolve, views: &[View], map: &[AtomicU32], caustic: &mut [Vec4]) {
    let size = views[params.view as usize].size;
    let rows = (size.y * params.faces) as usize;
    let caustic = &mut caustic[params.first_texel as usize..];
    caustic.par_chunks_mut(size.x as usize).take(rows).enumerate().for_each(|(row, texels)| {
        let face = row as u32 / size.y;
        let view = &views[(params.view + face) as usize];
        let larger = views[(params.scale_view + face) as usize].texel_slope / view.texel_slope;
        for (x, texel) in texels.iter_mut().enumerate() {
            let index = row * size.x as usize + x;
            let measure = view.texel_measure(UVec2::new(x as u32, row as u32 % size.y));
            let scale = params.scale * (larger.x * larger.y) / measure;
            let mut xyz = [0.0; 3];
            for (c, channel) in xyz.iter_mut().enumerate() {
                let word = 2 * (3 * index + c);
                let [low, high] = [word, word + 1].map(|w| map[w].load(Ordering::Relaxed) as f32);
                *channel = (high * 4_294_967_296.0 + low) * scale;
                if params.power != 1.0 {
                    *channel = channel.powf(params.power);
                }
            }
            *texel = Vec4::new(xyz[0], xyz[1], xyz[2], 0.0);
        }
    });
}
