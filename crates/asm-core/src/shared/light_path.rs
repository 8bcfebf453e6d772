//! Host side of `shaders/shared/light_path.wgsl`: paths of light through the whole scene, by its geometry, from the light through
//! every surface, with reflections inside the first glass, to what each meets last.
//!
//! Where light leaves the first glass after each number of reflections it goes on as an arrival of its own. Behind it, what goes
//! on is chosen, not drawn: through glass what passes, at mirrors and at total reflection what is thrown back. The first few
//! times that this leaves something behind, what is thrown back goes aside, and arrives for itself. Parts are integers and split
//! without a rest, so those of a path's arrivals and ends add up to its flux exactly.

use arrayvec::ArrayVec;
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

/// As the FNV-1a hash goes on.
pub fn way_on(way: u32, number: u32) -> u32 {
    (way ^ number).wrapping_mul(WAY_PRIME)
}

fn way_through(way: u32, t: &Triangle, what: u32) -> u32 {
    way_on(way, 8 * t.face + what)
}

/// Most that [`LightPaths::asides`] may be.
pub const MOST_ASIDES: usize = 2;

/// Those of 7 reflections inside, and what went aside.
const MOST_BRANCHES: usize = 8 + MOST_ASIDES;

/// A part of a path's light: on its way outside the first glass, or where it ended before.
#[derive(Clone, Copy)]
struct Branch {
    order: u32,
    /// Where it ended, and what it met there; none on its way.
    ended: Option<(u32, SurfaceHit)>,
    ray: Ray,
    /// The triangle that the ray starts on, as visibility buffers count.
    start: u32,
    part: u32,
    /// Of all surfaces so far.
    way: u32,
    /// The refractor that it is in, or [`NO_OBJECT`].
    object: u32,
    /// Around it, per working unit.
    absorption: f32,
    /// Inside the first glass, working units.
    length: f32,
}

impl Branch {
    /// Outside all glass.
    fn on_its_way(order: u32, ray: Ray, start: u32, part: u32, way: u32, length: f32) -> Self {
        let (object, absorption) = (NO_OBJECT, 0.0);
        Self { order, ended: None, ray, start, part, way, object, absorption, length }
    }
}

/// Of a path; the first ones leave the first glass, the others went aside behind it.
type Branches = ArrayVec<Branch, MOST_BRANCHES>;

/// Where what goes aside stands among branches, how many do, and not those that have less.
#[derive(Clone, Copy)]
struct Asides {
    first: usize,
    most: usize,
    least: u32,
}

/// Keeps a share of a part; the rest is absorbed.
fn absorb(part: &mut u32, ends: &mut PathEnds, passes: f32) {
    let left = flux_part(*part, part_from(passes));
    ends.absorbed += *part - left;
    *part = left;
}

/// The side of the surface that the ray comes from.
fn normal_towards(t: &Triangle, met: &SurfaceHit) -> Vec3 {
    -met.hit.facing.signum() * t.interpolated_normal(&met.hit)
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

    /// From the first glass, or from the first mirror, or from where it went aside, to where it lands: how it ends, what it meets
    /// there, and by which ray.
    fn follow(
        &self,
        branch: &mut Branch,
        ends: &mut PathEnds,
        bin: u32,
        branches: &mut Branches,
        asides: Asides,
    ) -> (u32, SurfaceHit) {
        for _ in 0..MOST_SURFACES {
            let Branch { ray, object, start, .. } = *branch;
            let met = self.surfaces.nearest(ray, &Sought { object, start, only: 0 });
            if met.visible == NOTHING {
                return (END_ESCAPED, met);
            }
            let t = self.triangle(met.visible);
            let medium = self.medium(t, bin);
            absorb(&mut branch.part, ends, (-branch.absorption * met.hit.distance).exp());
            let normal = normal_towards(t, &met);
            let origin = ray.origin + met.hit.distance * ray.direction;
            let go_on = |branch: &mut Branch, direction, what| {
                branch.ray = Ray { origin, direction };
                branch.start = met.visible;
                branch.way = way_through(branch.way, t, what);
            };
            if t.flags & TRIANGLE_MIRROR != 0 {
                let share = mirror_reflectance(ray.direction, normal, medium.surface);
                let back = reflect_at(ray.direction, normal, t, share);
                if back.end != END_LANDED {
                    return (back.end, met);
                }
                absorb(&mut branch.part, ends, back.reflectance);
                go_on(branch, back.direction, WAY_BACK);
            } else if t.flags & TRIANGLE_REFRACTS != 0 {
                let entering = met.hit.facing < 0.0;
                let eta = if entering { medium.index } else { 1.0 / medium.index };
                let crossing = cross_surface(ray.direction, normal, t, eta, self.rule);
                let back = reflect_at(ray.direction, normal, t, 1.0);
                if crossing.end == END_TOTAL {
                    if back.end != END_LANDED {
                        return (back.end, met);
                    }
                    go_on(branch, back.direction, WAY_BACK);
                } else if crossing.end != END_LANDED {
                    return (crossing.end, met);
                } else {
                    let passed = flux_part(branch.part, part_from(1.0 - crossing.reflectance));
                    let rest = branch.part - passed;
                    let goes = if back.end == END_LANDED { rest } else { 0 };
                    if branches.len() < asides.first + asides.most && goes >= asides.least {
                        let order = self.orders + (branches.len() - asides.first) as u32;
                        let mut aside = Branch { order, part: goes, ..*branch };
                        go_on(&mut aside, back.direction, WAY_BACK);
                        branches.push(aside);
                    } else if object == NO_OBJECT {
                        ends.reflected += rest;
                    } else {
                        ends.kept_inside += rest;
                    }
                    branch.part = passed;
                    absorb(&mut branch.part, ends, medium.surface);
                    go_on(branch, crossing.direction, WAY_THROUGH);
                    (branch.object, branch.absorption) =
                        if entering { (t.object, medium.absorption) } else { (NO_OBJECT, 0.0) };
                }
            } else {
                return (END_LANDED, met);
            }
        }
        (END_NO_EXIT, SurfaceHit::default())
    }

    /// Inside the first glass: what leaves it after each number of reflections is a branch, what is left then stays inside.
    fn trace_inside(
        &self,
        mut inside: Branch,
        front: &Triangle,
        ends: &mut PathEnds,
        bin: u32,
        whole: u32,
        branches: &mut Branches,
    ) {
        let medium = self.medium(front, bin);
        while inside.order < self.orders && inside.part >= whole / LEAST_SHARE {
            let Branch { ray, start, object, .. } = inside;
            let met = self.surfaces.nearest(ray, &Sought { object, start, only: 0 });
            if met.visible == NOTHING {
                let end = if front.flags & TRIANGLE_OPEN != 0 { END_ESCAPED } else { END_NO_EXIT };
                return branches.push(Branch { ended: Some((end, met)), ..inside });
            }
            let t = self.triangle(met.visible);
            inside.length += met.hit.distance;
            let normal = normal_towards(t, &met);
            let origin = ray.origin + met.hit.distance * ray.direction;
            let back = if t.flags & (TRIANGLE_REFRACTS | TRIANGLE_MIRROR) == 0 {
                return branches.push(Branch { ended: Some((END_LANDED, met)), ..inside });
            } else if t.flags & TRIANGLE_MIRROR != 0 {
                let share = mirror_reflectance(ray.direction, normal, self.medium(t, bin).surface);
                let back = reflect_at(ray.direction, normal, t, share);
                absorb(&mut inside.part, ends, back.reflectance);
                back
            } else {
                let crossing = cross_surface(ray.direction, normal, t, 1.0 / medium.index, self.rule);
                if crossing.end == END_LANDED {
                    let mut leaves = flux_part(inside.part, part_from(1.0 - crossing.reflectance));
                    inside.part -= leaves;
                    absorb(&mut leaves, ends, medium.surface);
                    let ray = Ray { origin, direction: crossing.direction };
                    let way = way_through(inside.way, t, WAY_THROUGH);
                    let Branch { order, length, .. } = inside;
                    branches.push(Branch::on_its_way(order, ray, met.visible, leaves, way, length));
                } else if crossing.end != END_TOTAL {
                    return branches.push(Branch { ended: Some((crossing.end, met)), ..inside });
                }
                reflect_at(ray.direction, normal, t, 1.0)
            };
            inside.order += 1;
            if back.end != END_LANDED {
                if inside.order < self.orders {
                    return branches.push(Branch { ended: Some((back.end, met)), ..inside });
                }
                break;
            }
            inside.way = way_through(inside.way, t, WAY_BACK);
            inside.ray = Ray { origin, direction: back.direction };
            inside.start = met.visible;
        }
        ends.kept_inside += inside.part;
    }

    /// Back from the first surface; what goes into glass there stays, what a mirror does not throw back is absorbed.
    fn trace_reflected(
        &self,
        ray: Ray,
        met: &SurfaceHit,
        bin: u32,
        whole: u32,
        branches: &mut Branches,
    ) -> PathEnds {
        let front = self.triangle(met.visible);
        let medium = self.medium(front, bin);
        let normal = normal_towards(front, met);
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
        let origin = ray.origin + met.hit.distance * ray.direction;
        let thrown = Ray { origin, direction: back.direction };
        let way = way_through(WAY_START, front, WAY_BACK);
        branches.push(Branch::on_its_way(0, thrown, met.visible, part, way, 0.0));
        PathEnds { end: END_LANDED, reflected: 0, absorbed, kept_inside }
    }

    /// Through the first surface, into glass or out of it.
    fn trace_refracted(
        &self,
        ray: Ray,
        met: &SurfaceHit,
        bin: u32,
        whole: u32,
        branches: &mut Branches,
    ) -> PathEnds {
        let front = self.triangle(met.visible);
        let medium = self.medium(front, bin);
        let entering = met.hit.facing < 0.0;
        let eta = if entering { medium.index } else { 1.0 / medium.index };
        let crossing = cross_surface(ray.direction, normal_towards(front, met), front, eta, self.rule);
        if crossing.end != END_LANDED {
            return PathEnds { end: crossing.end, ..PathEnds::default() };
        }
        let mut part = flux_part(whole, part_from(1.0 - crossing.reflectance));
        let mut ends = PathEnds { end: END_LANDED, reflected: whole - part, absorbed: 0, kept_inside: 0 };
        absorb(&mut part, &mut ends, medium.surface);
        let origin = ray.origin + met.hit.distance * ray.direction;
        let ray = Ray { origin, direction: crossing.direction };
        let way = way_through(WAY_START, front, WAY_THROUGH);
        let passed = Branch::on_its_way(0, ray, met.visible, part, way, 0.0);
        if entering {
            let inside = Branch { object: front.object, ..passed };
            self.trace_inside(inside, front, &mut ends, bin, whole, branches);
        } else {
            branches.push(passed);
        }
        ends
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
        let mut branches = Branches::new();
        let (mut ends, asides) = if self.path == PATH_REFLECTED {
            (self.trace_reflected(ray, met, bin, whole, &mut branches), 0)
        } else {
            let asides = if met.hit.facing < 0.0 { self.asides as usize } else { 0 };
            (self.trace_refracted(ray, met, bin, whole, &mut branches), asides)
        };
        let first = branches.len();
        let medium = self.triangle(met.visible).material;
        let least = (whole / LEAST_SHARE).max(1);
        let mut i = 0;
        while i < branches.len() {
            let mut branch = branches[i];
            let (end, met) = branch.ended.unwrap_or_else(|| {
                let most = if i < first { asides } else { 0 };
                self.follow(&mut branch, &mut ends, bin, &mut branches, Asides { first, most, least })
            });
            let Branch { order, ray, part, way, length, .. } = branch;
            arrives(Arrival { order, end, ray, met, part, way, length, medium });
            i += 1;
        }
        ends
    }
}
