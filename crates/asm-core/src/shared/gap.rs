//! Host side of `shaders/shared/gap.wgsl`: gaps in a map between the wavelengths that light was split into.

use glam::{IVec2, UVec2};

/// Mean of the hits and the texel (Blanchette & Agu 2013, text).
pub const GAP_PAPER: u32 = 0;
/// Sum of the hits (their Fig. 9).
pub const GAP_PAPER_LITERAL: u32 = 1;
/// Exchange within the radius, where there are gaps: keeps energy.
pub const GAP_DISC: u32 = 2;

/// No light, and none is put there.
pub const MASK_DARK: u32 = 0;
/// Holds light.
pub const MASK_LIT: u32 = 1;
/// Dark, between lit texels that face each other.
pub const MASK_GAP: u32 = 2;
/// Holds light, with a gap within twice the radius.
pub const MASK_BESIDE: u32 = 3;

/// Offsets of the texels within `radius`, without the middle, row by row: entry i and entry (last - i) are opposite.
pub(crate) fn disc(radius: u32) -> Vec<IVec2> {
    let r = radius as i32;
    (-r..=r)
        .flat_map(|y| (-r..=r).map(move |x| IVec2::new(x, y)))
        .filter(|d| *d != IVec2::ZERO && d.length_squared() <= r * r)
        .collect()
}

/// Index of the texel at an offset from another, both in the same face of a map whose faces have `size`.
pub fn texel_at(size: UVec2, texel: UVec2, offset: IVec2) -> Option<usize> {
    let face_row = texel.y / size.y * size.y;
    let at = (texel - UVec2::new(0, face_row)).as_ivec2() + offset;
    let holds = at.cmpge(IVec2::ZERO).all() && at.cmplt(size.as_ivec2()).all();
    holds.then(|| ((face_row + at.y as u32) * size.x + at.x as u32) as usize)
}
