//! The map's views, fitted to where light lands. Twin of `shaders/map_fit.wgsl`.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{BVec2, UVec2, Vec2};

use super::{VIEW_WGSL, binding};
use crate::shared::photons::BOUNDS_WORDS;
use crate::shared::view::View;

/// Uniform of the pass; mirrors `MapFit` in `shaders/map_fit.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MapFit {
    /// First of the views that light was sought in.
    pub landing_view: u32,
    /// First of the map's.
    pub map_view: u32,
    /// Number of each.
    pub faces: u32,
    /// Cells along a side of a landing view.
    pub cells: u32,
    /// Cells that the map shows at least.
    pub least: UVec2,
    /// Cells beyond the outermost that hold a landing.
    pub margin: u32,
    /// The map's side over what its guard leaves of it.
    pub spread: f32,
}

/// All that an executor needs to build and run `map_fit`.
pub const MAP_FIT: PassInfo = PassInfo {
    name: "map_fit",
    wgsl: &[VIEW_WGSL, include_str!("../../../../shaders/map_fit.wgsl")],
    params_struct: "MapFit",
    params_bytes: size_of::<MapFit>() as u32,
    bindings: &[binding("bounds", BindingKind::ReadAtomic), binding("views", BindingKind::Write)],
    kind: PassKind::Compute {
        workgroup: [8, 1, 1],
        mirror: |args| map_fit(&args.params(), args.atomics("bounds"), args.write("views")),
    },
};

/// First cell and the one after the last along a side of `size` texels, where nothing lies nearer than `from_end` to its end
/// and `from_start` to its start.
fn fitted_cells(params: &MapFit, from_end: u32, from_start: u32, size: u32, least: u32) -> [u32; 2] {
    let cells = params.cells;
    let mut first = (size - from_end) * cells / size;
    let mut last = (from_start * cells).div_ceil(size);
    first -= first.min(params.margin);
    last = (last + params.margin).min(cells);
    if last - first < least {
        first -= first.min((least - (last - first)) / 2);
        last = (first + least).min(cells);
        first = last - least;
    }
    [first, last]
}

/// CPU mirror.
pub fn map_fit(params: &MapFit, bounds: &[AtomicU32], views: &mut [View]) {
    for face in 0..params.faces {
        let mut view = views[(params.landing_view + face) as usize];
        let from: Vec<u32> = bounds[BOUNDS_WORDS * face as usize..][..BOUNDS_WORDS]
            .iter()
            .map(|word| word.load(Ordering::Relaxed))
            .collect();
        if from[0] != 0 {
            let x = fitted_cells(params, from[0], from[1], view.size.x, params.least.x);
            let y = fitted_cells(params, from[2], from[3], view.size.y, params.least.y);
            let cells = params.cells as f32;
            // Texels count rows downwards, slopes go up.
            let middle =
                Vec2::new((x[0] + x[1]) as f32, -((y[0] + y[1]) as f32)) / cells + Vec2::new(-1.0, 1.0);
            let share = Vec2::new((x[1] - x[0]) as f32, (y[1] - y[0]) as f32) / cells * params.spread;
            // What is not finer stays as it is.
            let finer: BVec2 = share.cmplt(Vec2::ONE);
            view.slope_center =
                Vec2::select(finer, view.slope_center + middle * view.slope_half, view.slope_center);
            view.texel_slope = Vec2::select(finer, view.texel_slope * share, view.texel_slope);
            view.slope_half = Vec2::select(finer, view.slope_half * share, view.slope_half);
        }
        views[(params.map_view + face) as usize] = view;
    }
}
