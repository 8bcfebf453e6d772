//! Host side of `shaders/shared/refract.wgsl`: Snell and Fresnel in f32, written for cancellation.

use glam::Vec3;

/// What an interface does with unpolarised light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refraction {
    /// Total internal reflection: nothing is transmitted.
    pub total: bool,
    /// Unit direction of the transmitted ray.
    pub direction: Vec3,
    /// Share of unpolarised light that is reflected, 0 to 1.
    pub reflectance: f32,
}

/// Refracts `direction` at a surface whose unit `normal` is on the side the light comes from; `eta` is
/// n_transmitted / n_incident. Every difference of nearly equal numbers is factored through eta - 1, which is exact near 1.
pub fn refract_light(direction: Vec3, normal: Vec3, eta: f32) -> Refraction {
    let cos_i = (-direction.dot(normal)).max(0.0);
    let cos2_i = cos_i * cos_i;
    let contrast = (eta - 1.0) * (eta + 1.0);
    // eta^2 cos_t^2 = eta^2 - 1 + cos_i^2, from Snell's law without forming 1 - sin^2.
    let scaled = contrast + cos2_i;
    if scaled < 0.0 {
        return Refraction { total: true, direction, reflectance: 1.0 };
    }
    let eta_cos_t = scaled.sqrt();
    // cos_i - eta cos_t = (1 - eta^2) / (cos_i + eta cos_t). Where that sum is 0, eta is 1 and the numerator is 0 too.
    let sum_s = cos_i + eta_cos_t;
    let bent = (direction - contrast / sum_s.max(1e-15) * normal).normalize();
    // r_s = (cos_i - eta cos_t) / (cos_i + eta cos_t), r_p = (eta cos_i - cos_t) / (eta cos_i + cos_t), each multiplied
    // above and below by its denominator.
    let sum_p = eta * eta * cos_i + eta_cos_t;
    let r_s = contrast / (sum_s * sum_s).max(1e-30);
    let r_p = contrast * ((eta * eta + 1.0) * cos2_i - 1.0) / (sum_p * sum_p).max(1e-30);
    Refraction { total: false, direction: bent, reflectance: (0.5 * (r_s * r_s + r_p * r_p)).min(1.0) }
}
