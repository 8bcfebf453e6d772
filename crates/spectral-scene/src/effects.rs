//! What light transport a scene calls for, each effect with its reason.
//!
//! The questions are answered conservatively: an effect is off only if the scene cannot show it. What blocks
//! the way between two things is not looked at.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};
use spectral_core::light::LightSpectrum;

use crate::{Camera, Light, LightShape, Scene};

/// Whether a scene calls for an effect, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Effect {
    /// The scene calls for it.
    pub on: bool,
    /// Why, or why not: names of objects, materials or lights.
    pub reason: String,
}

/// The effects of a scene; see [`Effects::required_by`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Effects {
    /// Surfaces that light passes through.
    pub refraction: Effect,
    /// A refractive index that depends on the wavelength.
    pub dispersion: Effect,
    /// Glass that takes colour out of light on its way.
    pub absorption: Effect,
    /// Light that leaves a refractor at its first outside reflection (part of the `reflected` layer of a bake).
    pub reflection: Effect,
    /// Light redirected by a refractor that may land on a matt object, with texture coordinates or without.
    pub caustics: Effect,
    /// Light redirected by a mirror that may land on a matt object, with texture coordinates or without (in the
    /// `reflected` layer of a bake, or in `refracted` where it has met glass). Metal too rough for a mirror is named in
    /// the reason.
    pub reflective_caustics: Effect,
    /// Objects that may stand between a light and a receiver.
    pub shadows: Effect,
    /// Glass in view of a camera, through which the scene behind is seen.
    pub deferred_refraction: Effect,
    /// Mirrors in view of a camera, in which the rest of the scene is seen.
    pub mirror_images: Effect,
    /// Cameras inside a refractor, or behind an open one such as a water surface: what they see is attenuated on the way,
    /// and the water's surface is seen from below.
    pub immersion: Effect,
    /// Matt surfaces with texture coordinates that light can reach, directly or by way of a refractor or a mirror.
    pub receivers: Effect,
    /// Lights with a position, whose rays diverge.
    pub point_or_spot_lights: Effect,
    /// Lights other than white D65.
    pub coloured_light: Effect,
    /// Thin films: always off, not simulated yet.
    pub iridescence: Effect,
    /// Glass that scatters: always off, treated as smooth.
    pub rough_glass: Effect,
}

impl Effects {
    /// The effects that a valid scene calls for.
    ///
    /// # Panics
    /// If an index in the scene is out of range; [`Scene::validate`] rules that out.
    pub fn required_by(scene: &Scene) -> Self {
        let survey = Survey::new(scene);
        Self {
            refraction: survey.refraction(),
            dispersion: survey.dispersion(),
            absorption: survey.absorption(),
            reflection: survey.reflection(),
            caustics: survey.caustics(),
            reflective_caustics: survey.reflective_caustics(),
            shadows: survey.shadows(),
            deferred_refraction: survey.deferred_refraction(),
            mirror_images: survey.mirror_images(),
            immersion: survey.immersion(),
            receivers: survey.receivers(),
            point_or_spot_lights: survey.point_or_spot_lights(),
            coloured_light: survey.coloured_light(),
            iridescence: survey.iridescence(),
            rough_glass: survey.rough_glass(),
        }
    }

    /// Every effect with its field's name, in the order of the fields.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Effect)> {
        [
            ("refraction", &self.refraction),
            ("dispersion", &self.dispersion),
            ("absorption", &self.absorption),
            ("reflection", &self.reflection),
            ("caustics", &self.caustics),
            ("reflective_caustics", &self.reflective_caustics),
            ("shadows", &self.shadows),
            ("deferred_refraction", &self.deferred_refraction),
            ("mirror_images", &self.mirror_images),
            ("immersion", &self.immersion),
            ("receivers", &self.receivers),
            ("point_or_spot_lights", &self.point_or_spot_lights),
            ("coloured_light", &self.coloured_light),
            ("iridescence", &self.iridescence),
            ("rough_glass", &self.rough_glass),
        ]
        .into_iter()
    }
}

fn on(reason: String) -> Effect {
    Effect { on: true, reason }
}

fn off(reason: impl Into<String>) -> Effect {
    Effect { on: false, reason: reason.into() }
}

/// On with all the reasons there are, off with `none` if there are none.
fn on_if_any(reasons: Vec<String>, none: &str) -> Effect {
    if reasons.is_empty() { off(none) } else { on(listed(reasons)) }
}

/// The first few entries, and how many more there are.
fn listed(mut names: Vec<String>) -> String {
    const SHOWN: usize = 6;
    if names.len() > SHOWN {
        let more = names.len() - SHOWN;
        names.truncate(SHOWN);
        names.push(format!("{more} more"));
    }
    names.join(", ")
}

const NO_REFRACTOR: &str = "no object transmits light";
const NO_MIRROR: &str = "no object is of polished metal";

/// What the single questions have in common.
struct Survey<'a> {
    scene: &'a Scene,
    /// Lights that give any light at all.
    lights: Vec<&'a Light>,
    refractors: Vec<usize>,
    mirrors: Vec<usize>,
    /// Refractors and mirrors that a light may reach without detour.
    lit_casters: Vec<usize>,
    /// Opaque objects that a light may reach without detour.
    lit_opaque: Vec<usize>,
}

impl<'a> Survey<'a> {
    fn new(scene: &'a Scene) -> Self {
        let lights: Vec<&Light> =
            scene.lights.iter().filter(|l| l.intensity > 0.0 && l.color.iter().any(|&c| c > 0.0)).collect();
        let has_faces = |&i: &usize| !scene.meshes[scene.objects[i].mesh].triangles.is_empty();
        let lit = |i: &usize| {
            let sphere = Sphere::around(scene, *i);
            lights.iter().any(|light| sphere.is_some_and(|s| s.may_be_lit(&light.shape)))
        };
        Self {
            scene,
            refractors: scene.refractors().filter(has_faces).collect(),
            mirrors: scene.mirrors().filter(has_faces).collect(),
            lit_casters: scene.casters().filter(has_faces).filter(lit).collect(),
            lit_opaque: scene.opaque().filter(has_faces).filter(lit).collect(),
            lights,
        }
    }

    fn name(&self, object: usize) -> String {
        format!("`{}`", self.scene.objects[object].name)
    }

    fn names(&self, objects: &[usize]) -> String {
        listed(objects.iter().map(|&i| self.name(i)).collect())
    }

    /// One reason per refractor's material for which `reason` finds one.
    fn of_glass(&self, reason: impl Fn(&crate::Material) -> Option<String>) -> Vec<String> {
        let mut materials: Vec<usize> =
            self.refractors.iter().map(|&i| self.scene.objects[i].material).collect();
        materials.sort_unstable();
        materials.dedup();
        let material = |m| {
            let material = &self.scene.materials[m];
            reason(material).map(|reason| format!("`{}` {reason}", material.name))
        };
        materials.into_iter().filter_map(material).collect()
    }

    fn refraction(&self) -> Effect {
        on_if_any(self.of_glass(|m| Some(format!("has n_d {:.4}", m.dispersion.n_d()))), NO_REFRACTOR)
    }

    fn dispersion(&self) -> Effect {
        if self.refractors.is_empty() {
            return off(NO_REFRACTOR);
        }
        let reasons = self.of_glass(|m| {
            m.dispersion.is_dispersive().then(|| format!("has V_d {:.1}", m.dispersion.abbe_v_d()))
        });
        on_if_any(reasons, "every material has dispersion 0")
    }

    fn absorption(&self) -> Effect {
        if self.refractors.is_empty() {
            return off(NO_REFRACTOR);
        }
        let reasons = self.of_glass(|m| {
            let a = m.attenuation.filter(|a| a.color != [1.0; 3])?;
            let [r, g, b] = a.color;
            Some(format!("leaves ({r}, {g}, {b}) after {} m", a.distance_m))
        });
        on_if_any(reasons, "no refractor attenuates")
    }

    fn reflection(&self) -> Effect {
        let reasons = self.of_glass(|m| {
            let n = m.dispersion.n_d();
            let at_normal = ((n - 1.0) / (n + 1.0)).powi(2);
            (n > 1.0 || m.dispersion.is_dispersive())
                .then(|| format!("reflects {:.1} % at normal incidence", at_normal * 100.0))
        });
        match &reasons[..] {
            [] if self.refractors.is_empty() => off(NO_REFRACTOR),
            [] => off("every refractor has the index of vacuum"),
            _ => on(listed(reasons)),
        }
    }

    fn caustics(&self) -> Effect {
        self.caustics_of(&self.refractors, NO_REFRACTOR)
    }

    fn reflective_caustics(&self) -> Effect {
        let mut effect = self.caustics_of(&self.mirrors, NO_MIRROR);
        let material = |i: usize| self.scene.material_of(i);
        let rough: Vec<usize> = self.scene.matt().filter(|&i| material(i).is_metal()).collect();
        if !rough.is_empty() {
            effect.reason += &format!("; rough metal {} is treated as matt", self.names(&rough));
        }
        effect
    }

    /// Whether any of these refractors or mirrors may send light to a matt object.
    fn caustics_of(&self, casters: &[usize], none: &str) -> Effect {
        if casters.is_empty() {
            return off(none);
        }
        if let Some(dark) = self.no_light() {
            return dark;
        }
        if self.lit_casters.is_empty() {
            return off(format!("no light reaches {}", self.names(casters)));
        }
        if self.scene.matt().next().is_none() {
            return off("no matt object to land on");
        }
        let lit: Vec<usize> = casters.iter().copied().filter(|i| self.lit_casters.contains(i)).collect();
        if lit.is_empty() {
            let detour = self.names(&self.lit_casters);
            return on(format!("{} may be lit by way of {detour}", self.names(casters)));
        }
        on(format!("{} in light", self.names(&lit)))
    }

    fn shadows(&self) -> Effect {
        if let Some(dark) = self.no_light() {
            return dark;
        }
        if self.lit_opaque.is_empty() {
            return off("no opaque object in light");
        }
        if self.scene.matt().next().is_none() {
            return off("no matt object for a shadow to fall on");
        }
        let opaque: Vec<usize> = self.scene.opaque().collect();
        // A single flat surface cannot shade itself.
        if self.refractors.is_empty() && opaque.len() == 1 && self.is_flat(opaque[0]) {
            return off(format!("nothing stands beside {}", self.name(opaque[0])));
        }
        let blockers: Vec<usize> = self.refractors.iter().copied().chain(opaque).collect();
        on(format!("{} may block light", self.names(&blockers)))
    }

    fn is_flat(&self, object: usize) -> bool {
        let mesh = self.scene.world_mesh(object);
        let Some(&origin) = mesh.positions.first() else { return true };
        let size = mesh.positions.iter().map(|p| p.distance(origin)).fold(0.0, f64::max);
        let normals = mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            (b - a).cross(c - a)
        });
        let normal = normals.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        let normal = normal.unwrap_or_default().normalize_or_zero();
        mesh.positions.iter().all(|&p| (p - origin).dot(normal).abs() <= 1e-6 * size)
    }

    fn deferred_refraction(&self) -> Effect {
        self.seen_by_a_camera(&self.refractors, NO_REFRACTOR, "no camera sees a refractor")
    }

    fn mirror_images(&self) -> Effect {
        self.seen_by_a_camera(&self.mirrors, NO_MIRROR, "no camera sees a mirror")
    }

    fn seen_by_a_camera(&self, objects: &[usize], none: &str, unseen: &str) -> Effect {
        if objects.is_empty() {
            return off(none);
        }
        if self.scene.cameras.is_empty() {
            return off("no camera");
        }
        let seen = |camera: &Camera| -> Vec<usize> {
            let in_view = |&i: &usize| Sphere::around(self.scene, i).is_some_and(|s| s.may_be_seen(camera));
            objects.iter().copied().filter(in_view).collect()
        };
        let reasons = self.scene.cameras.iter().filter_map(|camera| {
            let seen = seen(camera);
            (!seen.is_empty()).then(|| format!("`{}` sees {}", camera.name, self.names(&seen)))
        });
        on_if_any(reasons.collect(), unseen)
    }

    fn immersion(&self) -> Effect {
        if self.refractors.is_empty() {
            return off(NO_REFRACTOR);
        }
        let reasons = self.scene.cameras.iter().filter_map(|camera| {
            let eye = camera.world_from_camera.w_axis.truncate();
            let around = self.scene.refractors_around(eye);
            (!around.is_empty()).then(|| format!("`{}` is inside {}", camera.name, self.names(&around)))
        });
        on_if_any(reasons.collect(), "every camera is in free space")
    }

    fn receivers(&self) -> Effect {
        let all: Vec<usize> = self.scene.receivers().collect();
        if all.is_empty() {
            return off("no matt object has texture coordinates");
        }
        if let Some(dark) = self.no_light() {
            return dark;
        }
        if !self.lit_casters.is_empty() {
            return on(format!(
                "{} may catch light from {}",
                self.names(&all),
                self.names(&self.lit_casters)
            ));
        }
        let lit: Vec<usize> = all.iter().copied().filter(|i| self.lit_opaque.contains(i)).collect();
        if lit.is_empty() {
            return off(format!("no light reaches {}", self.names(&all)));
        }
        on(format!("{} in light", self.names(&lit)))
    }

    fn point_or_spot_lights(&self) -> Effect {
        let positioned = self.lights.iter().filter_map(|light| match light.shape {
            LightShape::Directional { .. } => None,
            LightShape::Point { .. } => Some(format!("`{}` is a point light", light.name)),
            LightShape::Spot { .. } => Some(format!("`{}` is a spot light", light.name)),
        });
        let none = if self.lights.is_empty() { "no light" } else { "every light is directional" };
        on_if_any(positioned.collect(), none)
    }

    fn coloured_light(&self) -> Effect {
        let coloured = self.lights.iter().filter_map(|light| {
            let what = match &light.spectrum {
                spectrum if *spectrum == LightSpectrum::default() => return None,
                LightSpectrum::UpsampledD65 { linear_srgb: [r, g, b], .. } if r == g && g == b => {
                    return None;
                }
                LightSpectrum::UpsampledD65 { linear_srgb: [r, g, b], .. } => {
                    format!("has the colour ({r}, {g}, {b})")
                }
                LightSpectrum::Illuminant(illuminant) => format!("is illuminant {illuminant}"),
                LightSpectrum::BlackBody { cct_k } => format!("is a black body of {cct_k} K"),
                LightSpectrum::Daylight { cct_k } => format!("is daylight of {cct_k} K"),
                LightSpectrum::Line { lambda_nm } => format!("is a line at {lambda_nm} nm"),
            };
            Some(format!("`{}` {what}", light.name))
        });
        let none = if self.lights.is_empty() { "no light" } else { "every light is white D65" };
        on_if_any(coloured.collect(), none)
    }

    fn iridescence(&self) -> Effect {
        let films =
            self.scene.materials.iter().filter(|m| m.iridescence.is_some_and(|film| film.factor > 0.0));
        let films: Vec<String> = films.map(|m| format!("`{}`", m.name)).collect();
        match films.is_empty() {
            true => off("not simulated yet; no material is iridescent"),
            false => off(format!("not simulated yet, though {} calls for it", listed(films))),
        }
    }

    fn rough_glass(&self) -> Effect {
        let rough = self.of_glass(|m| (m.roughness > 0.0).then(|| format!("(roughness {})", m.roughness)));
        match rough.is_empty() {
            true => off("not simulated yet; every refractor is smooth"),
            false => off(format!("not simulated yet, {} is treated as smooth", listed(rough))),
        }
    }

    fn no_light(&self) -> Option<Effect> {
        self.lights.is_empty().then(|| off("no light"))
    }
}

/// A sphere around an object's bounds.
#[derive(Clone, Copy)]
struct Sphere {
    centre: DVec3,
    radius: f64,
}

impl Sphere {
    fn around(scene: &Scene, object: usize) -> Option<Self> {
        let (low, high) = scene.bounds([object])?;
        Some(Self { centre: (low + high) / 2.0, radius: low.distance(high) / 2.0 })
    }

    fn may_be_lit(&self, light: &LightShape) -> bool {
        let near = |position: DVec3, range_m: Option<f64>| {
            range_m.is_none_or(|range| position.distance(self.centre) <= range + self.radius)
        };
        match *light {
            LightShape::Directional { .. } => true,
            LightShape::Point { position_m, range_m } => near(position_m, range_m),
            LightShape::Spot { position_m, direction, outer_cone_rad, range_m, .. } => {
                near(position_m, range_m) && self.touches_cone(position_m, direction, outer_cone_rad)
            }
        }
    }

    fn may_be_seen(&self, camera: &Camera) -> bool {
        // The picture's shape is not known yet: this circle encloses all up to 2.4 : 1.
        let half_diagonal = ((camera.yfov_rad / 2.0).tan() * 1_f64.hypot(2.4)).atan();
        let backward = DMat3::from_mat4(camera.world_from_camera).z_axis;
        self.touches_cone(camera.world_from_camera.w_axis.truncate(), -backward, half_diagonal)
    }

    /// Whether the sphere reaches into a cone of half angle up to 90 degrees about a unit `axis`.
    fn touches_cone(&self, apex: DVec3, axis: DVec3, half_angle: f64) -> bool {
        let offset = self.centre - apex;
        let distance = offset.length();
        if distance <= self.radius {
            return true;
        }
        // Both angles are seen from the apex: to the sphere's centre, and from there to its rim.
        let to_centre = (offset.dot(axis) / distance).clamp(-1.0, 1.0).acos();
        to_centre - (self.radius / distance).asin() <= half_angle
    }
}
