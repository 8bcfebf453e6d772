//! Primitives to meshes: every way of indexing becomes a triangle list.

use glam::DVec3;

use super::accessor::Reader;
use super::document::Primitive;
use super::error::{LoadError, Warning, invalid};
use crate::Mesh;

/// Normals within this of unit length are taken as they are; f32 rounding stays below it.
const UNIT_TOLERANCE: f64 = 1e-5;

impl Mesh {
    /// The same surface with its triangles the other way round.
    pub(super) fn flipped(mut self) -> Self {
        for triangle in &mut self.triangles {
            triangle.swap(1, 2);
        }
        self
    }
}

/// Reads a primitive; `None` for points and lines, which have no surface.
pub(super) fn read(
    reader: &mut Reader<'_>,
    primitive: &Primitive,
    at: &str,
    name: String,
    warnings: &mut Vec<Warning>,
) -> Result<Option<Mesh>, LoadError> {
    let mode = primitive.mode.unwrap_or(4);
    match mode {
        0..=3 => {
            warnings.push(Warning::Ignored { at: at.into(), what: "a primitive of points or lines is" });
            return Ok(None);
        }
        4..=6 => {}
        _ => return invalid(format!("{at}.mode"), format!("is {mode}"), "it must be 0 to 6"),
    }
    // An extension may hold the real data of accessors that are there for form's sake.
    if let Some(name) = primitive.extensions.keys().find(|name| name.contains("compression")) {
        return Err(LoadError::UnsupportedExtension { name: name.clone(), at: at.into() });
    }
    let ignored = [
        ("vertex colours are", primitive.attributes.keys().any(|k| k.starts_with("COLOR_"))),
        ("morph targets are", !primitive.targets.is_empty()),
    ];
    for (what, _) in ignored.into_iter().filter(|(_, there)| *there) {
        warnings.push(Warning::Ignored { at: at.into(), what });
    }

    let Some(&positions) = primitive.attributes.get("POSITION") else {
        return invalid(at, "has no POSITION", "a surface needs positions");
    };
    let positions: Vec<[f32; 3]> = reader.vectors(positions, "POSITION")?;
    let optional = |name: &str| primitive.attributes.get(name).copied();
    let mut normals: Vec<[f32; 3]> =
        optional("NORMAL").map_or(Ok(vec![]), |i| reader.vectors(i, "NORMAL"))?;
    let uvs: Vec<[f32; 2]> =
        optional("TEXCOORD_0").map_or(Ok(vec![]), |i| reader.vectors(i, "TEXCOORD_0"))?;
    for (semantic, count) in [("NORMAL", normals.len()), ("TEXCOORD_0", uvs.len())] {
        if count != positions.len() && optional(semantic).is_some() {
            let problem = format!("has {count} of {semantic} for {} of POSITION", positions.len());
            return invalid(at, problem, "all attributes need the same count");
        }
    }
    let corners = match primitive.indices {
        Some(accessor) => reader.indices(accessor)?,
        None => (0..positions.len() as u32).collect(),
    };
    if let Some(i) = corners.iter().position(|&v| v as usize >= positions.len()) {
        let problem = format!("has {} as index {i}", corners[i]);
        return invalid(at, problem, format!("there are {} vertices", positions.len()));
    }
    let Some(triangles) = triangles(mode, &corners) else {
        let problem = format!("has {} corners", corners.len());
        return invalid(at, problem, "a triangle list needs a multiple of 3, a strip or fan at least 3");
    };
    let count = repair_normals(&mut normals, &positions, &triangles);
    if count > 0 {
        warnings.push(Warning::NormalsRepaired { at: at.into(), count });
    }
    Ok(Some(Mesh { name, positions, normals, uvs, triangles }))
}

/// Corners to triangles by glTF's mode (4 list, 5 strip, 6 fan); `None` if their number does not fit the mode.
fn triangles(mode: u32, corners: &[u32]) -> Option<Vec<[u32; 3]>> {
    if corners.is_empty() {
        return Some(vec![]);
    }
    if mode == 4 {
        let (triangles, rest) = corners.as_chunks::<3>();
        return rest.is_empty().then(|| triangles.to_vec());
    }
    if corners.len() < 3 {
        return None;
    }
    let pairs = corners[1..].windows(2);
    let triangles = match mode {
        6 => pairs.map(|p| [p[0], p[1], corners[0]]).collect(),
        // Every second triangle of a strip is wound the other way; equal corners stitch strips together.
        _ => (corners.windows(3).enumerate())
            .map(|(i, c)| if i % 2 == 0 { [c[0], c[1], c[2]] } else { [c[0], c[2], c[1]] })
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect(),
    };
    Some(triangles)
}

/// Brings normals to unit length; one of no length becomes the mean normal of its vertex's faces. Returns how
/// many were touched.
fn repair_normals(normals: &mut [[f32; 3]], positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> usize {
    let f64s = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let mut repaired = 0;
    let mut lost = Vec::new();
    for (i, normal) in normals.iter_mut().enumerate() {
        let n = f64s(*normal);
        if (n.length() - 1.0).abs() <= UNIT_TOLERANCE {
            continue;
        }
        repaired += 1;
        match n.try_normalize() {
            Some(unit) => *normal = unit.as_vec3().to_array(),
            None => lost.push(i),
        }
    }
    if lost.is_empty() {
        return repaired;
    }
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for t in triangles {
        let [a, b, c] = t.map(|v| f64s(positions[v as usize]));
        let area_normal = (b - a).cross(c - a);
        for &v in t {
            sums[v as usize] += area_normal;
        }
    }
    for i in lost {
        // A vertex of triangles without area meets no light: any direction will do.
        normals[i] = sums[i].try_normalize().unwrap_or(DVec3::Y).as_vec3().to_array();
    }
    repaired
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_one_orientation() {
        // A quad 0-1-3-2 as a strip, and as a fan 0-1-3-2.
        assert_eq!(triangles(5, &[0, 1, 2, 3]), Some(vec![[0, 1, 2], [1, 3, 2]]));
        assert_eq!(triangles(6, &[0, 1, 3, 2]), Some(vec![[1, 3, 0], [3, 2, 0]]));
        assert_eq!(triangles(5, &[0, 1, 2, 2, 4, 4, 5, 6]), Some(vec![[0, 1, 2], [4, 6, 5]]));
        assert_eq!(triangles(4, &[0, 1, 2, 3]), None);
        assert_eq!(triangles(5, &[0, 1]), None);
    }

    #[test]
    fn normals_without_length_come_from_their_faces() {
        let positions = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        let mut normals = [[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 3.0, 4.0]];
        assert_eq!(repair_normals(&mut normals, &positions, &[[0, 1, 2]]), 2);
        assert_eq!(normals, [[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.6, 0.8]]);
    }
}
