//! Which triangles make up one face: what light that goes through one may be interpolated to light through another.

use std::collections::HashMap;

use glam::Vec3;

use crate::shared::triangle::Triangle;

/// Cosine of the largest angle between two normals that are the same.
const SAME_NORMAL: f32 = 1.0 - 1e-6;

/// Both ends as bits, the smaller first, and the object.
type Edge = ([u32; 3], [u32; 3], u32);

/// Writes [`Triangle::face`]: triangles of one object with a common edge belong to one face where their normals at its ends
/// agree. A smooth mesh is one face, a cut gem has one per facet. Faces are numbered from 1 in the order of their first triangles.
pub(crate) fn mark_faces(triangles: &mut [Triangle]) {
    let mut parents: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut edges: HashMap<Edge, Vec<(u32, [Vec3; 2])>> = HashMap::new();
    for (i, t) in triangles.iter().enumerate() {
        let corners = [(t.p0, t.n0), (t.p1, t.n1), (t.p2, t.n2)];
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            // Adding 0 makes one zero of two.
            let bits = |p: Vec3| (p + 0.0).to_array().map(f32::to_bits);
            let (a, b) = if bits(b.0) < bits(a.0) { (b, a) } else { (a, b) };
            let sharing = edges.entry((bits(a.0), bits(b.0), t.object)).or_default();
            for (other, normals) in sharing.iter() {
                if normals[0].dot(a.1) >= SAME_NORMAL && normals[1].dot(b.1) >= SAME_NORMAL {
                    let (x, y) = (root(&mut parents, i as u32), root(&mut parents, *other));
                    parents[x.max(y) as usize] = x.min(y);
                }
            }
            sharing.push((i as u32, [a.1, b.1]));
        }
    }
    for i in 0..triangles.len() as u32 {
        triangles[i as usize].face = root(&mut parents, i) + 1;
    }
}

fn root(parents: &mut [u32], mut i: u32) -> u32 {
    while parents[i as usize] != i {
        parents[i as usize] = parents[parents[i as usize] as usize];
        i = parents[i as usize];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad(corners: [Vec3; 4], normals: [Vec3; 4], object: u32) -> [Triangle; 2] {
        [[0, 1, 2], [0, 2, 3]].map(|[a, b, c]: [usize; 3]| Triangle {
            p0: corners[a],
            p1: corners[b],
            p2: corners[c],
            n0: normals[a],
            n1: normals[b],
            n2: normals[c],
            object,
            ..Triangle::default()
        })
    }

    #[test]
    fn faces_end_where_normals_jump_or_objects_end() {
        let floor = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 0.0, -1.0), Vec3::NEG_Z];
        let wall = [Vec3::ZERO, Vec3::Y, Vec3::new(1.0, 1.0, 0.0), Vec3::X];
        let creased = [quad(floor, [Vec3::Y; 4], 0), quad(wall, [Vec3::Z; 4], 0)].concat();
        let rounded_normal = (Vec3::Y + Vec3::Z).normalize();
        let smooth = [
            quad(floor, [rounded_normal, rounded_normal, Vec3::Y, Vec3::Y], 0),
            quad(wall, [rounded_normal, Vec3::Z, Vec3::Z, rounded_normal], 0),
        ]
        .concat();
        let apart = [quad(floor, [Vec3::Y; 4], 0), quad(floor, [Vec3::Y; 4], 1)].concat();
        let faces = |mut triangles: Vec<Triangle>| {
            mark_faces(&mut triangles);
            triangles.iter().map(|t| t.face).collect::<Vec<_>>()
        };
        assert_eq!(faces(creased), [1, 1, 3, 3]);
        assert_eq!(faces(smooth), [1, 1, 1, 1]);
        assert_eq!(faces(apart), [1, 1, 3, 3]);
    }
}
