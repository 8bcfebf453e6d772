//! Surroundings as an equirectangular picture.

use std::path::{Path, PathBuf};

use exr::prelude::read_first_rgba_layer_from_file;

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

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Linear sRGB of every texel, row after row.
    pub fn linear_srgb(&self) -> &[[f32; 3]] {
        &self.linear_srgb
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::write_rgb_file;

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
