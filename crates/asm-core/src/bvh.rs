//! Building the tree of boxes over a plan's triangles: the library `obvhs` finds its shape (PLOC).

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use crate::PlanError;
use crate::shared::bvh::{BESIDE, BVH_STACK, BvhNode};
use crate::shared::triangle::Triangle;

/// Boxes are wider than their triangles by this: what counts as met beside them, and rounding of rays and boxes.
const SLACK: f32 = 4.0 * BESIDE;

/// Corners of the box round a triangle.
fn bounds(t: &Triangle) -> (Vec3, Vec3) {
    let (low, high) = (t.p0.min(t.p1).min(t.p2), t.p0.max(t.p1).max(t.p2));
    (low - SLACK, high + SLACK)
}

/// Root first, children side by side, a triangle per leaf; empty without triangles.
pub(crate) fn build(triangles: &[Triangle]) -> Result<Vec<BvhNode>, PlanError> {
    if triangles.is_empty() {
        return Ok(Vec::new());
    }
    let boxes: Vec<Aabb> = triangles
        .iter()
        .map(|t| {
            let (low, high) = bounds(t);
            Aabb::new(Vec3A::from(low), Vec3A::from(high))
        })
        .collect();
    let count = boxes.len() as u32;
    let tree = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Low,
        &boxes,
        (0..count).collect(),
        SortPrecision::U64,
        1,
    );
    let nodes: Vec<BvhNode> = tree
        .nodes
        .iter()
        .map(|node| BvhNode {
            low: node.aabb.min.into(),
            first: if node.is_leaf() {
                tree.primitive_indices[node.first_index as usize]
            } else {
                node.first_index
            },
            high: node.aabb.max.into(),
            count: node.prim_count,
        })
        .collect();
    let depth = depth(&nodes);
    if depth > BVH_STACK {
        return Err(PlanError::Limit {
            what: "the tree over the triangles".into(),
            needed: depth as u64,
            unit: "levels",
            max: BVH_STACK as u64,
            remedy: "triangles",
        });
    }
    Ok(nodes)
}

/// Nodes on the longest way down.
fn depth(nodes: &[BvhNode]) -> usize {
    let mut deepest = 0;
    let mut waiting = vec![(0_u32, 1)];
    while let Some((at, depth)) = waiting.pop() {
        deepest = deepest.max(depth);
        let node = &nodes[at as usize];
        if node.count == 0 {
            waiting.extend([(node.first, depth + 1), (node.first + 1, depth + 1)]);
        }
    }
    deepest
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::shared::bvh::{NO_OBJECT, Sought, Surfaces, meets_within};
    use crate::shared::triangle::{NOTHING, SAME_SURFACE};
    use crate::shared::view::Ray;

    /// Points of a low-discrepancy sequence in the unit cube (Roberts 2018, R3).
    fn point(i: usize) -> Vec3 {
        let at = |step: f64| (0.5 + step * i as f64).fract() as f32;
        Vec3::new(at(0.819_172_513), at(0.671_043_606), at(0.549_700_477))
    }

    fn soup(count: usize) -> Vec<Triangle> {
        (0..count)
            .map(|i| {
                let p0 = point(3 * i);
                let [p1, p2] = [1, 2].map(|k| p0 + 0.2 * (point(3 * i + k + 1) - 0.5));
                Triangle { p0, p1, p2, ..Triangle::default() }
            })
            .collect()
    }

    #[test]
    fn the_tree_finds_what_a_search_of_all_triangles_finds() {
        let triangles = soup(400);
        let bvh = build(&triangles).unwrap();
        let surfaces = Surfaces { bvh: &bvh, triangles: &triangles };
        let sought = Sought { object: NO_OBJECT, start: NOTHING, only: 0 };
        let mut met = 0;
        for i in 0..2000 {
            let origin = 2.0 * point(7 * i + 1) - 0.5;
            let axis = [Vec3::X, Vec3::NEG_Y, Vec3::Z][i % 3];
            let direction = if i % 10 == 0 { axis } else { (point(i + 5) - origin).normalize() };
            let ray = Ray { origin, direction };
            let found = surfaces.nearest(ray, &sought);
            let all = (0..triangles.len() as u32).map(|k| (k + 1, triangles[k as usize].plane_hit(ray)));
            let wanted = all
                .filter(|(visible, hit)| {
                    meets_within(&triangles[*visible as usize - 1], hit) && hit.distance > SAME_SURFACE
                })
                .min_by(|a, b| a.1.distance.total_cmp(&b.1.distance).then(a.0.cmp(&b.0)));
            assert_eq!(found.visible, wanted.map_or(NOTHING, |(visible, _)| visible), "ray {i}");
            met += u32::from(found.visible != NOTHING);
        }
        assert!((400..1900).contains(&met), "{met} rays meet something");
    }

    #[test]
    fn a_single_triangle_is_a_tree() {
        let triangles = [Triangle { p1: Vec3::X, p2: Vec3::Y, ..Triangle::default() }];
        let bvh = build(&triangles).unwrap();
        let surfaces = Surfaces { bvh: &bvh, triangles: &triangles };
        let sought = Sought { object: NO_OBJECT, start: NOTHING, only: 0 };
        let at = |x: f32| Ray { origin: Vec3::new(x, 0.2, 1.0), direction: Vec3::NEG_Z };
        assert_eq!(surfaces.nearest(at(0.2), &sought).visible, 1);
        assert_eq!(surfaces.nearest(at(1.2), &sought).visible, NOTHING);
    }
}
