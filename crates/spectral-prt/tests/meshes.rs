//! The figures' meshes are whole.

use std::collections::HashMap;

use glam::Vec3;
use spectral_prt::figures::{cow, knot};
use spectral_scene::Mesh;

fn points(mesh: &Mesh) -> impl Iterator<Item = Vec3> {
    mesh.positions.iter().map(|p| Vec3::from(*p))
}

/// Triangles whose vertex normals point to the other side.
fn turned(mesh: &Mesh) -> usize {
    let faces_in = |t: &&[u32; 3]| {
        let [a, b, c] = t.map(|v| Vec3::from(mesh.positions[v as usize]));
        let normals: Vec3 = t.iter().map(|&v| Vec3::from(mesh.normals[v as usize])).sum();
        (b - a).cross(c - a).dot(normals) <= 0.0
    };
    mesh.triangles.iter().filter(faces_in).count()
}

#[test]
fn triangles_face_the_way_their_normals_do() {
    // Where parts meet in a crease narrower than the lattice, a few are folded over.
    for (mesh, per_thousand) in [(cow(), 1), (knot(), 0)] {
        let most = per_thousand * mesh.triangles.len() / 1000;
        assert!(turned(&mesh) <= most, "{}: {}, not {most}", mesh.name, turned(&mesh));
        assert!(mesh.normals.iter().all(|n| (Vec3::from(*n).length() - 1.0).abs() < 1e-6));
    }
}

#[test]
fn the_cow_is_closed_stands_on_the_ground_and_has_two_equal_sides() {
    let mesh = cow();
    let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
    for t in &mesh.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    assert!(edges.values().all(|sum| *sum == 0), "every edge has a triangle on either side");
    let lowest = points(&mesh).map(|p| p.y).fold(f32::INFINITY, f32::min);
    assert!(lowest.abs() < 0.02, "{lowest}");
    let left_most = points(&mesh).map(|p| p.z).fold(f32::INFINITY, f32::min);
    let right_most = points(&mesh).map(|p| p.z).fold(f32::NEG_INFINITY, f32::max);
    assert!((left_most + right_most).abs() < 2e-3, "{left_most} {right_most}");
}

#[test]
fn the_knot_does_not_run_through_itself() {
    let mesh = knot();
    // Rings of the tube that are not neighbours keep their distance: their points lie outside of each other.
    let around = mesh.uvs.iter().take_while(|uv| uv[0] == 0.0).count();
    let rings: Vec<Vec<Vec3>> =
        mesh.positions.chunks(around).map(|ring| ring.iter().map(|p| Vec3::from(*p)).collect()).collect();
    let middles: Vec<Vec3> =
        rings.iter().map(|ring| ring[1..].iter().sum::<Vec3>() / (around - 1) as f32).collect();
    let radius = rings[0][0].distance(middles[0]);
    let count = middles.len() - 1;
    for (i, middle) in middles.iter().enumerate() {
        for (j, ring) in rings.iter().enumerate() {
            let apart = i.abs_diff(j) % count;
            if apart.min(count - apart) > count / 8 {
                assert!(ring.iter().all(|p| p.distance(*middle) > 1.05 * radius), "{i} {j}");
            }
        }
    }
}
