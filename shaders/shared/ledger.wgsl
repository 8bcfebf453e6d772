// Rows of the flux ledger. Host side: asm-core's `shared/ledger.rs`.
//
// aimed = missed + blocked + emitted
// emitted = reflected + kept inside + absorbed + every way a photon ends, from landed on

const LEDGER_AIMED: u32 = 0u;         // through the emission view
const LEDGER_EMITTED: u32 = 1u;       // that met glass first
const LEDGER_REFLECTED: u32 = 2u;     // at the entry, Fresnel
const LEDGER_KEPT_INSIDE: u32 = 3u;   // at the exit, Fresnel: what is reflected inside and not followed
const LEDGER_ABSORBED: u32 = 4u;
const LEDGER_ASTRAY: u32 = 5u;        // part of landed: put down away from the surface, image space had not converged
const LEDGER_BESIDE: u32 = 6u;        // part of outside map: put down so near to a surface that splats reach it
const LEDGER_FIRST_END: u32 = 7u;     // the ends follow, in the order of END_*
const LEDGER_ROWS: u32 = 15u;
const LEDGER_WORDS: u32 = 3u;         // low and high word of the flux, number of photons

// How a texel's flux at one wavelength ends.
const END_MISSED: u32 = 0u;       // what the texel shows first is not glass
const END_BLOCKED: u32 = 1u;      // something opaque stands in front of glass
const END_LANDED: u32 = 2u;
const END_OUTSIDE_MAP: u32 = 3u;  // no texel of the map shows the place and side where it arrives
const END_ESCAPED: u32 = 4u;      // leads away from every surface the light sees
const END_TOTAL: u32 = 5u;        // total internal reflection
const END_WRONG_SIDE: u32 = 6u;   // the interpolated normal sends it through the wrong side of its facet
const END_NO_EXIT: u32 = 7u;      // no back face of a closed refractor in the image, or more reflections than are followed
