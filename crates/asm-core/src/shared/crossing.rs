//! Host side of `shaders/shared/crossing.wgsl`: light through a facet.

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

/// As the GLSL specification has it; its eta is n_incident / n_transmitted.
pub fn glsl_refract(direction: Vec3, normal: Vec3, eta: f32) -> Vec3 {
    let cosine = normal.dot(direction);
    let k = 1.0 - eta * eta * (1.0 - cosine * cosine);
    if k < 0.0 {
        return Vec3::ZERO;
    }
    (eta * direction - (eta * cosine + k.sqrt()) * normal).normalize()
}
