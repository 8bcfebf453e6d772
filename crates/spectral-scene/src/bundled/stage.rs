//! Puts scenes together: floors and boxes with UVs, suns and cameras.

use glam::{DMat4, DVec3};
use spectral_core::dispersion::Dispersion;
use spectral_core::light::LightSpectrum;

use crate::{Camera, Light, LightShape, Material, Mesh, Object, Scene};

/// Light grey of walls and floors, linear sRGB.
pub(super) const GREY: [f64; 3] = [0.73, 0.73, 0.73];
const RED: [f64; 3] = [0.63, 0.065, 0.05];
const GREEN: [f64; 3] = [0.14, 0.45, 0.091];

/// A scene under construction.
pub(super) struct Stage(pub(super) Scene);

impl Stage {
    pub(super) fn new(name: &str) -> Self {
        Stage(Scene { name: name.into(), ..Scene::default() })
    }

    /// Places a mesh under the mesh's own name. Equal materials are shared.
    pub(super) fn place(&mut self, mesh: Mesh, material: Material, world_from_mesh: DMat4) {
        let scene = &mut self.0;
        let material = scene.materials.iter().position(|m| *m == material).unwrap_or_else(|| {
            scene.materials.push(material);
            scene.materials.len() - 1
        });
        let name = mesh.name.clone();
        scene.meshes.push(mesh);
        scene.objects.push(Object { name, mesh: scene.meshes.len() - 1, material, world_from_mesh });
    }

    /// The main receiver: a grey square on y = 0 with u along +x and v along +z.
    pub(super) fn floor(&mut self, centre_x: f64, centre_z: f64, half: f64) {
        self.floor_of(centre_x, centre_z, half, matte("grey", GREY));
    }

    pub(super) fn floor_of(&mut self, centre_x: f64, centre_z: f64, half: f64, material: Material) {
        let corner = DVec3::new(centre_x - half, 0.0, centre_z - half);
        let quad = quad("receiver", corner, DVec3::X * 2.0 * half, DVec3::Z * 2.0 * half);
        self.place(quad, material, DMat4::IDENTITY);
    }

    /// The floor of side `2 * half`, with a red wall on the left, a green one on the right and a grey one
    /// behind: a Cornell box without the ceiling and the front, so that light from outside comes in.
    pub(super) fn cornell_box(&mut self, half: f64, height: f64) {
        self.floor(0.0, 0.0, half);
        self.walls(half, height, [matte("grey", GREY), matte("red", RED), matte("green", GREEN)]);
    }

    /// Walls behind, on the left and on the right of a square of side `2 * half` about the origin.
    pub(super) fn walls(&mut self, half: f64, height: f64, [back, left, right]: [Material; 3]) {
        let (side, down) = (2.0 * half, DVec3::NEG_Y * height);
        let mut wall = |name, corner, u_edge, material| {
            self.place(quad(name, corner, u_edge, down), material, DMat4::IDENTITY);
        };
        wall("wall-back", DVec3::new(-half, height, -half), DVec3::X * side, back);
        wall("wall-left", DVec3::new(-half, height, half), DVec3::NEG_Z * side, left);
        wall("wall-right", DVec3::new(half, height, -half), DVec3::Z * side, right);
    }

    /// A white directional light.
    pub(super) fn sun(&mut self, direction: DVec3, lux: f64, spectrum: LightSpectrum) {
        let shape = LightShape::Directional { direction: direction.normalize() };
        self.0.lights.push(Light { name: "sun".into(), color: [1.0; 3], intensity: lux, spectrum, shape });
    }

    /// The default camera.
    pub(super) fn camera(&mut self, eye: DVec3, target: DVec3) {
        self.0.cameras.push(Camera::look_at(eye, target));
    }
}

/// A parallelogram whose texture runs from `corner` along `u_edge` and `v_edge`; it faces `v_edge x u_edge`.
pub(super) fn quad(name: &str, corner: DVec3, u_edge: DVec3, v_edge: DVec3) -> Mesh {
    let normal = v_edge.cross(u_edge).normalize().as_vec3().to_array();
    let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
    Mesh {
        name: name.into(),
        positions: corners.map(|[u, v]| (corner + u_edge * u + v_edge * v).as_vec3().to_array()).to_vec(),
        normals: vec![normal; 4],
        uvs: corners.map(|uv| uv.map(|c| c as f32)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// An opaque, rough surface of the given linear sRGB reflectance, seen from both sides.
pub(super) fn matte(name: &str, base_color: [f64; 3]) -> Material {
    Material { double_sided: true, ..Material::matt(name, base_color) }
}

/// Clear, smooth glass. `thickness_m` is for other viewers of the written glTF; here geometry decides.
pub(super) fn clear(name: &str, dispersion: Dispersion, thickness_m: f64) -> Material {
    Material { thickness_m, ..Material::glass(name, dispersion) }
}
