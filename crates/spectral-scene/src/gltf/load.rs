//! Reads a document's node tree into a [`Scene`].

use std::collections::HashMap;
use std::path::Path;

use glam::{DMat3, DMat4, DQuat, DVec3};

use super::SUPPORTED_EXTENSIONS;
use super::accessor::{Reader, out_of_range};
use super::document::{self as doc, Document};
use super::error::{LoadError, Warning, invalid};
use super::{container, light, material, mesh};
use crate::{Camera, Object, Scene};

/// Limits on what a small file can ask for by placing its meshes many times over.
const MAX_OBJECTS: usize = 1 << 20;
const MAX_PLACED_TRIANGLES: usize = 1 << 28;

/// Loads a `.gltf` or `.glb` file; buffers may lie in its folder or below. The scene is valid (see
/// [`Scene::validate`]), is named after the file, and has a camera if it has any geometry.
///
/// # Errors
/// [`LoadError`] says what is wrong, where, and what would be right.
pub fn load(path: impl AsRef<Path>) -> Result<(Scene, Vec<Warning>), LoadError> {
    let path = path.as_ref();
    let io = |source| LoadError::Io { path: path.into(), source };
    // Looked at before it is opened: a pipe would keep us waiting, a device might never end.
    if !std::fs::metadata(path).map_err(io)?.is_file() {
        return Err(LoadError::NotAFile { path: path.into() });
    }
    let bytes = std::fs::read(path).map_err(io)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    load_from(&bytes, &name, Some(path.parent().unwrap_or(Path::new(""))))
}

/// As [`load`], from the bytes of a `.glb`, or of a `.gltf` whose buffers are data URIs.
///
/// # Errors
/// As [`load`]; a buffer in another file is one.
pub fn load_bytes(bytes: &[u8], name: &str) -> Result<(Scene, Vec<Warning>), LoadError> {
    load_from(bytes, name, None)
}

fn load_from(bytes: &[u8], name: &str, folder: Option<&Path>) -> Result<(Scene, Vec<Warning>), LoadError> {
    let (json, binary) = container::split(bytes)?;
    let document: Document = serde_json::from_slice(json).map_err(LoadError::Json)?;
    let mut warnings = Vec::new();
    check_version(&document)?;
    check_extensions(&document, &mut warnings)?;
    if !document.animations.is_empty() {
        warnings.push(Warning::Ignored { at: "animations".into(), what: "all animation is" });
    }
    let buffers = container::buffers(&document, binary, folder)?;
    let mut loader = Loader {
        document: &document,
        reader: Reader::new(&document, buffers),
        scene: Scene { name: name.into(), ..Scene::default() },
        warnings,
        loaded: HashMap::new(),
        placed_triangles: 0,
    };
    loader.nodes()?;
    loader.materials()?;
    let Loader { mut scene, mut warnings, .. } = loader;

    let counts = scene.validate()?;
    for object in scene.turn_outwards() {
        warnings.push(Warning::InsideOut { object: scene.objects[object].name.clone() });
    }
    if counts.zero_area_triangles > 0 {
        let (zero_area, triangles) = (counts.zero_area_triangles, counts.triangles);
        warnings.push(Warning::ZeroAreaTriangles { zero_area, triangles });
    }
    if scene.lights.is_empty() {
        warnings.push(Warning::NoLight);
    }
    if scene.cameras.is_empty()
        && let Some(camera) = Camera::framing(&scene)
    {
        scene.cameras.push(camera);
        warnings.push(Warning::DefaultCamera);
    }
    Ok((scene, warnings))
}

fn check_version(document: &Document) -> Result<(), LoadError> {
    let asset = &document.asset;
    let readable = |version: &str| version.split('.').next() == Some("2");
    let minimum = asset.min_version.as_deref().unwrap_or("2.0");
    if readable(&asset.version) && minimum == "2.0" {
        Ok(())
    } else {
        let problem = format!("says version `{}`, minVersion `{minimum}`", asset.version);
        invalid("asset", problem, "glTF 2.0 is supported")
    }
}

fn check_extensions(document: &Document, warnings: &mut Vec<Warning>) -> Result<(), LoadError> {
    let unknown = |name: &&String| !SUPPORTED_EXTENSIONS.contains(&name.as_str());
    if let Some(name) = document.extensions_required.iter().find(unknown) {
        return Err(LoadError::UnsupportedExtension { name: name.clone(), at: "the file".into() });
    }
    for name in document.extensions_used.iter().filter(unknown) {
        warnings.push(Warning::ExtensionIgnored { name: name.clone() });
    }
    Ok(())
}

struct Loader<'a> {
    document: &'a Document,
    reader: Reader<'a>,
    scene: Scene,
    warnings: Vec<Warning>,
    /// Where a primitive (mesh, primitive, mirrored) went in [`Scene::meshes`]; `None` for points and lines.
    loaded: HashMap<(usize, usize, bool), Option<usize>>,
    placed_triangles: usize,
}

impl Loader<'_> {
    /// Visits the tree of the document's scene, parents before children, in the document's order.
    fn nodes(&mut self) -> Result<(), LoadError> {
        let nodes = &self.document.nodes;
        let mut visited = vec![false; nodes.len()];
        let mut stack: Vec<(usize, DMat4)> =
            self.roots()?.into_iter().rev().map(|root| (root, DMat4::IDENTITY)).collect();
        while let Some((index, world_from_parent)) = stack.pop() {
            let Some(node) = nodes.get(index) else { return out_of_range("nodes", index, nodes.len()) };
            if std::mem::replace(&mut visited[index], true) {
                let problem = "is reached twice, by two parents or in a circle";
                return invalid(format!("nodes[{index}]"), problem, "nodes must form a tree");
            }
            let world_from_node = world_from_parent * parent_from_node(index, node)?;
            if !world_from_node.is_finite() {
                let problem = "has an infinite transform together with its parents";
                return invalid(format!("nodes[{index}]"), problem, "transforms must be finite");
            }
            self.node(index, node, world_from_node)?;
            stack.extend(node.children.iter().rev().map(|&child| (child, world_from_node)));
        }
        Ok(())
    }

    /// Roots of the default scene, else of the first; of the whole document if it has no scenes.
    fn roots(&self) -> Result<Vec<usize>, LoadError> {
        let Document { scene, scenes, nodes, .. } = self.document;
        if let Some(chosen) = scenes.get(scene.unwrap_or(0)) {
            return Ok(chosen.nodes.clone());
        }
        if let Some(scene) = *scene {
            return out_of_range("scenes", scene, scenes.len());
        }
        let mut is_child = vec![false; nodes.len()];
        for &child in nodes.iter().flat_map(|node| &node.children) {
            if let Some(is_child) = is_child.get_mut(child) {
                *is_child = true;
            }
        }
        Ok((0..nodes.len()).filter(|&i| !is_child[i]).collect())
    }

    fn node(&mut self, index: usize, node: &doc::Node, world_from_node: DMat4) -> Result<(), LoadError> {
        let at = format!("nodes[{index}]");
        if node.skin.is_some() {
            self.warnings.push(Warning::Ignored { at: at.clone(), what: "a skin is" });
        }
        if let Some(mesh) = node.mesh {
            self.mesh(&at, node, mesh, world_from_node)?;
        }
        let name = node.name.clone().unwrap_or_else(|| format!("node {index}"));
        if let Some(reference) = node.extensions.as_ref().and_then(|e| e.lights_punctual.as_ref()) {
            let lights = self.document.extensions.as_ref().and_then(|e| e.lights_punctual.as_ref());
            let lights = lights.map_or(&[][..], |l| &l.lights[..]);
            let Some(light) = lights.get(reference.light) else {
                return out_of_range("KHR_lights_punctual.lights", reference.light, lights.len());
            };
            self.scene.lights.push(light::read(reference.light, light, &name, world_from_node)?);
        }
        if let Some(camera) = node.camera {
            let cameras = &self.document.cameras;
            let Some(camera) = cameras.get(camera) else {
                return out_of_range("cameras", camera, cameras.len());
            };
            match &camera.perspective {
                Some(perspective) => self.scene.cameras.push(Camera {
                    name: camera.name.clone().unwrap_or(name),
                    world_from_camera: rigid(world_from_node),
                    yfov_rad: perspective.yfov,
                    znear_m: perspective.znear,
                }),
                None => self.warnings.push(Warning::Ignored { at, what: "an orthographic camera is" }),
            }
        }
        Ok(())
    }

    fn mesh(
        &mut self,
        at: &str,
        node: &doc::Node,
        index: usize,
        world_from_mesh: DMat4,
    ) -> Result<(), LoadError> {
        let meshes = &self.document.meshes;
        let Some(mesh) = meshes.get(index) else { return out_of_range("meshes", index, meshes.len()) };
        let determinant = DMat3::from_mat4(world_from_mesh).determinant();
        if determinant == 0.0 {
            self.warnings.push(Warning::Ignored { at: at.into(), what: "a mesh scaled to nothing is" });
            return Ok(());
        }
        let mesh_name = mesh.name.clone().unwrap_or_else(|| format!("mesh {index}"));
        let object_name = node.name.as_ref().unwrap_or(&mesh_name).clone();
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let numbered = |name: &str| if p == 0 { name.to_owned() } else { format!("{name}.{p}") };
            let at = format!("meshes[{index}].primitives[{p}]");
            let key = (index, p, determinant < 0.0);
            if !self.loaded.contains_key(&key) {
                let read =
                    mesh::read(&mut self.reader, primitive, &at, numbered(&mesh_name), &mut self.warnings)?;
                let place = read.map(|mesh| {
                    self.scene.meshes.push(if determinant < 0.0 { mesh.flipped() } else { mesh });
                    self.scene.meshes.len() - 1
                });
                self.loaded.insert(key, place);
            }
            let Some(mesh) = self.loaded[&key] else { continue };
            let materials = self.document.materials.len();
            let material = match primitive.material {
                Some(m) if m >= materials => return out_of_range("materials", m, materials),
                // The default material is appended to the document's own.
                other => other.unwrap_or(materials),
            };
            self.placed_triangles += self.scene.meshes[mesh].triangles.len();
            if self.scene.objects.len() == MAX_OBJECTS || self.placed_triangles > MAX_PLACED_TRIANGLES {
                let problem = format!(
                    "brings the scene to {} objects and {} triangles",
                    self.scene.objects.len() + 1,
                    self.placed_triangles
                );
                let expected = format!("at most {MAX_OBJECTS} and {MAX_PLACED_TRIANGLES} are supported");
                return invalid(at, problem, expected);
            }
            let name = numbered(&object_name);
            self.scene.objects.push(Object { name, mesh, material, world_from_mesh });
        }
        Ok(())
    }

    /// All of the document's materials, and the default one if an object needs it.
    fn materials(&mut self) -> Result<(), LoadError> {
        let mut used = vec![false; self.document.materials.len() + 1];
        for object in &self.scene.objects {
            used[object.material] = true;
        }
        for (i, source) in self.document.materials.iter().enumerate() {
            let (material, warnings) = material::read(i, source)?;
            self.scene.materials.push(material);
            if used[i] {
                self.warnings.extend(warnings);
            }
        }
        if used[self.document.materials.len()] {
            let default = doc::Material { name: Some("default".into()), ..doc::Material::default() };
            self.scene.materials.push(material::read(self.document.materials.len(), &default)?.0);
        }
        Ok(())
    }
}

fn parent_from_node(index: usize, node: &doc::Node) -> Result<DMat4, LoadError> {
    if let Some(columns) = node.matrix {
        return Ok(DMat4::from_cols_array(&columns));
    }
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let rotation = DQuat::from_xyzw(x, y, z, w);
    if !(rotation.length() > 0.0 && rotation.length().is_finite()) {
        let at = format!("nodes[{index}].rotation");
        return invalid(at, format!("is [{x}, {y}, {z}, {w}]"), "it must be a unit quaternion");
    }
    Ok(DMat4::from_scale_rotation_translation(
        DVec3::from(node.scale.unwrap_or([1.0; 3])),
        rotation.normalize(),
        DVec3::from(node.translation.unwrap_or([0.0; 3])),
    ))
}

/// The node's position and the frame of its -Z and its Y: a camera takes no scale and no mirroring from its
/// parents.
fn rigid(world_from_node: DMat4) -> DMat4 {
    let linear = DMat3::from_mat4(world_from_node);
    let off = linear.transpose() * linear - DMat3::IDENTITY;
    if off.to_cols_array().iter().all(|c| c.abs() < 1e-12) && linear.determinant() > 0.0 {
        return world_from_node;
    }
    let backward = linear.z_axis.try_normalize().unwrap_or(DVec3::Z);
    let right =
        linear.y_axis.cross(backward).try_normalize().unwrap_or_else(|| backward.any_orthonormal_vector());
    DMat4::from_cols(
        right.extend(0.0),
        backward.cross(right).extend(0.0),
        backward.extend(0.0),
        world_from_node.w_axis,
    )
}
