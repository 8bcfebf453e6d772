//! Solids with flat facets; their meshes have no normals.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::Mesh;

/// A flat mesh from polygons that are counter-clockwise seen from outside, each cut into a triangle fan.
fn faceted(name: &str, corners: &[DVec3], polygons: &[Vec<usize>]) -> Mesh {
    let triangles = polygons
        .iter()
        .flat_map(|p| p[1..].windows(2).map(|pair| [p[0], pair[0], pair[1]].map(|i| i as u32)))
        .collect();
    Mesh {
        name: name.into(),
        positions: corners.iter().map(|c| c.as_vec3().to_array()).collect(),
        triangles,
        ..Mesh::default()
    }
}

/// The gem of the outside reference: two rings of 8 and two apexes, 24 faces after cutting the girdle's
/// 8 quadrilaterals, in world coordinates.
pub(super) fn gem() -> Mesh {
    let ring = |y: f64| {
        (0..8).map(move |i| {
            let (sin, cos) = ((f64::from(i) + 0.5) * 45.0 + 7.0).to_radians().sin_cos();
            DVec3::new(0.05 * cos, y, 0.05 * sin)
        })
    };
    let (apex, culet) = (DVec3::Y * 0.102, DVec3::Y * 0.060);
    let corners: Vec<DVec3> = ring(0.084).chain(ring(0.076)).chain([apex, culet]).collect();
    let (apex, culet) = (16, 17);
    let polygons: Vec<Vec<usize>> = (0..8)
        .flat_map(|i| {
            let next = (i + 1) % 8;
            [vec![i, apex, next], vec![8 + i, i, next, 8 + next], vec![culet, 8 + i, 8 + next]]
        })
        .collect();
    faceted("gem", &corners, &polygons)
}

/// A standard round brilliant of girdle radius 1 about the y axis, table up, culet pointed: 57 facets and a
/// girdle of 16, 110 triangles.
///
/// Proportions after Tolkowsky (Diamond Design, 1919): table 53 %, crown angle 34.5, pavilion angle 40.75
/// degrees; star facets reach half way to the girdle, lower halves 77 % of the way to the culet.
pub(super) fn brilliant() -> Mesh {
    const TABLE: f64 = 0.53;
    const STAR: f64 = 0.5;
    const LOWER_HALF: f64 = 0.77;
    const GIRDLE: f64 = 0.03;
    let (crown, pavilion) = (34.5_f64.to_radians().tan(), 40.75_f64.to_radians().tan());
    let half_step = (TAU / 16.0).cos();
    // `sixteenth` counts places round the girdle; the main facets stand at the even ones.
    let at = |radius: f64, sixteenth: usize, y: f64| {
        let (sin, cos) = (TAU * sixteenth as f64 / 16.0).sin_cos();
        DVec3::new(radius * cos, y, radius * sin)
    };
    // Heights on the planes of the crown's and the pavilion's main facets, `along` their own axis.
    let on_crown = |along: f64| GIRDLE / 2.0 + crown * (1.0 - along);
    let on_pavilion = |along: f64| -GIRDLE / 2.0 - pavilion * (1.0 - along);
    let star_radius = TABLE * half_step + STAR * (1.0 - TABLE * half_step);
    let lower_radius = 1.0 - LOWER_HALF;

    let mut corners = Vec::new();
    let mut ring = |places: Vec<usize>, radius: f64, y: f64| {
        let first = corners.len();
        corners.extend(places.iter().map(|&k| at(radius, k, y)));
        first
    };
    let (even, odd) = (|| (0..16).step_by(2).collect(), || (1..16).step_by(2).collect());
    let table = ring(even(), TABLE, on_crown(TABLE));
    let star = ring(odd(), star_radius, on_crown(star_radius * half_step));
    let upper = ring((0..16).collect(), 1.0, GIRDLE / 2.0);
    let lower = ring((0..16).collect(), 1.0, -GIRDLE / 2.0);
    let junction = ring(odd(), lower_radius, on_pavilion(lower_radius * half_step));
    let culet = ring(vec![0], 0.0, on_pavilion(0.0));

    let mut polygons = vec![(0..8).rev().map(|k| table + k).collect()];
    for k in 0..8 {
        // Angles grow from x to z, clockwise seen from above.
        let (next, before) = ((k + 1) % 8, (k + 7) % 8);
        let (main, half, next_main) = (2 * k, 2 * k + 1, (2 * k + 2) % 16);
        polygons.extend([
            vec![table + k, table + next, star + k],
            vec![table + k, star + k, upper + main, star + before],
            vec![star + k, upper + half, upper + main],
            vec![star + k, upper + next_main, upper + half],
            vec![upper + main, upper + half, lower + half, lower + main],
            vec![upper + half, upper + next_main, lower + next_main, lower + half],
            vec![junction + k, lower + main, lower + half],
            vec![junction + k, lower + half, lower + next_main],
            vec![culet, junction + before, lower + main, junction + k],
        ]);
    }
    faceted("diamond", &corners, &polygons)
}

/// A prism of the given length along z over an equilateral triangle in the xy plane, centred on its
/// centroid, with one edge pointing along +x.
pub(super) fn equilateral_prism(side: f64, length: f64) -> Mesh {
    let radius = side / 3_f64.sqrt();
    let corners: Vec<DVec3> = [-0.5, 0.5]
        .iter()
        .flat_map(|end| {
            (0..3).map(move |k| {
                let (sin, cos) = (TAU * f64::from(k) / 3.0).sin_cos();
                DVec3::new(radius * cos, radius * sin, length * end)
            })
        })
        .collect();
    let mut polygons = vec![vec![2, 1, 0], vec![3, 4, 5]];
    polygons.extend((0..3).map(|k| vec![k, (k + 1) % 3, (k + 1) % 3 + 3, k + 3]));
    faceted("prism", &corners, &polygons)
}

/// A plate in the xz plane of half extents `half`, pierced by a slit of half extents `slit`, `thickness` in y.
pub(super) fn slit_plate(half: [f64; 2], slit: [f64; 2], thickness: f64) -> Mesh {
    let signs = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
    // Outer rim above, outer rim below, slit above, slit below; each counter-clockwise seen from above.
    let corners: Vec<DVec3> = [(half, 0.5), (half, -0.5), (slit, 0.5), (slit, -0.5)]
        .iter()
        .flat_map(|&(extent, y)| signs.map(|[x, z]| DVec3::new(x * extent[0], y * thickness, z * extent[1])))
        .collect();
    let polygons: Vec<Vec<usize>> = (0..4)
        .flat_map(|k| {
            let n = (k + 1) % 4;
            let [above, below, slit_above, slit_below] = [0, 4, 8, 12];
            [
                vec![above + k, above + n, slit_above + n, slit_above + k],
                vec![below + n, below + k, slit_below + k, slit_below + n],
                vec![above + n, above + k, below + k, below + n],
                vec![slit_above + k, slit_above + n, slit_below + n, slit_below + k],
            ]
        })
        .collect();
    faceted("slit-plate", &corners, &polygons)
}
