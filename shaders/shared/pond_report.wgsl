// Words of a pond's report. Host side: caustic-heightfield's `passes/report.rs`.

const PAST_45_DEGREES: u32 = 0u;   // samples steeper than that
const SELF_SHADOWED: u32 = 1u;     // samples behind other water
const TURNED_AWAY: u32 = 2u;       // samples whose facet is turned away from the light
const TOTALLY_REFLECTED: u32 = 3u; // samples that no light passes
const GROUNDED: u32 = 4u;          // samples on the floor or below it
const STEEPEST: u32 = 5u;          // the largest slope, as the bits of a float
const OUTSIDE_STATES: u32 = 6u;    // samples with a state outside of the table
const UPWARDS: u32 = 7u;           // beams that have no state
const INCIDENT: u32 = 8u;          // flux that reaches the surface: two words, the lower first
const TRANSMITTED: u32 = 10u;      // flux that passes it, likewise
const REPORT_WORDS: u32 = 12u;
