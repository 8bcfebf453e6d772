//! Paths of light from the corners of cells of the emission view to where they land. Twin of `shaders/path_trace.wgsl`; how they go
//! on stands in [`crate::shared::light_path`].

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::UVec2;
use rayon::prelude::*;

use super::{
    BVH_WGSL, CROSSING_WGSL, EMISSION_WGSL, FLUX_WGSL, FOOTPRINT_WGSL, LEDGER_WGSL, LIGHT_PATH_WGSL,
    LIGHT_VIEWS_WGSL, OPTICS_WGSL, PHOTON_QUEUE_WGSL, REFRACT_WGSL, TRIANGLE_WGSL, VIEW_WGSL,
    VISIBILITY_TEXTURE_ARRAY, binding,
};
use crate::shared::bvh::Surfaces;
use crate::shared::flux::WHOLE;
use crate::shared::footprint::{CELL_WORDS, CELLS_HEAD, FootprintCell, PathEnds, PathLanding, node_bin};
use crate::shared::ledger::*;
use crate::shared::light_path::{Arrival, LightPaths, way_on};
use crate::shared::optics::Optics;
use crate::shared::photon_queue::QUEUE_COUNT;
use crate::shared::photons::landing_bounds_add;
use crate::shared::view::View;

/// Uniform of the pass; mirrors `PathTrace` in `shaders/path_trace.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PathTrace {
    /// View fitted to the refractors.
    pub emission_view: u32,
    /// First view of where light may land.
    pub landing_view: u32,
    /// Number of those views.
    pub landing_faces: u32,
    /// Wavelengths of a path's corner.
    pub nodes: u32,
    /// Landings of a path.
    pub orders: u32,
    /// Of the whole spectrum.
    pub bins: u32,
    /// Row length of `optics`.
    pub materials: u32,
    /// Row of this light.
    pub first_optics: u32,
    /// First word in `queues`; [`NO_QUEUE`]: corners are the texel centres of the emission view.
    pub queue: u32,
    /// Most workgroups of the device, per dimension.
    pub max_groups: u32,
    /// `PATH_*`.
    pub path: u32,
    /// `TRIANGLE_*` of the surfaces that paths begin at.
    pub casters: u32,
    /// `RULE_*`.
    pub rule: u32,
    /// Light beyond this distance is dark; 0 has no end.
    pub range: f32,
    /// 1: `bounds` gets where paths land.
    pub keeps_bounds: u32,
    /// Padding.
    pub reserved0: u32,
}

/// No cells are queued.
pub const NO_QUEUE: u32 = u32::MAX;

/// Paths that a workgroup takes.
pub const PATHS_PER_GROUP: u32 = 64;

/// All that an executor needs to build and run `path_trace`.
pub const PATH_TRACE: PassInfo = PassInfo {
    name: "path_trace",
    wgsl: &[
        VIEW_WGSL,
        TRIANGLE_WGSL,
        REFRACT_WGSL,
        OPTICS_WGSL,
        FLUX_WGSL,
        LIGHT_VIEWS_WGSL,
        LEDGER_WGSL,
        CROSSING_WGSL,
        BVH_WGSL,
        PHOTON_QUEUE_WGSL,
        FOOTPRINT_WGSL,
        EMISSION_WGSL,
        LIGHT_PATH_WGSL,
        include_str!("../../../../shaders/path_trace.wgsl"),
    ],
    params_struct: "PathTrace",
    params_bytes: size_of::<PathTrace>() as u32,
    bindings: &[
        binding("triangles", BindingKind::Read),
        binding("bvh", BindingKind::Read),
        binding("views", BindingKind::Read),
        binding("optics", BindingKind::Read),
        binding("landing_visibility", VISIBILITY_TEXTURE_ARRAY),
        binding("queues", BindingKind::ReadAtomic),
        binding("landings", BindingKind::Write),
        binding("ends", BindingKind::Write),
        binding("bounds", BindingKind::Atomic),
    ],
    kind: PassKind::Compute {
        workgroup: [PATHS_PER_GROUP, 1, 1],
        mirror: |args| {
            let inputs = Inputs {
                params: args.params(),
                surfaces: Surfaces { bvh: args.read("bvh"), triangles: args.read("triangles") },
                views: args.read("views"),
                optics: args.read("optics"),
                landing_visibility: args.texture("landing_visibility"),
            };
            let (landings, ends) = (args.write("landings"), args.write("ends"));
            path_trace(&inputs, args.atomics("queues"), landings, ends, args.atomics("bounds"));
        },
    },
};

/// What `path_trace` reads.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The uniform.
    pub params: PathTrace,
    /// All triangles and the tree over them.
    pub surfaces: Surfaces<'a>,
    /// All views.
    pub views: &'a [View],
    /// Bin x material that paths go through.
    pub optics: &'a [Optics],
    /// Where light may land.
    pub landing_visibility: TextureView<'a>,
}

const WAY_LANDS: u32 = 3;

/// CPU mirror: a path per node and texel of the emission view, or per node and corner of the queued cells.
pub fn path_trace(
    inputs: &Inputs<'_>,
    queues: &[AtomicU32],
    landings: &mut [PathLanding],
    ends: &mut [PathEnds],
    bounds: &[AtomicU32],
) {
    let params = &inputs.params;
    let light_paths = inputs.paths();
    let view = &inputs.views[params.emission_view as usize];
    let queue = (params.queue != NO_QUEUE).then(|| &queues[params.queue as usize..]);
    let load = |queue: &[AtomicU32], word: usize| queue[word].load(Ordering::Relaxed);
    let places = queue.map_or(view.size.x * view.size.y, |queue| 4 * load(queue, QUEUE_COUNT));
    let paths = (places * params.nodes) as usize;
    let per_group = PATHS_PER_GROUP as usize;
    let landings = landings.par_chunks_mut(per_group * params.orders as usize);
    let groups = landings.zip(ends.par_chunks_mut(per_group)).take(paths.div_ceil(per_group)).enumerate();
    groups.for_each(|(group, (landings, ends))| {
        let of_path = landings.chunks_exact_mut(params.orders as usize).zip(ends);
        for (local, (landings, ends)) in of_path.enumerate() {
            let path = (group * per_group + local) as u32;
            let (node, place) = (path % params.nodes, path / params.nodes);
            if place >= places {
                break;
            }
            let (cell, corner) = match queue {
                None => {
                    let at = UVec2::new(place % view.size.x, place / view.size.x);
                    (FootprintCell { at, level: UVec2::ZERO, first: 0, bins: params.bins }, 0)
                }
                Some(queue) => {
                    let word = CELLS_HEAD + CELL_WORDS * (place / 4) as usize;
                    let words = [0, 1].map(|i| load(queue, word + i));
                    (FootprintCell::from_words(words), place % 4)
                }
            };
            landings.fill(PathLanding { end: END_MISSED, ..PathLanding::default() });
            let ray = view.ray(cell.corner(corner));
            *ends = light_paths.trace(ray, node_bin(params.nodes, node, &cell), WHOLE, |arrival| {
                landings[arrival.order as usize] = inputs.landing(&light_paths, &arrival);
            });
            if params.keeps_bounds == 1 {
                for landing in landings.iter().filter(|landing| landing.end == END_LANDED) {
                    inputs.add_bounds(landing, bounds);
                }
            }
        }
    });
}

impl<'a> Inputs<'a> {
    fn paths(&self) -> LightPaths<'a> {
        let params = &self.params;
        LightPaths {
            surfaces: self.surfaces,
            views: self.views,
            optics: self.optics,
            landing_visibility: self.landing_visibility,
            landing_view: params.landing_view,
            landing_faces: params.landing_faces,
            materials: params.materials,
            first_optics: params.first_optics,
            orders: params.orders,
            path: params.path,
            casters: params.casters,
            rule: params.rule,
            range: params.range,
        }
    }

    /// The landing that footprints are made of.
    fn landing(&self, paths: &LightPaths<'_>, arrival: &Arrival) -> PathLanding {
        let Arrival { end, part, way, length, medium, .. } = *arrival;
        let landing = PathLanding { length, part, way, end, medium, ..PathLanding::default() };
        if end != END_LANDED {
            return landing;
        }
        let Some(at) = paths.locate(arrival) else { return PathLanding { end: END_OUTSIDE_MAP, ..landing } };
        let t = &self.surfaces.triangles[arrival.met.visible as usize - 1];
        let side = if arrival.met.hit.facing > 0.0 { 4 } else { 0 };
        PathLanding {
            texel: at.texel,
            way: way_on(way, 8 * t.object + WAY_LANDS + side),
            place: at.face | t.material << 8,
            ..landing
        }
    }

    fn add_bounds(&self, landing: &PathLanding, bounds: &[AtomicU32]) {
        let face = landing.place & 0xff;
        let size = self.views[(self.params.landing_view + face) as usize].size;
        landing_bounds_add(size, face, landing.texel, bounds);
    }
}
