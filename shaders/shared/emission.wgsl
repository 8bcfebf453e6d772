// How light sets out. Host side: asm-core's `shared/emission.rs`.

// What it does where it meets glass or a mirror first.
const PATH_REFRACTED: u32 = 0u; // into glass
const PATH_REFLECTED: u32 = 1u; // back from the first surface

// Share of a cone's light in a direction (KHR_lights_punctual): the square of clamp(cosine * scale + offset).
fn spot_falloff(direction: vec3<f32>, axis: vec3<f32>, scale: f32, offset: f32) -> f32 {
    let cone = clamp(dot(direction, axis) * scale + offset, 0.0, 1.0);
    return cone * cone;
}
