//! How many texels of the emission view matter under each cell of a mip level. Twin of `shaders/coverage_mip.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::{StorageTextureMut, TextureView};
use frame_plan::{BindingKind, PassInfo, PassKind, TextureFormat};
use glam::UVec2;
use rayon::prelude::*;

use super::{TRIANGLE_WGSL, VIEW_WGSL, VISIBILITY_TEXTURE, binding};
use crate::shared::photon_queue::TILE_TEXELS;
use crate::shared::triangle::{NOTHING, Triangle};

/// Uniform of the pass; mirrors `CoverageMip` in `shaders/coverage_mip.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct CoverageMip {
    /// 0 counts texels of tiles, others add up cells of the level below.
    pub level: u32,
    /// `TRIANGLE_*` of what photons are for.
    pub casters: u32,
    /// Cells of this level.
    pub size: UVec2,
}

/// All that an executor needs to build and run `coverage_mip`.
pub const COVERAGE_MIP: PassInfo = PassInfo {
    name: "coverage_mip",
    wgsl: &[VIEW_WGSL, TRIANGLE_WGSL, include_str!("../../../../shaders/coverage_mip.wgsl")],
    params_struct: "CoverageMip",
    params_bytes: size_of::<CoverageMip>() as u32,
    bindings: &[
        binding("triangles", BindingKind::Read),
        binding("source", VISIBILITY_TEXTURE),
        binding("exit_visibility", VISIBILITY_TEXTURE),
        binding("coverage", BindingKind::StorageTexture { format: TextureFormat::R32Uint }),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            coverage_mip(
                &args.params(),
                args.read("triangles"),
                &args.texture("source"),
                &args.texture("exit_visibility"),
                args.storage_texture("coverage"),
            );
        },
    },
};

/// CPU mirror.
pub fn coverage_mip(
    params: &CoverageMip,
    triangles: &[Triangle],
    source: &TextureView<'_>,
    exit_visibility: &TextureView<'_>,
    coverage: StorageTextureMut<'_>,
) {
    // Photons from elsewhere are counted as missed, without any other trace of them.
    let covered = |x: u32, y: u32| {
        let visible = source.load_uint(x, y);
        visible != NOTHING
            && (triangles[visible as usize - 1].flags & params.casters != 0
                || exit_visibility.load_uint(x, y) != NOTHING)
    };
    coverage.par_rows().take(params.size.y as usize).enumerate().for_each(|(y, mut row)| {
        for x in 0..params.size.x {
            let y = y as u32;
            let sum = if params.level == 0 {
                let [x, y] = [TILE_TEXELS * x, TILE_TEXELS * y];
                let rows = (y..y + TILE_TEXELS).flat_map(|y| (x..x + TILE_TEXELS).map(move |x| (x, y)));
                rows.filter(|&(x, y)| covered(x, y)).count() as u32
            } else {
                (0..4).map(|i| source.load_uint(2 * x + (i & 1), 2 * y + (i >> 1))).sum()
            };
            row.store_uint(x, sum);
        }
    });
}
