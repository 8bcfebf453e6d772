//! Paths of light from the corners of cells of the emission view to where they land. Twin of `shaders/path_trace.wgsl`; how they go
//! on stands in [`crate::shared::light_path`].

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::{
    BVH_WGSL, CROSSING_WGSL, EMISSION_WGSL, FLUX_WGSL, FOOTPRINT_WGSL, LEDGER_WGSL, LIGHT_PATH_WGSL,
    LIGHT_VIEWS_WGSL, OPTICS_WGSL, PHOTON_QUEUE_WGSL, REFRACT_WGSL, TRIANGLE_WGSL, VIEW_WGSL,
    VISIBILITY_TEXTURE_ARRAY, binding,
};
use crate::shared::bvh::Surfaces;
use crate::shared::flux::WHOLE;
use crate::shared::footprint::{
    FootprintCell, PATCH_NEW, PATCH_PLACES, PATCH_ROW, PathEnds, PathLanding, node_bin,
};
use crate::shared::footprint_cells::{CELLS_PER_GROUP, NO_QUEUE, queued_patch};
use crate::shared::ledger::*;
use crate::shared::light_path::{Arrival, LightPaths, way_on};
use crate::shared::optics::Optics;
use crate::shared::photon_queue::QUEUE_COUNT;
use crate::shared::photons::landing_bounds_add;
use crate::shared::view::{Ray, View};

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
    /// First place of the queued patches' corners.
    pub first_place: u32,
    /// Places from one row of their parents' corners to the next.
    pub parent_row: u32,
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
    /// Of its landings, those of what was thrown back behind the first glass.
    pub asides: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
}

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
        workgroup: [CELLS_PER_GROUP, 1, 1],
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
const WAY_BEYOND: u32 = 4;

/// CPU mirror: the paths of every texel of the emission view, or of the corners of the queued patches.
pub fn path_trace(
    inputs: &Inputs<'_>,
    queues: &[AtomicU32],
    landings: &mut [PathLanding],
    ends: &mut [PathEnds],
    bounds: &[AtomicU32],
) {
    let params = &inputs.params;
    let (nodes, orders) = (params.nodes as usize, params.orders as usize);
    if params.queue == NO_QUEUE {
        let size = inputs.views[params.emission_view as usize].size;
        let corners = landings.par_chunks_exact_mut(nodes * orders).zip(ends.par_chunks_exact_mut(nodes));
        let corners = corners.take((size.x * size.y) as usize).enumerate();
        return corners.with_min_len(CELLS_PER_GROUP as usize).for_each(|(place, (landings, ends))| {
            let at = UVec2::new(place as u32 % size.x, place as u32 / size.x);
            let cell = FootprintCell { at, level: UVec2::ZERO, first: 0, bins: params.bins };
            inputs.trace_corner(&cell, landings, ends, bounds);
        });
    }
    // Parents lie before or behind the patches' own places.
    let first = params.first_place as usize * nodes;
    let patches = queues[params.queue as usize + QUEUE_COUNT].load(Ordering::Relaxed) as usize;
    let paths = PATCH_PLACES as usize * nodes;
    let end = first + patches * paths;
    let (landings_before, rest) = landings.split_at_mut(first * orders);
    let (landings, landings_behind) = rest.split_at_mut((end - first) * orders);
    let (ends_before, rest) = ends.split_at_mut(first);
    let (ends, ends_behind) = rest.split_at_mut(end - first);
    let patches =
        landings.par_chunks_exact_mut(paths * orders).zip(ends.par_chunks_exact_mut(paths)).enumerate();
    patches.with_min_len(8).for_each(|(slot, (landings, ends))| {
        let patch = queued_patch(queues, params.queue, slot as u32);
        let paths_of = |at: UVec2| {
            let first = (at.x + PATCH_ROW * at.y) as usize * nodes;
            first..first + nodes
        };
        let landings_of = |paths: &Range<usize>| paths.start * orders..paths.end * orders;
        for at in (0..PATCH_NEW).filter_map(|i| patch.new_corner(i)) {
            let cell = FootprintCell { at: patch.cell(0).at + at, ..patch.cell(0) };
            let own = paths_of(at);
            inputs.trace_corner(&cell, &mut landings[landings_of(&own)], &mut ends[own], bounds);
        }
        if patch.has_parent() {
            for corner in [UVec2::ZERO, UVec2::X, UVec2::Y, UVec2::ONE] {
                let own = paths_of(corner * patch.parts);
                let place = patch.parent + corner.x + params.parent_row * corner.y;
                let from = place as usize * nodes..(place as usize + 1) * nodes;
                if from.end <= first {
                    landings[landings_of(&own)].copy_from_slice(&landings_before[landings_of(&from)]);
                    ends[own].copy_from_slice(&ends_before[from]);
                } else {
                    let from = from.start - end..from.end - end;
                    landings[landings_of(&own)].copy_from_slice(&landings_behind[landings_of(&from)]);
                    ends[own].copy_from_slice(&ends_behind[from]);
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
            orders: params.orders - params.asides,
            asides: params.asides,
            path: params.path,
            casters: params.casters,
            rule: params.rule,
            range: params.range,
        }
    }

    /// The first corner of a cell, at all nodes; `landings` has node x order, `ends` nodes.
    fn trace_corner(
        &self,
        cell: &FootprintCell,
        landings: &mut [PathLanding],
        ends: &mut [PathEnds],
        bounds: &[AtomicU32],
    ) {
        let params = &self.params;
        let paths = self.paths();
        let ray = self.views[params.emission_view as usize].ray(cell.corner(0));
        let first = paths.first_surface(ray);
        landings.fill(PathLanding { end: END_MISSED, ..PathLanding::default() });
        let of_nodes = landings.chunks_exact_mut(params.orders as usize).zip(ends).zip(0..);
        for ((landings, ends), node) in of_nodes {
            let bin = node_bin(params.nodes, node, cell);
            *ends = match &first {
                Err(end) => PathEnds { end: *end, ..PathEnds::default() },
                Ok(met) => paths.trace_from(ray, met, bin, WHOLE, |arrival| {
                    landings[arrival.order as usize] = self.landing(&paths, &arrival);
                }),
            };
        }
        if params.keeps_bounds == 1 {
            for landing in landings.iter().filter(|landing| landing.end == END_LANDED) {
                self.add_bounds(landing, bounds);
            }
        }
    }

    /// The landing that footprints are made of.
    fn landing(&self, paths: &LightPaths<'_>, arrival: &Arrival) -> PathLanding {
        let Arrival { end, part, way, length, medium, .. } = *arrival;
        let landing = PathLanding { length, part, way, end, medium, ..PathLanding::default() };
        if end == END_ESCAPED {
            let way = self.way_beyond(way, &arrival.ray, self.leaves_at(&arrival.ray));
            return PathLanding { way, ..landing };
        }
        if end != END_LANDED {
            return landing;
        }
        let Some(at) = paths.locate(arrival) else {
            let way = self.way_beyond(way, &arrival.ray, arrival.met.hit.distance);
            return PathLanding { way, end: END_OUTSIDE_MAP, ..landing };
        };
        let t = &self.surfaces.triangles[arrival.met.visible as usize - 1];
        let side = if arrival.met.hit.facing > 0.0 { 4 } else { 0 };
        PathLanding {
            texel: at.texel,
            way: way_on(way, 8 * t.object + WAY_LANDS + side),
            place: at.face | t.material << 8,
            ..landing
        }
    }

    /// Along a ray, to where it leaves the box of all surfaces.
    fn leaves_at(&self, ray: &Ray) -> f32 {
        let all = &self.surfaces.bvh[0];
        let upwards = ray.direction.cmpgt(Vec3::ZERO);
        let ahead = Vec3::select(upwards, all.high, all.low);
        let run =
            Vec3::select(upwards, Vec3::ONE, Vec3::NEG_ONE) * ray.direction.abs().max(Vec3::splat(1e-12));
        ((ahead - ray.origin) / run).min_element()
    }

    /// Paths that go by the map on different sides of it do not belong together: those between them may land.
    fn way_beyond(&self, way: u32, ray: &Ray, distance: f32) -> u32 {
        let view = &self.views[self.params.landing_view as usize];
        let at = view.project(ray.origin + distance * ray.direction);
        let (before, behind) = (at.texel.cmplt(Vec2::ZERO), at.texel.cmpge(view.size.as_vec2()));
        let sides = before.bitmask() | behind.bitmask() << 2 | u32::from(at.z <= 0.0) << 4;
        let sides = if self.params.landing_faces == 1 { sides } else { 0 };
        way_on(way, 8 * sides + WAY_BEYOND)
    }

    fn add_bounds(&self, landing: &PathLanding, bounds: &[AtomicU32]) {
        let face = landing.place & 0xff;
        let size = self.views[(self.params.landing_view + face) as usize].size;
        landing_bounds_add(size, face, landing.texel, bounds);
    }
}
