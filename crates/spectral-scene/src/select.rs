//! Which objects refract, mirror or can be baked onto, and an object's mesh in world space.

use glam::{DMat3, DVec3};

use crate::{Material, Scene};

/// Why no object can serve as the receiver that was asked for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReceiverError {
    /// No node and no mesh has this name.
    #[error("no object or mesh is named `{name}`; {}", list(.receivers))]
    Unknown {
        /// The name asked for.
        name: String,
        /// Names that would have worked.
        receivers: Vec<String>,
    },
    /// The mesh cannot be baked onto without texture coordinates.
    #[error("`{name}` has no texture coordinates to bake onto; {}", list(.receivers))]
    NoUvs {
        /// The name asked for.
        name: String,
        /// Names that would have worked.
        receivers: Vec<String>,
    },
    /// Nothing lands on a mirror.
    #[error("`{name}` is made of the polished metal `{material}`, a receiver is matt; {}", list(.receivers))]
    Mirror {
        /// The name asked for.
        name: String,
        /// The material's name.
        material: String,
        /// Names that would have worked.
        receivers: Vec<String>,
    },
    /// Light passes through glass; only opaque surfaces are baked.
    #[error("`{name}` is made of the refracting material `{material}`, a receiver is opaque; {}", list(.receivers))]
    Refractor {
        /// The name asked for.
        name: String,
        /// The material's name.
        material: String,
        /// Names that would have worked.
        receivers: Vec<String>,
    },
}

fn list(receivers: &[String]) -> String {
    match receivers {
        [] => "the scene has no matt object with texture coordinates".into(),
        names => format!("receivers in the scene: {}", names.join(", ")),
    }
}

impl Scene {
    /// Objects that light passes through, as indices into [`Scene::objects`].
    pub fn refractors(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.objects.len()).filter(|&i| self.material_of(i).is_refractor())
    }

    /// Objects that are mirrors, as indices into [`Scene::objects`].
    pub fn mirrors(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.objects.len()).filter(|&i| self.material_of(i).is_mirror())
    }

    /// Objects that throw caustics, refractors and mirrors, as indices into [`Scene::objects`].
    pub fn casters(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.objects.len())
            .filter(|&i| self.material_of(i).is_refractor() || self.material_of(i).is_mirror())
    }

    /// Objects that light lands on, neither refractors nor mirrors, as indices into [`Scene::objects`].
    pub fn matt(&self) -> impl Iterator<Item = usize> + '_ {
        self.opaque().filter(|&i| !self.material_of(i).is_mirror())
    }

    /// Objects that block light, mirrors among them, as indices into [`Scene::objects`].
    pub fn opaque(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.objects.len()).filter(|&i| !self.material_of(i).is_refractor())
    }

    /// Matt objects with texture coordinates, as indices into [`Scene::objects`].
    pub fn receivers(&self) -> impl Iterator<Item = usize> + '_ {
        self.matt().filter(|&i| !self.meshes[self.objects[i].mesh].uvs.is_empty())
    }

    /// The object to bake onto: the first receiver whose own name, or else whose mesh's name, is `name`.
    ///
    /// # Errors
    /// [`ReceiverError`], which lists the receivers that there are.
    pub fn receiver(&self, name: &str) -> Result<usize, ReceiverError> {
        let by_object = |&i: &usize| self.objects[i].name == name;
        let by_mesh = |&i: &usize| self.meshes[self.objects[i].mesh].name == name;
        if let Some(found) = self.receivers().find(by_object).or_else(|| self.receivers().find(by_mesh)) {
            return Ok(found);
        }
        let receivers = self.receivers().map(|i| self.objects[i].name.clone()).collect();
        let name = name.to_owned();
        let mut all = 0..self.objects.len();
        Err(match all.clone().find(by_object).or_else(|| all.find(by_mesh)) {
            None => ReceiverError::Unknown { name, receivers },
            Some(i) if self.material_of(i).is_refractor() => {
                ReceiverError::Refractor { name, material: self.material_of(i).name.clone(), receivers }
            }
            Some(i) if self.material_of(i).is_mirror() => {
                ReceiverError::Mirror { name, material: self.material_of(i).name.clone(), receivers }
            }
            Some(_) => ReceiverError::NoUvs { name, receivers },
        })
    }

    /// The material of an object, by its index into [`Scene::objects`].
    ///
    /// # Panics
    /// If the index, or the object's own, is out of range; [`Scene::validate`] rules the latter out.
    pub fn material_of(&self, object: usize) -> &Material {
        &self.materials[self.objects[object].material]
    }

    /// An object's mesh moved into world space, in f64.
    ///
    /// Normals go through the inverse transpose and are of unit length again. Triangles keep their order, see
    /// [`Mesh::triangles`](crate::Mesh::triangles).
    ///
    /// # Panics
    /// If an index is out of range; [`Scene::validate`] rules that out.
    pub fn world_mesh(&self, object: usize) -> WorldMesh<'_> {
        let object = &self.objects[object];
        let mesh = &self.meshes[object.mesh];
        let world_from_mesh = object.world_from_mesh;
        let world_from_normal = normal_matrix(DMat3::from_mat4(world_from_mesh));
        WorldMesh {
            positions: mesh
                .positions
                .iter()
                .map(|&p| world_from_mesh.transform_point3(DVec3::from(p.map(f64::from))))
                .collect(),
            normals: mesh
                .normals
                .iter()
                .map(|&n| (world_from_normal * DVec3::from(n.map(f64::from))).normalize_or_zero())
                .collect(),
            uvs: &mesh.uvs,
            triangles: &mesh.triangles,
        }
    }

    /// Smallest and largest world coordinate over the given objects; `None` if they have no vertices.
    pub fn bounds(&self, objects: impl IntoIterator<Item = usize>) -> Option<(DVec3, DVec3)> {
        let mut bounds: Option<(DVec3, DVec3)> = None;
        for object in objects {
            let Some(object) = self.objects.get(object) else { continue };
            for &p in &self.meshes[object.mesh].positions {
                let p = object.world_from_mesh.transform_point3(DVec3::from(p.map(f64::from)));
                bounds = Some(bounds.map_or((p, p), |(lo, hi)| (lo.min(p), hi.max(p))));
            }
        }
        bounds
    }
}

/// An [`Object`](crate::Object)'s mesh in world space; see [`Scene::world_mesh`].
#[derive(Clone, Debug, PartialEq)]
pub struct WorldMesh<'a> {
    /// Vertex positions, metres.
    pub positions: Vec<DVec3>,
    /// Unit vertex normals, one per position; empty means flat facets.
    pub normals: Vec<DVec3>,
    /// Texture coordinates, one per position; may be empty.
    pub uvs: &'a [[f32; 2]],
    /// Triples of indices into `positions`, counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
}

/// The direction of the inverse transpose: its cofactors times the sign of the determinant, which stay
/// finite for transforms at the scale of a millimetre or ten kilometres.
fn normal_matrix(linear: DMat3) -> DMat3 {
    let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    cofactors * linear.determinant().signum()
}
