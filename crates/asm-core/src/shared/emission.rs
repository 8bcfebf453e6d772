//! Host side of `shaders/shared/emission.wgsl`: how light sets out.

use glam::Vec3;

/// Into glass.
pub const PATH_REFRACTED: u32 = 0;
/// Back from the first surface.
pub const PATH_REFLECTED: u32 = 1;

/// Share of a cone's light in a direction (KHR_lights_punctual): the square of clamp(cosine * scale + offset).
pub fn spot_falloff(direction: Vec3, axis: Vec3, scale: f32, offset: f32) -> f32 {
    let cone = (direction.dot(axis) * scale + offset).clamp(0.0, 1.0);
    cone * cone
}
