//! A picture's way to a screen on the device: what executors share of it.

use bytemuck::{Pod, Zeroable};
use spectral_core::display::{Display, ToneMap};
use spectral_core::rgb::{D65_WHITE_XYZ, RgbSpace};

/// Draws a picture over a whole target with `display_vertex` and `display_fragment`: the steps of [`spectral_core::display`].
pub const DISPLAY_WGSL: &str = include_str!("../../../shaders/display.wgsl");

/// Uniform of `shaders/display.wgsl`; mirrors `DisplayParams` there.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct DisplayParams {
    /// Pixels of the picture.
    pub picture_size: [u32; 2],
    /// Texels of the target.
    pub target_size: [u32; 2],
    /// XYZ is multiplied by this.
    pub exposure: f32,
    /// Luminance that Reinhard's map takes to white; 0 means another, or none but the cut at 1.
    pub reinhard_white: f32,
    /// 1 if the target stores what it is given, and is given encoded sRGB.
    pub encode: u32,
    /// Of the sigmoid; 0 means another tone map.
    pub sigmoid_contrast: f32,
    /// Columns of the matrix from XYZ to linear sRGB, and padding.
    pub linear_srgb_from_x: [f32; 4],
    /// Second column.
    pub linear_srgb_from_y: [f32; 4],
    /// Third column.
    pub linear_srgb_from_z: [f32; 4],
    /// XYZ of white, and padding.
    pub white_xyz: [f32; 4],
}

impl DisplayParams {
    /// For a picture and a target, which encodes sRGB itself unless `encode`.
    #[must_use]
    pub fn new(display: &Display, picture_size: [u32; 2], target_size: [u32; 2], encode: bool) -> Self {
        let rows = RgbSpace::SRGB.rgb_from_xyz();
        let column = |c: usize| [rows[0][c] as f32, rows[1][c] as f32, rows[2][c] as f32, 0.0];
        let [x, y, z] = D65_WHITE_XYZ.map(|v| v as f32);
        let (reinhard_white, sigmoid_contrast) = match display.tone_map {
            ToneMap::Clip => (0.0, 0.0),
            ToneMap::Reinhard { white } => (white, 0.0),
            ToneMap::Sigmoid { contrast } => (0.0, contrast),
        };
        Self {
            picture_size,
            target_size,
            exposure: display.exposure as f32,
            reinhard_white: reinhard_white as f32,
            encode: encode.into(),
            sigmoid_contrast: sigmoid_contrast as f32,
            linear_srgb_from_x: column(0),
            linear_srgb_from_y: column(1),
            linear_srgb_from_z: column(2),
            white_xyz: [x, y, z, 0.0],
        }
    }
}
