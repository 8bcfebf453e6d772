//! What every consumer may rely on.

use glam::{DMat3, DVec3};

use crate::{LightShape, Mesh, Scene};

/// Unit vectors may be off by this much: an f32 normal is within 1e-7, one quantised by an exporter within 1e-3.
const UNIT_TOLERANCE: f64 = 2e-3;

/// Nothing lies farther out, metres: a squared triangle area still fits into f32.
const MAX_COORDINATE_M: f64 = 1e9;
const REACH: &str = "finite and within 1e9 m of the origin";

/// No light is stronger, lux or candela, in intensity, colour or their product: the Sun has 3e27 cd, and lit from a
/// millimetre or focused a hundredfold this still fits into f32.
const MAX_INTENSITY: f64 = 1e30;
const STRENGTH: &str = "from 0 to 1e30 lux or candela";

/// What [`Scene::validate`] counted on its way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneCounts {
    /// Triangles of all objects; a mesh placed twice counts twice.
    pub triangles: usize,
    /// How many of them have no area in world space, to f64 precision. They are legal and meet no ray.
    pub zero_area_triangles: usize,
}

/// Why a scene is not usable.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// An index points past the end of its list.
    #[error("{at} is {index}, there are {count}")]
    IndexOutOfRange {
        /// The offending index, such as `objects[2].mesh`.
        at: String,
        /// Its value.
        index: usize,
        /// How many entries the list has.
        count: usize,
    },
    /// A list that runs parallel to the positions has another length.
    #[error("{at} has {got} entries for {positions} positions; it must have as many, or none")]
    CountMismatch {
        /// The list, such as `meshes[0].normals`.
        at: String,
        /// Its length.
        got: usize,
        /// How many positions the mesh has.
        positions: usize,
    },
    /// A number is outside what it can mean.
    #[error("{at} is {got}; it must be {expected}")]
    OutOfRange {
        /// Which number.
        at: String,
        /// Its value.
        got: String,
        /// What would be right.
        expected: &'static str,
    },
    /// A refractive index that no medium has.
    #[error("{at}: {source}")]
    Dispersion {
        /// Which material's.
        at: String,
        /// What is wrong with it.
        source: spectral_core::dispersion::DispersionError,
    },
}

impl Scene {
    /// Checks everything that consumers rely on: indices in range, lists of equal length, finite numbers, unit
    /// normals and directions, invertible transforms, places within 1e9 m of the origin, factors between 0 and 1,
    /// lights of at most 1e30 lux or candela.
    /// Empty scenes are valid; open meshes and triangles without area are too.
    ///
    /// # Errors
    /// The first thing found wrong, as a [`SceneError`].
    pub fn validate(&self) -> Result<SceneCounts, SceneError> {
        for (i, mesh) in self.meshes.iter().enumerate() {
            validate_mesh(mesh, &format!("meshes[{i}]"))?;
        }
        for i in 0..self.materials.len() {
            self.validate_material(i)?;
        }
        let mut counts = SceneCounts::default();
        for i in 0..self.objects.len() {
            self.validate_object(i, &mut counts)?;
        }
        for i in 0..self.lights.len() {
            self.validate_light(i)?;
        }
        for (i, camera) in self.cameras.iter().enumerate() {
            let at = |field: &str| format!("cameras[{i}].{field}");
            let m = DMat3::from_mat4(camera.world_from_camera);
            let rigid = within_reach(camera.world_from_camera.w_axis.truncate())
                && (m.transpose() * m).abs_diff_eq(DMat3::IDENTITY, UNIT_TOLERANCE)
                && m.determinant() > 0.0;
            require(
                rigid,
                at("world_from_camera"),
                camera.world_from_camera,
                "a rotation and a translation",
            )?;
            let yfov = camera.yfov_rad;
            require(yfov > 0.0 && yfov < std::f64::consts::PI, at("yfov_rad"), yfov, "between 0 and pi")?;
            let znear = camera.znear_m;
            require(znear > 0.0 && znear.is_finite(), at("znear_m"), znear, "above 0 and finite")?;
        }
        Ok(counts)
    }

    fn validate_object(&self, i: usize, counts: &mut SceneCounts) -> Result<(), SceneError> {
        let object = &self.objects[i];
        let at = |field: &str| format!("objects[{i}].{field}");
        in_range(at("mesh"), object.mesh, self.meshes.len())?;
        in_range(at("material"), object.material, self.materials.len())?;
        let m = object.world_from_mesh;
        let determinant = m.determinant();
        let invertible =
            m.is_finite() && determinant != 0.0 && determinant.is_finite() && m.row(3) == glam::DVec4::W;
        require(invertible, at("world_from_mesh"), m, "finite, affine and invertible")?;
        let world = self.world_mesh(i);
        if let Some(p) = world.positions.iter().find(|p| !within_reach(**p)) {
            return require(false, at("world vertex"), p, REACH);
        }
        counts.triangles += world.triangles.len();
        counts.zero_area_triangles += world
            .triangles
            .iter()
            .filter(|t| {
                let [a, b, c] = t.map(|v| world.positions[v as usize]);
                (b - a).cross(c - a).length_squared() == 0.0
            })
            .count();
        Ok(())
    }

    fn validate_material(&self, i: usize) -> Result<(), SceneError> {
        let material = &self.materials[i];
        let at = |field: &str| format!("materials[{i}].{field}");
        let share =
            |field: &str, value: f64| require((0.0..=1.0).contains(&value), at(field), value, "from 0 to 1");
        let not_negative = |field: &str, value: f64| {
            require(value >= 0.0 && value.is_finite(), at(field), value, "at least 0 and finite")
        };
        for c in material.base_color {
            share("base_color", c)?;
        }
        share("metallic", material.metallic)?;
        share("roughness", material.roughness)?;
        share("transmission", material.transmission)?;
        not_negative("thickness_m", material.thickness_m)?;
        for c in material.emissive {
            not_negative("emissive", c)?;
        }
        material
            .dispersion
            .validate()
            .map_err(|source| SceneError::Dispersion { at: at("dispersion"), source })?;
        if let Some(attenuation) = material.attenuation {
            for c in attenuation.color {
                share("attenuation.color", c)?;
            }
            let d = attenuation.distance_m;
            require(d > 0.0 && d.is_finite(), at("attenuation.distance_m"), d, "above 0 and finite")?;
        }
        if let Some(film) = material.iridescence {
            share("iridescence.factor", film.factor)?;
            require(
                film.ior >= 1.0 && film.ior.is_finite(),
                at("iridescence.ior"),
                film.ior,
                "at least 1 and finite",
            )?;
            not_negative("iridescence.thickness_min_nm", film.thickness_min_nm)?;
            not_negative("iridescence.thickness_max_nm", film.thickness_max_nm)?;
        }
        Ok(())
    }

    fn validate_light(&self, i: usize) -> Result<(), SceneError> {
        let light = &self.lights[i];
        let at = |field: &str| format!("lights[{i}].{field}");
        let strength = |field: &str, value: f64| {
            let at = format!("lights[{i}].{field} of `{}`", light.name);
            require((0.0..=MAX_INTENSITY).contains(&value), at, value, STRENGTH)
        };
        strength("intensity", light.intensity)?;
        for c in light.color {
            strength("color", c)?;
            strength("intensity x color", light.intensity * c)?;
        }
        let (position, direction, range) = match light.shape {
            LightShape::Directional { direction } => (None, Some(direction), None),
            LightShape::Point { position_m, range_m } => (Some(position_m), None, range_m),
            LightShape::Spot { position_m, direction, range_m, .. } => {
                (Some(position_m), Some(direction), range_m)
            }
        };
        if let Some(p) = position {
            require(within_reach(p), at("position_m"), p, REACH)?;
        }
        if let Some(d) = direction {
            require((d.length() - 1.0).abs() <= UNIT_TOLERANCE, at("direction"), d, "a unit vector")?;
        }
        if let Some(range) = range {
            require(range > 0.0 && range.is_finite(), at("range_m"), range, "above 0 and finite")?;
        }
        if let LightShape::Spot { inner_cone_rad: inner, outer_cone_rad: outer, .. } = light.shape {
            let ordered = 0.0 <= inner && inner < outer && outer <= std::f64::consts::FRAC_PI_2;
            let cone = format!("{inner} inside {outer}");
            require(ordered, at("cone"), cone, "0 <= inner < outer <= pi / 2")?;
        }
        Ok(())
    }
}

fn validate_mesh(mesh: &Mesh, at: &str) -> Result<(), SceneError> {
    let count = mesh.positions.len();
    for (field, got) in [("normals", mesh.normals.len()), ("uvs", mesh.uvs.len())] {
        if got != 0 && got != count {
            return Err(SceneError::CountMismatch { at: format!("{at}.{field}"), got, positions: count });
        }
    }
    let finite = |field: &str, i: usize, v: &[f32]| {
        let ok = v.iter().all(|c| c.is_finite());
        require(ok, format_args!("{at}.{field}[{i}]"), format_args!("{v:?}"), "finite")
    };
    for (i, p) in mesh.positions.iter().enumerate() {
        finite("positions", i, p)?;
    }
    for (i, uv) in mesh.uvs.iter().enumerate() {
        finite("uvs", i, uv)?;
    }
    for (i, n) in mesh.normals.iter().enumerate() {
        let length = n.iter().map(|&c| f64::from(c).powi(2)).sum::<f64>().sqrt();
        let unit = (length - 1.0).abs() <= UNIT_TOLERANCE;
        require(unit, format_args!("{at}.normals[{i}]"), format_args!("{n:?}"), "a unit vector")?;
    }
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        for &vertex in triangle {
            in_range(format_args!("{at}.triangles[{i}]"), vertex as usize, count)?;
        }
    }
    Ok(())
}

fn within_reach(p: DVec3) -> bool {
    // Not `max_element`: NaN must fail.
    p.to_array().iter().all(|c| c.abs() <= MAX_COORDINATE_M)
}

fn in_range(at: impl ToString, index: usize, count: usize) -> Result<(), SceneError> {
    if index < count { Ok(()) } else { Err(SceneError::IndexOutOfRange { at: at.to_string(), index, count }) }
}

fn require(
    ok: bool,
    at: impl ToString,
    got: impl ToString,
    expected: &'static str,
) -> Result<(), SceneError> {
    if ok {
        Ok(())
    } else {
        Err(SceneError::OutOfRange { at: at.to_string(), got: got.to_string(), expected })
    }
}
