//! What runs plans for a window, and where.

use frame_plan::DeviceInfo;
use spectral_cli::{Backend, backend};

/// What runs plans for the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Runner {
    /// wgpu, on the window's own device.
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

/// Who makes pictures, and whether inside the window's frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// Who.
    pub(crate) runner: Runner,
    /// Recorded into the window's frames; else on a thread beside them.
    pub(crate) inside: bool,
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
}
