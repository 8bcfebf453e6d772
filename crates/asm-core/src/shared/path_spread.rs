//! Host side of `shaders/shared/path_spread.wgsl`: what a path does at other nodes than the middle one, as told by how wavelengths go
//! apart at corners around it.

use glam::{UVec2, Vec2, Vec4};

use super::flux::WHOLE;
use super::footprint::{PathEnds, PathLanding, middle_node};
use super::ledger::{END_BLOCKED, END_LANDED, END_MISSED};

/// The paths of a corner.
#[derive(Clone, Copy)]
pub struct CornerPaths<'a> {
    /// Node x order.
    pub landings: &'a [PathLanding],
    /// Of nodes.
    pub ends: &'a [PathEnds],
}

impl<'a> CornerPaths<'a> {
    /// Of one among others: corner x node x order, and corner x node.
    pub fn of(
        landings: &'a [PathLanding],
        ends: &'a [PathEnds],
        corner: usize,
        nodes: usize,
        orders: usize,
    ) -> Self {
        let paths = corner * nodes..(corner + 1) * nodes;
        Self { landings: &landings[paths.start * orders..paths.end * orders], ends: &ends[paths] }
    }
}

/// Corners around one, and where it lies between them.
#[derive(Clone, Copy)]
pub struct Around<'a> {
    /// Upper left, upper right, lower left, lower right.
    pub corners: [CornerPaths<'a>; 4],
    /// In x and y, 0 to 1.
    pub weight: Vec2,
}

/// Of what a path lands off the plane through those around, its nodes land apart by so much at most: dispersion of dense flint.
const MOST_DISPERSION: f32 = 1.0 / 16.0;

/// Between corners around, what changes from one to another is off by so much of that at most: a parabola that begins or ends level.
const MOST_BETWEEN: f32 = 0.25;

/// Flux is not told where what lies between its nodes changes more from one corner around to another, as a share of a path's.
const MOST_UNEVEN: f32 = 1.0 / 128.0;

/// From one part to another, as a share of the whole.
fn share_apart(a: u32, b: u32) -> f32 {
    b.wrapping_sub(a) as i32 as f32 / WHOLE as f32
}

/// From one node's landing to another's: texels in x and y, share of the flux, length inside.
fn apart_of(a: &PathLanding, b: &PathLanding) -> Vec4 {
    (b.texel - a.texel).extend(share_apart(a.part, b.part)).extend(b.length - a.length)
}

fn told_part(part: u32, apart: f32, left: &mut u32) -> u32 {
    let told = part.saturating_add_signed((apart * WHOLE as f32) as i32).min(*left);
    *left -= told;
    told
}

impl Around<'_> {
    fn mix(&self, values: [Vec4; 4]) -> Vec4 {
        let [upper, lower] = [0, 2].map(|i| values[i].lerp(values[i + 1], self.weight.x));
        upper.lerp(lower, self.weight.y)
    }

    /// From the middle node's landing to another's, where light goes one way around at both, and changes so little that this is known
    /// between the corners.
    fn shift(
        &self,
        own: &PathLanding,
        landings_around: [[&PathLanding; 2]; 4],
        tolerance: f32,
    ) -> Option<Vec4> {
        if !landings_around.as_flattened().iter().all(|landing| own.goes_with(landing)) {
            return None;
        }
        let apart = landings_around.map(|[a, b]| apart_of(a, b));
        let off = own.texel
            - self.mix(landings_around.map(|[a, _]| a.texel.extend(0.0).extend(0.0))).truncate().truncate();
        let [first, rest @ ..] = apart;
        let (high, low) = rest.iter().fold((first, first), |(high, low), v| (high.max(*v), low.min(*v)));
        let range = high - low;
        let error = (MOST_DISPERSION * off.abs().max_element()).max(MOST_BETWEEN * range.x.max(range.y));
        (error <= tolerance && range.z <= MOST_UNEVEN).then(|| self.mix(apart))
    }

    /// The path of a corner at a node that is not the middle one, if what is around tells it to within a tolerance, texels of the landing
    /// view, whose faces have these sizes. `landings` has node x order, `ends` nodes; those of the middle one are given, and the other's are written if this is true.
    pub fn tell_path(
        &self,
        landings: &mut [PathLanding],
        ends: &mut [PathEnds],
        node: usize,
        tolerance: f32,
        size_of_face: impl Fn(u32) -> UVec2,
    ) -> bool {
        let orders = landings.len() / ends.len();
        let middle = middle_node(ends.len() as u32) as usize;
        let own = ends[middle];
        if own.end == END_MISSED || own.end == END_BLOCKED {
            // No surface has parted the wavelengths.
            landings.copy_within(middle * orders..(middle + 1) * orders, node * orders);
            ends[node] = own;
            return true;
        }
        let ends_around = self.corners.map(|corner| [corner.ends[middle], corner.ends[node]]);
        if own.end != END_LANDED || ends_around.as_flattened().iter().any(|ends| ends.end != END_LANDED) {
            return false;
        }
        // Those written for an order before one that is not known are written again by whoever traces them.
        let mut left = WHOLE;
        // What lands is on the landing view; a path that leaves it ends otherwise.
        let beside_view = |own: &PathLanding, texel: Vec2| {
            let size = size_of_face(own.place & 0xff).as_vec2();
            own.end == END_LANDED && (texel.cmplt(Vec2::ZERO) | texel.cmpge(size)).any()
        };
        for order in 0..orders {
            let around = self.corners.map(|c| [middle, node].map(|node| &c.landings[node * orders + order]));
            let own = landings[middle * orders + order];
            let Some(apart) = self.shift(&own, around, tolerance) else { return false };
            let texel = own.texel + apart.truncate().truncate();
            if beside_view(&own, texel) {
                return false;
            }
            landings[node * orders + order] = PathLanding {
                texel,
                length: own.length + apart.w,
                part: told_part(own.part, apart.z, &mut left),
                ..own
            };
        }
        let apart = self.mix(ends_around.map(|[a, b]| {
            let taken =
                Vec2::new(share_apart(a.absorbed, b.absorbed), share_apart(a.kept_inside, b.kept_inside));
            taken.extend(0.0).extend(0.0)
        }));
        let absorbed = told_part(own.absorbed, apart.x, &mut left);
        let kept_inside = told_part(own.kept_inside, apart.y, &mut left);
        ends[node] = PathEnds { end: END_LANDED, reflected: left, absorbed, kept_inside };
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::ledger::END_ESCAPED;

    const NODES: usize = 3;
    const MIDDLE: usize = 1;

    /// Of a corner at a place: one node goes `spread` to the right of the next, and lets `spread / 64` less through.
    fn paths(at: Vec2, spread: f32, way: u32) -> (Vec<PathLanding>, Vec<PathEnds>) {
        let landing = |node: usize| {
            let steps = node as f32 - MIDDLE as f32;
            let part = (WHOLE / 2).saturating_add_signed((-steps * spread / 64.0 * WHOLE as f32) as i32);
            let texel = 10.0 * at + Vec2::new(steps * spread, 0.0);
            PathLanding { texel, length: 2.0 + steps, part, way, end: END_LANDED, ..PathLanding::default() }
        };
        let landings: Vec<_> = (0..NODES).map(landing).collect();
        let ends = landings.iter().map(|landing| PathEnds {
            end: END_LANDED,
            reflected: 0,
            absorbed: WHOLE / 4,
            kept_inside: WHOLE - WHOLE / 4 - landing.part,
        });
        (landings.clone(), ends.collect())
    }

    const WEIGHT: Vec2 = Vec2::new(0.25, 0.5);

    /// What the last node is told at [`WEIGHT`] between four corners, of which the lower right one is given.
    fn told_by(
        last: (Vec<PathLanding>, Vec<PathEnds>),
        own: (Vec<PathLanding>, Vec<PathEnds>),
    ) -> Option<(PathLanding, PathEnds)> {
        let others = [Vec2::ZERO, Vec2::X, Vec2::Y].map(|at| paths(at, 1.0, 7));
        let around: Vec<_> = others.into_iter().chain([last]).collect();
        let corners = std::array::from_fn(|i| CornerPaths { landings: &around[i].0, ends: &around[i].1 });
        let (mut landings, mut ends) = own;
        (landings[2], ends[2]) = Default::default();
        let around = Around { corners, weight: WEIGHT };
        around
            .tell_path(&mut landings, &mut ends, 2, 0.1, |_| UVec2::splat(11))
            .then_some((landings[2], ends[2]))
    }

    fn own() -> (Vec<PathLanding>, Vec<PathEnds>) {
        paths(WEIGHT, 0.0, 7)
    }

    fn last(spread: f32) -> (Vec<PathLanding>, Vec<PathEnds>) {
        paths(Vec2::ONE, spread, 7)
    }

    #[test]
    fn what_changes_evenly_is_told() {
        let (landing, ends) = told_by(last(1.0), own()).unwrap();
        assert_eq!((landing.texel, landing.length), (Vec2::new(3.5, 5.0), 3.0));
        assert_eq!((landing.way, landing.end), (7, END_LANDED));
        let near = |part: u32, share: f32| (part as f32 / WHOLE as f32 - share).abs() < 1e-6;
        assert!(near(landing.part, 0.5 - 1.0 / 64.0), "{}", landing.part);
        // What is absorbed is the same at all nodes, and more stays inside.
        assert!(ends.absorbed == WHOLE / 4 && near(ends.kept_inside, 0.25 + 1.0 / 64.0), "{ends:?}");
        assert!(near(ends.reflected, 0.0), "{ends:?}");
        // A little more at one corner is a little more here: an eighth of it.
        let more = told_by(last(1.25), own()).unwrap().0;
        assert!((more.texel.x - (3.5 + 0.25 / 8.0)).abs() < 1e-5, "{}", more.texel);
    }

    #[test]
    fn what_goes_apart_is_not_told() {
        assert_eq!(told_by(paths(Vec2::ONE, 1.0, 8), own()), None, "another way");
        assert_eq!(told_by(last(1.5), own()), None, "half a texel more");
        let ends_elsewhere = |mut own: (Vec<PathLanding>, Vec<PathEnds>)| {
            own.1[MIDDLE].end = END_ESCAPED;
            own
        };
        assert_eq!(told_by(last(1.0), ends_elsewhere(own())), None, "own light ends elsewhere");
        let moved = |by: f32| {
            let mut own = own();
            own.0[MIDDLE].texel.x += by;
            own
        };
        assert!(told_by(last(1.0), moved(1.5)).is_some());
        assert_eq!(told_by(last(1.0), moved(1.7)), None, "off what lies around");
        let mut uneven = last(1.0);
        uneven.0[2].part -= WHOLE / 100;
        assert_eq!(told_by(uneven, own()), None, "flux that changes by more than a 128th");
        assert_eq!(told_by(last(1.0), paths(Vec2::new(0.95, 0.5), 0.0, 7)), None, "beside what is seen");
    }

    #[test]
    fn light_that_meets_no_glass_has_no_wavelengths() {
        let mut blocked = own();
        blocked.1[MIDDLE].end = END_BLOCKED;
        let (landing, ends) = told_by(paths(Vec2::ONE, 9.0, 8), blocked).unwrap();
        assert_eq!((landing, ends.end), (own().0[MIDDLE], END_BLOCKED));
    }
}
