//! Writes a [`Scene`] as `.glb`.

use std::collections::HashMap;

use glam::{DMat3, DMat4, DVec3};

use super::document::{self as doc, Document};
use super::{SUPPORTED_EXTENSIONS, container, light, material};
use crate::{Mesh, Scene, SceneError};

const F32: u32 = 5126;
const U32: u32 = 5125;
const VERTEX_DATA: u32 = 34962;
const INDEX_DATA: u32 = 34963;

/// Why a scene cannot be written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SaveError {
    /// It is not valid.
    #[error("the scene is not valid: {0}")]
    Scene(#[from] SceneError),
    /// A `.glb` file states its length in 32 bits.
    #[error("the scene takes more than the 4 GiB that a .glb can hold")]
    TooLarge,
}

/// The scene as a `.glb` file. [`load_bytes`](super::load_bytes) gives it back: exactly, but for directions of
/// lights (rounding of the last bit), and meshes that no object uses and objects without triangles (left out).
///
/// glTF forbids shear in a node, so an object under a sheared transform is written with its vertices already
/// in world space.
///
/// # Errors
/// If the scene is not valid, or too large for the format.
pub fn to_glb(scene: &Scene) -> Result<Vec<u8>, SaveError> {
    scene.validate()?;
    let mut writer = Writer::default();
    writer.document.materials = scene.materials.iter().map(material::write).collect();
    for object in 0..scene.objects.len() {
        writer.object(scene, object);
    }
    let mut lights = Vec::new();
    for (i, light) in scene.lights.iter().enumerate() {
        let (light, node) = light::write(i, light);
        lights.push(light);
        writer.document.nodes.push(node);
    }
    for camera in &scene.cameras {
        let perspective = doc::Perspective { yfov: camera.yfov_rad, znear: camera.znear_m };
        writer.document.cameras.push(doc::Camera {
            name: Some(camera.name.clone()),
            kind: "perspective".into(),
            perspective: Some(perspective),
        });
        let index = writer.document.cameras.len() - 1;
        let node = node(&camera.name, camera.world_from_camera);
        writer.document.nodes.push(doc::Node { camera: Some(index), ..node });
    }
    let Writer { mut document, binary, .. } = writer;
    document.asset = doc::Asset {
        version: "2.0".into(),
        min_version: None,
        generator: Some(concat!("spectral-scene ", env!("CARGO_PKG_VERSION")).into()),
    };
    document.scene = Some(0);
    document.scenes =
        vec![doc::SceneRoots { name: Some(scene.name.clone()), nodes: (0..document.nodes.len()).collect() }];
    if !lights.is_empty() {
        let lights_punctual = Some(doc::Lights { lights });
        document.extensions = Some(doc::DocumentExtensions { lights_punctual });
    }
    if !binary.is_empty() {
        document.buffers = vec![doc::Buffer { uri: None, byte_length: binary.len() }];
    }
    document.extensions_used = extensions_used(&document);
    let json = serde_json::to_vec(&document).expect("strings and finite numbers always serialise");
    container::join(&json, &binary).ok_or(SaveError::TooLarge)
}

fn extensions_used(document: &Document) -> Vec<String> {
    let any = |has: fn(&doc::MaterialExtensions) -> bool| {
        document.materials.iter().filter_map(|m| m.extensions.as_ref()).any(has)
    };
    let used = |name: &str| match name {
        "KHR_lights_punctual" => document.extensions.is_some(),
        "KHR_materials_dispersion" => any(|e| e.dispersion.is_some()),
        "KHR_materials_emissive_strength" => any(|e| e.emissive_strength.is_some()),
        "KHR_materials_ior" => any(|e| e.ior.is_some()),
        "KHR_materials_iridescence" => any(|e| e.iridescence.is_some()),
        "KHR_materials_transmission" => any(|e| e.transmission.is_some()),
        _ => any(|e| e.volume.is_some()),
    };
    SUPPORTED_EXTENSIONS.iter().filter(|name| used(name)).map(|name| (*name).to_owned()).collect()
}

fn node(name: &str, world_from_node: DMat4) -> doc::Node {
    doc::Node {
        name: Some(name.into()),
        matrix: (world_from_node != DMat4::IDENTITY).then(|| world_from_node.to_cols_array()),
        ..doc::Node::default()
    }
}

#[derive(Default)]
struct Writer {
    document: Document,
    binary: Vec<u8>,
    /// glTF meshes by (mesh, material, mirrored): glTF puts the material into the mesh.
    written: HashMap<(usize, usize, bool), usize>,
}

impl Writer {
    fn object(&mut self, scene: &Scene, index: usize) {
        let object = &scene.objects[index];
        let mesh = &scene.meshes[object.mesh];
        if mesh.triangles.is_empty() {
            return;
        }
        let linear = DMat3::from_mat4(object.world_from_mesh);
        let (written, world_from_mesh) = if has_shear(linear) {
            (self.mesh(&in_world_space(scene, index), object.material), DMat4::IDENTITY)
        } else {
            // glTF turns the triangles of a mirrored node round by itself.
            let mirrored = linear.determinant() < 0.0;
            let key = (object.mesh, object.material, mirrored);
            let written = match self.written.get(&key) {
                Some(&written) => written,
                None if mirrored => self.mesh(&mesh.clone().flipped(), object.material),
                None => self.mesh(mesh, object.material),
            };
            self.written.insert(key, written);
            (written, object.world_from_mesh)
        };
        let node = node(&object.name, world_from_mesh);
        self.document.nodes.push(doc::Node { mesh: Some(written), ..node });
    }

    fn mesh(&mut self, mesh: &Mesh, material: usize) -> usize {
        let mut attributes = std::collections::BTreeMap::new();
        let bounds = |pick: fn(f32, f32) -> f32| {
            let bound =
                mesh.positions.iter().copied().reduce(|a, b| std::array::from_fn(|k| pick(a[k], b[k])));
            bound.unwrap_or_default().map(f64::from).to_vec()
        };
        let positions = self.accessor("VEC3", F32, &mesh.positions, |c| c.to_le_bytes());
        self.document.accessors[positions].min = bounds(f32::min);
        self.document.accessors[positions].max = bounds(f32::max);
        attributes.insert("POSITION".into(), positions);
        if !mesh.normals.is_empty() {
            let normals = self.accessor("VEC3", F32, &mesh.normals, |c| c.to_le_bytes());
            attributes.insert("NORMAL".into(), normals);
        }
        if !mesh.uvs.is_empty() {
            let uvs = self.accessor("VEC2", F32, &mesh.uvs, |c| c.to_le_bytes());
            attributes.insert("TEXCOORD_0".into(), uvs);
        }
        let corners: Vec<[u32; 1]> = mesh.triangles.iter().flatten().map(|&v| [v]).collect();
        let indices = self.accessor("SCALAR", U32, &corners, |c| c.to_le_bytes());
        let primitive = doc::Primitive {
            attributes,
            indices: Some(indices),
            material: Some(material),
            ..doc::Primitive::default()
        };
        self.document.meshes.push(doc::Mesh { name: Some(mesh.name.clone()), primitives: vec![primitive] });
        self.document.meshes.len() - 1
    }

    /// Appends elements of four-byte components in a buffer view of their own.
    fn accessor<T: Copy, const N: usize>(
        &mut self,
        kind: &str,
        component_type: u32,
        elements: &[[T; N]],
        bytes: impl Fn(T) -> [u8; 4],
    ) -> usize {
        let byte_offset = self.binary.len();
        self.binary.extend(elements.iter().flatten().flat_map(|&component| bytes(component)));
        self.document.buffer_views.push(doc::BufferView {
            buffer: 0,
            byte_offset,
            byte_length: self.binary.len() - byte_offset,
            target: Some(if N == 1 { INDEX_DATA } else { VERTEX_DATA }),
            ..doc::BufferView::default()
        });
        self.document.accessors.push(doc::Accessor {
            buffer_view: Some(self.document.buffer_views.len() - 1),
            component_type,
            count: elements.len(),
            kind: kind.into(),
            ..doc::Accessor::default()
        });
        self.document.accessors.len() - 1
    }
}

/// The columns are not perpendicular, beyond the rounding of f32 matrices.
fn has_shear(linear: DMat3) -> bool {
    let (x, y, z) = (linear.x_axis.normalize(), linear.y_axis.normalize(), linear.z_axis.normalize());
    [x.dot(y), y.dot(z), z.dot(x)].iter().any(|cosine| cosine.abs() > 1e-6)
}

fn in_world_space(scene: &Scene, object: usize) -> Mesh {
    let world = scene.world_mesh(object);
    let f32s = |v: &DVec3| v.as_vec3().to_array();
    let mesh = &scene.meshes[scene.objects[object].mesh];
    Mesh {
        positions: world.positions.iter().map(f32s).collect(),
        normals: world.normals.iter().map(f32s).collect(),
        ..mesh.clone()
    }
}
