//! Host side of `shaders/shared/light_path.wgsl`: paths of light through the whole scene, by its geometry, from the light through
//! every surface, with reflections inside the first glass, to what each meets last.
//!
//! Where light leaves the first glass after each number of reflections it goes on as an arrival of its own. Behind it, what goes
//! on is chosen, not drawn: through glass what passes, at mirrors and at total reflection what is thrown back. The first few
//! times that this leaves something behind, what is thrown back goes aside, and arrives for itself. Parts are integers and split
//! without a rest, so those of a path's arrivals and ends add up to its flux exactly.

use frame_plan::cpu::TextureView;
use glam::Vec3;

use super::bvh::{NO_OBJECT, Sought, SurfaceHit, Surfaces};
use super::crossing::{cross_surface, interface_reflectance, mirror_reflectance, reflect_at};
use super::emission::PATH_REFLECTED;
use super::flux::{flux_part, part_from};
use super::footprint::PathEnds;
use super::ledger::*;
use super::light_views::{Located, locate};
use super::optics::Optics;
use super::triangle::{
    NOTHING, SAME_SURFACE, TRIANGLE_MIRROR, TRIANGLE_OPEN, TRIANGLE_REFRACTS, Triangle, visible_in_layer,
};
use super::view::{Ray, View};

/// A scene that paths go through, and which of them.
#[derive(Clone, Copy)]
pub struct LightPaths<'a> {
    /// All triangles and the tree over them.
    pub surfaces: Surfaces<'a>,
    /// All views.
    pub views: &'a [View],
    /// Bin x material that paths go through.
    pub optics: &'a [Optics],
    /// Where light may land.
    pub landing_visibility: TextureView<'a>,
    /// First view of where light may land.
    pub landing_view: u32,
    /// Number of those views.
    pub landing_faces: u32,
    /// Row length of `optics`.
    pub materials: u32,
    /// Row of this light.
    pub first_optics: u32,
    /// Reflections inside the first glass after which light may leave it, and none.
    pub orders: u32,
    /// What is thrown back behind the first glass and followed, at most so often; up to [`MOST_ASIDES`].
    pub asides: u32,
    /// `PATH_*`.
    pub path: u32,
    /// `TRIANGLE_*` of the surfaces that paths begin at.
    pub casters: u32,
    /// `RULE_*`.
    pub rule: u32,
    /// Light beyond this distance is dark; 0 has no end.
    pub range: f32,
}

/// Where a path, or what of it leaves the first glass after so many reflections, leads.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Reflections inside the first glass; from [`LightPaths::orders`] on what went aside.
    pub order: u32,
    /// `END_*`; `END_LANDED` at an opaque surface, wherever that is.
    pub end: u32,
    /// The last.
    pub ray: Ray,
    /// What it meets; nothing unless `end` is `END_LANDED`.
    pub met: SurfaceHit,
    /// Of its flux; what the first glass absorbs is not yet taken off.
    pub part: u32,
    /// Of all surfaces on the way.
    pub way: u32,
    /// Inside the first glass, working units.
    pub length: f32,
    /// Material of the first glass.
    pub medium: u32,
}

/// Light on its way outside the first glass, at most so many surfaces.
const MOST_SURFACES: u32 = 12;

/// What is left inside glass is followed no longer when it is less than one in so many of all.
const LEAST_SHARE: u32 = 4096;

const WAY_START: u32 = 2_166_136_261;
const WAY_PRIME: u32 = 16_777_619;
const WAY_THROUGH: u32 = 1;
const WAY_BACK: u32 = 2;

/// Where light outside all glass is: in no object, where nothing absorbs.
const OUTSIDE: (u32, f32) = (NO_OBJECT, 0.0);

/// As the FNV-1a hash goes on.
pub fn way_on(way: u32, number: u32) -> u32 {
    (way ^ number).wrapping_mul(WAY_PRIME)
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

/// Most that [`LightPaths::asides`] may be.
pub const MOST_ASIDES: usize = 2;

/// What was thrown back behind the first glass.
#[derive(Clone, Copy)]
struct Aside {
    ray: Ray,
    start: u32,
    part: u32,
    surfaces: u32,
    /// The refractor that it is in, or [`NO_OBJECT`].
    object: u32,
    /// Around it, per working unit.
    absorption: f32,
    /// Inside the first glass, working units.
    length: f32,
}

/// Those of a path, in the order of its surfaces.
#[derive(Default)]
struct Asides {
    kept: [Option<Aside>; MOST_ASIDES],
    count: usize,
    /// How many may still come.
    room: u32,
    /// Not kept if they have less.
    least: u32,
    /// Of the way so far inside the first glass.
    length: f32,
}

impl Asides {
    fn keep(&mut self, aside: Aside) -> bool {
        let fits = self.room > 0 && aside.part >= self.least;
        if fits {
            self.kept[self.count] = Some(Aside { length: self.length, ..aside });
            self.count += 1;
            self.room -= 1;
        }
        fits
    }
}

impl Way {
    /// At what it meets, outside the first glass.
    fn arrival(&self, end: u32, met: &SurfaceHit) -> Arrival {
        Arrival {
            order: 0,
            end,
            ray: self.ray,
            met: *met,
            part: self.part,
            way: self.surfaces,
            length: 0.0,
            medium: 0,
        }
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
        self.surfaces = way_on(self.surfaces, 8 * t.face + what);
    }
}

impl LightPaths<'_> {
    fn triangle(&self, visible: u32) -> &Triangle {
        &self.surfaces.triangles[visible as usize - 1]
    }

    fn medium(&self, t: &Triangle, bin: u32) -> Optics {
        self.optics[((self.first_optics + bin) * self.materials + t.material) as usize]
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

    /// Where a landing view shows the place and side that light arrives at, if one does.
    pub fn locate(&self, arrival: &Arrival) -> Option<Located> {
        let (ray, met) = (arrival.ray, arrival.met);
        let point = ray.origin + met.hit.distance * ray.direction;
        let at = locate(self.views, self.landing_view, self.landing_faces, point);
        let lit = || {
            let light_ray = self.views[at.view as usize].ray_through(point);
            self.triangle(met.visible).plane_hit(light_ray).facing * met.hit.facing > 0.0
        };
        (at.found && lit() && self.shown_there(&at, met.visible, point)).then_some(at)
    }

    /// From the first glass, or from the first mirror, or from where it went aside inside an object that absorbs per working
    /// unit, to where it lands.
    fn follow(&self, way: &mut Way, inside: (u32, f32), bin: u32, asides: &mut Asides) -> Arrival {
        let (mut object, mut absorption) = inside;
        for _ in 0..MOST_SURFACES {
            let met = self.surfaces.nearest(way.ray, &Sought { object, start: way.start, only: 0 });
            if met.visible == NOTHING {
                return way.arrival(END_ESCAPED, &met);
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
                    return way.arrival(back.end, &met);
                }
                way.absorb(back.reflectance);
                way.go_on(origin, back.direction, &met, t, WAY_BACK);
            } else if t.flags & TRIANGLE_REFRACTS != 0 {
                let entering = met.hit.facing < 0.0;
                let eta = if entering { medium.index } else { 1.0 / medium.index };
                let crossing = cross_surface(direction, normal, t, eta, self.rule);
                if crossing.end == END_TOTAL {
                    let back = reflect_at(direction, normal, t, 1.0);
                    if back.end != END_LANDED {
                        return way.arrival(back.end, &met);
                    }
                    way.go_on(origin, back.direction, &met, t, WAY_BACK);
                } else if crossing.end != END_LANDED {
                    return way.arrival(crossing.end, &met);
                } else {
                    let passed = flux_part(way.part, part_from(1.0 - crossing.reflectance));
                    let rest = way.part - passed;
                    let back = reflect_at(direction, normal, t, 1.0);
                    let aside = Aside {
                        ray: Ray { origin, direction: back.direction },
                        start: met.visible,
                        part: if back.end == END_LANDED { rest } else { 0 },
                        surfaces: way_on(way.surfaces, 8 * t.face + WAY_BACK),
                        object,
                        absorption,
                        length: 0.0,
                    };
                    if !asides.keep(aside) {
                        if object == NO_OBJECT {
                            way.ends.reflected += rest;
                        } else {
                            way.ends.kept_inside += rest;
                        }
                    }
                    way.part = passed;
                    way.absorb(medium.surface);
                    way.go_on(origin, crossing.direction, &met, t, WAY_THROUGH);
                    (object, absorption) =
                        if entering { (t.object, medium.absorption) } else { (NO_OBJECT, 0.0) };
                }
            } else {
                return way.arrival(END_LANDED, &met);
            }
        }
        way.arrival(END_NO_EXIT, &SurfaceHit::default())
    }

    /// Inside the first glass: what leaves it after each number of reflections goes on, what is left then stays inside.
    fn trace_inside(
        &self,
        mut way: Way,
        front: &Triangle,
        bin: u32,
        whole: u32,
        asides: &mut Asides,
        arrives: &mut impl FnMut(Arrival),
    ) -> PathEnds {
        let medium = self.medium(front, bin);
        let mut length = 0.0;
        for order in 0..self.orders {
            if way.part < whole / LEAST_SHARE {
                break;
            }
            let mut keep = |order, arrival, length| {
                arrives(Arrival { order, length, medium: front.material, ..arrival });
            };
            let sought = Sought { object: front.object, start: way.start, only: 0 };
            let met = self.surfaces.nearest(way.ray, &sought);
            if met.visible == NOTHING {
                let open = front.flags & TRIANGLE_OPEN != 0;
                let end = if open { END_ESCAPED } else { END_NO_EXIT };
                keep(order, way.arrival(end, &met), length);
                return way.ends;
            }
            let t = self.triangle(met.visible);
            length += met.hit.distance;
            let direction = way.ray.direction;
            let normal = -met.hit.facing.signum() * t.interpolated_normal(&met.hit);
            let origin = way.ray.origin + met.hit.distance * direction;
            let back = if t.flags & (TRIANGLE_REFRACTS | TRIANGLE_MIRROR) == 0 {
                keep(order, way.arrival(END_LANDED, &met), length);
                return way.ends;
            } else if t.flags & TRIANGLE_MIRROR != 0 {
                let share = mirror_reflectance(direction, normal, self.medium(t, bin).surface);
                let back = reflect_at(direction, normal, t, share);
                way.absorb(back.reflectance);
                back
            } else {
                let crossing = cross_surface(direction, normal, t, 1.0 / medium.index, self.rule);
                if crossing.end == END_LANDED {
                    let leaves = flux_part(way.part, part_from(1.0 - crossing.reflectance));
                    let mut outside = Way { part: leaves, ..way };
                    outside.absorb(medium.surface);
                    outside.go_on(origin, crossing.direction, &met, t, WAY_THROUGH);
                    asides.length = length;
                    keep(order, self.follow(&mut outside, OUTSIDE, bin, asides), length);
                    way.part -= leaves;
                    way.ends = outside.ends;
                } else if crossing.end != END_TOTAL {
                    keep(order, way.arrival(crossing.end, &met), length);
                    return way.ends;
                }
                reflect_at(direction, normal, t, 1.0)
            };
            if back.end != END_LANDED {
                if order + 1 < self.orders {
                    keep(order + 1, way.arrival(back.end, &met), length);
                    return way.ends;
                }
                break;
            }
            way.go_on(origin, back.direction, &met, t, WAY_BACK);
        }
        way.ends.kept_inside += way.part;
        way.ends
    }

    /// What went aside, to where it lands; nothing of it goes aside once more.
    fn follow_asides(
        &self,
        asides: &Asides,
        medium: u32,
        bin: u32,
        mut ends: PathEnds,
        arrives: &mut impl FnMut(Arrival),
    ) -> PathEnds {
        for (aside, order) in asides.kept.iter().flatten().zip(self.orders..) {
            let Aside { ray, start, part, surfaces, object, absorption, length } = *aside;
            let mut way = Way { ray, start, part, surfaces, ends };
            let arrival = self.follow(&mut way, (object, absorption), bin, &mut Asides::default());
            arrives(Arrival { order, length, medium, ..arrival });
            ends = way.ends;
        }
        ends
    }

    /// Back from the first surface; what goes into glass there stays, what a mirror does not throw back is absorbed.
    fn trace_reflected(
        &self,
        ray: Ray,
        met: &SurfaceHit,
        bin: u32,
        whole: u32,
        arrives: &mut impl FnMut(Arrival),
    ) -> PathEnds {
        let front = self.triangle(met.visible);
        let medium = self.medium(front, bin);
        let normal = -met.hit.facing.signum() * front.interpolated_normal(&met.hit);
        let mirror = front.flags & TRIANGLE_MIRROR != 0;
        let share = if mirror {
            mirror_reflectance(ray.direction, normal, medium.surface)
        } else {
            let eta = if met.hit.facing < 0.0 { medium.index } else { 1.0 / medium.index };
            interface_reflectance(ray.direction, normal, eta, self.rule)
        };
        let back = reflect_at(ray.direction, normal, front, share);
        if back.end != END_LANDED {
            return PathEnds { end: back.end, ..PathEnds::default() };
        }
        let part = flux_part(whole, part_from(back.reflectance));
        let (absorbed, kept_inside) = if mirror { (whole - part, 0) } else { (0, whole - part) };
        let ends = PathEnds { end: END_LANDED, reflected: 0, absorbed, kept_inside };
        let mut way = Way { ray, start: NOTHING, part, surfaces: WAY_START, ends };
        let origin = ray.origin + met.hit.distance * ray.direction;
        way.go_on(origin, back.direction, met, front, WAY_BACK);
        let arrival = self.follow(&mut way, OUTSIDE, bin, &mut Asides::default());
        arrives(Arrival { medium: front.material, ..arrival });
        way.ends
    }

    /// Where light meets what paths begin at, or how it ends.
    pub fn first_surface(&self, ray: Ray) -> Result<SurfaceHit, u32> {
        let sought = |only| Sought { object: NO_OBJECT, start: NOTHING, only };
        let met = self.surfaces.nearest(ray, &sought(0));
        if met.visible == NOTHING || (self.range > 0.0 && met.hit.distance > self.range) {
            return Err(END_MISSED);
        }
        let front = self.triangle(met.visible);
        if front.flags & self.casters == 0 {
            let behind = self.surfaces.nearest(ray, &sought(self.casters));
            let blocks = front.flags & TRIANGLE_REFRACTS == 0 && behind.visible != NOTHING;
            return Err(if blocks { END_BLOCKED } else { END_MISSED });
        }
        Ok(met)
    }

    /// All of a path with the flux `whole`: what it leaves on its way, and its arrivals to `arrives`.
    pub fn trace(&self, ray: Ray, bin: u32, whole: u32, arrives: impl FnMut(Arrival)) -> PathEnds {
        match self.first_surface(ray) {
            Err(end) => PathEnds { end, ..PathEnds::default() },
            Ok(met) => self.trace_from(ray, &met, bin, whole, arrives),
        }
    }

    /// As [`LightPaths::trace`] from the first surface on, which all wavelengths have in common.
    pub fn trace_from(
        &self,
        ray: Ray,
        met: &SurfaceHit,
        bin: u32,
        whole: u32,
        mut arrives: impl FnMut(Arrival),
    ) -> PathEnds {
        let front = self.triangle(met.visible);
        if self.path == PATH_REFLECTED {
            return self.trace_reflected(ray, met, bin, whole, &mut arrives);
        }
        let medium = self.medium(front, bin);
        let normal = -met.hit.facing.signum() * front.interpolated_normal(&met.hit);
        let entering = met.hit.facing < 0.0;
        let eta = if entering { medium.index } else { 1.0 / medium.index };
        let crossing = cross_surface(ray.direction, normal, front, eta, self.rule);
        if crossing.end != END_LANDED {
            return PathEnds { end: crossing.end, ..PathEnds::default() };
        }
        let part = flux_part(whole, part_from(1.0 - crossing.reflectance));
        let ends = PathEnds { end: END_LANDED, reflected: whole - part, absorbed: 0, kept_inside: 0 };
        let mut way = Way { ray, start: NOTHING, part, surfaces: WAY_START, ends };
        way.absorb(medium.surface);
        let origin = ray.origin + met.hit.distance * ray.direction;
        way.go_on(origin, crossing.direction, met, front, WAY_THROUGH);
        if entering {
            let least = (whole / LEAST_SHARE).max(1);
            let mut asides = Asides { room: self.asides, least, ..Asides::default() };
            let ends = self.trace_inside(way, front, bin, whole, &mut asides, &mut arrives);
            return self.follow_asides(&asides, front.material, bin, ends, &mut arrives);
        }
        let arrival = self.follow(&mut way, OUTSIDE, bin, &mut Asides::default());
        arrives(Arrival { medium: front.material, ..arrival });
        way.ends
    }
}
