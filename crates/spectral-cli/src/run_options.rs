//! What the options of `bake` and `render` mean together: which method takes which.

use crate::args::RunArgs;
use crate::choices::{Backend, Method, Refraction};
use crate::error::CliError;

impl Method {
    /// The one way through glass that the method has.
    pub(crate) fn refraction(self) -> Refraction {
        match self {
            Self::Reference => Refraction::Traced,
            Self::CausticsMap => Refraction::ImageSpace,
        }
    }
}

impl RunArgs {
    /// Hold the options against the method and each other.
    ///
    /// # Errors
    /// A usage error that names the option and what would be right.
    pub(crate) fn check(&self) -> Result<(), CliError> {
        let method = self.method.name();
        let refraction = self.method.refraction();
        if let Some(asked) = self.refraction.filter(|asked| *asked != refraction) {
            return usage(format!(
                "--refraction {} does not go with --method {method}, which has: {}",
                asked.name(),
                refraction.name()
            ));
        }
        if self.backend == Backend::Cpu
            && let Some(adapter) = &self.adapter
        {
            return usage(format!(
                "--adapter {adapter:?} names a GPU, and --backend is cpu: leave one of them out"
            ));
        }
        match self.method {
            Method::Reference => self.check_reference(),
            Method::CausticsMap => self.check_caustics_map(),
        }
    }

    fn check_reference(&self) -> Result<(), CliError> {
        let gpu = match self.backend {
            Backend::Wgpu => "--backend wgpu",
            Backend::Vulkan => "--backend vulkan",
            Backend::Auto | Backend::Cpu if self.adapter.is_some() => "--adapter",
            Backend::Auto | Backend::Cpu => return Ok(()),
        };
        usage(format!("--method reference runs on the CPU only: leave out {gpu}"))
    }

    fn check_caustics_map(&self) -> Result<(), CliError> {
        let stochastic = [("--photons", self.photons.is_some()), ("--noise", self.noise.is_some())];
        if let Some((option, _)) = stochastic.iter().find(|(_, given)| *given) {
            return usage(format!(
                "{option} goes with --method reference only, and the method is caustics-map"
            ));
        }
        match self.bounces {
            None | Some(0) => Ok(()),
            Some(bounces) => usage(format!(
                "--bounces {bounces} does not go with --method caustics-map, which follows no internal reflections: \
                 0, or --method reference"
            )),
        }
    }
}

fn usage(problem: String) -> Result<(), CliError> {
    Err(CliError::Usage(problem))
}
