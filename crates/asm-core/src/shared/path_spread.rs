//! Host side of `shaders/shared/path_spread.wgsl`: what a path does at other nodes than the middle one, as told by how wavelengths go
//! apart at corners around it.

use glam::{Vec2, Vec4};

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
    pub at: Vec2,
}

/// Of what a path lands off the plane through those around, its nodes land apart by so much at most: dispersion of dense flint.
const MOST_DISPERSION: f32 = 1.0 / 16.0;

/// Between corners around, what changes from one to another is off by so much of that at most: a parabola that begins or ends level.
const MOST_BETWEEN: f32 = 0.25;

/// Flux that changes more from one corner around to another, as a share of a path's, is not told.
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
        let [upper, lower] = [0, 2].map(|i| values[i].lerp(values[i + 1], self.at.x));
        upper.lerp(lower, self.at.y)
    }

    /// From the middle node's landing to another's, where light goes one way around at both, and changes so little that this is known
    /// between the corners.
    fn spread(
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
    /// view. `landings` has node x order, `ends` nodes; those of the middle one are given, and the other's are written if this is true.
    pub fn tell_path(
        &self,
        landings: &mut [PathLanding],
        ends: &mut [PathEnds],
        node: usize,
        tolerance: f32,
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
        for order in 0..orders {
            let around = self.corners.map(|c| [middle, node].map(|node| &c.landings[node * orders + order]));
            let own = landings[middle * orders + order];
            let Some(apart) = self.spread(&own, around, tolerance) else { return false };
            landings[node * orders + order] = PathLanding {
                texel: own.texel + apart.truncate().truncate(),
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

    /// What is told at (0.25, 0.5) between four corners, of which the lower right one spreads otherwise and goes another way.
    fn told(last_spread: f32, last_way: u32, own_end: u32) -> Option<(PathLanding, PathEnds)> {
        let places = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE];
        let around: Vec<_> = places
            .iter()
            .map(|at| if *at == Vec2::ONE { paths(*at, last_spread, last_way) } else { paths(*at, 1.0, 7) })
            .collect();
        let corners = std::array::from_fn(|i| CornerPaths { landings: &around[i].0, ends: &around[i].1 });
        let at = Vec2::new(0.25, 0.5);
        let (mut landings, mut ends) = paths(at, 0.0, 7);
        ends[MIDDLE].end = own_end;
        (landings[2], ends[2]) = Default::default();
        Around { corners, at }.tell_path(&mut landings, &mut ends, 2, 0.1).then_some((landings[2], ends[2]))
    }

    #[test]
    fn what_changes_evenly_is_told() {
        let (landing, ends) = told(1.0, 7, END_LANDED).unwrap();
        assert_eq!((landing.texel, landing.length), (Vec2::new(3.5, 5.0), 3.0));
        assert_eq!((landing.way, landing.end), (7, END_LANDED));
        let part = (WHOLE / 2 - WHOLE / 64) as f32;
        assert!((landing.part as f32 - part).abs() <= 1e-6 * part, "{}", landing.part);
        assert_eq!(ends.absorbed, WHOLE / 4);
        assert_eq!(landing.part + ends.reflected + ends.absorbed + ends.kept_inside, WHOLE, "all of it");
        // A little more at one corner is a little more here: an eighth of it.
        let more = told(1.25, 7, END_LANDED).unwrap().0;
        assert!((more.texel.x - (3.5 + 0.25 / 8.0)).abs() < 1e-5, "{}", more.texel);
    }

    #[test]
    fn what_goes_apart_is_not_told() {
        assert_eq!(told(1.0, 8, END_LANDED), None, "another way");
        assert_eq!(told(1.5, 7, END_LANDED), None, "half a texel more");
        assert_eq!(told(1.0, 7, END_ESCAPED), None, "own light ends elsewhere");
    }

    #[test]
    fn light_that_meets_no_glass_has_no_wavelengths() {
        let (landing, ends) = told(9.0, 8, END_BLOCKED).unwrap();
        assert_eq!((landing, ends.end), (paths(Vec2::new(0.25, 0.5), 0.0, 7).0[MIDDLE], END_BLOCKED));
    }
}
