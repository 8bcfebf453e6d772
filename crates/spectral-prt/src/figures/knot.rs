//! A knotted tube with texture coordinates, which shades itself.

use std::f64::consts::TAU;

use glam::DVec3;

use spectral_scene::Mesh;

/// Distance of the knot's middle from its axis, and how far it swings from there, metres.
const RING_M: f64 = 1.0;
const SWING_M: f64 = 0.45;
/// Radius of the tube, metres.
const TUBE_M: f64 = 0.27;
/// Quads along the tube and around it.
const ALONG: u32 = 256;
const AROUND: u32 = 32;

/// A trefoil about the y axis, 2.9 m wide; u runs once along the tube, v once around it, with seams.
pub fn knot() -> Mesh {
    let mut mesh = Mesh { name: "knot".into(), ..Mesh::default() };
    for i in 0..=ALONG {
        let u = f64::from(i) / f64::from(ALONG);
        for j in 0..=AROUND {
            let v = f64::from(j) / f64::from(AROUND);
            // Both sides of a seam are the same points to the bit.
            let (point, normal) =
                tube(f64::from(i % ALONG) / f64::from(ALONG), f64::from(j % AROUND) / f64::from(AROUND));
            mesh.positions.push(point.as_vec3().to_array());
            mesh.normals.push(normal.as_vec3().to_array());
            mesh.uvs.push([u as f32, v as f32]);
            if i < ALONG && j < AROUND {
                let at = |i: u32, j: u32| i * (AROUND + 1) + j;
                mesh.triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
                mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
            }
        }
    }
    mesh
}

/// The tube's middle: twice around the axis while it swings three times.
fn middle(u: f64) -> DVec3 {
    let ((sin_2, cos_2), (sin_3, cos_3)) = ((2.0 * TAU * u).sin_cos(), (3.0 * TAU * u).sin_cos());
    let reach = RING_M + SWING_M * cos_3;
    DVec3::new(reach * cos_2, SWING_M * sin_3, reach * sin_2)
}

/// A point of the tube and the unit normal there.
fn tube(u: f64, v: f64) -> (DVec3, DVec3) {
    let step = 1e-5;
    let along = (middle(u + step) - middle(u - step)).normalize();
    // Never along the tube: that lies flat where it passes by the axis.
    let outward = DVec3::new(middle(u).x, 0.0, middle(u).z).reject_from_normalized(along).normalize();
    let (sin, cos) = (TAU * v).sin_cos();
    let normal = outward * cos + along.cross(outward) * sin;
    (middle(u) + normal * TUBE_M, normal)
}
