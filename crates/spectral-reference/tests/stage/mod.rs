//! Small scenes for physics tests, and sums over maps.
#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::{DMat4, DVec3};
use spectral_core::dispersion::Dispersion;
use spectral_core::illuminant::Illuminant;
use spectral_core::light::LightSpectrum;
use spectral_reference::{Bake, BakeSettings, Effort, bake};
use spectral_scene::{Light, LightShape, Material, Mesh, Object, Scene};

/// An empty scene to add to.
pub(crate) struct Stage(pub(crate) Scene);

impl Stage {
    pub(crate) fn new() -> Self {
        Self(Scene { name: "test".into(), ..Scene::default() })
    }

    pub(crate) fn add(&mut self, mesh: Mesh, material: Material, world_from_mesh: DMat4) -> usize {
        let name = mesh.name.clone();
        self.0.meshes.push(mesh);
        self.0.materials.push(material);
        let (mesh, material) = (self.0.meshes.len() - 1, self.0.materials.len() - 1);
        self.0.objects.push(Object { name, mesh, material, world_from_mesh });
        self.0.objects.len() - 1
    }

    /// A square receiver on the plane y = `y`, facing up, u along x and v along z; its index.
    pub(crate) fn floor(&mut self, centre: [f64; 2], half: f64, y: f64) -> usize {
        let at = DMat4::from_translation(DVec3::new(centre[0], y, centre[1]))
            * DMat4::from_scale(DVec3::splat(half));
        self.add(square(), matte(), at)
    }

    /// White equal-energy light of 1 lux.
    pub(crate) fn sun(&mut self, direction: [f64; 3]) {
        self.light(LightShape::Directional { direction: DVec3::from(direction).normalize() }, 1.0);
    }

    pub(crate) fn light(&mut self, shape: LightShape, intensity: f64) {
        let spectrum = LightSpectrum::Illuminant(Illuminant::E);
        self.0.lights.push(Light { name: "light".into(), color: [1.0; 3], intensity, spectrum, shape });
    }
}

/// The square from -1 to 1 in x and z, facing +y.
pub(crate) fn square() -> Mesh {
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
    Mesh {
        name: "receiver".into(),
        positions: corners.map(|[x, z]| [x, 0.0, z]).to_vec(),
        uvs: corners.map(|[x, z]| [0.5 * (x + 1.0), 0.5 * (z + 1.0)]).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// The cube from -1 to 1, flat.
pub(crate) fn cube() -> Mesh {
    let positions =
        (0..8).map(|k| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { 1.0 } else { -1.0 })).collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { name: "cube".into(), positions, triangles, ..Mesh::default() }
}

/// The unit sphere from an octahedron whose faces are divided `n` times along each edge, smooth.
pub(crate) fn sphere(n: u32) -> Mesh {
    let mut mesh = Mesh { name: "sphere".into(), ..Mesh::default() };
    for octant in 0..8 {
        let sign = [0, 1, 2].map(|axis| if octant >> axis & 1 == 1 { -1.0 } else { 1.0 });
        let first = mesh.positions.len() as u32;
        let index = |i: u32, j: u32| first + i * (2 * n + 3 - i) / 2 + j;
        for i in 0..=n {
            for j in 0..=n - i {
                let corner = DVec3::new(f64::from(i), f64::from(j), f64::from(n - i - j));
                let direction = corner.normalize().to_array();
                let p = [0, 1, 2].map(|axis| (sign[axis] * direction[axis]) as f32);
                mesh.positions.push(p);
                mesh.normals.push(p);
            }
        }
        let mut face = |a, b, c| {
            let outward = sign[0] * sign[1] * sign[2] > 0.0;
            mesh.triangles.push(if outward { [a, b, c] } else { [a, c, b] });
        };
        for i in 0..n {
            for j in 0..n - i {
                face(index(i, j), index(i + 1, j), index(i, j + 1));
                if j + 1 < n - i {
                    face(index(i + 1, j), index(i + 1, j + 1), index(i, j + 1));
                }
            }
        }
    }
    mesh
}

pub(crate) fn matte() -> Material {
    Material::matt("matte", [1.0; 3])
}

pub(crate) fn glass(n: f64) -> Material {
    Material::glass("glass", Dispersion::Constant { n })
}

pub(crate) fn metal(base_color: [f64; 3]) -> Material {
    Material::mirror("metal", base_color)
}

/// Makes [`square`] a panel: u along `u`, front to `normal`.
pub(crate) fn panel(centre: DVec3, u: DVec3, normal: DVec3, half: f64) -> DMat4 {
    let columns = [u, normal, u.cross(normal)].map(|axis| (axis * half).extend(0.0));
    DMat4::from_cols(columns[0], columns[1], columns[2], centre.extend(1.0))
}

/// Scaled by half extents, then moved.
pub(crate) fn placed(centre: [f64; 3], half: [f64; 3]) -> DMat4 {
    DMat4::from_translation(DVec3::from(centre)) * DMat4::from_scale(DVec3::from(half))
}

pub(crate) fn settings(size: u32, photons: u64) -> BakeSettings {
    BakeSettings {
        size: [size; 2],
        effort: Effort::Photons(photons),
        direct_samples: 64,
        step_nm: 5.0,
        ..BakeSettings::default()
    }
}

/// Bakes, and checks what must hold in every bake: balanced books, finite and no negative light.
pub(crate) fn baked(scene: &Scene, receiver: usize, settings: &BakeSettings) -> Bake {
    let bake = bake(scene, receiver, settings, &|_| ()).expect("the stage bakes");
    let imbalance = bake.ledger.imbalance();
    assert!(imbalance < 1e-9, "imbalance {imbalance}");
    for layer in [&bake.direct, &bake.refracted, &bake.reflected] {
        assert_eq!(layer.len(), (settings.size[0] * settings.size[1]) as usize);
        assert!(layer.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
    }
    bake
}

/// Mean of a channel over a layer.
pub(crate) fn mean(layer: &[[f64; 3]], channel: usize) -> f64 {
    layer.iter().map(|xyz| xyz[channel]).sum::<f64>() / layer.len() as f64
}

/// Asserts that `got` is within a relative bound of `expected`.
pub(crate) fn assert_close(got: f64, expected: f64, relative: f64, what: &str) {
    let error = (got - expected).abs() / expected.abs();
    assert!(error <= relative, "{what}: {got}, expected {expected}, off by {error:.2e}");
}

/// RMS of the difference of Y over RMS of Y of the second.
pub(crate) fn relative_rms(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let difference: f64 = a.iter().zip(b).map(|(a, b)| (a[1] - b[1]).powi(2)).sum();
    (difference / b.iter().map(|b| b[1] * b[1]).sum::<f64>()).sqrt()
}

/// Unpolarised Fresnel reflectance by the textbook, for light from vacuum.
pub(crate) fn fresnel(cos_i: f64, n: f64) -> f64 {
    let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (n * n)).sqrt();
    let s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
    let p = (n * cos_i - cos_t) / (n * cos_i + cos_t);
    0.5 * (s * s + p * p)
}
