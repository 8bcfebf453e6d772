//! The paper's six passes in frame buffers: `--precision fixed8`, `fixed12`, `f16`.

use caustic_heightfield::adjusted::Format;
use caustic_heightfield::{
    Accumulation, Convolution, ConvolutionSettings, FloorLight, HeightField, Pond, PondError,
    SixPassSettings, SixPasses, relative_rms,
};
use serde_json::{Value, json};

use crate::stats::Stopwatch;

/// The floor and what the passes say about themselves; `with_error` also measures what the format costs, against f64.
pub(super) fn compute(
    surface: &HeightField,
    pond: &Pond,
    kernel_samples: Option<usize>,
    accumulation: Accumulation,
    format: impl Format,
    with_error: bool,
    times: &mut Stopwatch,
) -> Result<(FloorLight, Value), PondError> {
    let settings = SixPassSettings { kernel_samples, accumulation };
    let method = SixPasses::new(std::slice::from_ref(surface), pond, settings, format)?;
    times.did("prepare");
    let floor = method.floor(surface)?;
    times.did("floor");
    let mut details = json!({
        "kernel_samples": kernel_samples,
        "clamped": floor.clamped,
        "passes": method.report(),
    });
    if with_error {
        let settings = ConvolutionSettings { kernel_samples, ..ConvolutionSettings::default() };
        let in_f64 =
            Convolution::<f64>::new(surface.size, surface.extent_m, pond, settings)?.floor(surface)?;
        details["error_against_f64"] = json!(relative_rms(&floor.light.irradiance, &in_f64.irradiance));
        times.did("error");
    }
    Ok((floor.light, details))
}
