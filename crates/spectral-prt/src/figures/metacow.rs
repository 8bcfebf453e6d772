//! A herd, each animal in a colour of the ColorChecker in front and in its metamer behind.

use glam::DVec3;
use spectral_core::color_checker;
use spectral_core::illuminant::Illuminant;
use spectral_scene::Camera;

use super::{Figure, GRID, OBSERVER, cow};
use crate::metamer::{Metamer, MetamerError, MetamerSettings, metamer};
use crate::relighting::{Albedo, IndexMap};
use crate::surface::Surface;

/// Animals in a row, as patches on the chart.
const COLUMNS: usize = 6;
/// From animal to animal and from row to row, metres.
const SPACING_M: [f64; 2] = [3.1, 2.9];
/// Where an animal's two colours meet, along its length, metres.
const SEAM_M: f64 = 0.1;
/// Texture coordinates of an animal go so far in a metre that both halves lie within 0..1.
const U_PER_M: f64 = 0.2;
/// Quads of the ground along x and z, and how far it reaches beyond the herd, metres.
const GROUND_QUADS: [u32; 2] = [120, 80];
const GROUND_MARGIN_M: f64 = 2.0;
/// The patch that the ground is painted with, neutral 6.5.
const GROUND_PATCH: usize = 20;
/// Rays per vertex: shadows here are soft, and there are 100,000 vertices.
const RAYS: u32 = 256;

/// A colour of the chart and its metamer.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// Of [`color_checker::PATCHES`].
    pub patch: usize,
    /// What matches it under D65 and differs most under A.
    pub metamer: Metamer,
}

/// 24 animals on a grey ground. Paints 0 to 23 are the chart's, 24 to 47 their metamers.
///
/// # Errors
/// [`MetamerError::Unsolved`] if the optimiser fails.
pub fn metacow() -> Result<(Figure, Vec<Pair>), MetamerError> {
    let chart = color_checker::sampled(&GRID);
    let [day, lamp] = [Illuminant::D65, Illuminant::A].map(|i| GRID.sample(|l| i.relative_power(l)));
    let pair = |(patch, standard): (usize, &Vec<f64>)| {
        let metamer = metamer(&GRID, OBSERVER, standard, &day, &lamp, MetamerSettings::default())?;
        Ok(Pair { patch, metamer })
    };
    let pairs = chart.iter().enumerate().map(pair).collect::<Result<Vec<_>, _>>()?;
    let metamers = pairs.iter().map(|pair| pair.metamer.reflectance.clone());
    let reflectances: Vec<Vec<f64>> = chart.iter().cloned().chain(metamers).collect();

    let mesh = cow();
    let [normals, positions] = [&mesh.normals, &mesh.positions]
        .map(|of| of.iter().map(|v| DVec3::from(v.map(f64::from))).collect::<Vec<_>>());
    let uvs: Vec<[f32; 2]> =
        positions.iter().map(|p| [(0.5 + U_PER_M * (p.x - SEAM_M)) as f32, 0.5]).collect();
    let rows = chart.len() / COLUMNS;
    let half = [(COLUMNS - 1) as f64 * SPACING_M[0] / 2.0, (rows - 1) as f64 * SPACING_M[1] / 2.0];
    let (mut surfaces, mut index_maps, mut albedos) = (Vec::new(), Vec::new(), Vec::new());
    for patch in 0..chart.len() {
        let (column, row) = ((patch % COLUMNS) as f64, (patch / COLUMNS) as f64);
        let place = DVec3::new(column * SPACING_M[0] - half[0], 0.0, row * SPACING_M[1] - half[1]);
        let placed: Vec<DVec3> = positions.iter().map(|p| *p + place).collect();
        surfaces.push(Surface::new(&placed, &normals, &mesh.triangles).expect("the animal's mesh is sound"));
        let halves = vec![(chart.len() + patch) as u32, patch as u32];
        index_maps.push(IndexMap::new([2, 1], halves).expect("two texels"));
        albedos.push(Albedo::Indexed { map: patch, uvs: uvs.clone() });
    }
    surfaces.push(ground(half.map(|reach| reach + GROUND_MARGIN_M)));
    albedos.push(Albedo::Entry(GROUND_PATCH as u32));
    let camera =
        Camera { yfov_rad: 0.56, ..Camera::look_at(DVec3::new(0.0, 11.5, 19.5), DVec3::new(0.2, 0.2, 0.6)) };
    Ok((Figure { surfaces, reflectances, index_maps, albedos, camera, rays: RAYS }, pairs))
}

/// A level rectangle at y = 0, `reach` from the middle to its sides.
fn ground(reach: [f64; 2]) -> Surface {
    let [columns, rows] = GROUND_QUADS;
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for row in 0..=rows {
        for column in 0..=columns {
            let along = |i: u32, of: u32, reach: f64| reach * (2.0 * f64::from(i) / f64::from(of) - 1.0);
            positions.push(DVec3::new(along(column, columns, reach[0]), 0.0, along(row, rows, reach[1])));
            if row < rows && column < columns {
                let at = |r: u32, c: u32| (row + r) * (columns + 1) + column + c;
                triangles.extend([[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]]);
            }
        }
    }
    Surface::new(&positions, &vec![DVec3::Y; positions.len()], &triangles).expect("a level ground")
}
