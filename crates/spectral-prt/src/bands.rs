//! How many bands of spherical harmonics.

use serde::{Deserialize, Serialize};

/// Bands of spherical harmonics, 1 to 10: degrees 0 to `bands - 1`, `bands` squared coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct Bands(u8);

/// A number of bands that there is no transfer for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("1 to {max} bands of spherical harmonics are possible, got {got}", max = Bands::MAX.0)]
pub struct BandsError {
    /// Bands asked for.
    pub got: u8,
}

impl Bands {
    /// Ten: 100 coefficients.
    pub const MAX: Self = Self(10);

    /// `bands` of them.
    ///
    /// # Errors
    /// [`BandsError`] unless 1 to 10.
    pub fn new(bands: u8) -> Result<Self, BandsError> {
        if (1..=Self::MAX.0).contains(&bands) { Ok(Self(bands)) } else { Err(BandsError { got: bands }) }
    }

    /// How many there are.
    pub fn count(self) -> usize {
        usize::from(self.0)
    }

    /// Coefficients of all bands.
    pub fn coefficients(self) -> usize {
        self.count() * self.count()
    }
}

impl Default for Bands {
    /// Five, the paper's: 25 coefficients.
    fn default() -> Self {
        Self(5)
    }
}

impl TryFrom<u8> for Bands {
    type Error = BandsError;

    fn try_from(bands: u8) -> Result<Self, BandsError> {
        Self::new(bands)
    }
}

impl From<Bands> for u8 {
    fn from(bands: Bands) -> Self {
        bands.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_to_ten_bands() {
        assert_eq!(Bands::default().coefficients(), 25);
        assert_eq!(Bands::new(10), Ok(Bands::MAX));
        for bad in [0, 11, 255] {
            assert_eq!(Bands::new(bad), Err(BandsError { got: bad }));
        }
        assert_eq!(
            BandsError { got: 11 }.to_string(),
            "1 to 10 bands of spherical harmonics are possible, got 11"
        );
    }
}
