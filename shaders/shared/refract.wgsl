// Snell and Fresnel for one wavelength, written for cancellation: every difference of nearly equal numbers is factored
// through (eta - 1), which is exact near 1. Host side: asm-core's `shared/refract.rs`.
//
// cos_i     cosine of the incidence angle, >= 0
// cos_t     cosine of the refraction angle, >= 0
// eta       n_transmitted / n_incident at this wavelength

struct Refraction {
    total: bool,           // total internal reflection: nothing is transmitted
    direction: vec3<f32>,  // unit, of the transmitted ray
    reflectance: f32,      // of unpolarised light, 0..1
}

// `normal` is unit and on the side the light comes from: dot(direction, normal) <= 0.
fn refract_light(direction: vec3<f32>, normal: vec3<f32>, eta: f32) -> Refraction {
    let cos_i = max(-dot(direction, normal), 0.0);
    let cos2_i = cos_i * cos_i;
    let contrast = (eta - 1.0) * (eta + 1.0);
    // eta^2 cos_t^2 = eta^2 - 1 + cos_i^2, from Snell's law without forming 1 - sin^2.
    let scaled = contrast + cos2_i;
    if scaled < 0.0 {
        return Refraction(true, direction, 1.0);
    }
    let eta_cos_t = sqrt(scaled);
    // cos_i - eta cos_t = (1 - eta^2) / (cos_i + eta cos_t). Where that sum is 0, eta is 1 and the numerator is 0 too.
    let sum_s = cos_i + eta_cos_t;
    let bent = normalize(direction - contrast / max(sum_s, 1e-15) * normal);
    // r_s = (cos_i - eta cos_t) / (cos_i + eta cos_t), r_p = (eta cos_i - cos_t) / (eta cos_i + cos_t), each multiplied
    // above and below by its denominator.
    let sum_p = eta * eta * cos_i + eta_cos_t;
    let r_s = contrast / max(sum_s * sum_s, 1e-30);
    let r_p = contrast * ((eta * eta + 1.0) * cos2_i - 1.0) / max(sum_p * sum_p, 1e-30);
    return Refraction(false, bent, min(0.5 * (r_s * r_s + r_p * r_p), 1.0));
}
