//! One path of light through the scene, split at every interface.
//!
//! At an interface both the refracted and the reflected part go on, each with its share of the power. Where one share
//! would be weak, chance decides whether it goes on at a strength worth tracing or hands its power to the other, in
//! proportion: no power is made or lost, so every end is accounted for. Wavelengths travel together until a dispersive
//! interface refracts them apart.
//!
//! # How far light is followed
//!
//! * Reflections inside glass: `bounces` in a row; the count starts anew when light enters from outside.
//! * Outside reflections and reflections at mirrors, wherever they are: the first of light that has met nothing always
//!   (layer `reflected`), those of light that has been reflected or refracted before up to `bounces` of them. Reflected
//!   light that enters glass afterwards counts as refracted.
//! * A branch weaker than a cutoff, or deeper than [`MAX_DEPTH`] interfaces, is given up.
//!
//! What is given up is counted as truncated.

use glam::DVec3;

use crate::ledger::{End, Tally};
use crate::medium::Nesting;
use crate::mirror::Mirror;
use crate::optics;
use crate::sobol::Chance;
use crate::spectrum::{LANES, Lane, Lanes};
use crate::tree::{Pending, Ray};
use crate::world::{Hit, Start, StartKind, World};

/// Share of a wavelength's power below which light is not followed: between three and four reflections at glass.
const LIGHT_CUTOFF: f64 = 1e-5;

/// The same for eye rays, where nothing is focused.
const EYE_CUTOFF: f64 = 1e-3;

/// Share of a wavelength's power below which light is not split further: half of what glass reflects of light that
/// comes straight at it.
const LIGHT_SPLIT: f64 = 0.02;

/// Eye rays always split: a pixel has few of them.
const EYE_SPLIT: f64 = 0.0;

/// Interfaces on one path, beside those that the number of bounces calls for.
const MAX_DEPTH: u32 = 64;

/// Which map light belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layer {
    /// Met no glass yet.
    Direct,
    /// Reflected at mirrors or on the outside of glass only.
    Reflected,
    /// Has entered glass.
    Refracted,
}

/// Light arriving at an opaque surface.
pub(crate) struct Landing<'a> {
    pub(crate) hit: &'a Hit,
    /// The refractor whose medium it travelled in.
    pub(crate) medium: Option<u32>,
    pub(crate) layer: Layer,
    /// Flux of the whole path, lumens.
    pub(crate) flux: f64,
    pub(crate) lanes: &'a [Lane],
    /// How many the path started with.
    pub(crate) lanes_of_path: usize,
    /// What is left of each lane, 0 to 1.
    pub(crate) powers: &'a [f64],
}

/// Takes what lands.
pub(crate) trait Sink {
    /// Whether the light is in a map now; otherwise it counts as landed elsewhere.
    fn land(&mut self, landing: &Landing) -> bool;
}

/// A straight piece still to trace.
#[derive(Clone, Copy, Debug)]
struct Branch {
    origin: DVec3,
    direction: DVec3,
    start: Start,
    /// First and one past the last lane.
    lanes: (u8, u8),
    powers: [f64; LANES],
    layer: Layer,
    /// Reflections inside glass since it was entered from vacuum.
    inside: u32,
    /// Further reflections outside glass or at mirrors so far.
    outside: u32,
    depth: u32,
}

impl Branch {
    fn lanes_range(&self) -> std::ops::Range<usize> {
        usize::from(self.lanes.0)..usize::from(self.lanes.1)
    }
}

/// A place where a path meets glass or a mirror.
struct Surface {
    position: DVec3,
    triangle: u32,
    object: u32,
    /// Unit normals on the incident side.
    geometric: DVec3,
    shading: DVec3,
}

impl Surface {
    fn new(world: &World, hit: &Hit) -> Self {
        let face = &world.faces[hit.triangle as usize];
        let side = if hit.front { 1.0 } else { -1.0 };
        Self {
            position: world.position(hit),
            triangle: hit.triangle,
            object: face.object,
            geometric: side * face.normal,
            shading: side * world.shading_normal(hit),
        }
    }

    fn start(&self, kind: StartKind, nesting: Nesting) -> Start {
        Start { triangle: self.triangle, kind, nesting }
    }
}

/// What throws light back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reflector {
    /// Glass that the light is in.
    Inside,
    /// Glass from outside, or a mirror.
    Outside,
}

/// A path at its start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Emission {
    pub(crate) origin: DVec3,
    /// Unit direction of travel.
    pub(crate) direction: DVec3,
    /// Lumens.
    pub(crate) flux: f64,
    /// Refractors around the origin.
    pub(crate) nesting: Nesting,
    /// The refractor or mirror it is meant for: other first hits belong to other emissions. `None` takes any surface.
    pub(crate) target: Option<u32>,
    /// Light ends here, metres from the origin.
    pub(crate) range_m: f64,
    pub(crate) lanes: Lanes,
    pub(crate) chance: Chance,
}

/// How far paths are followed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Reflections inside glass in a row.
    pub(crate) bounces: u32,
    /// Branches weaker than this are given up.
    pub(crate) cutoff: f64,
    /// Branches weaker than this come about by chance.
    pub(crate) split: f64,
    /// Light that enters glass is not followed.
    pub(crate) outside_only: bool,
}

impl Limits {
    /// For light on its way to receivers.
    pub(crate) fn of_light(bounces: u32) -> Self {
        Self { bounces, cutoff: LIGHT_CUTOFF, split: LIGHT_SPLIT, outside_only: false }
    }

    /// For rays from the eye.
    pub(crate) fn of_eye(bounces: u32) -> Self {
        Self { bounces, cutoff: EYE_CUTOFF, split: EYE_SPLIT, outside_only: false }
    }

    /// For light that mirrors and the outside of glass reflect, and nothing else.
    pub(crate) fn of_outside_reflections(bounces: u32) -> Self {
        Self { outside_only: true, ..Self::of_light(bounces) }
    }
}

/// Traces paths and keeps the books.
pub(crate) struct Tracer<'a, S> {
    world: &'a World,
    limits: Limits,
    chance: Chance,
    pending: Pending,
    branches: Vec<Branch>,
    pub(crate) tally: Tally,
    pub(crate) sink: S,
}

impl<'a, S: Sink> Tracer<'a, S> {
    pub(crate) fn new(world: &'a World, limits: Limits, sink: S) -> Self {
        Self {
            world,
            limits,
            chance: Chance::default(),
            pending: Pending::default(),
            branches: Vec::new(),
            tally: Tally::new(limits.bounces),
            sink,
        }
    }

    pub(crate) fn trace(&mut self, emission: &Emission) {
        for lane in &emission.lanes.lanes[..emission.lanes.len] {
            self.tally.emit(lane.lambda_nm, emission.flux * lane.power);
        }
        self.chance = emission.chance;
        let start = Start::free(emission.nesting);
        let mut branch = Branch {
            origin: emission.origin,
            direction: emission.direction,
            start,
            lanes: (0, emission.lanes.len as u8),
            powers: [1.0; LANES],
            layer: Layer::Direct,
            inside: 0,
            outside: 0,
            depth: 0,
        };
        let hit = self.next_hit(&branch);
        let meant = |hit: &Hit| {
            let object = self.world.faces[hit.triangle as usize].object;
            emission.target.is_none_or(|target| target == object) && hit.distance <= emission.range_m
        };
        match hit {
            Some(hit) if meant(&hit) => {
                // A light inside glass has been in glass from the beginning.
                let inside = emission.nesting.medium().is_some();
                if inside {
                    branch.layer = Layer::Refracted;
                }
                match inside && self.limits.outside_only {
                    true => self.truncate(emission, &branch),
                    false => self.interact(emission, branch, &hit),
                }
            }
            _ => self.end(emission, &branch, End::Passed),
        }
        while let Some(branch) = self.branches.pop() {
            match self.next_hit(&branch) {
                Some(hit) => self.interact(emission, branch, &hit),
                None => {
                    self.tally.counts.misses += 1;
                    let end = if branch.layer == Layer::Refracted { End::Escaped } else { End::Reflected };
                    self.end(emission, &branch, end);
                }
            }
        }
    }

    fn next_hit(&mut self, branch: &Branch) -> Option<Hit> {
        self.tally.counts.rays += 1;
        self.world.closest(&Ray::new(branch.origin, branch.direction), &branch.start, &mut self.pending)
    }

    fn end(&mut self, emission: &Emission, branch: &Branch, end: End) {
        for l in branch.lanes_range() {
            let lane = &emission.lanes.lanes[l];
            self.tally.end(end, lane.lambda_nm, emission.flux * lane.power * branch.powers[l]);
        }
    }

    fn truncate(&mut self, emission: &Emission, branch: &Branch) {
        self.tally.counts.truncated += 1;
        self.end(emission, branch, End::Truncated);
    }

    /// Multiplies lane `l` by `kept`; the rest is absorbed.
    fn absorb(&mut self, emission: &Emission, branch: &mut Branch, l: usize, kept: f64) {
        let lane = &emission.lanes.lanes[l];
        let before = branch.powers[l];
        branch.powers[l] = before * kept;
        self.tally.end(
            End::Absorbed,
            lane.lambda_nm,
            emission.flux * lane.power * (before - branch.powers[l]),
        );
    }

    fn interact(&mut self, emission: &Emission, mut branch: Branch, hit: &Hit) {
        if let Some(medium) = self.world.medium(branch.start.nesting.medium()).filter(|m| m.absorbs()) {
            for l in branch.lanes_range() {
                let kept = medium.transmittance(emission.lanes.lanes[l].lambda_nm, hit.distance.max(0.0));
                self.absorb(emission, &mut branch, l, kept);
            }
        }
        let object = self.world.faces[hit.triangle as usize].object;
        let mirror = self.world.mirrors[object as usize];
        if self.world.medium(Some(object)).is_none() && mirror.is_none() {
            self.land(emission, &branch, hit);
            return;
        }
        if branch.depth >= MAX_DEPTH + 4 * self.limits.bounces {
            self.truncate(emission, &branch);
            return;
        }
        branch.depth += 1;
        let surface = Surface::new(self.world, hit);
        if let Some(mirror) = mirror {
            self.mirror(emission, branch, &surface, &mirror);
            return;
        }
        let mut around = branch.start.nesting;
        let (from, to) = if hit.front {
            (around.medium(), around.entered(object))
        } else {
            // Light that meets the back of a surface it never entered has been behind it all the time.
            if !around.contains(object) {
                around = around.entered(object).unwrap_or(around);
                branch.start.nesting = around;
            }
            (around.medium(), Some(around.left(object)))
        };
        let Some(to) = to else {
            self.tally.counts.too_nested += 1;
            self.end(emission, &branch, End::TooNested);
            return;
        };
        self.cross(emission, &branch, &surface, from, to);
    }

    /// Throws a branch back at a mirror, which keeps the rest.
    fn mirror(&mut self, emission: &Emission, mut branch: Branch, surface: &Surface, mirror: &Mirror) {
        let cos_i = -branch.direction.dot(surface.shading);
        if cos_i <= 0.0 {
            self.lose_wrong_side(emission, &branch);
            return;
        }
        for l in branch.lanes_range() {
            let kept = mirror.reflectance(emission.lanes.lanes[l].lambda_nm, cos_i);
            self.absorb(emission, &mut branch, l, kept);
        }
        self.reflect(emission, branch, surface, Reflector::Outside);
    }

    /// Splits a branch at a refractor's surface, on its way `from` one medium `to` what is around it then.
    fn cross(
        &mut self,
        emission: &Emission,
        branch: &Branch,
        surface: &Surface,
        from: Option<u32>,
        to: Nesting,
    ) {
        let (first, last) = branch.lanes;
        let media = [from, to.medium()].map(|object| self.world.medium(object));
        let dispersive = media.iter().flatten().any(|m| m.dispersive);
        // Wavelengths that bend alike stay together.
        let together = if dispersive { 1 } else { last - first };
        let cos_i = -branch.direction.dot(surface.shading);
        let mut reflected = Branch { powers: [0.0; LANES], ..*branch };
        let mut refracted = Branch {
            start: surface.start(StartKind::Refracted, to),
            origin: surface.position,
            layer: Layer::Refracted,
            inside: if from.is_none() { 0 } else { branch.inside },
            ..*branch
        };
        let mut directions = [branch.direction; LANES];
        for group in (first..last).step_by(usize::from(together)) {
            let lambda_nm = emission.lanes.lanes[usize::from(group)].lambda_nm;
            let [n_from, n_to] = media.map(|m| m.map_or(1.0, |m| m.ior(lambda_nm)));
            // No step in the index is no interface, however the smooth normal leans.
            if n_from == n_to {
                continue;
            }
            let lanes = usize::from(group)..usize::from(group + together);
            if cos_i <= 0.0 {
                self.lose_wrong_side(emission, &Branch { lanes: (group, group + together), ..*branch });
                refracted.powers[lanes].fill(0.0);
                continue;
            }
            let eta = n_from / n_to;
            let at = optics::interface(cos_i, eta);
            if at.cos_t > 0.0 {
                directions[usize::from(group)] =
                    optics::refract(branch.direction, surface.shading, cos_i, eta, at.cos_t);
            } else {
                self.tally.counts.total_reflections += u64::from(together);
            }
            for l in lanes {
                reflected.powers[l] = branch.powers[l] * at.reflectance;
                refracted.powers[l] = branch.powers[l] - reflected.powers[l];
            }
        }
        let reflector = if from.is_none() { Reflector::Outside } else { Reflector::Inside };
        if self.limits.outside_only {
            self.end(emission, &refracted, End::Truncated);
            self.reflect(emission, reflected, surface, reflector);
            return;
        }
        self.thin_out(&mut reflected, &mut refracted);
        for group in (first..last).step_by(usize::from(together)) {
            refracted.lanes = (group, group + together);
            if refracted.lanes_range().any(|l| refracted.powers[l] > 0.0) {
                refracted.direction = directions[usize::from(group)];
                self.go_through(emission, refracted, surface);
            }
        }
        self.reflect(emission, reflected, surface, reflector);
    }

    /// Leaves it to chance whether the weaker of two branches goes on, if it is too weak to be worth it: then at the
    /// strength that is, or else not at all; the stronger takes or gives the difference. Each keeps its mean power.
    fn thin_out(&mut self, reflected: &mut Branch, refracted: &mut Branch) {
        let lanes = reflected.lanes_range();
        let sum = |branch: &Branch| branch.powers[lanes.clone()].iter().sum::<f64>();
        let (weak, strong) =
            if sum(reflected) <= sum(refracted) { (reflected, refracted) } else { (refracted, reflected) };
        // Lanes share their fate, so that those of a mirror image stay together.
        let mut probability = 0.0_f64;
        for l in lanes.clone().filter(|&l| weak.powers[l] > 0.0) {
            let whole = weak.powers[l] + strong.powers[l];
            probability = probability.max(weak.powers[l] / whole.min(self.limits.split));
        }
        if probability == 0.0 || probability >= 1.0 {
            return;
        }
        let goes_on = self.chance.next() < probability;
        for l in lanes {
            let whole = weak.powers[l] + strong.powers[l];
            weak.powers[l] = if goes_on { (weak.powers[l] / probability).min(whole) } else { 0.0 };
            strong.powers[l] = whole - weak.powers[l];
        }
    }

    fn go_through(&mut self, emission: &Emission, mut refracted: Branch, surface: &Surface) {
        if refracted.direction.dot(surface.geometric) >= 0.0 {
            self.lose_wrong_side(emission, &refracted);
            return;
        }
        if let Some(medium) = self.world.medium(Some(surface.object)).filter(|m| m.tints()) {
            for l in refracted.lanes_range() {
                let kept = medium.surface_transmittance(emission.lanes.lanes[l].lambda_nm);
                self.absorb(emission, &mut refracted, l, kept);
            }
        }
        self.follow(emission, refracted);
    }

    fn reflect(&mut self, emission: &Emission, mut branch: Branch, surface: &Surface, reflector: Reflector) {
        if branch.lanes_range().all(|l| branch.powers[l] == 0.0) {
            return;
        }
        let cos_i = -branch.direction.dot(surface.shading);
        branch.direction = optics::reflect(branch.direction, surface.shading, cos_i);
        branch.origin = surface.position;
        if branch.direction.dot(surface.geometric) <= 0.0 {
            self.lose_wrong_side(emission, &branch);
            return;
        }
        branch.start = surface.start(StartKind::Reflected, branch.start.nesting);
        let followed = match (reflector, branch.layer) {
            (Reflector::Outside, Layer::Direct) => {
                branch.layer = Layer::Reflected;
                true
            }
            (Reflector::Outside, _) => {
                branch.outside += 1;
                branch.outside <= self.limits.bounces
            }
            (Reflector::Inside, _) => {
                branch.layer = Layer::Refracted;
                branch.inside += 1;
                branch.inside <= self.limits.bounces
            }
        };
        if followed {
            self.follow(emission, branch);
        } else {
            self.truncate(emission, &branch);
        }
    }

    fn follow(&mut self, emission: &Emission, branch: Branch) {
        if branch.lanes_range().any(|l| branch.powers[l] >= self.limits.cutoff) {
            self.branches.push(branch);
        } else if branch.lanes_range().any(|l| branch.powers[l] > 0.0) {
            self.truncate(emission, &branch);
        }
    }

    fn lose_wrong_side(&mut self, emission: &Emission, branch: &Branch) {
        self.tally.counts.wrong_side += 1;
        self.end(emission, branch, End::WrongSide);
    }

    fn land(&mut self, emission: &Emission, branch: &Branch, hit: &Hit) {
        let lanes = branch.lanes_range();
        let landing = Landing {
            hit,
            medium: branch.start.nesting.medium(),
            layer: branch.layer,
            flux: emission.flux,
            lanes: &emission.lanes.lanes[lanes.clone()],
            lanes_of_path: emission.lanes.len,
            powers: &branch.powers[lanes],
        };
        let mapped = self.sink.land(&landing);
        self.end(emission, branch, if mapped { End::Landed } else { End::LandedElsewhere });
        if mapped && branch.layer == Layer::Refracted {
            let y: f64 = landing.lanes.iter().zip(landing.powers).map(|(lane, p)| lane.xyz[1] * p).sum();
            let slot = &mut self.tally.by_reflections;
            let at = (branch.inside as usize).min(slot.len() - 1);
            slot[at] += y * emission.flux;
        }
    }
}
