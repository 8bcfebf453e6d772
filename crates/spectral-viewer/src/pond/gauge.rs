//! The error of what is shown, measured on a thread of its own.

use std::time::Instant;

use asm_core::Picture;
use caustic_heightfield::{FloorGrid, exact, relative_rms};

use super::choices::Choices;
use super::job::FloorJob;
use crate::worker::{Wake, Worker};

/// Points of the floor, on a side, that are held against `exact`: as many as leave it live.
const POINTS: usize = 16;

/// A floor as it is shown.
struct Shown {
    job: FloorJob,
    /// Irradiance at every sample.
    irradiance: Vec<f64>,
}

/// How far a floor is from `exact`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured {
    /// Relative RMS error at points of the floor.
    pub(super) error: f64,
    /// How many on each side.
    pub(super) points: [usize; 2],
    /// Milliseconds that `exact` took for them.
    pub(super) exact_ms: f64,
}

/// Measures one floor after the other.
pub(super) struct Gauge {
    wake: Wake,
    /// None until there is something to measure.
    worker: Option<Worker<Shown, Measured>>,
    /// What was last begun.
    of: Option<FloorJob>,
    newest: Option<(Choices, Result<Measured, String>)>,
}

impl Gauge {
    /// One that tells `wake` of what it has measured.
    pub(super) fn new(wake: Wake) -> Self {
        Self { wake, worker: None, of: None, newest: None }
    }

    /// Whether the floor of this job is still to be measured, and nothing else is just being.
    pub(super) fn wants(&self, job: &FloorJob) -> bool {
        !self.worker.as_ref().is_some_and(Worker::is_busy) && self.of.as_ref() != Some(job)
    }

    /// Measure a floor, unless another one is being measured.
    pub(super) fn take(&mut self, job: &FloorJob, picture: &Picture) {
        if !self.wants(job) {
            return;
        }
        let irradiance = picture.xyz.iter().map(|xyz| f64::from(xyz[1])).collect();
        let worker = self
            .worker
            .get_or_insert_with(|| Worker::start(self.wake.clone(), || Ok(|shown: Shown| measure(&shown))));
        worker.begin(Shown { job: job.clone(), irradiance });
        self.of = Some(job.clone());
    }

    /// Take in what has been measured.
    pub(super) fn collect(&mut self) {
        if let Some(outcome) = self.worker.as_mut().and_then(Worker::finished) {
            self.newest = self.of.as_ref().map(|of| (of.choices, outcome));
        }
    }

    /// What was measured last, if it was of floors that are computed in this way.
    pub(super) fn newest(&self, by: &Choices) -> Option<&Result<Measured, String>> {
        self.newest.as_ref().filter(|(of, _)| of == by).map(|(_, measured)| measured)
    }
}

fn measure(shown: &Shown) -> Result<Measured, String> {
    let begun = Instant::now();
    let surface = shown.job.surface().map_err(|error| error.to_string())?;
    let size = surface.size;
    let stride = size[0].max(size[1]).div_ceil(POINTS);
    let floor = FloorGrid::below(&surface).every(stride);
    let reference = exact(&surface, &shown.job.pond, floor).map_err(|error| error.to_string())?;
    let exact_ms = 1e3 * begun.elapsed().as_secs_f64();
    let points = reference.grid.size;
    let at = &|i: usize, j: usize| shown.irradiance[j * stride * size[0] + i * stride];
    let values: Vec<f64> = (0..points[1]).flat_map(|j| (0..points[0]).map(move |i| at(i, j))).collect();
    Ok(Measured { error: relative_rms(&values, &reference.irradiance), points, exact_ms })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pond::fit::{self, Method};
    use crate::pond::job::picture;
    use crate::pond::view::tests::view;
    use crate::subject::Subject;

    fn floor(arguments: &str) -> (FloorJob, Picture) {
        let mut view = view(arguments);
        view.pebbles.drop_at([0.4, 0.6]);
        view.pebbles.advance(0.6);
        let job = view.job([1, 1]);
        let Ok(Method::Host(floors, _)) = fit::method(&job) else { panic!("no plan") };
        let floor = floors.below(&job.surface().expect("waves")).expect("a floor");
        let picture = picture(&floor, job.basin.white_xyz);
        (job, picture)
    }

    fn error(job: &FloorJob, picture: &Picture) -> f64 {
        let irradiance = picture.xyz.iter().map(|xyz| f64::from(xyz[1])).collect();
        measure(&Shown { job: job.clone(), irradiance }).expect("measured").error
    }

    #[test]
    fn exact_has_no_error_and_terms_have_what_was_asked() {
        let (job, exact) = floor("--method exact --map 48");
        assert!(error(&job, &exact) < 1e-6, "{}", error(&job, &exact));
        let (job, terms) = floor("--method low-rank --precision f64 --map 48");
        assert!((1e-4..0.015).contains(&error(&job, &terms)), "{}", error(&job, &terms));
        // Of another moment, or with a row left out, it is none of this.
        let (mut later, _) = floor("--method exact --map 48");
        later.waves.time_s += 0.1;
        assert!(error(&later, &exact) > 0.02, "{}", error(&later, &exact));
        let mut shifted = exact.clone();
        shifted.xyz.rotate_left(48);
        assert!(error(&job, &shifted) > 0.02, "{}", error(&job, &shifted));
    }
}
