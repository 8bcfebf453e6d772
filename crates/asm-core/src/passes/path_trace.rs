//! Paths of light from the corners of cells of the emission view to where they land. Twin of `shaders/path_trace.wgsl`; how they go
//! on stands in [`crate::shared::light_path`].

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::{
    BVH_WGSL, CROSSING_WGSL, EMISSION_WGSL, FLUX_WGSL, FOOTPRINT_WGSL, LEDGER_WGSL, LIGHT_PATH_WGSL,
    LIGHT_VIEWS_WGSL, OPTICS_WGSL, PATH_SPREAD_WGSL, PHOTON_QUEUE_WGSL, REFRACT_WGSL, TRIANGLE_WGSL,
    VIEW_WGSL, VISIBILITY_TEXTURE_ARRAY, binding,
};
use crate::shared::bvh::Surfaces;
use crate::shared::flux::{WHOLE, add_64};
use crate::shared::footprint::{
    CELLS_PER_GROUP, FootprintCell, MOST_NODES, NO_QUEUE, PATCH_NEW, PATCH_PLACES, PATCH_ROW, PathEnds,
    PathLanding, WORK_CORNERS, WORK_RAYS, middle_node, node_bin,
};
use crate::shared::footprint_cells::queued_patch;
use crate::shared::ledger::*;
use crate::shared::light_path::{Arrival, LightPaths, way_on};
use crate::shared::optics::Optics;
use crate::shared::path_spread::{Around, CornerPaths};
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
    /// Spacing of corners of the emission view that tell, when all their nodes are known, how those halfway between them go.
    pub lattice: u32,
    /// Of what is told, texels of the landing view; 0: nothing yet, all nodes of that lattice are traced, and all middle ones.
    pub tolerance: f32,
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
        PATH_SPREAD_WGSL,
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
        binding("queues", BindingKind::Atomic),
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

/// Texels along the map's edges that are beside it for light that goes by: walls stand on its border, where rounding would choose a side.
const BORDER: f32 = 0.37;

/// CPU mirror: the paths of every texel of the emission view, or of the corners of the queued patches.
pub fn path_trace(
    inputs: &Inputs<'_>,
    queues: &[AtomicU32],
    landings: &mut [PathLanding],
    ends: &mut [PathEnds],
    bounds: &[AtomicU32],
) {
    let Work { corners, rays } = if inputs.params.queue == NO_QUEUE {
        inputs.trace_texels(landings, ends, bounds)
    } else {
        inputs.trace_patches(queues, landings, ends)
    };
    add_64(&queues[2 * WORK_CORNERS..], corners);
    add_64(&queues[2 * WORK_RAYS..], rays);
}

/// Every so many corners in x and y, and the last ones.
fn on_lattice(at: UVec2, size: UVec2, step: u32) -> bool {
    let on_line = |at, size| at % step == 0 || at == size - 1;
    on_line(at.x, size.x) && on_line(at.y, size.y)
}

/// A dispatch over the emission view takes this node of a corner.
fn takes_texel(params: &PathTrace, at: UVec2, size: UVec2, node: usize) -> bool {
    let (middle, step) = (node as u32 == middle_node(params.nodes), params.lattice);
    if params.tolerance == 0.0 {
        return middle || on_lattice(at, size, step);
    }
    !middle && on_lattice(at, size, step / 2) && !on_lattice(at, size, step)
}

/// Counts of what was done.
#[derive(Clone, Copy, Default)]
struct Work {
    /// That paths begin at.
    corners: u64,
    /// Traced.
    rays: u64,
}

impl std::iter::Sum for Work {
    fn sum<I: Iterator<Item = Self>>(works: I) -> Self {
        works.fold(Self::default(), |a, b| Self { corners: a.corners + b.corners, rays: a.rays + b.rays })
    }
}

/// The paths of such corners, row by row.
struct Lattice {
    landings: Vec<PathLanding>,
    ends: Vec<PathEnds>,
    /// Of the emission view.
    size: UVec2,
    step: u32,
    nodes: usize,
    orders: usize,
}

impl Lattice {
    fn of_texels(
        landings: &[PathLanding],
        ends: &[PathEnds],
        size: UVec2,
        step: u32,
        nodes: usize,
        orders: usize,
    ) -> Self {
        let texels = (0..size.x * size.y).map(|place| UVec2::new(place % size.x, place / size.x));
        let paths = texels.filter(|at| on_lattice(*at, size, step)).map(|at| {
            let first = (at.x + size.x * at.y) as usize * nodes;
            first..first + nodes
        });
        let landings = paths.clone().flat_map(|p| &landings[p.start * orders..p.end * orders]).copied();
        let (landings, ends) = (landings.collect(), paths.flat_map(|p| &ends[p]).copied().collect());
        Self { landings, ends, size, step, nodes, orders }
    }

    /// Corners around one that is not among these.
    fn around(&self, at: UVec2) -> Around<'_> {
        let last = self.size - 1;
        let low = UVec2::select(at.cmpeq(last), at, at / self.step * self.step);
        let high = UVec2::select(at.cmpeq(low), at, (low + self.step).min(last));
        let line = |at: UVec2| (at + self.step - 1) / self.step;
        let across = line(last).x + 1;
        let corners = [low, UVec2::new(high.x, low.y), UVec2::new(low.x, high.y), high]
            .map(|at| (line(at).x + across * line(at).y) as usize)
            .map(|i| CornerPaths::of(&self.landings, &self.ends, i, self.nodes, self.orders));
        Around { corners, weight: (at - low).as_vec2() / (high - low).max(UVec2::ONE).as_vec2() }
    }
}

impl<'a> Inputs<'a> {
    /// Of the emission view.
    fn trace_texels(
        &self,
        landings: &mut [PathLanding],
        ends: &mut [PathEnds],
        bounds: &[AtomicU32],
    ) -> Work {
        let params = &self.params;
        let (nodes, orders) = (params.nodes as usize, params.orders as usize);
        let size = self.views[params.emission_view as usize].size;
        let step = params.lattice;
        let lattice =
            (params.tolerance > 0.0).then(|| Lattice::of_texels(landings, ends, size, step, nodes, orders));
        let corners = landings.par_chunks_exact_mut(nodes * orders).zip(ends.par_chunks_exact_mut(nodes));
        let corners = corners.take((size.x * size.y) as usize).enumerate();
        let work = corners.with_min_len(CELLS_PER_GROUP as usize).map(|(place, (landings, ends))| {
            let at = UVec2::new(place as u32 % size.x, place as u32 / size.x);
            let cell = FootprintCell { at, level: UVec2::ZERO, first: 0, bins: params.bins };
            let taken = |node| takes_texel(params, at, size, node);
            let here = (0..nodes).filter(|node| taken(*node));
            let rays = match &lattice {
                None => self.trace_corner(&cell, taken, landings, ends),
                Some(_) if here.clone().next().is_none() => 0,
                Some(lattice) => self.trace_rest(&cell, &lattice.around(at), landings, ends),
            };
            if params.keeps_bounds == 1 {
                for landing in here.flat_map(|node| &landings[node * orders..(node + 1) * orders]) {
                    self.add_bounds(landing, bounds);
                }
            }
            Work { corners: u64::from(taken(self.middle())), rays }
        });
        work.sum()
    }

    /// Of the queued patches.
    fn trace_patches(
        &self,
        queues: &[AtomicU32],
        landings: &mut [PathLanding],
        ends: &mut [PathEnds],
    ) -> Work {
        let params = &self.params;
        let (nodes, orders) = (params.nodes as usize, params.orders as usize);
        // Parents lie before or behind the patches' own places.
        let first = params.first_place as usize * nodes;
        let patches = queues[params.queue as usize + QUEUE_COUNT].load(Ordering::Relaxed) as usize;
        let paths = PATCH_PLACES as usize * nodes;
        let end = first + patches * paths;
        let (landings_before, rest) = landings.split_at_mut(first * orders);
        let (landings, landings_behind) = rest.split_at_mut((end - first) * orders);
        let (ends_before, rest) = ends.split_at_mut(first);
        let (ends, ends_behind) = rest.split_at_mut(end - first);
        let parents = |place: usize| {
            if place * nodes < first {
                CornerPaths::of(landings_before, ends_before, place, nodes, orders)
            } else {
                CornerPaths::of(landings_behind, ends_behind, place - end / nodes, nodes, orders)
            }
        };
        let patches =
            landings.par_chunks_exact_mut(paths * orders).zip(ends.par_chunks_exact_mut(paths)).enumerate();
        let work = patches.with_min_len(8).map(|(slot, (landings, ends))| {
            let patch = queued_patch(queues, params.queue, slot as u32);
            let paths_of = |at: UVec2| {
                let first = (at.x + PATCH_ROW * at.y) as usize * nodes;
                (first * orders..(first + nodes) * orders, first..first + nodes)
            };
            let mut work = Work::default();
            for at in (0..PATCH_NEW).filter_map(|i| patch.new_corner(i)) {
                let cell = FootprintCell { at: patch.cell(0).at + at, ..patch.cell(0) };
                let (own_landings, own_ends) = paths_of(at);
                work.corners += 1;
                work.rays +=
                    self.trace_corner(&cell, |_| true, &mut landings[own_landings], &mut ends[own_ends]);
            }
            if patch.has_parent() {
                for outer in [UVec2::ZERO, UVec2::X, UVec2::Y, UVec2::ONE] {
                    let from = parents((patch.parent + outer.x + params.parent_row * outer.y) as usize);
                    let (own_landings, own_ends) = paths_of(outer * patch.parts);
                    landings[own_landings].copy_from_slice(from.landings);
                    ends[own_ends].copy_from_slice(from.ends);
                }
            }
            work
        });
        work.sum()
    }

    fn middle(&self) -> usize {
        middle_node(self.params.nodes) as usize
    }

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

    /// The first corner of a cell, at the wanted nodes; `landings` has node x order, `ends` nodes. Returns how many that were.
    fn trace_corner(
        &self,
        cell: &FootprintCell,
        wanted: impl Fn(usize) -> bool,
        landings: &mut [PathLanding],
        ends: &mut [PathEnds],
    ) -> u64 {
        let params = &self.params;
        let paths = self.paths();
        let ray = self.views[params.emission_view as usize].ray(cell.corner(0));
        let first = paths.first_surface(ray);
        let of_nodes = landings.chunks_exact_mut(params.orders as usize).zip(ends).enumerate();
        let mut rays = 0;
        for (node, (landings, ends)) in of_nodes.filter(|(node, _)| wanted(*node)) {
            landings.fill(PathLanding { end: END_MISSED, ..PathLanding::default() });
            *ends = match &first {
                Err(end) => PathEnds { end: *end, ..PathEnds::default() },
                Ok(met) => {
                    paths.trace_from(ray, met, node_bin(params.nodes, node as u32, cell), WHOLE, |arrival| {
                        landings[arrival.order as usize] = self.landing(&paths, &arrival);
                    })
                }
            };
            rays += 1;
        }
        rays
    }

    /// As [`Inputs::trace_corner`] at those nodes but the middle one that what is around does not tell.
    fn trace_rest(
        &self,
        cell: &FootprintCell,
        around: &Around<'_>,
        landings: &mut [PathLanding],
        ends: &mut [PathEnds],
    ) -> u64 {
        let params = &self.params;
        let size_of_face = |face| self.views[(params.landing_view + face) as usize].size;
        let mut untold = [false; MOST_NODES];
        for node in (0..ends.len()).filter(|node| *node != self.middle()) {
            untold[node] = !around.tell_path(landings, ends, node, params.tolerance, size_of_face);
        }
        if untold.contains(&true) { self.trace_corner(cell, |node| untold[node], landings, ends) } else { 0 }
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
        let (before, behind) =
            (at.texel.cmplt(Vec2::splat(BORDER)), at.texel.cmpge(view.size.as_vec2() - BORDER));
        let sides = before.bitmask() | behind.bitmask() << 2 | u32::from(at.z <= 0.0) << 4;
        let sides = if self.params.landing_faces == 1 { sides } else { 0 };
        way_on(way, 8 * sides + WAY_BEYOND)
    }

    fn add_bounds(&self, landing: &PathLanding, bounds: &[AtomicU32]) {
        if landing.end != END_LANDED {
            return;
        }
        let face = landing.place & 0xff;
        let size = self.views[(self.params.landing_view + face) as usize].size;
        landing_bounds_add(size, face, landing.texel, bounds);
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    const NODES: u32 = 3;

    /// As a bake runs them.
    fn dispatches() -> impl Iterator<Item = PathTrace> {
        let of = |(lattice, tolerance)| PathTrace { nodes: NODES, lattice, tolerance, ..PathTrace::zeroed() };
        [(8, 0.0), (8, 0.1), (4, 0.1), (2, 0.1)].into_iter().map(of)
    }

    fn corners(size: UVec2) -> impl Iterator<Item = UVec2> {
        (0..size.x * size.y).map(move |i| UVec2::new(i % size.x, i / size.x))
    }

    #[test]
    fn every_node_of_every_corner_is_taken_once() {
        for size in [2, 8, 9, 17].map(UVec2::splat).into_iter().chain([UVec2::new(66, 35)]) {
            for (at, node) in corners(size).flat_map(|at| (0..NODES as usize).map(move |node| (at, node))) {
                let taken = dispatches().filter(|params| takes_texel(params, at, size, node)).count();
                assert_eq!(taken, 1, "node {node} of {at}, {size}");
            }
        }
    }

    #[test]
    fn corners_around_are_on_the_lattice_and_their_weights_make_up_the_place() {
        for (size, step) in [(UVec2::splat(9), 8), (UVec2::splat(17), 4), (UVec2::new(66, 35), 8)] {
            let landings: Vec<_> = corners(size)
                .map(|at| PathLanding { texel: at.as_vec2(), ..PathLanding::default() })
                .collect();
            let ends = vec![PathEnds::default(); landings.len()];
            let lattice = Lattice::of_texels(&landings, &ends, size, step, 1, 1);
            for at in corners(size).filter(|at| !on_lattice(*at, size, step)) {
                let around = lattice.around(at);
                let [a, b, c, d] = around.corners.map(|corner| corner.landings[0].texel);
                assert!([a, b, c, d].iter().all(|corner| on_lattice(corner.as_uvec2(), size, step)), "{at}");
                let place = a.lerp(b, around.weight.x).lerp(c.lerp(d, around.weight.x), around.weight.y);
                assert!(place.abs_diff_eq(at.as_vec2(), 1e-4), "{at}: {place}");
            }
        }
    }
}
