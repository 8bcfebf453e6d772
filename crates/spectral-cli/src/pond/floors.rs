//! Floors by any method and in any numbers, and those that no plan computes.

use caustic_heightfield::adjusted::{F16, Format};
use caustic_heightfield::{
    Accumulation, Convolution, ConvolutionSettings, FloorGrid, FloorLight, HeightField, LobeSum,
    LowRankSettings, Pond, PondError, Sample, SixPassSettings, SixPasses, exact, relative_rms,
};
use serde_json::{Value, json};

use crate::choices::{PondMethod, Precision};

/// By what a floor is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloorChoice {
    /// How.
    pub method: PondMethod,
    /// In which numbers; `exact` is in f64, `photon` in f32, `low-rank` in either.
    pub precision: Precision,
    /// Where frame buffers round their sums.
    pub sums: Accumulation,
    /// Relative RMS error that low-rank stays below; its own default if nothing is said.
    pub error: Option<f64>,
    /// Samples across the kernels of convolution, odd; as far as the pond goes if nothing is said.
    pub kernel: Option<usize>,
}

/// A method that is ready for surfaces of one grid.
pub struct Floors {
    /// What it says about itself.
    pub(crate) details: Value,
    floor: Box<FloorOf>,
}

type FloorOf = dyn Fn(&HeightField) -> Result<Floor, PondError>;

/// The light on one floor.
pub struct Floor {
    /// The light.
    pub light: FloorLight,
    /// Values that were not as those of the surfaces that the method was made for: states of low-rank's table that were taken to be the
    /// nearest, or numbers that a frame buffer clamped.
    pub outside: usize,
    /// XYZ, of a method that has all wavelengths at once.
    pub xyz: Option<Vec<[f64; 3]>>,
}

impl From<FloorLight> for Floor {
    fn from(light: FloorLight) -> Self {
        Self { light, outside: 0, xyz: None }
    }
}

impl Floors {
    /// Without anything to say about itself.
    fn new(details: Value, floor: impl Fn(&HeightField) -> Result<Floor, PondError> + 'static) -> Self {
        Self { details, floor: Box::new(floor) }
    }

    /// The light on the floor below a surface.
    ///
    /// # Errors
    /// Those of the method.
    pub fn below(&self, surface: &HeightField) -> Result<Floor, PondError> {
        (self.floor)(surface)
    }
}

impl FloorChoice {
    /// By this method in these numbers, with nothing else said.
    #[must_use]
    pub fn new(method: PondMethod, precision: Precision) -> Self {
        Self { method, precision, sums: Accumulation::default(), error: None, kernel: None }
    }

    /// Whether it is a plan for executors, unless its lobe is splatted.
    #[must_use]
    pub fn is_plan(&self) -> bool {
        self.method != PondMethod::Exact && self.precision == Precision::F32
    }

    /// The method for surfaces like these, computed without a plan; `measured` asks what a frame buffer's format costs, against f64.
    ///
    /// # Errors
    /// What the method says.
    pub fn without_plan(
        &self,
        examples: &[HeightField],
        pond: &Pond,
        measured: bool,
    ) -> Result<Floors, PondError> {
        match self.precision {
            Precision::F32 | Precision::F64 => self.in_f64(examples, pond),
            Precision::F16 => self.in_frame_buffers(examples, pond, F16::default(), measured),
            Precision::Fixed(format) => self.in_frame_buffers(examples, pond, format, measured),
        }
    }

    fn in_f64(&self, examples: &[HeightField], pond: &Pond) -> Result<Floors, PondError> {
        Ok(match self.method {
            PondMethod::Exact => {
                let pond = pond.clone();
                Floors::new(Value::Null, move |surface| {
                    Ok(exact(surface, &pond, FloorGrid::below(surface))?.into())
                })
            }
            PondMethod::Convolution => {
                let method = self.convolution::<f64>(&examples[0], pond)?;
                let details = json!({ "kernel_samples": self.kernel, "fft": method.is_fft() });
                Floors::new(details, move |surface| Ok(method.floor(surface)?.into()))
            }
            PondMethod::LowRank => self.lobe_sum::<f64>(examples, pond)?.into(),
            PondMethod::Photon => return Err(PondError::Photon { what: "f64; take f32" }),
        })
    }

    /// The paper's six passes in frame buffers.
    fn in_frame_buffers(
        &self,
        examples: &[HeightField],
        pond: &Pond,
        format: impl Format + 'static,
        measured: bool,
    ) -> Result<Floors, PondError> {
        let settings = SixPassSettings { kernel_samples: self.kernel, accumulation: self.sums };
        let method = SixPasses::new(examples, pond, settings, format)?;
        let mut details = json!({ "kernel_samples": self.kernel, "passes": method.report() });
        if measured {
            let in_f64 = self.convolution::<f64>(&examples[0], pond)?.floor(&examples[0])?;
            let (irradiance, _) = method.irradiance(&examples[0])?;
            details["error_against_f64"] = json!(relative_rms(&irradiance, &in_f64.irradiance));
        }
        Ok(Floors::new(details, move |surface| {
            let floor = method.floor(surface)?;
            Ok(Floor { outside: floor.clamped, ..floor.light.into() })
        }))
    }

    /// The paper's method for surfaces of this one's grid.
    ///
    /// # Errors
    /// Those of the method.
    pub fn convolution<T: Sample>(
        &self,
        surface: &HeightField,
        pond: &Pond,
    ) -> Result<Convolution<T>, PondError> {
        let settings = ConvolutionSettings { kernel_samples: self.kernel, ..ConvolutionSettings::default() };
        Convolution::new(surface.size, surface.extent_m, pond, settings)
    }

    /// The exact lobe for surfaces like these, by terms or splatted.
    ///
    /// # Errors
    /// Those of the method.
    pub fn lobe_sum<T: Sample>(
        &self,
        examples: &[HeightField],
        pond: &Pond,
    ) -> Result<LobeSum<T>, PondError> {
        let default = LowRankSettings::default();
        let settings =
            LowRankSettings { target_error: self.error.unwrap_or(default.target_error), ..default };
        LobeSum::new(examples, pond, settings)
    }
}

impl<T: Sample + 'static> From<LobeSum<T>> for Floors {
    fn from(method: LobeSum<T>) -> Self {
        Self::new(json!(method.report()), move |surface| {
            let (light, outside) = method.floor(surface)?;
            Ok(Floor { outside, ..light.into() })
        })
    }
}
