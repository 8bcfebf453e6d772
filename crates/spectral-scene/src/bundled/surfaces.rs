//! Smooth surfaces, computed in f64 and rounded to f32 once.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::DVec3;

use crate::Mesh;

/// Points of the unit sphere and the triangles between them, counter-clockwise from outside.
pub(super) struct SphereGrid {
    pub(super) directions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl SphereGrid {
    /// An icosahedron whose 20 faces are cut into `frequency`^2 triangles each.
    pub(super) fn geodesic(frequency: u32) -> Self {
        let (corners, faces) = icosahedron();
        let mut directions = corners.clone();
        let mut triangles = Vec::with_capacity(faces.len() * (frequency * frequency) as usize);
        // Points on an icosahedron edge are shared by two faces: keyed by its ends and the place between.
        let mut on_edge: HashMap<(u32, u32, u32), u32> = HashMap::new();
        for face in faces {
            let mut vertex = |weights: [u32; 3]| -> u32 {
                let used: Vec<usize> = (0..3).filter(|&k| weights[k] > 0).collect();
                let point = |k: usize| corners[face[k] as usize] * f64::from(weights[k]);
                let mut push = |point: DVec3| {
                    directions.push(point.normalize());
                    (directions.len() - 1) as u32
                };
                match used[..] {
                    [k] => face[k],
                    [a, b] => {
                        let (a, b) = if face[a] < face[b] { (a, b) } else { (b, a) };
                        *on_edge
                            .entry((face[a], face[b], weights[b]))
                            .or_insert_with(|| push(point(a) + point(b)))
                    }
                    _ => push(point(0) + point(1) + point(2)),
                }
            };
            // Row i lies i steps from corner 0; its j-th point lies j steps towards corner 2.
            let rows: Vec<Vec<u32>> = (0..=frequency)
                .map(|i| (0..=i).map(|j| vertex([frequency - i, i - j, j])).collect())
                .collect();
            for pair in rows.windows(2) {
                let (near, far) = (&pair[0], &pair[1]);
                for j in 0..near.len() {
                    triangles.push([near[j], far[j], far[j + 1]]);
                    if j + 1 < near.len() {
                        triangles.push([near[j], far[j + 1], near[j + 1]]);
                    }
                }
            }
        }
        Self { directions, triangles }
    }

    /// Every triangle cut into four at its edges' midpoints, which are moved out onto the sphere.
    pub(super) fn subdivided(mut self) -> Self {
        let mut midpoints: HashMap<(u32, u32), u32> = HashMap::new();
        let directions = &mut self.directions;
        let mut midpoint = |a: u32, b: u32| {
            *midpoints.entry((a.min(b), a.max(b))).or_insert_with(|| {
                directions.push((directions[a as usize] + directions[b as usize]).normalize());
                (directions.len() - 1) as u32
            })
        };
        let triangles = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (midpoint(a, b), midpoint(b, c), midpoint(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
        Self { triangles, ..self }
    }

    /// The star-shaped surface through `point(direction)`, which also gives a normal of any length.
    pub(super) fn surface(self, name: &str, point: impl Fn(DVec3) -> (DVec3, DVec3)) -> Mesh {
        let (positions, normals) = self.directions.iter().map(|&d| vertex(point(d))).unzip();
        Mesh { name: name.into(), positions, normals, uvs: vec![], triangles: self.triangles }
    }
}

/// The point in direction `d` of the surface |x| = r(x / |x|) and its normal r d - grad r, the gradient taken along the
/// sphere; any part of `gradient` across it does not count.
pub(super) fn star_shaped(d: DVec3, radius: f64, gradient: DVec3) -> (DVec3, DVec3) {
    (d * radius, d * radius - (gradient - d * gradient.dot(d)))
}

/// The 12 corners and 20 faces of the icosahedron, counter-clockwise from outside.
fn icosahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let golden = (1.0 + 5_f64.sqrt()) / 2.0;
    let mut corners = Vec::new();
    for axis in 0..3 {
        for (one, long) in [(-1.0, -golden), (1.0, -golden), (-1.0, golden), (1.0, golden)] {
            let mut p = [0.0; 3];
            p[(axis + 1) % 3] = one;
            p[(axis + 2) % 3] = long;
            corners.push(DVec3::from(p).normalize());
        }
    }
    // Neighbours are the nearest corners, at distance 2 / |(1, golden)|.
    let edge = 2.0 / golden.hypot(1.0);
    let adjacent = |a: usize, b: usize| (corners[a].distance(corners[b]) - edge).abs() < 1e-9;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if adjacent(a, b) && adjacent(b, c) && adjacent(c, a) {
                    let outward =
                        (corners[b] - corners[a]).cross(corners[c] - corners[a]).dot(corners[a]) > 0.0;
                    let [b, c] = if outward { [b, c] } else { [c, b] };
                    faces.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    (corners, faces)
}

fn vertex((position, normal): (DVec3, DVec3)) -> ([f32; 3], [f32; 3]) {
    (position.as_vec3().to_array(), normal.normalize().as_vec3().to_array())
}

/// A torus about the y axis with `2 * around * across` faces.
pub(super) fn torus(name: &str, major: f64, minor: f64, around: u32, across: u32) -> Mesh {
    let mut mesh = Mesh { name: name.into(), ..Mesh::default() };
    for i in 0..around {
        let (sin_i, cos_i) = (TAU * f64::from(i) / f64::from(around)).sin_cos();
        let outward = DVec3::new(cos_i, 0.0, sin_i);
        for j in 0..across {
            let (sin_j, cos_j) = (TAU * f64::from(j) / f64::from(across)).sin_cos();
            let normal = outward * cos_j + DVec3::Y * sin_j;
            push(&mut mesh, outward * major + normal * minor, normal);
            let at = |i: u32, j: u32| (i % around) * across + j % across;
            mesh.triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
        }
    }
    mesh
}

/// A point of a profile in the half plane (distance from the axis, y), with its normal in that plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct ProfilePoint {
    pub(super) radius: f64,
    pub(super) y: f64,
    pub(super) normal: [f64; 2],
}

/// A surface of revolution about y in `segments` sectors. Each run of the profile is smooth; between two
/// runs, which share a point but not its normal, lies a crease. The profile starts and ends on the axis, or
/// ends where it starts, and the outside lies to its right (going outwards along +radius, the surface faces -y).
pub(super) fn revolve(name: &str, runs: &[Vec<ProfilePoint>], segments: u32) -> Mesh {
    let mut mesh = Mesh { name: name.into(), ..Mesh::default() };
    for run in runs {
        let mut previous: Option<(u32, bool)> = None;
        for p in run {
            let first = mesh.positions.len() as u32;
            let pole = p.radius == 0.0;
            for s in 0..if pole { 1 } else { segments } {
                let (sin, cos) = (TAU * f64::from(s) / f64::from(segments)).sin_cos();
                let out = DVec3::new(cos, 0.0, sin);
                push(&mut mesh, out * p.radius + DVec3::Y * p.y, out * p.normal[0] + DVec3::Y * p.normal[1]);
            }
            if let Some((before, before_is_pole)) = previous {
                for s in 0..segments {
                    let next = (s + 1) % segments;
                    let old = |s| if before_is_pole { before } else { before + s };
                    let new = |s| if pole { first } else { first + s };
                    if !pole {
                        mesh.triangles.push([old(s), new(s), new(next)]);
                    }
                    if !before_is_pole {
                        mesh.triangles.push([old(s), new(next), old(next)]);
                    }
                }
            }
            previous = Some((first, pole));
        }
    }
    mesh
}

/// An open height field over the square of half side `half` about the origin, `2 * cells^2` faces,
/// facing +y. `height` gives y and its slopes along x and z.
pub(super) fn height_field(
    name: &str,
    half: f64,
    cells: u32,
    height: impl Fn(f64, f64) -> (f64, [f64; 2]),
) -> Mesh {
    let mut mesh = Mesh { name: name.into(), ..Mesh::default() };
    let coordinate = |i: u32| half * (2.0 * f64::from(i) / f64::from(cells) - 1.0);
    for i in 0..=cells {
        for j in 0..=cells {
            let (x, z) = (coordinate(j), coordinate(i));
            let (y, slope) = height(x, z);
            push(&mut mesh, DVec3::new(x, y, z), DVec3::new(-slope[0], 1.0, -slope[1]));
            if i < cells && j < cells {
                let at = |i: u32, j: u32| i * (cells + 1) + j;
                mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    mesh
}

/// Height and slopes of sine waves about the height `level`: wave vector along x and z (rad/m), height (m), phase.
pub(super) fn waves(level: f64, waves: &[([f64; 2], f64, f64)]) -> impl Fn(f64, f64) -> (f64, [f64; 2]) {
    move |x, z| {
        waves.iter().fold((level, [0.0; 2]), |(y, slope), &([kx, kz], height, phase)| {
            let (sin, cos) = (kx * x + kz * z + phase).sin_cos();
            (y + height * sin, [slope[0] + height * kx * cos, slope[1] + height * kz * cos])
        })
    }
}

fn push(mesh: &mut Mesh, position: DVec3, normal: DVec3) {
    let (position, normal) = vertex((position, normal));
    mesh.positions.push(position);
    mesh.normals.push(normal);
}
