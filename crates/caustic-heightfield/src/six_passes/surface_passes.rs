//! Passes 1 to 5 as expressions: from heights to what is convolved.
//!
//! Symbols as in the paper; eta = n_t / n_i, n = 2a.

use spectral_core::optics::fresnel_dielectric;

use crate::adjusted::{Expressions, Format, Interval, Node};
use crate::height_field::HeightField;
use crate::normals::{ends, normal_of_slopes, slopes};
use crate::pond::{Form, Pond};
use crate::shadow::Shadows;

/// Heights that a slope is made of: two pairs of neighbours.
const ENDS: usize = 4;
/// The input that holds the light, after the heights for both slopes.
const LAMP: usize = 2 * ENDS;

/// What the example surfaces reach.
pub(super) struct Seen {
    height_m: f64,
    slope: [f64; 2],
    pitch_m: [f64; 2],
}

impl Seen {
    /// What heights are divided by; 1 m where all are 0.
    pub(super) fn highest_m(&self) -> f64 {
        if self.height_m > 0.0 { self.height_m } else { 1.0 }
    }

    pub(super) fn of(examples: &[HeightField], pond: &Pond) -> Self {
        let mut seen = Self { height_m: 0.0, slope: [0.0; 2], pitch_m: examples[0].pitch_m() };
        for surface in examples {
            let [low, high] = surface.range_m();
            seen.height_m = seen.height_m.max(low.abs()).max(high.abs());
            for slope in slopes(surface, pond.normals, pond.outside) {
                seen.slope = [0, 1].map(|k| seen.slope[k].max(slope[k].abs()));
            }
        }
        seen
    }
}

/// The expressions, and the three that are convolved: what belongs to the x, y and z of L_t, per area and brightest light.
pub(super) fn surface_passes(seen: &Seen, pond: &Pond, format: impl Format) -> (Expressions, [Node; 3]) {
    let mut e = Expressions::new();
    let light = pond.unit_light_direction();
    let eta = pond.eta();
    let n = 2.0 * pond.scattering;

    // In units of the highest: 0.5 is the water at rest, as the paper has it.
    let heights = Interval::around_zero(if seen.height_m > 0.0 { 1.0 } else { 0.0 });
    let h: Vec<Node> = (0..2 * ENDS).map(|_| e.input("h", heights, 0.0)).collect();
    let lamp = e.input("L_s", Interval::between(0.0, 1.0), 0.0);

    // Pass 1. Slopes are as steep as those seen, and what the rounding of heights adds.
    let slope = |e: &mut Expressions, k: usize, name: &str| {
        let c = 0.5 * seen.highest_m() / seen.pitch_m[k];
        let signs = [-c, c, -c, c];
        let terms: Vec<(f64, Node)> = signs.into_iter().zip(h[k * ENDS..][..ENDS].iter().copied()).collect();
        let known = seen.slope[k] + 4.0 * c * format.rounding(heights);
        e.sum_within(name, &terms, 0.0, Interval::around_zero(known))
    };
    let slopes = [slope(&mut e, 0, "dh/dx"), slope(&mut e, 1, "dh/dy")];
    let normal = [0, 1, 2].map(|k| {
        let name = ["N_x", "N_y", "N_z"][k];
        e.table_of_two(name, slopes, move |sx, sy| normal_of_slopes([sx, sy])[k])
    });

    // Pass 2. Gamma has one sign, that of n_i - n_t: its absolute value is the weight of a blend.
    let minus_light: Vec<(f64, Node)> = (0..3).map(|k| (-light[k], normal[k])).collect();
    let unit = Interval::between(-1.0, 1.0);
    let cos_i = e.sum_within("cos theta_i", &minus_light, 0.0, unit);
    let sign = if eta >= 1.0 { -1.0 } else { 1.0 };
    let gamma = e.table("|Gamma|", cos_i, move |cos_i| {
        let cos_i = cos_i.max(0.0);
        (sign * (cos_i / eta - fresnel_dielectric(cos_i, eta).cos_t)).max(0.0)
    });
    let bent =
        [0, 1, 2].map(|k| e.product(["|Gamma| N_x", "|Gamma| N_y", "|Gamma| N_z"][k], gamma, normal[k]));

    // Pass 3.
    let mut flux = e.table("cos theta_i T", cos_i, move |cos_i| {
        let cos_i = cos_i.max(0.0);
        cos_i * fresnel_dielectric(cos_i, eta).transmitted
    });
    flux = e.product("L_s cos theta_i T", flux, lamp);
    if pond.form == Form::Physical {
        let facet = e.table("1 / N_z", normal[2], |z| 1.0 / z);
        flux = e.product("L_s cos theta_i T / N_z", flux, facet);
    }

    // Pass 4. Downwards is positive; light that travels upwards meets no floor.
    let along = |e: &mut Expressions, k: usize, name: &str, side: f64, known: Interval| {
        e.sum_within(name, &[(side * sign, bent[k])], side * light[k] / eta, known)
    };
    let transmitted = [
        along(&mut e, 0, "L_tx", 1.0, unit),
        along(&mut e, 1, "L_ty", 1.0, unit),
        along(&mut e, 2, "-L_tz", -1.0, Interval::between(0.0, 1.0)),
    ];
    let power = e.table("(-L_tz)^(n-1)", transmitted[2], move |down| down.powf(n - 1.0));
    let lobe = [0, 1, 2].map(|k| {
        let name = ["L_tx (-L_tz)^(n-1)", "L_ty (-L_tz)^(n-1)", "(-L_tz)^n"][k];
        e.product(name, power, transmitted[k])
    });

    // Pass 5.
    let sources = [0, 1, 2].map(|k| e.product(["F_x", "F_y", "F_z"][k], flux, lobe[k]));
    (e, sources)
}

/// What the inputs of the passes are made of.
pub(super) struct Inputs<'a> {
    pub(super) surface: &'a HeightField,
    pub(super) pond: &'a Pond,
    pub(super) highest_m: f64,
    pub(super) brightest: f64,
    /// Where the surface can shade itself.
    pub(super) shadows: Option<Shadows<'a>>,
}

impl Inputs<'_> {
    /// The value of an input at a sample.
    pub(super) fn at(&self, number: usize, sample: usize) -> f64 {
        let HeightField { size, heights_m, .. } = self.surface;
        let at = [sample % size[0], sample / size[0]];
        if number == LAMP {
            let hidden = self.shadows.is_some_and(|shadows| shadows.hide(at[0], at[1]));
            let dark = hidden || self.brightest == 0.0;
            return if dark { 0.0 } else { self.pond.illumination.at(sample) / self.brightest };
        }
        let k = number / ENDS;
        let [low, high, steps] = ends(at[k], size[k], self.pond.normals, self.pond.outside);
        // A difference over two steps is the mean of two over one, a difference over one the mean of itself.
        let middle = if steps == 2 { [at[k]; 2] } else { [high, low] };
        let mut neighbour = at;
        neighbour[k] = [low, middle[0], middle[1], high][number % ENDS];
        heights_m[neighbour[1] * size[0] + neighbour[0]] / self.highest_m
    }
}
