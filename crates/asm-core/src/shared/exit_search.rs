//! Host side of `shaders/shared/exit_search.wgsl`: where a ray inside a refractor leaves it, from what a view shows of its
//! faces.

use glam::UVec2;

use super::triangle::{PlaneHit, SAME_SURFACE, Triangle};
use super::view::{Ray, View};

/// Where a ray crosses a triangle's plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exit {
    /// The crossing is in the triangle, not only in its plane.
    pub contained: bool,
    /// Index.
    pub triangle: u32,
    /// The crossing.
    pub hit: PlaneHit,
}

/// How far a search has come.
#[derive(Clone, Copy, Debug)]
pub struct ExitSearch {
    best: Option<Exit>,
    done: bool,
    /// The guess.
    distance: f32,
    /// The ray was seen inside here.
    inner: f32,
    /// And outside here.
    outer: f32,
}

/// The ray that a search follows, and the refractor that it is in.
#[derive(Clone, Copy)]
pub struct Inside<'a> {
    /// All triangles.
    pub triangles: &'a [Triangle],
    /// From a face of the refractor.
    pub ray: Ray,
    /// The refractor.
    pub object: u32,
    /// 1 in a body, [`EXIT_OF_BODY`]; -1 in what a hollow one encloses, as is light that a ring throws inwards.
    pub side: f32,
}

/// The ray is in the body.
pub const EXIT_OF_BODY: f32 = 1.0;

impl Inside<'_> {
    /// The crossing of a face that the ray can leave by, `facing` above 0 there whatever the ray is in. A ray that starts on a
    /// face starts up to [`SAME_SURFACE`] beside it, and does not leave by it.
    fn exit_hit(&self, visible: u32) -> PlaneHit {
        let triangle = visible.checked_sub(1).map(|index| &self.triangles[index as usize]);
        let Some(triangle) = triangle.filter(|t| t.object == self.object) else { return PlaneHit::default() };
        let hit = triangle.plane_hit(self.ray);
        let facing = hit.facing * self.side;
        PlaneHit { crosses: hit.crosses && facing > 0.0 && hit.distance > SAME_SURFACE, facing, ..hit }
    }

    /// Where the ray leaves, no farther than `reach`, after at most so many looks at what `view` shows: `shown` loads it. The
    /// loop that passes have in WGSL, where each loads from its own texture.
    pub fn find_exit(
        &self,
        view: &View,
        reach: f32,
        iterations: u32,
        shown: impl Fn(UVec2) -> u32,
    ) -> Option<Exit> {
        let texel = |distance: f32| view.texel(self.ray.origin + distance * self.ray.direction);
        let mut search = ExitSearch::new(reach);
        for _ in 0..iterations {
            if search.done {
                break;
            }
            search.step(shown(texel(search.distance)), self);
        }
        if let Some(crossing) = search.best.filter(|best| !best.hit.well_inside()) {
            let middle = texel(crossing.hit.distance);
            for side in 0..8 {
                search.look_beside(shown(view.texel_beside(middle, side)), self);
            }
        }
        search.best
    }
}

impl ExitSearch {
    /// No way out is longer than `reach`.
    pub fn new(reach: f32) -> Self {
        Self { best: None, done: false, distance: 0.0, inner: 0.0, outer: reach }
    }

    /// `visible` is what the view shows at the guess.
    pub fn step(&mut self, visible: u32, inside: &Inside<'_>) {
        let hit = inside.exit_hit(visible);
        if hit.crosses {
            let contained = hit.inside();
            self.done = contained || (hit.distance - self.distance).abs() <= SAME_SURFACE;
            if self.done || self.best.is_none_or(|best| hit.distance < best.hit.distance) {
                self.best = Some(Exit { contained, triangle: visible - 1, hit });
            }
            if self.done {
                self.distance = hit.distance;
                return;
            }
        }
        // Behind the plane of a face of the body, or where the view shows none of it, a guess is outside.
        if hit.facing * (self.distance - hit.distance) < 0.0 {
            self.inner = self.distance;
        } else if self.distance > 0.0 {
            self.outer = self.distance;
        }
        let between = hit.crosses && hit.distance > self.inner && hit.distance < self.outer;
        self.distance = if between { hit.distance } else { 0.5 * (self.inner + self.outer) };
    }

    /// `visible` is what the view shows beside the crossing, which may be another triangle's round about: rounding chooses between
    /// those that meet in an edge, and a line of photons may follow one.
    pub fn look_beside(&mut self, visible: u32, inside: &Inside<'_>) {
        let hit = inside.exit_hit(visible);
        if let Some(best) = &mut self.best
            && hit.crosses
            && hit.is_preferred(visible - 1, &best.hit, best.triangle)
        {
            *best = Exit { contained: true, triangle: visible - 1, hit };
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use glam::{UVec2, Vec2, Vec3};

    use super::*;
    use crate::shared::view::View;

    fn tilted(x: f32, y: f32) -> Vec3 {
        Vec3::new(x, y, -1.0 + 0.37 * x - 0.21 * y)
    }

    /// Two triangles of a facet one unit down the ray, tilted so that f32 distances along one ray differ in the last digits.
    fn facet() -> [Triangle; 2] {
        let triangle = |a: [f32; 2], b: [f32; 2], c: [f32; 2]| Triangle {
            p0: tilted(a[0], a[1]),
            p1: tilted(b[0], b[1]),
            p2: tilted(c[0], c[1]),
            ..Triangle::default()
        };
        // Clockwise from above: the facet faces down, away from the ray's origin.
        let lower = triangle([-0.7, -0.7], [0.9, 0.8], [0.9, -0.7]);
        let upper = triangle([-0.7, -0.7], [-0.7, 0.8], [0.9, 0.8]);
        [lower, upper]
    }

    fn from_above() -> View {
        View {
            eye: Vec3::Z,
            perspective: 0,
            right: Vec3::X,
            near: 0.0,
            up: Vec3::Y,
            far: 3.0,
            forward: Vec3::NEG_Z,
            reserved: 0.0,
            slope_center: Vec2::ZERO,
            slope_half: Vec2::ONE,
            size: UVec2::splat(64),
            texel_slope: Vec2::splat(2.0 / 64.0),
        }
    }

    #[test]
    fn the_exit_does_not_hang_on_which_of_the_triangles_round_an_edge_a_texel_shows() {
        let triangles = facet();
        let view = from_above();
        let mut on_edge = 0;
        for i in 0..200 {
            // Along the common edge, and up to the fourth part of a texel beside it.
            let t = -0.6 + 0.007 * i as f32;
            let beside = [0.0, 1e-5, -1e-5, 5e-3, -5e-3][i % 5];
            let y = -0.7 + (t + 0.7) * 1.5 / 1.6 + beside;
            let direction = Vec3::new(0.1, 0.2, -1.0).normalize();
            let ray = Ray { origin: tilted(t, y) - 1.3 * direction, direction };
            let inside = Inside { triangles: &triangles, ray, object: 0, side: EXIT_OF_BODY };
            let exits = [1, 2].map(|at_first| {
                // The guess's texel shows either, the texels round about both.
                let looks = Cell::new(0);
                let shown = |_| {
                    looks.set(looks.get() + 1);
                    if looks.get() <= 2 { at_first } else { 1 + looks.get() % 2 }
                };
                inside.find_exit(&view, 3.0, 8, shown).unwrap()
            });
            assert_eq!(exits[0], exits[1], "{ray:?}");
            assert!(exits[0].contained, "{ray:?}: {exits:?}");
            on_edge += u32::from(!exits[0].hit.well_inside());
        }
        assert!(on_edge > 20, "{on_edge} crossings on the edge");
    }
}
