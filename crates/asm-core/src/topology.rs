//! Whether a mesh encloses a volume, and which way round it is.

use glam::DVec3;
use spectral_scene::Mesh;

/// What holds a refractor's surface together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Topology {
    /// Every edge is run along as often one way as the other, once vertices at the same place are one and so are equal
    /// triangles.
    pub(crate) closed: bool,
    /// Closed, but its triangles face inwards.
    pub(crate) inside_out: bool,
}

impl Topology {
    /// `positions` are the mesh's vertices in any space of the mesh's own handedness.
    pub(crate) fn of(mesh: &Mesh, positions: &[DVec3]) -> Self {
        let welded = welded_indices(mesh);
        // A triangle that is there twice is one surface.
        let mut triangles: Vec<[u32; 3]> = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| welded[v as usize]);
                let least = a.min(b).min(c);
                if a == least {
                    [a, b, c]
                } else if b == least {
                    [b, c, a]
                } else {
                    [c, a, b]
                }
            })
            .collect();
        triangles.sort_unstable();
        triangles.dedup();
        // Each edge from its smaller to its larger end, +1 or -1 by direction.
        let mut edges: Vec<(u32, u32, i32)> = Vec::with_capacity(3 * mesh.triangles.len());
        for [a, b, c] in triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                if from < to {
                    edges.push((from, to, 1));
                } else if to < from {
                    edges.push((to, from, -1));
                }
            }
        }
        edges.sort_unstable();
        let closed = !edges.is_empty()
            && edges
                .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
                .all(|edge| edge.iter().map(|&(_, _, sign)| sign).sum::<i32>() == 0);
        Self { closed, inside_out: closed && volume(mesh, positions) < 0.0 }
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

fn volume(mesh: &Mesh, positions: &[DVec3]) -> f64 {
    let Some(&origin) = positions.first() else { return 0.0 };
    mesh.triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| positions[v as usize] - origin);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}
