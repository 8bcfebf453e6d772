//! Solids of glass, and what lets light through to them.

use glam::{DMat4, DVec3};
use spectral_scene::{Mesh, Scene};

use crate::stage::*;

/// A solid with flat faces: a convex polygon, counter-clockwise in x and y, drawn out along z.
pub(crate) fn drawn_out(polygon: &[[f64; 2]], depth: f64) -> Mesh {
    let n = polygon.len() as u32;
    let ends = [0.5, -0.5].map(|side| side * depth);
    let corner = |z: f64| move |[x, y]: &[f64; 2]| DVec3::new(*x, *y, z).as_vec3().to_array();
    let positions = ends.iter().flat_map(|z| polygon.iter().map(corner(*z))).collect();
    let fans = (1..n - 1).flat_map(|i| [[0, i, i + 1], [n, n + i + 1, n + i]]);
    let sides = (0..n).map(|i| (i, (i + 1) % n)).flat_map(|(i, j)| [[i, n + i, n + j], [i, n + j, j]]);
    Mesh { name: "solid".into(), positions, triangles: fans.chain(sides).collect(), ..Mesh::default() }
}

/// Half the width of wedges, and their thickness at the thin end, metres.
const WEDGE_HALF_M: f64 = 0.1;
const WEDGE_THIN_M: f64 = 0.01;

/// A wedge below y = 0, whose level top light enters and whose bottom falls to the right by this angle.
pub(crate) fn wedge(angle_deg: f64, depth: f64) -> Mesh {
    let thick = WEDGE_THIN_M + 2.0 * WEDGE_HALF_M * angle_deg.to_radians().tan();
    let [w, t] = [WEDGE_HALF_M, WEDGE_THIN_M];
    drawn_out(&[[-w, 0.0], [-w, -t], [w, -thick], [w, 0.0]], depth)
}

/// The same wedge upside down: its top lies along the other's bottom, its bottom is level.
pub(crate) fn wedge_back(angle_deg: f64, depth: f64) -> Mesh {
    let mut mesh = wedge(angle_deg, depth);
    mesh.positions.iter_mut().for_each(|p| *p = [-p[0], -p[1], p[2]]);
    mesh
}

/// Two black plates, each `size` along a side, with a slit of this width between them along z.
pub(crate) fn place_slit(scene: &mut Scene, at: DVec3, width: f64, size: f32) {
    for side in [-1.0, 1.0] {
        let offset = DVec3::X * side * 0.5 * (width + f64::from(size));
        place(scene, "black", quad(size), opaque([0.0; 3]), at + offset);
    }
}

/// A square floor of this side, as `receiver`, with its middle there.
pub(crate) fn floor_at(name: &str, side: f32, middle: DVec3) -> Scene {
    let mut scene = Scene { name: name.into(), ..Scene::default() };
    place(&mut scene, "receiver", quad(side), opaque([1.0; 3]), middle);
    scene
}

/// Turns the last object that was placed about its own origin.
pub(crate) fn turn_last(scene: &mut Scene, rotation: glam::DQuat) {
    let object = scene.objects.last_mut().unwrap();
    object.world_from_mesh *= DMat4::from_quat(rotation);
}
