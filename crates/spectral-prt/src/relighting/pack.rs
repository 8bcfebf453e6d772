//! Numbers as passes read them: in f32, four terms to a block.

use std::f64::consts::PI;

use asm_core::WorkingSpace;
use asm_core::shared::triangle::Triangle;
use glam::{DVec3, UVec2, UVec3, Vec2, Vec3, Vec4};

use super::albedo::{Albedo, AlbedoTerms, SpectralMap};
use super::scene::{RelitScene, SceneTransfer};
use crate::bands::Bands;
use crate::gloss::GlossTransfer;
use crate::passes::BLOCK;
use crate::passes::prt_gloss::{MATT, PrtGlossPoint};
use crate::sh::ShRotation;
use crate::shared::prt_picture::{PrtAlbedo, PrtCorners};
use crate::surface::Surface;

/// Blocks of a light.
pub(super) fn blocks(coefficients: usize) -> usize {
    coefficients.div_ceil(BLOCK)
}

/// Four of some coefficients, 0 beyond the last.
fn block(index: usize, coefficient: impl Fn(usize) -> Option<f64>) -> Vec4 {
    Vec4::from_array([0, 1, 2, 3].map(|i| coefficient(BLOCK * index + i).unwrap_or(0.0) as f32))
}

/// L_jk: block after block, harmonic after harmonic.
pub(super) fn sky(light: &[Vec<f64>], bands: Bands) -> Vec<Vec4> {
    let of_block = |b| (0..bands.coefficients()).map(move |k| block(b, |j| light.get(j).map(|l| l[k])));
    (0..blocks(light.len())).flat_map(of_block).collect()
}

/// The matrices of all degrees.
pub(super) fn rotation(rotation: &ShRotation) -> Vec<f32> {
    rotation.degrees().iter().flatten().map(|&entry| entry as f32).collect()
}

/// T_qk: function after function, harmonic after harmonic, vertex after vertex.
pub(super) fn transfer(transfer: &SceneTransfer<'_>) -> Vec<f32> {
    let of_vertex = transfer.functions() * transfer.bands().coefficients();
    let coefficients = transfer.coefficients();
    let vertices = coefficients.len() / of_vertex;
    (0..of_vertex).flat_map(|i| (0..vertices).map(move |v| coefficients[v * of_vertex + i])).collect()
}

/// Terms of an albedo: function after function, block after block, X, Y and Z of each.
pub(super) fn albedo(terms: &AlbedoTerms) -> impl Iterator<Item = Vec4> + '_ {
    terms.iter().flat_map(|coefficients| {
        (0..blocks(coefficients.len())).flat_map(move |b| {
            (0..3).map(move |c| block(b, |j| coefficients.get(j).map(|xyz: &[f64; 3]| xyz[c])))
        })
    })
}

/// Layers of a spectral map, one after the other.
pub(super) fn map_layers(map: &SpectralMap) -> Vec<Vec4> {
    let albedos: Vec<Vec<Vec4>> = map.albedos.iter().map(|terms| albedo(terms).collect()).collect();
    let layers = 3 * map.functions * blocks(map.coefficients);
    (0..layers)
        .flat_map(|layer| map.texels.iter().map(|&t| albedos[t as usize][layer]).collect::<Vec<_>>())
        .collect()
}

/// Working units round everything.
pub(super) fn space(surfaces: &[Surface]) -> WorkingSpace {
    let positions = || surfaces.iter().flat_map(|s| s.positions());
    let (low, high) =
        positions().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
    let center_m = 0.5 * (low + high);
    // Surfaces have an area, so this is not 0.
    WorkingSpace { center_m, metres_per_unit: center_m.distance(high) }
}

/// Triangles whose front is where their normals are, and their corners.
pub(super) fn triangles(scene: &RelitScene<'_>, space: &WorkingSpace) -> (Vec<Triangle>, Vec<PrtCorners>) {
    let (mut triangles, mut corners) = (Vec::new(), Vec::new());
    let mut first_vertex = 0;
    for (index, (surface, albedo)) in scene.surfaces.iter().zip(scene.albedos).enumerate() {
        let uv = |vertex: u32| match albedo {
            Albedo::Entry(_) => Vec2::ZERO,
            Albedo::Indexed { uvs, .. } | Albedo::Mapped { uvs, .. } => Vec2::from(uvs[vertex as usize]),
        };
        for &[a, b, c] in surface.triangles() {
            let at = |vertex: u32| surface.positions()[vertex as usize];
            let normal = |vertex: u32| surface.normals()[vertex as usize];
            let facet = (at(b) - at(a)).cross(at(c) - at(a));
            let turned = facet.dot(normal(a) + normal(b) + normal(c)) < 0.0;
            let vertices = if turned { [a, c, b] } else { [a, b, c] };
            let [p0, p1, p2] = vertices.map(|v| space.working_from_world(at(v)).as_vec3());
            let [n0, n1, n2]: [Vec3; 3] = vertices.map(|v| normal(v).as_vec3());
            let (material, object) = (index as u32, index as u32);
            triangles.push(Triangle { p0, p1, p2, n0, n1, n2, material, object, ..Triangle::default() });
            let [uv0, uv1, uv2] = vertices.map(uv);
            corners.push(PrtCorners {
                vertices: UVec3::from(vertices) + first_vertex,
                albedo: index as u32,
                uv0,
                uv1,
                uv2,
                reserved: Vec2::ZERO,
            });
        }
        first_vertex += surface.positions().len() as u32;
    }
    (triangles, corners)
}

/// Every vertex as gloss wants it, and the factors of all lobes: bands after bands, times pi.
pub(super) fn gloss_points(
    surfaces: &[Surface],
    gloss: &GlossTransfer,
    space: &WorkingSpace,
) -> (Vec<PrtGlossPoint>, Vec<f32>) {
    let (mut points, mut lobes, mut shining) = (Vec::new(), Vec::new(), 0);
    for (surface, lobe) in surfaces.iter().zip(gloss.lobes()) {
        let first = lobes.len() as u32;
        if let Some(lobe) = lobe {
            lobes.extend(lobe.degree_factors(gloss.bands()).iter().map(|factor| (PI * factor) as f32));
        }
        for (position, normal) in surface.positions().iter().zip(surface.normals()) {
            let position = space.working_from_world(*position).as_vec3();
            let row = if lobe.is_some() { shining } else { MATT };
            shining += u32::from(lobe.is_some());
            points.push(PrtGlossPoint { position, row, normal: normal.as_vec3(), lobe: first });
        }
    }
    (points, lobes)
}

/// Matrices function after function, entry after entry, vertex after vertex.
pub(super) fn gloss_matrices(gloss: &GlossTransfer) -> Vec<f32> {
    let rows = gloss.rows();
    let entries = gloss.functions() * gloss.bands().coefficients().pow(2);
    (0..entries).flat_map(|e| (0..rows).map(move |row| gloss.matrices[row * entries + e])).collect()
}

/// Albedos of all surfaces, and all index maps, one after the other. An entry of the palette is a map of one texel.
pub(super) fn albedos(scene: &RelitScene<'_>) -> (Vec<PrtAlbedo>, Vec<u32>) {
    let mut index_maps: Vec<u32> = Vec::new();
    let mut first_texels = Vec::new();
    for map in scene.index_maps {
        first_texels.push(index_maps.len() as u32);
        index_maps.extend(&map.entries);
    }
    let layers = 3 * scene.functions() * blocks(scene.coefficients());
    let mut albedo = |albedo: &Albedo| match albedo {
        Albedo::Entry(entry) => {
            index_maps.push(*entry);
            PrtAlbedo { map_size: UVec2::ONE, first: index_maps.len() as u32 - 1, spectral: 0 }
        }
        Albedo::Indexed { map, .. } => PrtAlbedo {
            map_size: UVec2::from(scene.index_maps[*map].size),
            first: first_texels[*map],
            spectral: 0,
        },
        Albedo::Mapped { map, .. } => PrtAlbedo {
            map_size: UVec2::from(scene.spectral_maps[*map].size),
            first: (map * layers) as u32,
            spectral: 1,
        },
    };
    let albedos = scene.albedos.iter().map(&mut albedo).collect();
    (albedos, index_maps)
}
