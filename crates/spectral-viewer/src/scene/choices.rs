//! What a user can switch.

use asm_core::{Method, Settings};

/// Wavelengths to choose from; none is the method's own number.
pub(crate) const WAVELENGTHS: [Option<u32>; 5] = [None, Some(1), Some(3), Some(7), Some(21)];
/// Sides of the light's view and of the map, texels.
pub(crate) const SIDES: [u32; 5] = [128, 256, 512, 1024, 2048];
/// Samples along a side of a pixel.
pub(crate) const SAMPLES: [u32; 3] = [1, 2, 4];
/// Screen pixels along a pixel of the picture.
pub(crate) const COARSENESSES: [u32; 3] = [1, 2, 4];

/// The methods of plans by their names on the command line.
pub(crate) fn methods() -> impl Iterator<Item = (&'static str, Method)> {
    spectral_cli::Method::ALL.into_iter().filter_map(|m| Some((m.name(), m.planned()?)))
}

/// Switches to another method. Footprints take sizes of their own: a cell is worth many photons.
pub(crate) fn take_method(settings: &mut Settings, method: Method) {
    if (settings.method == Method::Footprint) != (method == Method::Footprint) {
        settings.emission_size = Settings::of(method).emission_size;
        settings.wavelengths = None;
    }
    settings.method = method;
    if method == Method::Footprint {
        settings.refraction = None; // it knows one way
    }
}

/// All that makes another plan.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Choices {
    /// The plan's settings.
    pub(crate) settings: Settings,
    /// Screen pixels along a pixel of the picture.
    pub(crate) coarseness: u32,
}

impl Choices {
    /// Pixels of the picture for an area of the screen; at least one.
    pub(crate) fn picture_size(&self, area: [u32; 2]) -> [u32; 2] {
        area.map(|side| side.div_ceil(self.coarseness).max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_planned_method_can_be_chosen() {
        let names: Vec<_> = methods().map(|(name, _)| name).collect();
        assert_eq!(names, ["caustics-map", "acm", "asm", "footprint"]);
    }

    #[test]
    fn coarse_pictures_cover_the_area_and_are_never_empty() {
        let choices = Choices { settings: Settings::default(), coarseness: 4 };
        assert_eq!(choices.picture_size([801, 600]), [201, 150]);
        assert_eq!(choices.picture_size([0, 3]), [1, 1]);
    }
}
