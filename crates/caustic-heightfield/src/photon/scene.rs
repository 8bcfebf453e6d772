//! The pond as a scene: its surface as a mesh of water, its floor as a receiver, its light as a sun.

use glam::{DMat4, DVec3};
use spectral_core::dispersion::Dispersion;
use spectral_core::glass;
use spectral_scene::{Light, LightShape, Material, Mesh, Object, Scene};

use super::PhotonSettings;
use crate::dispersion::ior_below_at;
use crate::error::PondError;
use crate::floor::FloorGrid;
use crate::height_field::HeightField;
use crate::normals::normal_of_slopes;
use crate::pond::{Outside, Pond};
use crate::surface_light::SurfaceLight;

/// The floor among the objects; the water is the other one.
pub(super) const FLOOR: usize = 0;
/// Beams of other wavelengths, and of the surface between samples, go this much farther than those of the samples.
const FARTHER: f64 = 1.1;
/// Most vertices of the water.
const MOST_VERTICES: usize = 1 << 23;

/// Water on the outside of the pond that may light the floor of a periodic one, metres: in x and y, before its first and behind
/// its last sample.
pub(super) fn margins_m(
    surface: &HeightField,
    pond: &Pond,
    light: &SurfaceLight,
    floor: &FloorGrid,
) -> [[f64; 2]; 2] {
    if pond.outside == Outside::Dark {
        return [[0.0; 2]; 2];
    }
    let pitch_m = surface.pitch_m();
    [0, 1].map(|k| {
        // How far beams land to the one side and to the other.
        let (mut back, mut forth) = (0.0_f64, 0.0_f64);
        for (direction, h) in light.directions.iter().zip(&surface.heights_m).filter(|(d, _)| d[2] < 0.0) {
            let offset_m = FARTHER * direction[k] / -direction[2] * (pond.depth_m + h);
            back = back.max(-offset_m);
            forth = forth.max(offset_m);
        }
        let (first_m, last_m) = (floor.corner_m[k], floor.corner_m[k] + floor.extent_m[k]);
        let more_m = 2.0 * pitch_m[k];
        [(forth - first_m + more_m).max(0.0), (back + last_m - surface.extent_m[k] + more_m).max(0.0)]
    })
}

/// Where vertices lie on one axis, and of which samples they are made.
struct Node {
    at_m: f64,
    /// Samples and their weights.
    of: [(usize, f64); 2],
}

/// Vertices at the samples of an axis. A pond that ends has one more at either end, on the straight line through the outermost
/// samples; a periodic one goes on for its margins.
fn nodes(surface: &HeightField, outside: Outside, margins_m: [f64; 2], k: usize) -> Vec<Node> {
    let (count, pitch_m) = (surface.size[k], surface.pitch_m()[k]);
    let sample = |i: isize| {
        let own = i.rem_euclid(count as isize) as usize;
        Node { at_m: (i as f64 + 0.5) * pitch_m, of: [(own, 1.0), (own, 0.0)] }
    };
    match outside {
        Outside::Dark => {
            let edge = |at_m: f64, own: usize, next: usize| Node { at_m, of: [(own, 1.5), (next, -0.5)] };
            let first = edge(0.0, 0, 1.min(count - 1));
            let last = edge(surface.extent_m[k], count - 1, count.saturating_sub(2));
            std::iter::once(first).chain((0..count as isize).map(sample)).chain([last]).collect()
        }
        Outside::Periodic => {
            let [before, behind] = margins_m.map(|margin_m| (margin_m / pitch_m).ceil() as isize);
            (-before..count as isize + behind).map(sample).collect()
        }
    }
}

/// The surface, its triangles counter-clockwise from above, with normals of fourth order, whatever the pond's rule for them is.
fn water(surface: &HeightField, pond: &Pond, margins_m: [[f64; 2]; 2]) -> Result<Mesh, PondError> {
    let axes = [0, 1].map(|k| nodes(surface, pond.outside, margins_m[k], k));
    let [width, height] = [axes[0].len(), axes[1].len()];
    let count = width.saturating_mul(height);
    if count > MOST_VERTICES {
        return Err(PondError::Setting {
            name: "number of the water's vertices, with what is around a periodic pond,",
            got: count as f64,
            expected: "8388608 at most: fewer samples, shallower water or a higher sun",
        });
    }
    let heights = surface.view(pond.outside);
    let slopes = surface.cubic_slopes(pond.outside);
    let (mut positions, mut normals) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for y in &axes[1] {
        for x in &axes[0] {
            let along = |j: usize| x.of.iter().map(|&(i, weight)| weight * heights.at(i, j)).sum::<f64>();
            let h: f64 = y.of.iter().map(|&(j, weight)| weight * along(j)).sum();
            let sample = y.of[0].0 * surface.size[0] + x.of[0].0;
            positions.push([x.at_m as f32, y.at_m as f32, h as f32]);
            normals.push(normal_of_slopes(slopes[sample]).map(|c| c as f32));
        }
    }
    let cells = (0..height - 1).flat_map(|j| (0..width - 1).map(move |i| (j * width + i) as u32));
    let row = width as u32;
    let triangles = cells.flat_map(|v| [[v, v + 1, v + row + 1], [v, v + row + 1, v + row]]).collect();
    Ok(Mesh { name: "water".into(), positions, normals, uvs: Vec::new(), triangles })
}

/// The floor's texels as a square of texture coordinates, u along x and v along y.
fn receiver(pond: &Pond, floor: &FloorGrid) -> Mesh {
    const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let place = |k: usize, uv: [f64; 2]| (floor.corner_m[k] + uv[k] * floor.extent_m[k]) as f32;
    Mesh {
        name: "receiver".into(),
        positions: CORNERS.map(|uv| [place(0, uv), place(1, uv), -pond.depth_m as f32]).to_vec(),
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uvs: CORNERS.map(|uv| uv.map(|c| c as f32)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// Everything, metres, z upwards as the pond has it.
pub(super) fn scene(
    surface: &HeightField,
    pond: &Pond,
    settings: &PhotonSettings,
    floor: &FloorGrid,
    margins_m: [[f64; 2]; 2],
) -> Result<Scene, PondError> {
    let dispersion =
        if settings.dispersion { water_dispersion(pond)? } else { Dispersion::Constant { n: pond.eta() } };
    let clear = Material::glass("water", dispersion);
    let water_material = if pond.extinction_per_m > 0.0 {
        clear.attenuating([(-1.0_f64).exp(); 3], 1.0 / pond.extinction_per_m)
    } else {
        clear
    };
    let object = |name: &str, mesh: usize, material: usize| Object {
        name: name.into(),
        mesh,
        material,
        world_from_mesh: DMat4::IDENTITY,
    };
    let sun = Light {
        name: "sun".into(),
        color: [1.0; 3],
        intensity: pond.illumination.largest(),
        spectrum: settings.spectrum.clone(),
        shape: LightShape::Directional { direction: DVec3::from(pond.unit_light_direction()).normalize() },
    };
    Ok(Scene {
        name: "pond".into(),
        meshes: vec![receiver(pond, floor), water(surface, pond, margins_m)?],
        materials: vec![Material::matt("floor", [1.0; 3]), water_material],
        objects: vec![object("receiver", FLOOR, 0), object("water", 1, 1)],
        lights: vec![sun],
        cameras: Vec::new(),
    })
}

/// The pond's water relative to what is above it, as a formula: its index at a wavelength is [`ior_below_at`] over the pond's
/// `ior_above`, to better than 1e-6 over all that is visible.
///
/// n^2 - 1 is fitted with the poles of water and a constant, which is exact where the pond's index is water's own.
///
/// # Errors
/// Water whose index is below that of what is above it.
pub fn water_dispersion(pond: &Pond) -> Result<Dispersion, PondError> {
    const VISIBLE_NM: std::ops::RangeInclusive<u32> = 380..=780;
    let Dispersion::Sellmeier { terms } = glass::by_name("water").expect("water is in the catalogue") else {
        return Err(PondError::Photon { what: "water without Sellmeier's formula" });
    };
    let poles_um2: Vec<f64> = std::iter::once(0.0).chain(terms.iter().map(|[_, c_um2]| *c_um2)).collect();
    let index = |nm: f64| Ok((nm, ior_below_at(pond, nm)? / pond.ior_above));
    let indices = VISIBLE_NM.map(|nm| index(f64::from(nm))).collect::<Result<Vec<_>, PondError>>()?;
    Dispersion::sellmeier_with_poles(&poles_um2, &indices).map_err(|_| PondError::Photon {
        what: "light that goes from the dense to the thin side; take another method",
    })
}
