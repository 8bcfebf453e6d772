// Gaps in a map between the wavelengths that light was split into. Host side: asm-core's `shared/gap.rs`.
//
// lit       the texel holds light
// offsets   of the texels within the radius, without the middle: entry i and entry (last - i) are opposite
// Expects the globals `params.size`, `params.rows` and `offsets`.

const GAP_PAPER: u32 = 0u;          // mean of the hits and the texel (Blanchette & Agu 2013, text)
const GAP_PAPER_LITERAL: u32 = 1u;  // sum of the hits (their Fig. 9)
const GAP_DISC: u32 = 2u;           // exchange within the radius, where there are gaps: keeps energy

// What a mask holds.
const MASK_DARK: u32 = 0u;
const MASK_LIT: u32 = 1u;
const MASK_GAP: u32 = 2u;    // dark, between lit texels that face each other
const MASK_BESIDE: u32 = 3u; // holds light, with a gap within twice the radius

// Index of the texel at an offset from another, both in the same face of the map; NO_TEXEL outside.
const NO_TEXEL: u32 = 0xffffffffu;

fn texel_at(texel: vec2<u32>, offset: vec2<i32>) -> u32 {
    let face_row = texel.y / params.size.y * params.size.y;
    let at = vec2<i32>(texel - vec2<u32>(0u, face_row)) + offset;
    if any(at < vec2<i32>(0)) || any(at >= vec2<i32>(params.size)) {
        return NO_TEXEL;
    }
    return (face_row + u32(at.y)) * params.size.x + u32(at.x);
}
