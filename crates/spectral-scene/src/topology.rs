//! Whether a mesh encloses a volume, and which way round it is.

use std::collections::HashSet;

use glam::DVec3;

use crate::{Mesh, Scene};

/// What holds a surface together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Topology {
    /// Every edge is run along as often one way as the other, once vertices at the same place are one and repeated
    /// triangles are left out.
    pub closed: bool,
    /// Closed, but the volume enclosed is negative: the outermost triangles face inwards. The inner wall of a hollow
    /// body faces into its cavity; that takes volume away and is as it should be.
    pub inside_out: bool,
}

impl Topology {
    /// `positions` are the mesh's vertices in any space of the mesh's own handedness.
    fn of(mesh: &Mesh, positions: &[DVec3]) -> Self {
        let welded = welded_indices(mesh);
        let mut seen = HashSet::with_capacity(mesh.triangles.len());
        // Each edge from its smaller to its larger end, +1 or -1 by direction.
        let mut edges: Vec<(u32, u32, i32)> = Vec::with_capacity(3 * mesh.triangles.len());
        let mut volume = 0.0;
        let origin = positions.first().copied().unwrap_or_default();
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| welded[v as usize]);
            let mut corners = [a, b, c];
            corners.sort_unstable();
            if !seen.insert(corners) {
                continue;
            }
            for (from, to) in [(a, b), (b, c), (c, a)] {
                if from < to {
                    edges.push((from, to, 1));
                } else if to < from {
                    edges.push((to, from, -1));
                }
            }
            let [a, b, c] = triangle.map(|v| positions[v as usize] - origin);
            volume += a.dot(b.cross(c));
        }
        edges.sort_unstable();
        let closed = !edges.is_empty()
            && edges
                .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
                .all(|edge| edge.iter().map(|&(_, _, sign)| sign).sum::<i32>() == 0);
        Self { closed, inside_out: closed && volume < 0.0 }
    }
}

impl Scene {
    /// The topology of an object's mesh in the world.
    ///
    /// # Panics
    /// If an index is out of range; [`Scene::validate`] rules that out.
    pub fn topology(&self, object: usize) -> Topology {
        Topology::of(&self.meshes[self.objects[object].mesh], &self.world_mesh(object).positions)
    }

    /// Turns the meshes of refractors that are inside out, their normals with them where those face inwards too, and
    /// returns the objects concerned. A mesh that several objects share is turned once.
    ///
    /// # Panics
    /// As [`Scene::topology`].
    pub fn turn_outwards(&mut self) -> Vec<usize> {
        let mut topologies: Vec<Option<bool>> = vec![None; self.meshes.len()];
        let mut turned = Vec::new();
        let refractors: Vec<usize> = self.refractors().collect();
        for object in refractors {
            let at = self.objects[object].mesh;
            let inside_out = topologies[at].unwrap_or_else(|| self.topology(object).inside_out);
            if inside_out {
                turned.push(object);
                if topologies[at].is_none() {
                    self.meshes[at].turn();
                }
            }
            topologies[at] = Some(inside_out);
        }
        turned
    }
}

impl Mesh {
    fn turn(&mut self) {
        if self.normals_agree() {
            self.normals.iter_mut().flatten().for_each(|n| *n = -*n);
        }
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }

    /// Most vertex normals are on the side from which their triangles run counter-clockwise.
    fn normals_agree(&self) -> bool {
        let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let agreement = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| vector(self.positions[v as usize]));
            let mean: DVec3 = t.iter().map(|&v| vector(self.normals[v as usize])).sum();
            (b - a).cross(c - a).dot(mean)
        };
        !self.normals.is_empty() && self.triangles.iter().map(agreement).sum::<f64>() > 0.0
    }
}

/// Per vertex, the first vertex at the same place.
fn welded_indices(mesh: &Mesh) -> Vec<u32> {
    // Adding 0 makes -0 and 0 one place.
    let key = |i: u32| mesh.positions[i as usize].map(|c| (c + 0.0).to_bits());
    let mut order: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    order.sort_unstable_by_key(|&i| (key(i), i));
    let mut welded = vec![0; order.len()];
    for place in order.chunk_by(|&a, &b| key(a) == key(b)) {
        for &i in place {
            welded[i as usize] = place[0];
        }
    }
    welded
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;

    fn first_refractor(scene: &Scene) -> usize {
        scene.refractors().next().expect("the scene has glass")
    }

    #[test]
    fn bundled_glass_is_the_right_way_round_and_hollow_glass_too() {
        for name in ["sphere", "gem", "glass", "ring", "diamond", "organic"] {
            let mut scene = bundled(name).expect(name);
            let before = scene.clone();
            let topology = scene.topology(first_refractor(&scene));
            assert_eq!(topology, Topology { closed: true, inside_out: false }, "{name}");
            assert!(scene.turn_outwards().is_empty(), "{name}");
            assert_eq!(scene, before, "{name}");
        }
    }

    #[test]
    fn an_inside_out_body_is_turned_once_whoever_shares_it() {
        let original = bundled("sphere").expect("bundled");
        let glass = first_refractor(&original);
        let mesh = original.objects[glass].mesh;
        for normals_too in [false, true] {
            let mut scene = original.clone();
            scene.objects.push(scene.objects[glass].clone());
            let expected = scene.clone();
            scene.meshes[mesh].triangles.iter_mut().for_each(|t| t.swap(1, 2));
            if normals_too {
                scene.meshes[mesh].normals.iter_mut().flatten().for_each(|n| *n = -*n);
            }
            assert_eq!(scene.turn_outwards(), [glass, scene.objects.len() - 1]);
            assert_eq!(scene, expected);
        }
    }

    #[test]
    fn repeated_triangles_do_not_open_a_mesh_and_missing_ones_do() {
        let mut scene = bundled("gem").expect("bundled");
        let glass = first_refractor(&scene);
        let mesh = scene.objects[glass].mesh;
        let [a, b, c] = scene.meshes[mesh].triangles[0];
        scene.meshes[mesh].triangles.extend([[b, c, a], [a, a, b]]);
        assert!(scene.topology(glass).closed);
        scene.meshes[mesh].triangles.remove(1);
        assert_eq!(scene.topology(glass), Topology { closed: false, inside_out: false });
    }
}
