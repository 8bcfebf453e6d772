//! Chromatic adaptation, CIELAB and colour differences.

use core::f64::consts::PI;

use num_traits::Float;

use crate::mat3::{self, Mat3};

/// Cone responses from XYZ, Bradford (Lam 1985; ICC.1:2010, annex E).
const BRADFORD_FROM_XYZ: Mat3 =
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

/// Bradford's cone responses to `xyz`: what [`bradford`] scales. Spectral lines may have negative ones.
pub const fn bradford_responses(xyz: [f64; 3]) -> [f64; 3] {
    mat3::apply(&BRADFORD_FROM_XYZ, xyz)
}

/// The Bradford matrix that carries XYZ seen under `source_white_xyz` to XYZ under `target_white_xyz`: the identity
/// if both are equal.
pub const fn bradford(source_white_xyz: [f64; 3], target_white_xyz: [f64; 3]) -> Mat3 {
    let (source, target) = (bradford_responses(source_white_xyz), bradford_responses(target_white_xyz));
    if source[0] == target[0] && source[1] == target[1] && source[2] == target[2] {
        return mat3::IDENTITY;
    }
    let gains = mat3::diagonal([target[0] / source[0], target[1] / source[1], target[2] / source[2]]);
    mat3::multiply(&mat3::inverse(&BRADFORD_FROM_XYZ), &mat3::multiply(&gains, &BRADFORD_FROM_XYZ))
}

/// Where the cube root of CIELAB turns into a line, (6/29)^3, CIE 15:2004.
const LAB_LINEAR_BELOW: f64 = 216.0 / 24389.0;
/// Slope of that line times 116, (29/3)^3.
const LAB_KAPPA: f64 = 24389.0 / 27.0;

/// CIELAB (L* 0 to 100, a*, b*) of XYZ relative to `white_xyz` (CIE 15:2004, eq. 8.3 to 8.8).
///
/// Negative XYZ continues along the linear part, so the result is finite for every finite input and positive white.
pub fn lab_from_xyz(xyz: [f64; 3], white_xyz: [f64; 3]) -> [f64; 3] {
    let f = |channel: usize| {
        let t = xyz[channel] / white_xyz[channel];
        if t > LAB_LINEAR_BELOW { Float::cbrt(t) } else { (LAB_KAPPA * t + 16.0) / 116.0 }
    };
    let (fx, fy, fz) = (f(0), f(1), f(2));
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

/// The Jacobian of CIELAB at `xyz`: rows L*, a*, b*, columns X, Y, Z; see [`lab_from_xyz`].
pub fn lab_jacobian(xyz: [f64; 3], white_xyz: [f64; 3]) -> Mat3 {
    let [fx, fy, fz] = [0, 1, 2].map(|channel| {
        let t = xyz[channel] / white_xyz[channel];
        let slope = if t > LAB_LINEAR_BELOW {
            1.0 / (3.0 * Float::cbrt(t) * Float::cbrt(t))
        } else {
            LAB_KAPPA / 116.0
        };
        slope / white_xyz[channel]
    });
    [[0.0, 116.0 * fy, 0.0], [500.0 * fx, -500.0 * fy, 0.0], [0.0, 200.0 * fy, -200.0 * fz]]
}

/// XYZ of CIELAB relative to `white_xyz`: the inverse of [`lab_from_xyz`].
pub fn xyz_from_lab(lab: [f64; 3], white_xyz: [f64; 3]) -> [f64; 3] {
    let fy = (lab[0] + 16.0) / 116.0;
    let f = [fy + lab[1] / 500.0, fy, fy - lab[2] / 200.0];
    let mut xyz = [0.0; 3];
    for (channel, f) in f.into_iter().enumerate() {
        let cubed = f * f * f;
        let t = if cubed > LAB_LINEAR_BELOW { cubed } else { (116.0 * f - 16.0) / LAB_KAPPA };
        xyz[channel] = t * white_xyz[channel];
    }
    xyz
}

/// CIE94 colour difference with the graphic-arts weights (kL = 1, K1 = 0.045, K2 = 0.015; CIE 116-1995).
///
/// It is not symmetric: chroma is weighted by the first colour, the standard.
pub fn delta_e_94(standard_lab: [f64; 3], sample_lab: [f64; 3]) -> f64 {
    let [l1, a1, b1] = standard_lab;
    let [l2, a2, b2] = sample_lab;
    let (c1, c2) = (Float::hypot(a1, b1), Float::hypot(a2, b2));
    let (dl, dc) = (l1 - l2, c1 - c2);
    // The hue part is what chroma leaves of the distance in the a*, b* plane; rounding may leave less than nothing.
    let dh_squared = ((a1 - a2) * (a1 - a2) + (b1 - b2) * (b1 - b2) - dc * dc).max(0.0);
    let (sc, sh) = (1.0 + 0.045 * c1, 1.0 + 0.015 * c1);
    Float::sqrt(dl * dl + (dc / sc) * (dc / sc) + dh_squared / (sh * sh))
}

/// CIEDE2000 colour difference with kL = kC = kH = 1 (CIE 142-2001), by the formulas of Sharma, Wu and Dalal 2005,
/// "The CIEDE2000 color-difference formula: implementation notes", eq. 2 to 22.
pub fn delta_e_2000(lab_1: [f64; 3], lab_2: [f64; 3]) -> f64 {
    let [l1, a1, b1] = lab_1;
    let [l2, a2, b2] = lab_2;
    let seventh_power_share = |c: f64| {
        let c7 = Float::powi(c, 7);
        Float::sqrt(c7 / (c7 + 6_103_515_625.0)) // 25^7
    };
    let g = 0.5 * (1.0 - seventh_power_share(0.5 * (Float::hypot(a1, b1) + Float::hypot(a2, b2))));
    let (a1, a2) = ((1.0 + g) * a1, (1.0 + g) * a2);
    let (c1, c2) = (Float::hypot(a1, b1), Float::hypot(a2, b2));
    let hue_deg = |a: f64, b: f64| {
        // atan2 would give 180 degrees for a negative zero.
        if a == 0.0 && b == 0.0 {
            return 0.0;
        }
        let degrees = Float::to_degrees(Float::atan2(b, a));
        if degrees < 0.0 { degrees + 360.0 } else { degrees }
    };
    let (h1, h2) = (hue_deg(a1, b1), hue_deg(a2, b2));
    let achromatic = c1 * c2 == 0.0;

    let dh_deg = match h2 - h1 {
        _ if achromatic => 0.0,
        d if d > 180.0 => d - 360.0,
        d if d < -180.0 => d + 360.0,
        d => d,
    };
    let (dl, dc) = (l2 - l1, c2 - c1);
    let dh = 2.0 * Float::sqrt(c1 * c2) * Float::sin(0.5 * dh_deg * PI / 180.0);

    let mean_l = 0.5 * (l1 + l2);
    let mean_c = 0.5 * (c1 + c2);
    let mean_h_deg = match h1 + h2 {
        sum if achromatic => sum,
        sum if (h1 - h2).abs() <= 180.0 => 0.5 * sum,
        sum if sum < 360.0 => 0.5 * (sum + 360.0),
        sum => 0.5 * (sum - 360.0),
    };
    let cos_deg = |degrees: f64| Float::cos(degrees * PI / 180.0);
    let t = 1.0 - 0.17 * cos_deg(mean_h_deg - 30.0)
        + 0.24 * cos_deg(2.0 * mean_h_deg)
        + 0.32 * cos_deg(3.0 * mean_h_deg + 6.0)
        - 0.20 * cos_deg(4.0 * mean_h_deg - 63.0);
    let l_offset = (mean_l - 50.0) * (mean_l - 50.0);
    let sl = 1.0 + 0.015 * l_offset / Float::sqrt(20.0 + l_offset);
    let sc = 1.0 + 0.045 * mean_c;
    let sh = 1.0 + 0.015 * mean_c * t;
    let turn = (mean_h_deg - 275.0) / 25.0;
    let rotation_deg = 60.0 * Float::exp(-turn * turn);
    let rt = -2.0 * seventh_power_share(mean_c) * Float::sin(rotation_deg * PI / 180.0);

    let (l, c, h) = (dl / sl, dc / sc, dh / sh);
    // The quadratic form is positive definite except for rounding.
    Float::sqrt((l * l + c * c + h * h + rt * c * h).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rgb::D65_WHITE_XYZ;
    use proptest::prelude::*;

    /// Table 1 of Sharma, Wu & Dalal 2005: L*, a*, b* of both colours and their CIEDE2000 difference. The pairs were
    /// chosen to sit on every branch and discontinuity of the formula.
    #[rustfmt::skip]
    const SHARMA_2005: [[f64; 7]; 34] = [
        [50.0000, 2.6772, -79.7751, 50.0000, 0.0000, -82.7485, 2.0425],
        [50.0000, 3.1571, -77.2803, 50.0000, 0.0000, -82.7485, 2.8615],
        [50.0000, 2.8361, -74.0200, 50.0000, 0.0000, -82.7485, 3.4412],
        [50.0000, -1.3802, -84.2814, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -1.1848, -84.8006, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -0.9009, -85.5211, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, 0.0000, 0.0000, 50.0000, -1.0000, 2.0000, 2.3669],
        [50.0000, -1.0000, 2.0000, 50.0000, 0.0000, 0.0000, 2.3669],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0009, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0010, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0011, 7.2195],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0012, 7.2195],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0009, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0010, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0011, -2.4900, 4.7461],
        [50.0000, 2.5000, 0.0000, 50.0000, 0.0000, -2.5000, 4.3065],
        [50.0000, 2.5000, 0.0000, 73.0000, 25.0000, -18.0000, 27.1492],
        [50.0000, 2.5000, 0.0000, 61.0000, -5.0000, 29.0000, 22.8977],
        [50.0000, 2.5000, 0.0000, 56.0000, -27.0000, -3.0000, 31.9030],
        [50.0000, 2.5000, 0.0000, 58.0000, 24.0000, 15.0000, 19.4535],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.1736, 0.5854, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2972, 0.0000, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 1.8634, 0.5757, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2592, 0.3350, 1.0000],
        [60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644],
        [63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630],
        [61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731],
        [35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645],
        [22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373],
        [36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146],
        [90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441],
        [90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381],
        [6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377],
        [2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082],
    ];

    #[test]
    fn ciede2000_matches_the_published_pairs() {
        for (i, [l1, a1, b1, l2, a2, b2, expected]) in SHARMA_2005.into_iter().enumerate() {
            let (first, second) = ([l1, a1, b1], [l2, a2, b2]);
            for got in [delta_e_2000(first, second), delta_e_2000(second, first)] {
                assert!((got - expected).abs() < 5.1e-5, "pair {}: {got} {expected}", i + 1);
            }
        }
    }

    #[test]
    fn ciede2000_takes_negative_zero_for_grey() {
        let color = [50.0, 10.0, -20.0];
        assert_eq!(delta_e_2000([50.0, -0.0, 0.0], color), delta_e_2000([50.0, 0.0, 0.0], color));
        assert_eq!(delta_e_2000(color, [50.0, -0.0, -0.0]), delta_e_2000(color, [50.0, 0.0, 0.0]));
    }

    #[test]
    fn cie94_is_its_formula() {
        // By hand: C1 = 5, C2 = 10, dC = -5, da = -3, db = -4, dH = 0; SC = 1.225.
        let got = delta_e_94([50.0, 3.0, 4.0], [48.0, 6.0, 8.0]);
        assert!((got - (4.0 + (5.0 / 1.225_f64).powi(2)).sqrt()).abs() < 1e-12, "{got}");
        // A pure hue difference: C1 = C2 = 5, dH^2 = 2 * 25; SH = 1.075.
        let got = delta_e_94([50.0, 5.0, 0.0], [50.0, 0.0, 5.0]);
        assert!((got - 50.0_f64.sqrt() / 1.075).abs() < 1e-12, "{got}");
        // Weighted by the standard's chroma, hence not symmetric.
        assert!(
            delta_e_94([50.0, 3.0, 4.0], [50.0, 6.0, 8.0]) > delta_e_94([50.0, 6.0, 8.0], [50.0, 3.0, 4.0])
        );
    }

    #[test]
    fn lab_has_its_fixed_points() {
        assert_eq!(lab_from_xyz(D65_WHITE_XYZ, D65_WHITE_XYZ), [100.0, 0.0, 0.0]);
        assert_eq!(lab_from_xyz([0.0; 3], D65_WHITE_XYZ), [0.0, 0.0, 0.0]);
        // Y = 18.418651851244416 % is L* = 50 by definition.
        let grey = D65_WHITE_XYZ.map(|v| v * 0.184_186_518_512_444_16);
        let lab = lab_from_xyz(grey, D65_WHITE_XYZ);
        assert!((lab[0] - 50.0).abs() < 1e-13 && lab[1].abs() < 1e-13 && lab[2].abs() < 1e-13, "{lab:?}");
    }

    /// Lindbloom's Bradford matrix from D50 (0.96422, 1, 0.82521) to D65, seven digits.
    #[test]
    fn bradford_matches_the_published_matrix() {
        let published = [
            [0.955_576_6, -0.023_039_3, 0.063_163_6],
            [-0.028_289_5, 1.009_941_6, 0.021_007_7],
            [0.012_298_2, -0.020_483_0, 1.329_909_8],
        ];
        let matrix = bradford([0.96422, 1.0, 0.82521], D65_WHITE_XYZ);
        for i in 0..3 {
            for j in 0..3 {
                assert!((matrix[i][j] - published[i][j]).abs() < 6e-8, "{i} {j}: {}", matrix[i][j]);
            }
        }
    }

    #[test]
    fn bradford_carries_white_to_white_and_nothing_to_itself() {
        let a = [1.09850, 1.0, 0.35585];
        let adapted = mat3::apply(&bradford(a, D65_WHITE_XYZ), a);
        for c in 0..3 {
            assert!((adapted[c] - D65_WHITE_XYZ[c]).abs() < 1e-14, "{adapted:?}");
        }
        assert_eq!(bradford(a, a), mat3::IDENTITY);
    }

    fn any_lab() -> impl Strategy<Value = [f64; 3]> {
        (0.0..100.0, -128.0..128.0, -128.0..128.0).prop_map(|(l, a, b)| [l, a, b])
    }

    proptest! {
        #[test]
        fn lab_round_trips(x in -0.1..2.0, y in -0.1..2.0, z in -0.1..2.0) {
            let back = xyz_from_lab(lab_from_xyz([x, y, z], D65_WHITE_XYZ), D65_WHITE_XYZ);
            for (back, v) in back.into_iter().zip([x, y, z]) {
                prop_assert!((back - v).abs() < 1e-13, "{} {}", back, v);
            }
        }

        #[test]
        fn lab_s_jacobian_is_its_slope(x in 0.02..2.0, y in 0.02..2.0, z in 0.02..2.0) {
            let jacobian = lab_jacobian([x, y, z], D65_WHITE_XYZ);
            for column in 0..3 {
                let at = |step: f64| {
                    let mut xyz = [x, y, z];
                    xyz[column] += step;
                    lab_from_xyz(xyz, D65_WHITE_XYZ)
                };
                for (row, entries) in jacobian.iter().enumerate() {
                    let slope = (at(1e-6)[row] - at(-1e-6)[row]) / 2e-6;
                    prop_assert!((entries[column] - slope).abs() < 1e-4 * (1.0 + slope.abs()), "{row} {column}");
                }
            }
        }

        #[test]
        fn differences_are_finite_and_zero_only_for_equals(a in any_lab(), b in any_lab()) {
            for difference in [delta_e_94, delta_e_2000] {
                prop_assert_eq!(difference(a, a), 0.0);
                let d = difference(a, b);
                prop_assert!(d.is_finite() && d > 0.0, "{:?} {:?}: {}", a, b, d);
            }
        }

        #[test]
        fn ciede2000_is_symmetric(a in any_lab(), b in any_lab()) {
            prop_assert!((delta_e_2000(a, b) - delta_e_2000(b, a)).abs() < 1e-10);
        }
    }
}
