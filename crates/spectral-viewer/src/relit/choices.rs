//! What a user can switch.

use spectral_cli::Basis;

/// Numbers of coefficients to choose from.
pub(super) const COEFFICIENTS: [usize; 5] = [3, 4, 5, 8, 12];
/// Samples along a side of a pixel.
pub(super) const SAMPLES: [u32; 3] = [1, 2, 4];

/// What light and albedos are multiplied in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Colors {
    /// The coefficients of a spectral basis.
    Spectral(Basis, usize),
    /// Linear sRGB.
    Rgb,
    /// Every wavelength of the grid: what the others are compared with.
    Sampled,
}

/// All that makes another plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Choices {
    /// Of spectra, kept while RGB is shown.
    pub(super) basis: Basis,
    /// Their number.
    pub(super) coefficients: usize,
    /// Spectra, or RGB.
    pub(super) is_spectral: bool,
    /// Samples along a side of a pixel.
    pub(super) samples: u32,
}

impl Choices {
    /// What pictures are made in.
    pub(super) fn colors(&self) -> Colors {
        if self.is_spectral { Colors::Spectral(self.basis, self.coefficients) } else { Colors::Rgb }
    }
}
