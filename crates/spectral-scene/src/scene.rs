//! The scene types. Everything here is plain, public, serialisable data.

use glam::{DMat4, DVec3};
use serde::{Deserialize, Serialize};
use spectral_core::dispersion::Dispersion;
use spectral_core::light::LightSpectrum;

/// A scene: geometry, what it is made of, and what lights it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Name for reports and messages: a bundled name or the file's stem.
    pub name: String,
    /// Triangle meshes in their own space, referenced by [`Object::mesh`].
    pub meshes: Vec<Mesh>,
    /// Materials, referenced by [`Object::material`].
    pub materials: Vec<Material>,
    /// Placed meshes.
    pub objects: Vec<Object>,
    /// Lights, already in world space.
    pub lights: Vec<Light>,
    /// Cameras, already in world space; the first is the default.
    pub cameras: Vec<Camera>,
}

/// An indexed triangle mesh in its own space. [`Scene::world_mesh`] moves it into the world.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// The mesh's own name.
    pub name: String,
    /// Vertex positions, metres before the object's transform.
    pub positions: Vec<[f32; 3]>,
    /// Unit vertex normals, one per position, in mesh space; empty means flat facets.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, one per position; empty means the mesh cannot be baked onto.
    pub uvs: Vec<[f32; 2]>,
    /// Triangles as triples of indices into `positions`, counter-clockwise seen from outside **in the world**:
    /// the mesh of an object whose transform mirrors is stored with its triangles the other way round.
    pub triangles: Vec<[u32; 3]>,
}

/// A mesh placed in the world with a material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// Node name; `--receiver` matches it first, then the mesh's name.
    pub name: String,
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Affine, invertible transform from mesh space to world space. Whoever uses it also moves the normals, by
    /// its inverse transpose; [`Scene::world_mesh`] does both.
    pub world_from_mesh: DMat4,
}

/// What a surface is made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name for messages.
    pub name: String,
    /// Diffuse reflectance, or a mirror's reflectance at normal incidence, in linear sRGB; upsampled smoothly where a
    /// spectrum is needed.
    pub base_color: [f64; 3],
    /// 1 for metal, 0 for dielectric (glTF metallicFactor); see [`Material::is_mirror`].
    pub metallic: f64,
    /// Perceptual roughness; refractors are treated as smooth whatever it says, metal as a mirror or as matt (with a
    /// warning at load).
    pub roughness: f64,
    /// Share of light that is transmitted rather than diffusely reflected; above 0 the material is a refractor.
    pub transmission: f64,
    /// Refractive index as a function of the vacuum wavelength.
    pub dispersion: Dispersion,
    /// Absorption inside the volume, if any.
    pub attenuation: Option<Attenuation>,
    /// KHR_materials_volume thicknessFactor: read and written back, not used (real geometry is traced).
    pub thickness_m: f64,
    /// KHR_materials_iridescence: read and written back, not simulated yet.
    pub iridescence: Option<Iridescence>,
    /// Emission in linear sRGB, read and written back (emitters are not light sources here).
    pub emissive: [f64; 3],
    /// Both faces are visible (glTF doubleSided).
    pub double_sided: bool,
}

/// Beer-Lambert absorption as KHR_materials_volume states it: `color` remains after `distance_m`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attenuation {
    /// Transmitted colour of white light after `distance_m`, linear sRGB.
    pub color: [f64; 3],
    /// The distance at which `color` is reached, metres, above 0.
    pub distance_m: f64,
}

/// KHR_materials_iridescence, kept as read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Iridescence {
    /// iridescenceFactor.
    pub factor: f64,
    /// iridescenceIor.
    pub ior: f64,
    /// iridescenceThicknessMinimum, nanometres.
    pub thickness_min_nm: f64,
    /// iridescenceThicknessMaximum, nanometres.
    pub thickness_max_nm: f64,
}

/// A light with a spectrum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Name for messages.
    pub name: String,
    /// Colour in linear sRGB as the file states it; its luminance scales `intensity`.
    pub color: [f64; 3],
    /// Lux for directional lights, candela for point and spot lights.
    pub intensity: f64,
    /// Relative spectral power; the scale comes from `color` and `intensity`.
    pub spectrum: LightSpectrum,
    /// Where it is and where it points.
    pub shape: LightShape,
}

/// Placement of a light in world space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightShape {
    /// Exactly collimated light from infinity.
    Directional {
        /// Unit direction of travel.
        direction: DVec3,
    },
    /// Isotropic point.
    Point {
        /// Position, metres.
        position_m: DVec3,
        /// glTF range: 0 beyond, unlimited if `None`.
        range_m: Option<f64>,
    },
    /// Cone with smooth edge, as KHR_lights_punctual defines it.
    Spot {
        /// Position, metres.
        position_m: DVec3,
        /// Unit axis of the cone, in the direction of travel.
        direction: DVec3,
        /// Full intensity inside this half angle, radians.
        inner_cone_rad: f64,
        /// Dark outside this half angle, radians.
        outer_cone_rad: f64,
        /// glTF range: 0 beyond, unlimited if `None`.
        range_m: Option<f64>,
    },
}

/// A perspective pinhole camera looking along its -Z.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Name for messages.
    pub name: String,
    /// Rigid transform from camera space (looking along -Z, +Y up) to world space.
    pub world_from_camera: DMat4,
    /// Full vertical field of view, radians.
    pub yfov_rad: f64,
    /// Near plane, metres; nearer surfaces are clipped.
    pub znear_m: f64,
}

/// Irradiance on a receiver's UV square, XYZ in lux-scaled units (Y in lux), split by light path.
///
/// Row-major, row 0 is v = 0, column 0 is u = 0; every texel holds the mean over its area.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct IrradianceMaps {
    /// Texels in u.
    pub width: u32,
    /// Texels in v.
    pub height: u32,
    /// Light that met nothing before the receiver.
    pub direct: Vec<[f32; 3]>,
    /// Light that entered glass and left again, or landed inside it.
    pub refracted: Vec<[f32; 3]>,
    /// Light that left glass at its first outside reflection, or was reflected by a mirror before it met glass.
    pub reflected: Vec<[f32; 3]>,
}
