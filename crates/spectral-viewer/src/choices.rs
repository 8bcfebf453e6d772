//! What a user can switch.

use asm_core::{Method, Settings};
use frame_plan::DeviceInfo;
use spectral_cli::{Backend, backend};

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

/// What runs plans for the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Runner {
    /// wgpu, on the window's own device and inside its frames.
    Wgpu,
    /// The CPU executor, on a thread beside the window's.
    Cpu,
    /// Vulkan, with a device of its own, on a thread beside the window's.
    Vulkan,
}

impl Runner {
    /// All there are.
    pub(crate) const ALL: [Self; 3] = [Self::Wgpu, Self::Cpu, Self::Vulkan];

    /// What the command line asks for, in a window on this device.
    pub(crate) fn of(asked: Backend, window: &DeviceInfo) -> Self {
        match asked {
            Backend::Wgpu => Self::Wgpu,
            Backend::Cpu => Self::Cpu,
            Backend::Vulkan => Self::Vulkan,
            Backend::Auto if backend::auto(std::slice::from_ref(window)).is_ok() => Self::Wgpu,
            Backend::Auto => Self::Cpu,
        }
    }

    /// Its name on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Wgpu => "wgpu",
            Self::Cpu => "cpu",
            Self::Vulkan => "vulkan",
        }
    }
}

/// All that makes another plan or another executor.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Choices {
    /// The plan's settings.
    pub(crate) settings: Settings,
    /// What runs it.
    pub(crate) runner: Runner,
    /// Screen pixels along a pixel of the picture.
    pub(crate) coarseness: u32,
}

impl Choices {
    /// Pixels of the picture for an area of the screen; at least one.
    pub(crate) fn picture_size(&self, area: [u32; 2]) -> [u32; 2] {
        area.map(|side| side.div_ceil(self.coarseness).max(1))
    }
}

/// The one after `now` in a list, the first one after the last and for what is not in it.
pub(crate) fn after<T: PartialEq>(all: &[T], now: &T) -> usize {
    all.iter().position(|one| one == now).map_or(0, |i| (i + 1) % all.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use frame_plan::DeviceType;

    #[test]
    fn auto_is_the_window_s_gpu_but_no_software_driver() {
        let window = |device_type| DeviceInfo { device_type, ..DeviceInfo::default() };
        assert_eq!(Runner::of(Backend::Auto, &window(DeviceType::Discrete)), Runner::Wgpu);
        assert_eq!(Runner::of(Backend::Auto, &window(DeviceType::Cpu)), Runner::Cpu);
        assert_eq!(Runner::of(Backend::Wgpu, &window(DeviceType::Cpu)), Runner::Wgpu);
        assert_eq!(Runner::of(Backend::Vulkan, &window(DeviceType::Discrete)), Runner::Vulkan);
    }

    #[test]
    fn every_planned_method_can_be_chosen() {
        let names: Vec<_> = methods().map(|(name, _)| name).collect();
        assert_eq!(names, ["caustics-map", "acm", "asm", "footprint"]);
    }

    #[test]
    fn coarse_pictures_cover_the_area_and_are_never_empty() {
        let choices = Choices { settings: Settings::default(), runner: Runner::Cpu, coarseness: 4 };
        assert_eq!(choices.picture_size([801, 600]), [201, 150]);
        assert_eq!(choices.picture_size([0, 3]), [1, 1]);
    }

    #[test]
    fn lists_go_round() {
        assert_eq!(after(&WAVELENGTHS, &None), 1);
        assert_eq!(after(&WAVELENGTHS, &Some(21)), 0);
        assert_eq!(after(&WAVELENGTHS, &Some(5)), 0);
    }
}
