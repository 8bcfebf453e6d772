// Light through a facet, or thrown back by it. Host side: asm-core's `shared/crossing.rs`.

const RULE_FRESNEL: u32 = 0u; // Snell and Fresnel, total reflection told apart
const RULE_GLSL: u32 = 1u;    // GLSL's refract(): nothing reflects, and the zero vector stands for total reflection

struct Crossing {
    end: u32, // END_LANDED where light passes
    direction: vec3<f32>,
    reflectance: f32,
}

// `normal` is unit and on the side the light comes from, `eta` n_transmitted / n_incident. No step in the index is no
// interface, however the interpolated normal leans.
fn cross_surface(direction: vec3<f32>, normal: vec3<f32>, facet: Triangle, eta: f32, rule: u32) -> Crossing {
    if eta == 1.0 {
        return Crossing(END_LANDED, direction, 0.0);
    }
    if rule == RULE_GLSL {
        return Crossing(END_LANDED, glsl_refract(direction, normal, 1.0 / eta), 0.0);
    }
    if dot(direction, normal) >= 0.0 {
        return Crossing(END_WRONG_SIDE, direction, 0.0);
    }
    let refraction = refract_light(direction, normal, eta);
    if refraction.total {
        return Crossing(END_TOTAL, direction, 1.0);
    }
    let n = cross(facet.p1 - facet.p0, facet.p2 - facet.p0);
    if dot(refraction.direction, n) * dot(direction, n) <= 0.0 {
        return Crossing(END_WRONG_SIDE, direction, 0.0);
    }
    return Crossing(END_LANDED, refraction.direction, refraction.reflectance);
}

// What a facet throws back, `reflectance` of it; `normal` as above.
fn reflect_at(direction: vec3<f32>, normal: vec3<f32>, facet: Triangle, reflectance: f32) -> Crossing {
    let cosine = dot(direction, normal);
    let back = normalize(direction - 2.0 * cosine * normal);
    let n = cross(facet.p1 - facet.p0, facet.p2 - facet.p0);
    if cosine >= 0.0 || dot(back, n) * dot(direction, n) >= 0.0 {
        return Crossing(END_WRONG_SIDE, direction, 0.0);
    }
    return Crossing(END_LANDED, back, reflectance);
}

// Share that an interface reflects. GLSL's rule knows no reflection.
fn interface_reflectance(direction: vec3<f32>, normal: vec3<f32>, eta: f32, rule: u32) -> f32 {
    if eta == 1.0 || rule == RULE_GLSL {
        return 0.0;
    }
    return refract_light(direction, normal, eta).reflectance;
}

// Schlick 1994, "An Inexpensive BRDF Model for Physically-based Rendering", as in glTF 2.0, appendix B.3.4; `at_normal` is the
// share reflected at normal incidence.
fn mirror_reflectance(direction: vec3<f32>, normal: vec3<f32>, at_normal: f32) -> f32 {
    let grazing = 1.0 - min(abs(dot(direction, normal)), 1.0);
    let squared = grazing * grazing;
    return at_normal + (1.0 - at_normal) * squared * squared * grazing;
}

// As the GLSL specification has it; its eta is n_incident / n_transmitted.
fn glsl_refract(direction: vec3<f32>, normal: vec3<f32>, eta: f32) -> vec3<f32> {
    let cosine = dot(normal, direction);
    let k = 1.0 - eta * eta * (1.0 - cosine * cosine);
    if k < 0.0 {
        return vec3<f32>(0.0);
    }
    return normalize(eta * direction - (eta * cosine + sqrt(k)) * normal);
}
