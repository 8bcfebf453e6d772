//! Paths of light through the whole scene, by its geometry: from a corner of a cell of the emission view through every surface,
//! with reflections inside the first glass, to where they land. Twin of `shaders/path_trace.wgsl`.
//!
//! Where light leaves the first glass after each number of reflections it goes on as a landing of its own. Behind it, what goes on
//! is chosen, not drawn: through glass what passes, at mirrors and at total reflection what is thrown back. Parts are integers
//! and split without a rest, so those of a path's landings and ends add up to a whole exactly.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::photon_trace::BOUNDS_WORDS;
pub use super::photon_trace::{PATH_REFLECTED, PATH_REFRACTED};
use super::{
    BVH_WGSL, CROSSING_WGSL, FLUX_WGSL, FOOTPRINT_WGSL, LEDGER_WGSL, LIGHT_VIEWS_WGSL, OPTICS_WGSL,
    PHOTON_QUEUE_WGSL, REFRACT_WGSL, TRIANGLE_WGSL, VIEW_WGSL, VISIBILITY_TEXTURE_ARRAY, binding,
};
use crate::shared::bvh::{NO_OBJECT, Sought, SurfaceHit, Surfaces};
use crate::shared::crossing::{cross_surface, interface_reflectance, mirror_reflectance, reflect_at};
use crate::shared::flux::{WHOLE, flux_part, part_from};
use crate::shared::footprint::{CELL_WORDS, CELLS_HEAD, FootprintCell, PathEnds, PathLanding, node_bin};
use crate::shared::ledger::*;
use crate::shared::light_views::{Located, locate};
use crate::shared::optics::Optics;
use crate::shared::photon_queue::QUEUE_COUNT;
use crate::shared::triangle::{
    NOTHING, SAME_SURFACE, TRIANGLE_MIRROR, TRIANGLE_OPEN, TRIANGLE_REFRACTS, Triangle, visible_in_layer,
};
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
    /// Most workgroups of the device, per dimension.
    pub max_groups: u32,
    /// [`PATH_REFRACTED`] or [`PATH_REFLECTED`].
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

/// Light on its way outside the first glass, at most so many surfaces.
const MOST_SURFACES: u32 = 12;

/// What is left inside glass is followed no longer when it is less.
const LEAST_PART: u32 = WHOLE / 4096;

const WAY_START: u32 = 2_166_136_261;
const WAY_PRIME: u32 = 16_777_619;
const WAY_THROUGH: u32 = 1;
const WAY_BACK: u32 = 2;
const WAY_LANDS: u32 = 3;

/// As the FNV-1a hash goes on.
fn way_through(way: u32, t: &Triangle, what: u32) -> u32 {
    (way ^ (8 * t.face + what)).wrapping_mul(WAY_PRIME)
}

fn nowhere(end: u32, part: u32, way: u32) -> PathLanding {
    PathLanding { part, way, end, ..PathLanding::default() }
}

/// A path on its way: what is left of it, and what it has left behind.
#[derive(Clone, Copy)]
struct Way {
    ray: Ray,
    /// The triangle that the ray starts on, as visibility buffers count.
    start: u32,
    part: u32,
    /// Of all surfaces so far.
    surfaces: u32,
    ends: PathEnds,
}

impl Way {
    fn nowhere(&self, end: u32) -> PathLanding {
        nowhere(end, self.part, self.surfaces)
    }

    /// Keeps a share; the rest is absorbed.
    fn absorb(&mut self, passes: f32) {
        let left = flux_part(self.part, part_from(passes));
        self.ends.absorbed += self.part - left;
        self.part = left;
    }

    fn go_on(&mut self, origin: Vec3, direction: Vec3, met: &SurfaceHit, t: &Triangle, what: u32) {
        self.ray = Ray { origin, direction };
        self.start = met.visible;
        self.surfaces = way_through(self.surfaces, t, what);
    }
}

/// CPU mirror: a path per node and texel of the emission view, or per node and corner of the queued cells.
pub fn path_trace(
    inputs: &Inputs<'_>,
    queues: &[AtomicU32],
    landings: &mut [PathLanding],
    ends: &mut [PathEnds],
    bounds: &[AtomicU32],
) {
    let params = &inputs.params;
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
            landings.fill(nowhere(END_MISSED, 0, 0));
            let ray = view.ray(cell.corner(corner));
            *ends = inputs.trace(ray, node_bin(params.nodes, node, &cell), landings);
            if params.keeps_bounds == 1 {
                for landing in landings.iter().filter(|landing| landing.end == END_LANDED) {
                    inputs.add_bounds(landing, bounds);
                }
            }
        }
    });
}

impl Inputs<'_> {
    fn triangle(&self, visible: u32) -> &Triangle {
        &self.surfaces.triangles[visible as usize - 1]
    }

    fn medium(&self, t: &Triangle, bin: u32) -> Optics {
        self.optics[((self.params.first_optics + bin) * self.params.materials + t.material) as usize]
    }

    /// The view shows this surface at the place, or beside it.
    fn shown_there(&self, at: &Located, visible: u32, point: Vec3) -> bool {
        let view = &self.views[at.view as usize];
        let light_ray = view.ray_through(point);
        let distance = (point - light_ray.origin).dot(light_ray.direction);
        let object = self.triangle(visible).object;
        let middle = at.texel.as_uvec2();
        (-1..8).any(|i| {
            let texel = if i < 0 { middle } else { view.texel_beside(middle, i) };
            let shown = visible_in_layer(&self.landing_visibility, texel, at.face);
            if shown == visible {
                return true;
            }
            if shown == NOTHING || self.triangle(shown).object != object {
                return false;
            }
            let hit = self.triangle(shown).plane_hit(light_ray);
            hit.crosses && (hit.distance - distance).abs() <= 0.01 * distance.abs() + SAME_SURFACE
        })
    }

    fn land(&self, way: &Way, met: &SurfaceHit) -> PathLanding {
        let point = way.ray.origin + met.hit.distance * way.ray.direction;
        let t = self.triangle(met.visible);
        let at = locate(self.views, self.params.landing_view, self.params.landing_faces, point);
        let lit = || {
            let light_ray = self.views[at.view as usize].ray_through(point);
            t.plane_hit(light_ray).facing * met.hit.facing > 0.0
        };
        if !at.found || !lit() || !self.shown_there(&at, met.visible, point) {
            return way.nowhere(END_OUTSIDE_MAP);
        }
        let side = if met.hit.facing > 0.0 { 4 } else { 0 };
        PathLanding {
            texel: at.texel,
            length: 0.0,
            part: way.part,
            way: (way.surfaces ^ (8 * t.object + WAY_LANDS + side)).wrapping_mul(WAY_PRIME),
            end: END_LANDED,
            place: at.face | t.material << 8,
            medium: 0,
        }
    }

    /// From the first glass, or from the first mirror, to where it lands.
    fn follow(&self, way: &mut Way, bin: u32) -> PathLanding {
        let mut object = NO_OBJECT;
        let mut absorption = 0.0; // around the ray, per working unit
        for _ in 0..MOST_SURFACES {
            let met = self.surfaces.nearest(way.ray, &Sought { object, start: way.start, only: 0 });
            if met.visible == NOTHING {
                return way.nowhere(END_ESCAPED);
            }
            let t = self.triangle(met.visible);
            let medium = self.medium(t, bin);
            way.absorb((-absorption * met.hit.distance).exp());
            let direction = way.ray.direction;
            let normal = -met.hit.facing.signum() * t.interpolated_normal(&met.hit);
            let origin = way.ray.origin + met.hit.distance * direction;
            if t.flags & TRIANGLE_MIRROR != 0 {
                let share = mirror_reflectance(direction, normal, medium.surface);
                let back = reflect_at(direction, normal, t, share);
                if back.end != END_LANDED {
                    return way.nowhere(back.end);
                }
                way.absorb(back.reflectance);
                way.go_on(origin, back.direction, &met, t, WAY_BACK);
            } else if t.flags & TRIANGLE_REFRACTS != 0 {
                let entering = met.hit.facing < 0.0;
                let eta = if entering { medium.index } else { 1.0 / medium.index };
                let crossing = cross_surface(direction, normal, t, eta, self.params.rule);
                if crossing.end == END_TOTAL {
                    let back = reflect_at(direction, normal, t, 1.0);
                    if back.end != END_LANDED {
                        return way.nowhere(back.end);
                    }
                    way.go_on(origin, back.direction, &met, t, WAY_BACK);
                } else if crossing.end != END_LANDED {
                    return way.nowhere(crossing.end);
                } else {
                    let passed = flux_part(way.part, part_from(1.0 - crossing.reflectance));
                    let rest = way.part - passed;
                    if object == NO_OBJECT {
                        way.ends.reflected += rest;
                    } else {
                        way.ends.kept_inside += rest;
                    }
                    way.part = passed;
                    way.absorb(medium.surface);
                    way.go_on(origin, crossing.direction, &met, t, WAY_THROUGH);
                    (object, absorption) =
                        if entering { (t.object, medium.absorption) } else { (NO_OBJECT, 0.0) };
                }
            } else {
                return self.land(way, &met);
            }
        }
        way.nowhere(END_NO_EXIT)
    }

    /// Inside the first glass: what leaves it after each number of reflections goes on, what is left then stays inside.
    fn trace_inside(
        &self,
        mut way: Way,
        front: &Triangle,
        bin: u32,
        landings: &mut [PathLanding],
    ) -> PathEnds {
        let medium = self.medium(front, bin);
        let mut length = 0.0;
        let orders = landings.len();
        for order in 0..orders {
            if way.part < LEAST_PART {
                break;
            }
            let stored = |landing, length| PathLanding { length, medium: front.material, ..landing };
            let sought = Sought { object: front.object, start: way.start, only: 0 };
            let met = self.surfaces.nearest(way.ray, &sought);
            if met.visible == NOTHING {
                let open = front.flags & TRIANGLE_OPEN != 0;
                let end = if open { END_ESCAPED } else { END_NO_EXIT };
                landings[order] = stored(way.nowhere(end), length);
                return way.ends;
            }
            let t = self.triangle(met.visible);
            length += met.hit.distance;
            let direction = way.ray.direction;
            let normal = -met.hit.facing.signum() * t.interpolated_normal(&met.hit);
            let origin = way.ray.origin + met.hit.distance * direction;
            let back = if t.flags & (TRIANGLE_REFRACTS | TRIANGLE_MIRROR) == 0 {
                landings[order] = stored(self.land(&way, &met), length);
                return way.ends;
            } else if t.flags & TRIANGLE_MIRROR != 0 {
                let share = mirror_reflectance(direction, normal, self.medium(t, bin).surface);
                let back = reflect_at(direction, normal, t, share);
                way.absorb(back.reflectance);
                back
            } else {
                let crossing = cross_surface(direction, normal, t, 1.0 / medium.index, self.params.rule);
                if crossing.end == END_LANDED {
                    let leaves = flux_part(way.part, part_from(1.0 - crossing.reflectance));
                    let mut outside = Way { part: leaves, ..way };
                    outside.absorb(medium.surface);
                    outside.go_on(origin, crossing.direction, &met, t, WAY_THROUGH);
                    landings[order] = stored(self.follow(&mut outside, bin), length);
                    way.part -= leaves;
                    way.ends = outside.ends;
                } else if crossing.end != END_TOTAL {
                    landings[order] = stored(way.nowhere(crossing.end), length);
                    return way.ends;
                }
                reflect_at(direction, normal, t, 1.0)
            };
            if back.end != END_LANDED {
                if order + 1 < orders {
                    landings[order + 1] = stored(way.nowhere(back.end), length);
                    return way.ends;
                }
                break;
            }
            way.go_on(origin, back.direction, &met, t, WAY_BACK);
        }
        way.ends.kept_inside += way.part;
        way.ends
    }

    /// Back from the first surface; what goes into glass there stays, what a mirror does not throw back is absorbed.
    fn trace_reflected(
        &self,
        ray: Ray,
        met: &SurfaceHit,
        bin: u32,
        landings: &mut [PathLanding],
    ) -> PathEnds {
        let front = self.triangle(met.visible);
        let medium = self.medium(front, bin);
        let normal = -met.hit.facing.signum() * front.interpolated_normal(&met.hit);
        let mirror = front.flags & TRIANGLE_MIRROR != 0;
        let share = if mirror {
            mirror_reflectance(ray.direction, normal, medium.surface)
        } else {
            let eta = if met.hit.facing < 0.0 { medium.index } else { 1.0 / medium.index };
            interface_reflectance(ray.direction, normal, eta, self.params.rule)
        };
        let back = reflect_at(ray.direction, normal, front, share);
        if back.end != END_LANDED {
            return PathEnds { end: back.end, ..PathEnds::default() };
        }
        let part = flux_part(WHOLE, part_from(back.reflectance));
        let (absorbed, kept_inside) = if mirror { (WHOLE - part, 0) } else { (0, WHOLE - part) };
        let ends = PathEnds { end: END_LANDED, reflected: 0, absorbed, kept_inside };
        let mut way = Way { ray, start: NOTHING, part, surfaces: WAY_START, ends };
        let origin = ray.origin + met.hit.distance * ray.direction;
        way.go_on(origin, back.direction, met, front, WAY_BACK);
        let landing = self.follow(&mut way, bin);
        landings[0] = PathLanding { medium: front.material, ..landing };
        way.ends
    }

    /// From the light to where it lands; `landings` has as many as there are orders, all nowhere.
    pub fn trace(&self, ray: Ray, bin: u32, landings: &mut [PathLanding]) -> PathEnds {
        let params = &self.params;
        let ended = |end| PathEnds { end, ..PathEnds::default() };
        let sought = |only| Sought { object: NO_OBJECT, start: NOTHING, only };
        let met = self.surfaces.nearest(ray, &sought(0));
        if met.visible == NOTHING || (params.range > 0.0 && met.hit.distance > params.range) {
            return ended(END_MISSED);
        }
        let front = self.triangle(met.visible);
        if front.flags & params.casters == 0 {
            let behind = self.surfaces.nearest(ray, &sought(params.casters));
            let blocks = front.flags & TRIANGLE_REFRACTS == 0 && behind.visible != NOTHING;
            return ended(if blocks { END_BLOCKED } else { END_MISSED });
        }
        if params.path == PATH_REFLECTED {
            return self.trace_reflected(ray, &met, bin, landings);
        }
        let medium = self.medium(front, bin);
        let normal = -met.hit.facing.signum() * front.interpolated_normal(&met.hit);
        let entering = met.hit.facing < 0.0;
        let eta = if entering { medium.index } else { 1.0 / medium.index };
        let crossing = cross_surface(ray.direction, normal, front, eta, params.rule);
        if crossing.end != END_LANDED {
            return ended(crossing.end);
        }
        let part = flux_part(WHOLE, part_from(1.0 - crossing.reflectance));
        let ends = PathEnds { end: END_LANDED, reflected: WHOLE - part, absorbed: 0, kept_inside: 0 };
        let mut way = Way { ray, start: NOTHING, part, surfaces: WAY_START, ends };
        way.absorb(medium.surface);
        let origin = ray.origin + met.hit.distance * ray.direction;
        way.go_on(origin, crossing.direction, &met, front, WAY_THROUGH);
        if entering {
            return self.trace_inside(way, front, bin, landings);
        }
        let landing = self.follow(&mut way, bin);
        landings[0] = PathLanding { medium: front.material, ..landing };
        way.ends
    }

    fn add_bounds(&self, landing: &PathLanding, bounds: &[AtomicU32]) {
        let face = (landing.place & 0xff) as usize;
        let size = self.views[self.params.landing_view as usize + face].size;
        let texel = landing.texel.max(Vec2::ZERO).as_uvec2().min(size - 1);
        let from = [size.x - texel.x, texel.x + 1, size.y - texel.y, texel.y + 1];
        for (word, from) in bounds[BOUNDS_WORDS * face..].iter().zip(from) {
            word.fetch_max(from, Ordering::Relaxed);
        }
    }
}
