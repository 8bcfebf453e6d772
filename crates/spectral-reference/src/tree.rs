//! Bounding volume hierarchy: the library `obvhs` finds the tree (PLOC with reinsertion), this module walks it.
//!
//! The walk is ours because the library's leaves out boxes nearer than 1e-4: here nothing depends on the scene's scale.
//! Nodes are four wide, which measured 1.5 times as fast as two wide, and f32, half the memory of f64: boxes are
//! rounded outwards and rays are widened by what f32 rounds, so no box is missed that f64 would meet; triangles are met
//! in f64. f32 is finest around the origin, so that of the tree lies in the middle of the glass.

use glam::{DVec3, Vec3, Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

const WIDTH: usize = 4;
/// Leaves hold up to this many triangles, where that is cheaper by the surface area heuristic.
const LEAF_TRIANGLES: u32 = 2;
/// Share of nodes that the builder tries to reinsert elsewhere.
const REINSERTION: f32 = 0.05;

/// Two lines of a processor's cache.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Node {
    /// Per axis the lower, then the upper bounds of the children, in the tree's units; an unused child is an empty box.
    bounds: [[Vec4; 2]; 3],
    /// A node, or the first triangle of a leaf.
    first: [u32; WIDTH],
    /// Triangles of a leaf; 0 for a node.
    count: [u8; WIDTH],
}

const EMPTY_NODE: Node =
    Node { bounds: [[Vec4::INFINITY, Vec4::NEG_INFINITY]; 3], first: [0; WIDTH], count: [0; WIDTH] };

/// A ray with what every box and triangle needs of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    /// World space, metres.
    pub(crate) origin: DVec3,
    /// Unit length, so distances along it are metres.
    pub(crate) direction: DVec3,
}

impl Ray {
    pub(crate) fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction }
    }
}

/// Nodes still to visit, kept between rays to save the allocation.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pending(Vec<Entry>);

#[derive(Clone, Copy, Debug)]
struct Entry {
    first: u32,
    count: u32,
    /// Not farther than the box, in the tree's units.
    distance: f32,
}

/// More than the four roundings of a distance to a box (ray, difference, inverse, product) and the one of a limit.
const ROUNDING: f32 = 16.0 * f32::EPSILON;

#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// Where the tree's coordinates are 0, metres.
    centre: DVec3,
    /// The tree's units per metre.
    per_m: f64,
}

impl Tree {
    /// The tree over triangles and the order in which it wants them: leaves are ranges of that order. Boxes are
    /// `slack_m` wider than their triangles, and finest within the bounds `focus`.
    pub(crate) fn build(triangles: &[[DVec3; 3]], focus: (DVec3, DVec3), slack_m: f64) -> (Self, Vec<u32>) {
        if triangles.is_empty() {
            return (Self::default(), Vec::new());
        }
        let centre = 0.5 * (focus.0 + focus.1);
        let per_m = 1.0 / (focus.1 - focus.0).max_element().max(slack_m).max(f64::MIN_POSITIVE);
        // Only the tree's shape depends on these boxes.
        let boxes: Vec<Aabb> = triangles
            .iter()
            .map(|corners| {
                let [a, b, c] = corners.map(|p| Vec3A::from(((p - centre) * per_m).as_vec3()));
                Aabb::new(a.min(b).min(c), a.max(b).max(c))
            })
            .collect();
        let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            &boxes,
            (0..boxes.len() as u32).collect(),
            SortPrecision::U64,
            3,
        );
        let mut optimizer = ReinsertionOptimizer::default();
        optimizer.run(&mut binary, REINSERTION, None);
        collapse(&mut binary, LEAF_TRIANGLES, 1.0);
        optimizer.run(&mut binary, 2.0 * REINSERTION, None);

        let order = binary.primitive_indices.clone();
        let exact = exact_boxes(&binary, triangles);
        let mut tree = Self { nodes: Vec::with_capacity(binary.nodes.len() / 2 + 1), centre, per_m };
        tree.widen(&binary, &exact, slack_m);
        (tree, order)
    }

    /// Turns the binary tree into four-wide nodes, parents before children.
    fn widen(&mut self, binary: &Bvh2, exact: &[(DVec3, DVec3)], slack_m: f64) {
        let mut waiting = vec![(0_usize, None::<(usize, usize)>)];
        while let Some((from, parent)) = waiting.pop() {
            let id = self.nodes.len();
            self.nodes.push(EMPTY_NODE);
            if let Some((parent, slot)) = parent {
                self.nodes[parent].first[slot] = id as u32;
            }
            let mut children = vec![from];
            // The largest inner child is opened until four are there.
            while children.len() < WIDTH {
                let area = |&i: &usize| {
                    let e = exact[i].1 - exact[i].0;
                    e.x * e.y + e.y * e.z + e.z * e.x
                };
                let Some(at) = (0..children.len())
                    .filter(|&k| !binary.nodes[children[k]].is_leaf())
                    .max_by(|&j, &k| area(&children[j]).total_cmp(&area(&children[k])))
                else {
                    break;
                };
                let first = binary.nodes[children[at]].first_index as usize;
                children[at] = first;
                children.push(first + 1);
            }
            for (slot, &child) in children.iter().enumerate() {
                let local = |p: DVec3| ((p - self.centre) * self.per_m).as_vec3();
                let lower = local(exact[child].0 - slack_m).to_array().map(f32::next_down);
                let upper = local(exact[child].1 + slack_m).to_array().map(f32::next_up);
                let node = &mut self.nodes[id];
                for axis in 0..3 {
                    node.bounds[axis][0][slot] = lower[axis];
                    node.bounds[axis][1][slot] = upper[axis];
                }
                let source = &binary.nodes[child];
                if source.is_leaf() {
                    node.first[slot] = source.first_index;
                    // At most LEAF_TRIANGLES.
                    node.count[slot] = source.prim_count as u8;
                } else {
                    waiting.push((child, Some((id, slot))));
                }
            }
        }
    }

    /// Shows the ranges of triangles that the ray may meet between -`slack` and `limit`, metres, roughly from near to
    /// far. `visit` gets a range and the limit and returns the new limit. `slack` is at most that of the boxes.
    #[inline]
    pub(crate) fn walk(
        &self,
        ray: &Ray,
        slack: f64,
        mut limit: f64,
        pending: &mut Pending,
        mut visit: impl FnMut(std::ops::Range<usize>, f64) -> f64,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        let stack = &mut pending.0;
        stack.clear();
        let reach = |limit: f64| (limit * self.per_m) as f32 * (1.0 + ROUNDING);
        let slack = reach(slack);
        let mut farthest = reach(limit);
        let origin = ((ray.origin - self.centre) * self.per_m).as_vec3();
        let inverse = ray.direction.recip().as_vec3();
        // The true origin lies between: boxes are entered from the one and left from the other.
        let off = origin.abs() * (4.0 * f32::EPSILON) * Vec3::ONE.copysign(inverse);
        let (ahead, behind) = (origin + off, origin - off);
        let axis = |k: usize| {
            (
                usize::from(inverse[k] < 0.0),
                Vec4::splat(ahead[k]),
                Vec4::splat(behind[k]),
                Vec4::splat(inverse[k]),
            )
        };
        let axes = [axis(0), axis(1), axis(2)];
        let mut current = Entry { first: 0, count: 0, distance: -slack };
        loop {
            if current.count > 0 {
                let first = current.first as usize;
                limit = visit(first..first + current.count as usize, limit);
                farthest = reach(limit);
            } else {
                let node = &self.nodes[current.first as usize];
                let mut enter = Vec4::splat(-slack);
                let mut leave = Vec4::splat(farthest);
                for (bounds, &(backward, ahead, behind, inverse)) in node.bounds.iter().zip(&axes) {
                    // NaN, from 0 times infinity, restricts nothing: then the second operand is what remains.
                    enter = ((bounds[backward] - ahead) * inverse).max(enter);
                    leave = ((bounds[1 - backward] - behind) * inverse).min(leave);
                }
                let mut met = enter.cmple(leave * (1.0 + ROUNDING) + slack).bitmask();
                let distances = enter.to_array();
                let base = stack.len();
                while met != 0 {
                    let slot = met.trailing_zeros() as usize;
                    met &= met - 1;
                    let entry = Entry {
                        first: node.first[slot],
                        count: u32::from(node.count[slot]),
                        distance: distances[slot],
                    };
                    let mut at = stack.len();
                    stack.push(entry);
                    while at > base && stack[at - 1].distance < entry.distance {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                    stack[at] = entry;
                }
            }
            loop {
                let Some(entry) = stack.pop() else { return };
                if entry.distance <= farthest {
                    current = entry;
                    break;
                }
            }
        }
    }
}

/// Boxes of the binary tree's nodes in f64.
fn exact_boxes(binary: &Bvh2, triangles: &[[DVec3; 3]]) -> Vec<(DVec3, DVec3)> {
    let mut parents_first = vec![0_usize];
    let mut next = 0;
    while next < parents_first.len() {
        let node = &binary.nodes[parents_first[next]];
        if !node.is_leaf() {
            parents_first.extend([node.first_index as usize, node.first_index as usize + 1]);
        }
        next += 1;
    }
    let mut boxes = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); binary.nodes.len()];
    for &id in parents_first.iter().rev() {
        let node = &binary.nodes[id];
        let first = node.first_index as usize;
        boxes[id] = if node.is_leaf() {
            binary.primitive_indices[first..first + node.prim_count as usize]
                .iter()
                .flat_map(|&t| triangles[t as usize])
                .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)))
        } else {
            let (left, right) = (boxes[first], boxes[first + 1]);
            (left.0.min(right.0), left.1.max(right.1))
        };
    }
    boxes
}
