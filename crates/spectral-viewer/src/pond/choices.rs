//! What a user can switch.

use caustic_heightfield::adjusted::Fixed;
use spectral_cli::{FloorChoice, PondMethod, Precision};

/// Samples of surface and floor on a side.
pub(super) const SIDES: [usize; 4] = [64, 128, 256, 512];

/// Bits of frame buffers to choose from.
const BITS: [u32; 2] = [12, 8];

/// All that a floor is made anew for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Choices {
    /// Method and numbers.
    pub(crate) floor: FloorChoice,
    /// Samples on a side.
    pub(crate) samples: usize,
    /// Whether wavelengths are refracted apart, by methods that have all of them at once.
    pub(crate) dispersion: bool,
}

impl Choices {
    /// Switch to another method, in the same numbers if it has them.
    pub(super) fn take_method(&mut self, method: PondMethod) {
        let precision = method.precision(Some(self.floor.precision)).or_else(|_| method.precision(None));
        let precision = precision.unwrap_or(Precision::F32);
        self.floor = FloorChoice::new(method, precision);
    }

    /// Whether the method has all wavelengths at once.
    pub(super) fn is_spectral(&self) -> bool {
        self.floor.method == PondMethod::Photon
    }
}

/// The numbers that a method can be computed in, of those there are.
pub(super) fn precisions(method: PondMethod) -> Vec<Precision> {
    let fixed = BITS.into_iter().filter_map(Fixed::new).map(Precision::Fixed);
    let all = [Precision::F32, Precision::F64, Precision::F16].into_iter().chain(fixed);
    all.filter(|&precision| method.precision(Some(precision)).is_ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_numbers_and_only_the_papers_has_frame_buffers() {
        let names = |method| precisions(method).iter().map(ToString::to_string).collect::<Vec<_>>();
        assert_eq!(names(PondMethod::Convolution), ["f32", "f64", "f16", "fixed12", "fixed8"]);
        assert_eq!(names(PondMethod::LowRank), ["f32", "f64"]);
        assert_eq!(names(PondMethod::Exact), ["f64"]);
        assert_eq!(names(PondMethod::Photon), ["f32"]);
    }

    #[test]
    fn numbers_stay_where_the_next_method_has_them() {
        let floor = FloorChoice::new(PondMethod::Convolution, Precision::F64);
        let mut choices = Choices { floor, samples: 128, dispersion: true };
        for (method, precision) in [
            (PondMethod::LowRank, Precision::F64),
            (PondMethod::Exact, Precision::F64),
            (PondMethod::Photon, Precision::F32),
            (PondMethod::Convolution, Precision::F32),
        ] {
            choices.take_method(method);
            assert_eq!((choices.floor.method, choices.floor.precision), (method, precision));
        }
    }
}
