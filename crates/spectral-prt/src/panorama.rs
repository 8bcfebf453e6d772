//! Surroundings as an equirectangular picture.

use std::path::{Path, PathBuf};

use exr::prelude::read_first_rgba_layer_from_file;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Radiance from all directions in linear sRGB, white D65 of luminance 1 being (1, 1, 1).
///
/// The first row is straight up, +Y. The middle column looks along -Z, and +X is to its right.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    width: usize,
    height: usize,
    linear_srgb: Vec<[f32; 3]>,
}

/// Why a picture lights nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PanoramaError {
    /// No texels, or not as many as the size says.
    #[error("{texels} texels for a panorama of {width} x {height}")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Texels there are.
        texels: usize,
    },
    /// An undefined, infinite or negative radiance.
    #[error("the texel in column {column}, row {row} is ({0}, {1}, {2}); radiance is finite and not negative", got[0], got[1], got[2])]
    Radiance {
        /// Its column, from 0.
        column: usize,
        /// Its row, from 0.
        row: usize,
        /// What it holds, linear sRGB.
        got: [f32; 3],
    },
    /// Every texel is 0.
    #[error("all texels are black: nothing would be lit")]
    Dark,
    /// A file that is no such picture.
    #[error("{} cannot be read as an EXR with R, G and B: {problem}", path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
}

impl Panorama {
    /// A picture, row after row.
    ///
    /// # Errors
    /// [`PanoramaError`] for a wrong number of texels, for radiances that are NaN, infinite or negative, and if all are 0.
    pub fn new(width: usize, height: usize, linear_srgb: Vec<[f32; 3]>) -> Result<Self, PanoramaError> {
        if linear_srgb.is_empty() || width.checked_mul(height) != Some(linear_srgb.len()) {
            return Err(PanoramaError::Size { width, height, texels: linear_srgb.len() });
        }
        let bad = |texel: &[f32; 3]| !texel.iter().all(|v| v.is_finite() && *v >= 0.0);
        if let Some(at) = linear_srgb.iter().position(bad) {
            return Err(PanoramaError::Radiance {
                column: at % width,
                row: at / width,
                got: linear_srgb[at],
            });
        }
        if linear_srgb.as_flattened().iter().all(|v| *v == 0.0) {
            return Err(PanoramaError::Dark);
        }
        Ok(Self { width, height, linear_srgb })
    }

    /// The first layer with the channels R, G and B of an EXR file.
    ///
    /// # Errors
    /// As [`Panorama::new`], and [`PanoramaError::File`].
    pub fn from_exr(path: &Path) -> Result<Self, PanoramaError> {
        let image = read_first_rgba_layer_from_file(
            path,
            |size, _| (size.width(), vec![[0.0; 3]; size.area()]),
            |(width, texels), at, (r, g, b, _): (f32, f32, f32, f32)| {
                texels[at.y() * *width + at.x()] = [r, g, b]
            },
        )
        .map_err(|error| PanoramaError::File { path: path.to_path_buf(), problem: error.to_string() })?;
        let size = image.layer_data.size;
        Self::new(size.width(), size.height(), image.layer_data.channel_data.pixels.1)
    }

    /// Each texel's direction, solid angle in steradians, and linear sRGB.
    pub fn texels(&self) -> impl Iterator<Item = (DVec3, f64, [f64; 3])> + '_ {
        let row_angle = PI / self.height as f64;
        self.linear_srgb.iter().enumerate().map(move |(i, texel)| {
            let (row, column) = ((i / self.width) as f64, (i % self.width) as f64);
            let theta = (row + 0.5) * row_angle;
            let phi = TAU * ((column + 0.5) / self.width as f64 - 0.5);
            let direction = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
            // cos(a) - cos(b) over the row, without cancellation.
            let solid_angle = TAU / self.width as f64 * 2.0 * theta.sin() * (0.5 * row_angle).sin();
            (direction, solid_angle, texel.map(f64::from))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::write_rgb_file;

    #[test]
    fn texels_cover_the_sphere_and_look_where_they_should() {
        let panorama = Panorama::new(8, 4, (0..32).map(|i| [i as f32; 3]).collect()).unwrap();
        let whole: f64 = panorama.texels().map(|(_, solid_angle, _)| solid_angle).sum();
        assert!((whole - 4.0 * PI).abs() < 1e-12);
        let texels: Vec<_> = panorama.texels().collect();
        assert!(texels[0].0.y > 0.9 && texels[31].0.y < -0.9);
        // The two middle columns share -Z between them; three quarters to the right is +X.
        let level = |column: usize| (texels[8 + column].0 + texels[16 + column].0).normalize();
        assert!(((level(3) + level(4)).normalize() - DVec3::NEG_Z).length() < 1e-12);
        assert!(((level(5) + level(6)).normalize() - DVec3::X).length() < 1e-12);
    }

    #[test]
    fn a_file_comes_back() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("sky.exr");
        write_rgb_file(&path, 6, 3, |x, y| (x as f32, y as f32 * 0.25, 1.5_f32)).unwrap();
        let panorama = Panorama::from_exr(&path).unwrap();
        assert_eq!((panorama.width, panorama.height), (6, 3));
        assert_eq!(panorama.linear_srgb[6 + 4], [4.0, 0.25, 1.5]);
    }

    #[test]
    fn what_lights_nothing_is_refused_with_its_place() {
        for bad in [-0.5, f32::NAN, f32::INFINITY] {
            let mut texels = vec![[1.0; 3]; 18];
            texels[8][1] = bad;
            let refused = Panorama::new(6, 3, texels).unwrap_err();
            assert!(matches!(refused, PanoramaError::Radiance { column: 2, row: 1, .. }), "{refused}");
        }
        assert_eq!(Panorama::new(6, 3, vec![[0.0; 3]; 18]), Err(PanoramaError::Dark));
        assert_eq!(
            Panorama::new(6, 3, vec![[1.0; 3]; 17]),
            Err(PanoramaError::Size { width: 6, height: 3, texels: 17 })
        );
        assert!(Panorama::new(0, 0, Vec::new()).is_err());
        let missing = Panorama::from_exr(Path::new("no-such-sky.exr")).unwrap_err();
        assert!(missing.to_string().starts_with("no-such-sky.exr cannot be read"), "{missing}");
    }
}
