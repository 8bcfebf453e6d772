//! Host side of `shaders/shared/crossing.wgsl`: light through a facet, or thrown back by it.

use glam::Vec3;

use super::ledger::{END_LANDED, END_TOTAL, END_WRONG_SIDE};
use super::refract::refract_light;
use super::triangle::Triangle;

/// Snell and Fresnel, total reflection told apart.
pub const RULE_FRESNEL: u32 = 0;
/// GLSL's `refract()`: nothing reflects, and the zero vector stands for total reflection.
pub const RULE_GLSL: u32 = 1;

/// What an interface does with a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// [`END_LANDED`] where light passes.
    pub end: u32,
    /// Of what passes.
    pub direction: Vec3,
    /// Share that is reflected.
    pub reflectance: f32,
}

/// `normal` is unit and on the side the light comes from, `eta` n_transmitted / n_incident. No step in the index is no
/// interface, however the interpolated normal leans.
pub fn cross_surface(direction: Vec3, normal: Vec3, facet: &Triangle, eta: f32, rule: u32) -> Crossing {
    let crossing = |end, direction, reflectance| Crossing { end, direction, reflectance };
    if eta == 1.0 {
        return crossing(END_LANDED, direction, 0.0);
    }
    if rule == RULE_GLSL {
        return crossing(END_LANDED, glsl_refract(direction, normal, 1.0 / eta), 0.0);
    }
    if direction.dot(normal) >= 0.0 {
        return crossing(END_WRONG_SIDE, direction, 0.0);
    }
    let refraction = refract_light(direction, normal, eta);
    if refraction.total {
        return crossing(END_TOTAL, direction, 1.0);
    }
    let n = facet.scaled_normal();
    if refraction.direction.dot(n) * direction.dot(n) <= 0.0 {
        return crossing(END_WRONG_SIDE, direction, 0.0);
    }
    crossing(END_LANDED, refraction.direction, refraction.reflectance)
}

/// What a facet throws back, `reflectance` of it; `normal` as in [`cross_surface`].
pub fn reflect_at(direction: Vec3, normal: Vec3, facet: &Triangle, reflectance: f32) -> Crossing {
    let cosine = direction.dot(normal);
    let back = (direction - 2.0 * cosine * normal).normalize();
    let n = facet.scaled_normal();
    if cosine >= 0.0 || back.dot(n) * direction.dot(n) >= 0.0 {
        return Crossing { end: END_WRONG_SIDE, direction, reflectance: 0.0 };
    }
    Crossing { end: END_LANDED, direction: back, reflectance }
}

/// Share that an interface reflects. GLSL's rule knows no reflection.
pub fn interface_reflectance(direction: Vec3, normal: Vec3, eta: f32, rule: u32) -> f32 {
    if eta == 1.0 || rule == RULE_GLSL { 0.0 } else { refract_light(direction, normal, eta).reflectance }
}

/// Schlick 1994, "An Inexpensive BRDF Model for Physically-based Rendering", as in glTF 2.0, appendix B.3.4; `at_normal` is
/// the share reflected at normal incidence.
pub fn mirror_reflectance(direction: Vec3, normal: Vec3, at_normal: f32) -> f32 {
    let grazing = 1.0 - direction.dot(normal).abs().min(1.0);
    let squared = grazing * grazing;
    at_normal + (1.0 - at_normal) * squared * squared * grazing
}

/// As the GLSL specification has it; its eta is n_incident / n_transmitted.
pub fn glsl_refract(direction: Vec3, normal: Vec3, eta: f32) -> Vec3 {
    let cosine = normal.dot(direction);
    let k = 1.0 - eta * eta * (1.0 - cosine * cosine);
    if k < 0.0 {
        return Vec3::ZERO;
    }
    (eta * direction - (eta * cosine + k.sqrt()) * normal).normalize()
}
