//! FLIP, a difference of two pictures as an observer who flips between them would see it.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild 2020, "FLIP: A Difference Evaluator for
//! Alternating Images"; sections and constants below are the paper's. The bindings to its authors' program
//! need a C++ compiler, which a machine with only Rust lacks, so it is written out here and tested against
//! values from that program.
//!
//! ppd          pixels per degree of visual angle
//! `YCxCz`      linearised CIELAB (section 4.1.1)
//! q_c, q_f     exponents of the colour and the feature difference

use spectral_core::color::lab_from_xyz;
use spectral_core::display::linear_from_srgb;
use spectral_core::rgb::{D65_WHITE_XYZ, linear_srgb_from_xyz, xyz_from_linear_srgb};

/// The authors' default viewer: 0.7 m from a 0.7 m wide display of 3840 pixels.
pub const PIXELS_PER_DEGREE: f64 = 0.7 * 3840.0 / 0.7 * std::f64::consts::PI / 180.0;

/// Exponent of the colour difference, section 4.1.4.
const Q_C: f64 = 0.7;
/// Exponent of the feature difference, section 4.2.
const Q_F: f64 = 0.5;
/// Differences below this share of the largest one ...
const P_C: f64 = 0.4;
/// ... take up this share of the scale, section 4.1.4.
const P_T: f64 = 0.95;
/// Width of the feature detectors, degrees, section 4.2.
const FEATURE_WIDTH_DEG: f64 = 0.082;

/// Contrast sensitivity per `YCxCz` channel as two Gaussians, a sqrt(pi / b) exp(-pi^2 x^2 / b), Table 1.
const SENSITIVITY: [[(f64, f64); 2]; 3] =
    [[(1.0, 0.0047), (0.0, 1e-5)], [(1.0, 0.0053), (0.0, 1e-5)], [(34.1, 0.04), (13.5, 0.025)]];

/// A picture in display sRGB, each component in 0..=1, row-major.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// Pixels across and down, both above 0.
    pub size: [usize; 2],
    /// One encoded sRGB triple a pixel.
    pub srgb: &'a [[f64; 3]],
}

/// FLIP per pixel, 0 (no visible difference) to 1, seen at `pixels_per_degree`.
///
/// # Panics
/// If the sizes differ, or do not fit the number of pixels.
pub fn flip(test: &Picture<'_>, reference: &Picture<'_>, pixels_per_degree: f64) -> Vec<f64> {
    for picture in [test, reference] {
        assert_eq!(picture.size, reference.size, "pictures of different sizes");
        assert_eq!(picture.srgb.len(), picture.size[0] * picture.size[1], "pixels do not fit the size");
    }
    let [test, reference] = [test, reference].map(opponent);
    let [seen_test, seen_reference] = [&test, &reference].map(|p| perceived(p, pixels_per_degree));
    let largest = hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(Q_C);
    let [features_test, features_reference] = [&test, &reference].map(|p| Features::of(p, pixels_per_degree));
    (0..test.pixels.len())
        .map(|i| {
            let color = redistributed(hyab(seen_test[i], seen_reference[i]).powf(Q_C), largest);
            let edge = (features_test.edges[i] - features_reference.edges[i]).abs();
            let point = (features_test.points[i] - features_reference.points[i]).abs();
            let feature = (edge.max(point) * std::f64::consts::FRAC_1_SQRT_2).powf(Q_F).min(1.0);
            color.powf(1.0 - feature)
        })
        .collect()
}

/// Three channels a pixel.
struct Field {
    size: [usize; 2],
    pixels: Vec<[f64; 3]>,
}

/// The picture in `YCxCz`, section 4.1.1.
fn opponent(picture: &Picture<'_>) -> Field {
    let pixel = |srgb: &[f64; 3]| {
        let xyz = xyz_from_linear_srgb(srgb.map(linear_from_srgb));
        let [x, y, z] = std::array::from_fn(|i| xyz[i] / D65_WHITE_XYZ[i]);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    };
    Field { size: picture.size, pixels: picture.srgb.iter().map(pixel).collect() }
}

/// What is left of it at the viewing distance, in Hunt-adjusted Lab, sections 4.1.2 and 4.1.3.
fn perceived(opponent: &Field, ppd: f64) -> Vec<[f64; 3]> {
    let pixel = |[y, cx, cz]: [f64; 3]| {
        let y = (y + 16.0) / 116.0;
        let relative = [y + cx / 500.0, y, y - cz / 200.0];
        let xyz = std::array::from_fn(|i| relative[i] * D65_WHITE_XYZ[i]);
        hunt_lab(linear_srgb_from_xyz(xyz).map(|v| v.clamp(0.0, 1.0)))
    };
    filtered_by_sensitivity(opponent, ppd).into_iter().map(pixel).collect()
}

/// Lab with its chroma scaled by lightness.
fn hunt_lab(linear_srgb: [f64; 3]) -> [f64; 3] {
    let [l, a, b] = lab_from_xyz(xyz_from_linear_srgb(linear_srgb), D65_WHITE_XYZ);
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// |dL| + distance in the a, b plane, section 4.1.3.
fn hyab(p: [f64; 3], q: [f64; 3]) -> f64 {
    (p[0] - q[0]).abs() + (p[1] - q[1]).hypot(p[2] - q[2])
}

/// Map 0..=largest to 0..=1, section 4.1.4.
fn redistributed(difference: f64, largest: f64) -> f64 {
    let knee = P_C * largest;
    if difference < knee {
        difference * P_T / knee
    } else {
        P_T + (difference - knee) / (largest - knee) * (1.0 - P_T)
    }
}

/// Blur every channel by its sensitivity. A sum of Gaussians is no product of rows and columns, but each one is.
fn filtered_by_sensitivity(field: &Field, ppd: f64) -> Vec<[f64; 3]> {
    let widest = SENSITIVITY.iter().flatten().map(|&(_, b)| b).fold(0.0, f64::max);
    let radius = (3.0 * (widest / (2.0 * std::f64::consts::PI.powi(2))).sqrt() * ppd).ceil() as i64;
    let mut result = vec![[0.0; 3]; field.pixels.len()];
    for (channel, gaussians) in SENSITIVITY.iter().enumerate() {
        let plane: Vec<f64> = field.pixels.iter().map(|p| p[channel]).collect();
        let kernels = gaussians.map(|(a, b)| {
            let weight = |x: i64| (-(std::f64::consts::PI * x as f64 / ppd).powi(2) / b).exp();
            let kernel: Vec<f64> = (-radius..=radius).map(weight).collect();
            (a * (std::f64::consts::PI / b).sqrt(), kernel)
        });
        let total: f64 = kernels.iter().map(|(a, k)| a * k.iter().sum::<f64>().powi(2)).sum();
        for (a, kernel) in kernels.iter().filter(|(a, _)| *a > 0.0) {
            let blurred = convolved(&plane, field.size, kernel, kernel);
            for (pixel, value) in result.iter_mut().zip(blurred) {
                pixel[channel] += a / total * value;
            }
        }
    }
    result
}

/// How strongly each pixel is an edge or a point, section 4.2.
struct Features {
    edges: Vec<f64>,
    points: Vec<f64>,
}

impl Features {
    fn of(opponent: &Field, ppd: f64) -> Self {
        let sigma = 0.5 * FEATURE_WIDTH_DEG * ppd;
        let radius = (3.0 * sigma).ceil() as i64;
        let gauss = |x: i64| (-(x as f64).powi(2) / (2.0 * sigma * sigma)).exp();
        let smooth: Vec<f64> = (-radius..=radius).map(gauss).collect();
        let first: Vec<f64> = (-radius..=radius).map(|x| -(x as f64) * gauss(x)).collect();
        let second: Vec<f64> =
            (-radius..=radius).map(|x| ((x as f64 / sigma).powi(2) - 1.0) * gauss(x)).collect();
        let y: Vec<f64> = opponent.pixels.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
        let smooth = sides_of_one(&smooth);
        let strength = |derivative: &[f64]| -> Vec<f64> {
            let kernel = sides_of_one(derivative);
            let across = convolved(&y, opponent.size, &kernel, &smooth);
            let down = convolved(&y, opponent.size, &smooth, &kernel);
            across.iter().zip(down).map(|(a, d)| a.hypot(d)).collect()
        };
        Self { edges: strength(&first), points: strength(&second) }
    }
}

/// Scaled so that its positive weights sum to 1 and its negative ones to -1.
fn sides_of_one(kernel: &[f64]) -> Vec<f64> {
    let positive: f64 = kernel.iter().filter(|&&k| k > 0.0).sum();
    let negative: f64 = -kernel.iter().filter(|&&k| k < 0.0).sum::<f64>();
    kernel.iter().map(|&k| if k > 0.0 { k / positive } else { k / negative.max(f64::MIN_POSITIVE) }).collect()
}

/// Convolution by `across` in x and `down` in y; beyond the border the border's pixels go on.
fn convolved(plane: &[f64], [width, height]: [usize; 2], across: &[f64], down: &[f64]) -> Vec<f64> {
    let rows = weighted(plane, across, |i, shift| i / width * width + shifted(i % width, shift, width));
    weighted(&rows, down, |i, shift| shifted(i / width, shift, height) * width + i % width)
}

fn weighted(plane: &[f64], kernel: &[f64], source: impl Fn(usize, i64) -> usize) -> Vec<f64> {
    let radius = kernel.len() as i64 / 2;
    let pixel = |i: usize| -> f64 {
        kernel.iter().zip(-radius..).map(|(weight, shift)| weight * plane[source(i, shift)]).sum()
    };
    (0..plane.len()).map(pixel).collect()
}

fn shifted(index: usize, shift: i64, count: usize) -> usize {
    (index as i64 + shift).clamp(0, count as i64 - 1) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [64, 48];

    /// Waves in red and green and a blue chequerboard, moved by `shift` and dimmed to `scale`.
    fn pattern(shift: usize, scale: f64) -> Vec<[f64; 3]> {
        let pixel = |i: usize| {
            let (x, y) = (i % SIZE[0], i / SIZE[0]);
            let red = 0.5 + 0.5 * (0.37 * (x + shift) as f64 + 0.11 * y as f64).sin();
            let green = 0.5 + 0.5 * (0.23 * x as f64 - 0.31 * (y + shift) as f64).cos();
            let blue = ((x / 8 + y / 8 + shift) % 2) as f64 * 0.8;
            [red * scale, green * scale, blue * scale]
        };
        (0..SIZE[0] * SIZE[1]).map(pixel).collect()
    }

    #[test]
    fn agrees_with_the_authors_program() {
        let reference = pattern(0, 1.0);
        // Mean, pixel (20, 10) and pixel (0, 0) by version 1.7 of the authors' Python package, in f32.
        let published = [
            (1, 1.0, [0.638_411_8, 0.811_608_1, 0.968_248_1]),
            (0, 0.9, [0.394_944_1, 0.435_866_4, 0.555_585_8]),
            (3, 0.5, [0.891_072_8, 0.982_433_1, 0.985_195_6]),
        ];
        for (shift, scale, expected) in published {
            let test = pattern(shift, scale);
            let map = flip(
                &Picture { size: SIZE, srgb: &test },
                &Picture { size: SIZE, srgb: &reference },
                PIXELS_PER_DEGREE,
            );
            let mean = map.iter().sum::<f64>() / map.len() as f64;
            for (got, expected) in [mean, map[10 * SIZE[0] + 20], map[0]].into_iter().zip(expected) {
                assert!((got - expected).abs() < 2e-4, "shift {shift}: {got} against {expected}");
            }
        }
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        let picture = pattern(0, 1.0);
        let picture = Picture { size: SIZE, srgb: &picture };
        assert!(flip(&picture, &picture, PIXELS_PER_DEGREE).iter().all(|&v| v == 0.0));
    }
}
