//! The surface and the pond of the paper's correctness experiment (section 5.2), for the test and the table of precision.

use caustic_heightfield::{Form, HeightField, Impulse, Normals, Pond, Ripple, WallImages, impulse_heights};

/// Three pebbles and their reflections: "one of the more complex height fields".
pub(crate) fn pebbles(size: [usize; 2]) -> HeightField {
    let pebble = |x, y, start_s| Impulse { position_m: [x, y], start_s, amplitude_m: 0.004 };
    let pebbles = [pebble(0.3, 0.4, 0.0), pebble(0.7, 0.2, 0.3), pebble(0.6, 0.8, 0.5)];
    impulse_heights(size, [1.0, 1.0], &Ripple::PEBBLE, &pebbles, WallImages::Four, 1.5).expect("finite waves")
}

/// Eq. 2 with the paper's normals, light from straight above.
pub(crate) fn papers_pond() -> Pond {
    Pond { form: Form::Paper, normals: Normals::OneSided, ..Pond::default() }
}
