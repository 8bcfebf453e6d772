//! RGB spaces from their primaries and white, and their matrices to and from XYZ.
//!
//! XYZ is always relative to D65 as [`D65_WHITE_XYZ`] gives it. A space with another white (ACEScg) is
//! adapted to it with Bradford, so equal components are neutral and display as white in every space.

use crate::color::bradford;
use crate::mat3::{self, Mat3};

/// XYZ of D65 with Y = 1: the white of this project, exact by definition.
pub const D65_WHITE_XYZ: [f64; 3] = [0.95047, 1.0, 1.08883];

/// An RGB space with linear components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RgbSpace {
    /// Name as printed, such as `sRGB`.
    pub name: &'static str,
    /// Chromaticities (x, y) of red, green and blue.
    pub primaries_xy: [[f64; 2]; 3],
    /// XYZ of the space's own white, Y = 1.
    pub white_xyz: [f64; 3],
    xyz_from_rgb: Mat3,
    rgb_from_xyz: Mat3,
}

impl RgbSpace {
    /// IEC 61966-2-1 sRGB with linear components (Rec. 709 primaries).
    pub const SRGB: Self = Self::new("sRGB", [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]], D65_WHITE_XYZ);

    /// Display P3 (SMPTE EG 432-1 primaries with a D65 white), linear.
    pub const DISPLAY_P3: Self =
        Self::new("Display P3", [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]], D65_WHITE_XYZ);

    /// ITU-R BT.2020, linear.
    pub const REC2020: Self =
        Self::new("Rec. 2020", [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]], D65_WHITE_XYZ);

    /// ACEScg (Academy S-2014-004): AP1 primaries, white (0.32168, 0.33767) near D60, adapted to D65.
    pub const ACESCG: Self = Self::new(
        "ACEScg",
        [[0.713, 0.293], [0.165, 0.830], [0.128, 0.044]],
        xyz_from_xyy([0.32168, 0.33767], 1.0),
    );

    /// The spaces known by name.
    pub const ALL: [Self; 4] = [Self::SRGB, Self::DISPLAY_P3, Self::REC2020, Self::ACESCG];

    /// The space with these primaries and this white (SMPTE RP 177): each primary is scaled so that they add up
    /// to the white, then the white is adapted to D65 with Bradford unless it is D65 already.
    ///
    /// The blue column is closed so that [`Self::xyz_from_rgb`] times (1, 1, 1), summed from left to right, is
    /// [`D65_WHITE_XYZ`] to the last bit. Collinear primaries have no matrix: their entries are not finite.
    pub const fn new(name: &'static str, primaries_xy: [[f64; 2]; 3], white_xyz: [f64; 3]) -> Self {
        let (r, g, b) = (
            xyz_from_xyy(primaries_xy[0], 1.0),
            xyz_from_xyy(primaries_xy[1], 1.0),
            xyz_from_xyy(primaries_xy[2], 1.0),
        );
        let columns = [[r[0], g[0], b[0]], [r[1], g[1], b[1]], [r[2], g[2], b[2]]];
        let luminances = mat3::apply(&mat3::inverse(&columns), white_xyz);
        let own = mat3::multiply(&columns, &mat3::diagonal(luminances));
        let mut xyz_from_rgb = mat3::multiply(&bradford(white_xyz, D65_WHITE_XYZ), &own);
        let mut i = 0;
        while i < 3 {
            xyz_from_rgb[i][2] = D65_WHITE_XYZ[i] - (xyz_from_rgb[i][0] + xyz_from_rgb[i][1]);
            i += 1;
        }
        Self { name, primaries_xy, white_xyz, xyz_from_rgb, rgb_from_xyz: mat3::inverse(&xyz_from_rgb) }
    }

    /// The matrix from linear components to D65-relative XYZ.
    pub const fn xyz_from_rgb(&self) -> Mat3 {
        self.xyz_from_rgb
    }

    /// The matrix from D65-relative XYZ to linear components.
    pub const fn rgb_from_xyz(&self) -> Mat3 {
        self.rgb_from_xyz
    }

    /// Relative luminance Y of linear components; (1, 1, 1) has 1.
    pub const fn luminance(&self, linear_rgb: [f64; 3]) -> f64 {
        let y = &self.xyz_from_rgb[1];
        y[0] * linear_rgb[0] + y[1] * linear_rgb[1] + y[2] * linear_rgb[2]
    }
}

/// XYZ of linear sRGB; (1, 1, 1) gives [`D65_WHITE_XYZ`] exactly.
pub const fn xyz_from_linear_srgb(linear_srgb: [f64; 3]) -> [f64; 3] {
    mat3::apply(&RgbSpace::SRGB.xyz_from_rgb, linear_srgb)
}

/// Linear sRGB of XYZ, with negative components outside the gamut.
pub const fn linear_srgb_from_xyz(xyz: [f64; 3]) -> [f64; 3] {
    mat3::apply(&RgbSpace::SRGB.rgb_from_xyz, xyz)
}

/// Relative luminance Y of linear sRGB; white has 1.
pub const fn luminance(linear_srgb: [f64; 3]) -> f64 {
    RgbSpace::SRGB.luminance(linear_srgb)
}

/// XYZ with luminance `y_luminance` at the chromaticity (x, y).
pub const fn xyz_from_xyy(xy: [f64; 2], y_luminance: f64) -> [f64; 3] {
    [xy[0] / xy[1] * y_luminance, y_luminance, (1.0 - xy[0] - xy[1]) / xy[1] * y_luminance]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mat3::{IDENTITY, apply, multiply};

    #[test]
    fn white_is_d65_exactly_in_every_space() {
        for space in RgbSpace::ALL {
            assert_eq!(apply(&space.xyz_from_rgb(), [1.0; 3]), D65_WHITE_XYZ, "{}", space.name);
            assert_eq!(space.luminance([1.0; 3]), 1.0, "{}", space.name);
        }
        assert_eq!(xyz_from_linear_srgb([1.0; 3]), D65_WHITE_XYZ);
    }

    #[test]
    fn matrices_are_inverse_to_each_other() {
        for space in RgbSpace::ALL {
            let product = multiply(&space.rgb_from_xyz(), &space.xyz_from_rgb());
            for i in 0..3 {
                for j in 0..3 {
                    assert!((product[i][j] - IDENTITY[i][j]).abs() < 1e-14, "{} {product:?}", space.name);
                }
            }
        }
    }

    /// Bruce Lindbloom's sRGB matrix, which has the same white; IEC 61966-2-1's own four digits, from a white rounded
    /// to (0.3127, 0.3290), are within 1e-4.
    #[test]
    fn srgb_matrix_is_the_published_one() {
        let published = [
            [0.412_456_4, 0.357_576_1, 0.180_437_5],
            [0.212_672_9, 0.715_152_2, 0.072_175_0],
            [0.019_333_9, 0.119_192_0, 0.950_304_1],
        ];
        let derived = RgbSpace::SRGB.xyz_from_rgb();
        for i in 0..3 {
            for j in 0..3 {
                assert!((derived[i][j] - published[i][j]).abs() < 6e-8, "{i} {j} {}", derived[i][j]);
            }
        }
    }

    /// Luma coefficients of ITU-R BT.2020 and the luminance row of the P3 D65 matrix, to the digits printed.
    #[test]
    fn luminance_rows_match_the_standards() {
        let rows =
            [(RgbSpace::REC2020, [0.2627, 0.6780, 0.0593]), (RgbSpace::DISPLAY_P3, [0.2290, 0.6917, 0.0793])];
        for (space, published) in rows {
            for (derived, published) in space.xyz_from_rgb()[1].iter().zip(published) {
                assert!((derived - published).abs() < 6e-5, "{} {derived} {published}", space.name);
            }
        }
    }

    /// Before adaptation, AP1's luminance row is (0.2722287168, 0.6740817658, 0.0536895174), Academy S-2014-004.
    #[test]
    fn acescg_is_ap1_adapted_by_bradford() {
        let back = bradford(D65_WHITE_XYZ, RgbSpace::ACESCG.white_xyz);
        let ap1 = multiply(&back, &RgbSpace::ACESCG.xyz_from_rgb());
        for (derived, published) in ap1[1].iter().zip([0.272_228_716_8, 0.674_081_765_8, 0.053_689_517_4]) {
            assert!((derived - published).abs() < 1e-9, "{derived} {published}");
        }
    }

    #[test]
    fn primaries_keep_their_chromaticities() {
        for space in [RgbSpace::SRGB, RgbSpace::DISPLAY_P3, RgbSpace::REC2020] {
            for (k, xy) in space.primaries_xy.iter().enumerate() {
                let mut rgb = [0.0; 3];
                rgb[k] = 1.0;
                let [x, y, z] = apply(&space.xyz_from_rgb(), rgb);
                assert!((x / (x + y + z) - xy[0]).abs() < 1e-14, "{} {k}", space.name);
                assert!((y / (x + y + z) - xy[1]).abs() < 1e-14, "{} {k}", space.name);
            }
        }
    }
}
