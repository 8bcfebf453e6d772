//! The animal of METACOW, in our own shape: rounded parts that melt into each other.

use fast_surface_nets::ndshape::{RuntimeShape, Shape};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use glam::DVec3;

use spectral_scene::Mesh;

/// How far parts melt into each other, metres.
const MELT_M: f64 = 0.12;
/// Side of a cell of the lattice that the surface is found on, metres.
const CELL_M: f64 = 0.04;
/// Corners of the space that the shape fits in, metres.
const SPACE_M: [DVec3; 2] = [DVec3::new(-1.15, -0.12, -0.62), DVec3::new(1.55, 1.98, 0.62)];
/// Step of the differences that normals are made of, metres.
const STEP_M: f64 = 1e-4;

/// Along a line from one ball to another: centre, radius; metres. Those off the middle have a twin on the other side.
const LIMBS: [([f64; 3], f64, [f64; 3], f64); 11] = [
    ([0.60, 1.15, 0.0], 0.26, [0.92, 1.42, 0.0], 0.18),  // neck
    ([0.95, 1.50, 0.0], 0.18, [1.30, 1.27, 0.0], 0.115), // head
    ([1.27, 1.28, 0.0], 0.12, [1.36, 1.22, 0.0], 0.11),  // muzzle
    ([0.93, 1.55, 0.13], 0.07, [0.87, 1.53, 0.36], 0.075), // ears
    ([0.99, 1.64, 0.10], 0.06, [1.05, 1.84, 0.20], 0.05), // horns
    ([0.55, 0.85, 0.20], 0.17, [0.57, 0.08, 0.20], 0.085), // fore legs
    ([-0.58, 0.90, 0.20], 0.20, [-0.50, 0.50, 0.21], 0.11), // thighs
    ([-0.50, 0.50, 0.21], 0.10, [-0.58, 0.08, 0.21], 0.085), // hind legs
    ([-0.80, 1.24, 0.0], 0.065, [-0.98, 0.66, 0.0], 0.055), // tail
    ([-0.98, 0.66, 0.0], 0.06, [-0.99, 0.50, 0.0], 0.08), // its tuft
    ([-0.24, 0.66, 0.0], 0.15, [-0.34, 0.60, 0.0], 0.15), // udder
];
/// The trunk: centre and semi-axes, metres.
const TRUNK_M: [DVec3; 2] = [DVec3::new(-0.05, 1.02, 0.0), DVec3::new(0.86, 0.44, 0.38)];

/// A cow, standing on y = 0 with its head towards +x: 2.4 m long, closed, with smooth normals.
pub fn cow() -> Mesh {
    let size = ((SPACE_M[1] - SPACE_M[0]) / CELL_M).ceil();
    let shape = RuntimeShape::<u32, 3>::new([size.x, size.y, size.z].map(|cells| cells as u32 + 1));
    let place = |at: [f64; 3]| SPACE_M[0] + DVec3::from(at) * CELL_M;
    let distances: Vec<f32> =
        (0..shape.size()).map(|i| distance_m(place(shape.delinearize(i).map(f64::from))) as f32).collect();
    let mut net = SurfaceNetsBuffer::default();
    surface_nets(&distances, &shape, [0; 3], shape.as_array().map(|side| side - 1), &mut net);
    let on_surface = net.positions.iter().map(|at| {
        // The net cuts corners: two steps along the slope bring its points onto the surface.
        let mut point = place(at.map(f64::from));
        for _ in 0..2 {
            let slope = slope(point);
            point -= slope * (distance_m(point) / slope.length_squared());
        }
        (point.as_vec3().to_array(), slope(point).normalize().as_vec3().to_array())
    });
    let (positions, normals) = on_surface.unzip();
    let (triangles, []) = net.indices.as_chunks::<3>() else { unreachable!("a net consists of triangles") };
    Mesh { name: "cow".into(), positions, normals, uvs: vec![], triangles: triangles.to_vec() }
}

/// About the distance from the surface, metres, negative inside.
fn distance_m(point: DVec3) -> f64 {
    let [centre, axes] = TRUNK_M;
    let from_centre = point - centre;
    let (near, steep) = ((from_centre / axes).length(), (from_centre / (axes * axes)).length());
    let trunk = if steep > 0.0 { near * (near - 1.0) / steep } else { -axes.min_element() };
    // Both sides are alike.
    let point = DVec3::new(point.x, point.y, point.z.abs());
    LIMBS.iter().fold(trunk, |distance, &(start, start_m, end, end_m)| {
        let (start, end) = (DVec3::from(start), DVec3::from(end));
        let along = end - start;
        let t = ((point - start).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        melt(distance, point.distance(start + along * t) - (start_m + t * (end_m - start_m)))
    })
}

/// The smaller of two distances, rounded where they are about equal (the quadratic smooth minimum).
fn melt(a: f64, b: f64) -> f64 {
    let near = (MELT_M - (a - b).abs()).max(0.0) / MELT_M;
    a.min(b) - near * near * MELT_M / 4.0
}

fn slope(point: DVec3) -> DVec3 {
    DVec3::from(
        [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
            (distance_m(point + axis * STEP_M) - distance_m(point - axis * STEP_M)) / (2.0 * STEP_M)
        }),
    )
}
