//! Bounding volume hierarchy: the library `obvhs` finds the tree (PLOC with reinsertion), this module walks it.
//!
//! The walk is ours because the library's is f32 and leaves out boxes nearer than 1e-4: here boxes are rebuilt
//! exactly in f64 from the triangles, so nothing depends on the scene's scale, and nodes are four wide, which
//! measured 1.5 times as fast as two wide.

use glam::{DVec3, Vec3A};
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

#[derive(Clone, Debug)]
struct Node {
    /// Per axis the lower, then the upper bounds of the children; an unused child is an empty box.
    bounds: [[[f64; WIDTH]; 2]; 3],
    /// A node, or the first triangle of a leaf.
    first: [u32; WIDTH],
    /// Triangles of a leaf; 0 for a node.
    count: [u32; WIDTH],
}

const EMPTY_NODE: Node = Node {
    bounds: [[[f64::INFINITY; WIDTH], [f64::NEG_INFINITY; WIDTH]]; 3],
    first: [0; WIDTH],
    count: [0; WIDTH],
};

/// A ray with what every box and triangle needs of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    /// World space, metres.
    pub(crate) origin: DVec3,
    /// Unit length, so distances along it are metres.
    pub(crate) direction: DVec3,
    inverse: DVec3,
}

impl Ray {
    pub(crate) fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, inverse: direction.recip() }
    }
}

/// Nodes still to visit, kept between rays to save the allocation.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pending(Vec<Entry>);

#[derive(Clone, Copy, Debug)]
struct Entry {
    first: u32,
    count: u32,
    distance: f64,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
}

impl Tree {
    /// The tree over triangles and the order in which it wants them: leaves are ranges of that order.
    pub(crate) fn build(triangles: &[[DVec3; 3]]) -> (Self, Vec<u32>) {
        if triangles.is_empty() {
            return (Self::default(), Vec::new());
        }
        let corners = || triangles.iter().flatten().copied();
        let lo = corners().fold(DVec3::INFINITY, DVec3::min);
        let hi = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        let centre = 0.5 * (lo + hi);
        // Only the tree's shape depends on these f32 boxes.
        let scale = 1.0 / (hi - lo).max_element().max(f64::MIN_POSITIVE);
        let boxes: Vec<Aabb> = triangles
            .iter()
            .map(|corners| {
                let [a, b, c] = corners.map(|p| Vec3A::from(((p - centre) * scale).as_vec3()));
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
        let mut tree = Self { nodes: Vec::with_capacity(binary.nodes.len() / 2 + 1) };
        tree.widen(&binary, &exact);
        (tree, order)
    }

    /// Turns the binary tree into four-wide nodes, parents before children.
    fn widen(&mut self, binary: &Bvh2, exact: &[(DVec3, DVec3)]) {
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
                let node = &mut self.nodes[id];
                for axis in 0..3 {
                    node.bounds[axis][0][slot] = exact[child].0[axis];
                    node.bounds[axis][1][slot] = exact[child].1[axis];
                }
                let source = &binary.nodes[child];
                if source.is_leaf() {
                    node.first[slot] = source.first_index;
                    node.count[slot] = source.prim_count;
                } else {
                    waiting.push((child, Some((id, slot))));
                }
            }
        }
    }

    /// Shows the ranges of triangles that the ray may meet between `-slack` and `limit`, roughly from near to far.
    /// `visit` gets a range and the limit and returns the new limit. Boxes missed by less than `slack`, which must
    /// exceed the rounding of distances, count as met.
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
        let origin = ray.origin.to_array();
        let inverse = ray.inverse.to_array();
        let backward = inverse.map(|i| i < 0.0);
        let mut current = Entry { first: 0, count: 0, distance: -slack };
        loop {
            if current.count > 0 {
                let first = current.first as usize;
                limit = visit(first..first + current.count as usize, limit);
            } else {
                let node = &self.nodes[current.first as usize];
                let mut enter = [-slack; WIDTH];
                let mut leave = [limit; WIDTH];
                for axis in 0..3 {
                    let distances =
                        |side: &[f64; WIDTH]| side.map(|bound| (bound - origin[axis]) * inverse[axis]);
                    let [lower, upper] = &node.bounds[axis];
                    let (near, far) = if backward[axis] { (upper, lower) } else { (lower, upper) };
                    enter = larger(distances(near), enter);
                    leave = smaller(distances(far), leave);
                }
                let base = stack.len();
                for slot in 0..WIDTH {
                    if enter[slot] <= leave[slot] + slack {
                        let entry =
                            Entry { first: node.first[slot], count: node.count[slot], distance: enter[slot] };
                        let mut at = stack.len();
                        stack.push(entry);
                        while at > base && stack[at - 1].distance < entry.distance {
                            stack[at] = stack[at - 1];
                            at -= 1;
                        }
                        stack[at] = entry;
                    }
                }
            }
            loop {
                let Some(entry) = stack.pop() else { return };
                if entry.distance <= limit {
                    current = entry;
                    break;
                }
            }
        }
    }
}

/// Lane by lane; NaN, from 0 times infinity, restricts nothing. Written for one instruction per two lanes.
#[inline(always)]
fn larger(a: [f64; WIDTH], b: [f64; WIDTH]) -> [f64; WIDTH] {
    std::array::from_fn(|k| if a[k] > b[k] { a[k] } else { b[k] })
}

#[inline(always)]
fn smaller(a: [f64; WIDTH], b: [f64; WIDTH]) -> [f64; WIDTH] {
    std::array::from_fn(|k| if a[k] < b[k] { a[k] } else { b[k] })
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
