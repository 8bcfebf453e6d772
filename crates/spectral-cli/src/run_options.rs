//! What the options of `bake` and `render` mean together: which method takes which.

use asm_core::{Emission, Refraction, Settings};

use crate::args::{DeviceArgs, PlanOptions, RunArgs};
use crate::choices::{Backend, Fit, Gaps, Glass, Method, Reflected, Rule, Way};
use crate::error::CliError;
use crate::messages;
use crate::values::MAX_TRACED_WAVELENGTHS;

impl Method {
    /// The method of plans that it is.
    ///
    /// # Errors
    /// A usage error for the reference.
    pub(crate) fn of_plan(self) -> Result<asm_core::Method, CliError> {
        self.planned().ok_or_else(|| {
            let problem =
                "--method reference has no plan, it traces the scene itself; there is: caustics-map, acm, asm, footprint";
            CliError::Usage(problem.into())
        })
    }
}

impl DeviceArgs {
    /// Hold the options against each other.
    ///
    /// # Errors
    /// A usage error that names the option and what would be right.
    pub(crate) fn check(&self) -> Result<(), CliError> {
        match &self.adapter {
            Some(adapter) if self.backend == Backend::Cpu => usage(format!(
                "--adapter {adapter:?} names a GPU, and --backend is cpu: leave one of them out"
            )),
            _ => Ok(()),
        }
    }

    /// The option that is for what runs plans.
    pub(crate) fn given(&self) -> Option<&'static str> {
        self.gpu().or_else(|| self.threads.map(|_| "--threads"))
    }

    /// The option that asks for a GPU.
    pub(crate) fn gpu(&self) -> Option<&'static str> {
        match self.backend {
            Backend::Wgpu => Some("--backend wgpu"),
            Backend::Vulkan => Some("--backend vulkan"),
            Backend::Auto | Backend::Cpu => self.adapter.as_ref().map(|_| "--adapter"),
        }
    }
}

impl RunArgs {
    /// How light finds its way through glass.
    pub(crate) fn refraction(&self) -> Refraction {
        match self.method.planned() {
            Some(method) => self.plan.settings(method, self.wavelengths, self.bounces).refraction(),
            None => self.plan.refraction.map_or(Refraction::Traced, |Way(refraction)| refraction),
        }
    }

    /// Hold the options against the method and each other.
    ///
    /// # Errors
    /// A usage error that names the option and what would be right; a failure for what this program cannot do yet.
    pub(crate) fn check(&self) -> Result<(), CliError> {
        let method = self.method.name();
        if self.refraction() == Refraction::ImageSpace
            && matches!(self.method, Method::Reference | Method::Footprint)
        {
            return Err(CliError::Failed(format!(
                "--refraction image-space is not for --method {method}, which follows light through the geometry itself: \
                 take traced, or --method caustics-map, acm or asm"
            )));
        }
        self.device.check()?;
        match self.method {
            Method::Reference => self.check_reference(),
            Method::CausticsMap | Method::Acm | Method::Asm | Method::Footprint => self.check_planned(),
        }
    }

    fn check_reference(&self) -> Result<(), CliError> {
        if let Some(option) = self.plan.given() {
            return usage(format!(
                "{option} goes with --method caustics-map, acm, asm and footprint, and the method is reference"
            ));
        }
        let Some(gpu) = self.device.gpu() else { return Ok(()) };
        usage(format!("--method reference runs on the CPU only: leave out {gpu}"))
    }

    fn check_planned(&self) -> Result<(), CliError> {
        let method = self.method.name();
        if let Some(n) = self.wavelengths.filter(|&n| n > MAX_TRACED_WAVELENGTHS) {
            return usage(format!(
                "--wavelengths {n} is too many for --method {method}, which takes 1 to {MAX_TRACED_WAVELENGTHS}"
            ));
        }
        for (option, given) in [("--photons", self.photons.is_some()), ("--noise", self.noise.is_some())] {
            if given {
                messages::warn(&format!(
                    "{option} is not used: it is for --method reference, and the method is {method}"
                ));
            }
        }
        if self.refraction() == Refraction::ImageSpace
            && let Some(bounces) = self.bounces.filter(|&bounces| bounces > 0)
        {
            messages::warn(&format!(
                "--bounces {bounces} is not used: --method {method} in image space follows no internal reflections"
            ));
        }
        Ok(())
    }
}

impl PlanOptions {
    /// The first option that was given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        [
            ("--levels", self.levels.is_some()),
            ("--scheme", self.scheme.is_some()),
            ("--rule", self.rule.is_some()),
            ("--glass", self.glass.is_some()),
            ("--reflections", self.reflections.is_some()),
            ("--map-fit", self.map_fit.is_some()),
            ("--gap-filling", self.gap_filling.is_some()),
            ("--gap-radius", self.gap_radius.is_some()),
            ("--gap-samples", self.gap_samples.is_some()),
            ("--gap-threshold", self.gap_threshold.is_some()),
        ]
        .into_iter()
        .find(|(_, given)| *given)
        .map(|(option, _)| option)
    }

    /// Settings of a method with these options.
    pub(crate) fn settings(
        &self,
        method: asm_core::Method,
        wavelengths: Option<usize>,
        bounces: Option<u32>,
    ) -> Settings {
        let defaults = Settings::of(method);
        Settings {
            wavelengths: wavelengths.map(|n| n as u32),
            bounces: bounces.unwrap_or(defaults.bounces),
            scheme: self.scheme,
            emission: self.levels.map(|levels| match levels {
                0 => Emission::Grid,
                levels => Emission::Adaptive { levels },
            }),
            refraction: self.refraction.map(|Way(refraction)| refraction),
            refraction_rule: self.rule.map_or(defaults.refraction_rule, |Rule(rule)| rule),
            glass_view: self.glass.map(|Glass(view)| view),
            reflections: self.reflections.map_or(defaults.reflections, |Reflected(which)| which),
            map_fit: self.map_fit.map(|Fit(fit)| fit),
            gap_filling: self.gap_filling.map(|Gaps(rule)| rule),
            gap_radius: self.gap_radius.unwrap_or(defaults.gap_radius),
            gap_samples: self.gap_samples.unwrap_or(defaults.gap_samples),
            gap_threshold: self.gap_threshold.unwrap_or(defaults.gap_threshold),
            ..defaults
        }
    }
}

fn usage(problem: String) -> Result<(), CliError> {
    Err(CliError::Usage(problem))
}
