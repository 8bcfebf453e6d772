//! The ColorChecker on a knotted tube.

use glam::DVec3;
use spectral_core::color_checker;
use spectral_scene::Camera;

use super::{Figure, GRID, knot};
use crate::relighting::{Albedo, IndexMap};
use crate::surface::Surface;

/// Columns and rows of the chart.
const CHART: [u32; 2] = [6, 4];
/// How often the chart comes along the tube.
const REPEATS: f32 = 4.0;
const RAYS: u32 = 1024;

/// A knot that the 24 patches are painted on, as an index map of one texel each.
pub fn painted_knot() -> Figure {
    let mesh = knot();
    let [positions, normals] = [&mesh.positions, &mesh.normals]
        .map(|of| of.iter().map(|v| DVec3::from(v.map(f64::from))).collect::<Vec<_>>());
    let surface = Surface::new(&positions, &normals, &mesh.triangles).expect("the knot's mesh is sound");
    let uvs = mesh.uvs.iter().map(|[u, v]| [REPEATS * u, *v]).collect();
    let chart = IndexMap::new(CHART, (0..color_checker::PATCHES.len() as u32).collect());
    Figure {
        surfaces: vec![surface],
        reflectances: color_checker::sampled(&GRID),
        index_maps: vec![chart.expect("as many texels as patches")],
        albedos: vec![Albedo::Indexed { map: 0, uvs }],
        camera: Camera {
            yfov_rad: 0.6,
            ..Camera::look_at(DVec3::new(0.6, 4.2, 3.6), DVec3::new(0.0, -0.1, 0.0))
        },
        rays: RAYS,
    }
}
