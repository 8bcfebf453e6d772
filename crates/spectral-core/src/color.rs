//! Chromatic adaptation, CIELAB and colour differences.

use core::f64::consts::PI;

use num_traits::Float;

use crate::mat3::{self, Mat3};

/// Cone responses from XYZ, Bradford (Lam 1985; ICC.1:2010, annex E).
const BRADFORD_FROM_XYZ: Mat3 =
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

/// The Bradford matrix that carries XYZ seen under `source_white_xyz` to XYZ under `target_white_xyz`: the identity
/// if both are equal.
pub const fn bradford(source_white_xyz: [f64; 3], target_white_xyz: [f64; 3]) -> Mat3 {
    let (source, target) = (
        mat3::apply(&BRADFORD_FROM_XYZ, source_white_xyz),
        mat3::apply(&BRADFORD_FROM_XYZ, target_white_xyz),
    );
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
