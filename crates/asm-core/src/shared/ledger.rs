//! Host side of `shaders/shared/ledger.wgsl`: rows of the flux ledger.
//!
//! aimed = missed + blocked + emitted, and emitted = reflected + kept inside + absorbed + every end from landed on.

/// Through the emission view.
pub const LEDGER_AIMED: usize = 0;
/// That met glass first.
pub const LEDGER_EMITTED: usize = 1;
/// At the entry, Fresnel.
pub const LEDGER_REFLECTED: usize = 2;
/// At the exit, Fresnel: what is reflected inside and not followed.
pub const LEDGER_KEPT_INSIDE: usize = 3;
/// Absorbed on the way.
pub const LEDGER_ABSORBED: usize = 4;
/// Part of landed: put down away from the surface, image space had not converged.
pub const LEDGER_ASTRAY: usize = 5;
/// Part of outside map: put down so near to a surface that splats reach it.
pub const LEDGER_BESIDE: usize = 6;
/// The ends follow, in the order of `END_*`.
pub const LEDGER_FIRST_END: usize = 7;
/// Number of rows per wavelength.
pub const LEDGER_ROWS: usize = 15;
/// Words per row: low and high word of the flux, number of photons.
pub const LEDGER_WORDS: usize = 3;

/// What a texel shows first is not glass.
pub const END_MISSED: u32 = 0;
/// Something opaque stands in front of glass.
pub const END_BLOCKED: u32 = 1;
/// On the map.
pub const END_LANDED: u32 = 2;
/// No texel of the map shows the place and side where it arrives.
pub const END_OUTSIDE_MAP: u32 = 3;
/// Leads away from every surface the light sees.
pub const END_ESCAPED: u32 = 4;
/// Total internal reflection.
pub const END_TOTAL: u32 = 5;
/// The interpolated normal sends it through the wrong side of its facet.
pub const END_WRONG_SIDE: u32 = 6;
/// No back face of a closed refractor in the image, or more reflections than are followed.
pub const END_NO_EXIT: u32 = 7;
