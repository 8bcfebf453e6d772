//! The error of what is shown, measured on a thread of its own.

use std::sync::Arc;
use std::time::Instant;

use frame_plan::cpu::CpuExecutor;
use spectral_cli::{Differences, RelitView, differences};
use spectral_core::illuminant::Illuminant;
use spectral_prt::PASSES;

use super::choices::Colors;
use super::frames::Frames;
use super::job::RelitJob;
use crate::worker::{Wake, Worker};

/// Longest side, pixels, of the pictures that are compared: as many as leave it live.
const SIDE: u32 = 240;

/// How far colours are from those of sampling every 5 nm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured {
    /// CIE94 over the pixels that show something.
    pub(super) differences: Differences,
    /// Pixels of the pictures compared.
    pub(super) size: [u32; 2],
    /// Milliseconds that both took.
    pub(super) ms: f64,
}

/// Measures one picture after the other.
pub(super) struct Gauge {
    stage: Arc<RelitView>,
    wake: Wake,
    /// None until there is something to measure.
    worker: Option<Worker<RelitJob, Measured>>,
    /// What was last begun.
    of: Option<RelitJob>,
    newest: Option<(Colors, Option<Illuminant>, Result<Measured, String>)>,
}

impl Gauge {
    /// One that tells `wake` of what it has measured.
    pub(super) fn new(stage: Arc<RelitView>, wake: Wake) -> Self {
        Self { stage, wake, worker: None, of: None, newest: None }
    }

    /// Whether this view is still to be measured, and nothing else is just being.
    pub(super) fn wants(&self, job: &RelitJob) -> bool {
        !self.worker.as_ref().is_some_and(Worker::is_busy) && self.of.as_ref() != Some(job)
    }

    /// Measure a view, unless another one is being measured.
    pub(super) fn take(&mut self, job: &RelitJob) {
        if !self.wants(job) {
            return;
        }
        let (stage, wake) = (&self.stage, &self.wake);
        let worker = self.worker.get_or_insert_with(|| {
            let stage = Arc::clone(stage);
            Worker::start(wake.clone(), move || {
                let mut pictures = Pictures::new(&stage)?;
                Ok(move |job: RelitJob| pictures.measure(job))
            })
        });
        worker.begin(job.clone());
        self.of = Some(job.clone());
    }

    /// Take in what has been measured.
    pub(super) fn collect(&mut self) {
        if let (Some(outcome), Some(of)) = (self.worker.as_mut().and_then(Worker::finished), &self.of) {
            self.newest = Some((of.colors, of.lamp, outcome));
        }
    }

    /// What was measured last, if it was in these colours and this light.
    pub(super) fn newest(&self, by: Colors, lamp: Option<Illuminant>) -> Option<&Result<Measured, String>> {
        let newest = self.newest.as_ref().filter(|(colors, of, _)| (*colors, *of) == (by, lamp));
        newest.map(|(_, _, measured)| measured)
    }
}

/// The same view in two ways on the CPU executor, so that no two rasterisers are compared.
struct Pictures {
    shown: Frames<CpuExecutor>,
    sampled: Frames<CpuExecutor>,
}

impl Pictures {
    fn new(stage: &Arc<RelitView>) -> Result<Self, String> {
        let frames = || {
            let executor = CpuExecutor::new(PASSES, None).map_err(|error| error.to_string())?;
            Ok::<_, String>(Frames::new(Arc::clone(stage), executor))
        };
        Ok(Self { shown: frames()?, sampled: frames()? })
    }

    fn measure(&mut self, job: RelitJob) -> Result<Measured, String> {
        let begun = Instant::now();
        let stride = job.size[0].max(job.size[1]).div_ceil(SIDE).max(1);
        let job = RelitJob { size: job.size.map(|side| side.div_ceil(stride)), samples: 1, ..job };
        let shown = self.shown.picture(&job)?.xyz;
        let sampled = self.sampled.picture(&RelitJob { colors: Colors::Sampled, ..job.clone() })?.xyz;
        // Nothing is brighter than white: colours are what it is about.
        let brightest = sampled.iter().map(|xyz| xyz[1]).fold(0.0, f32::max);
        let exposure = if brightest > 0.0 { 1.0 / f64::from(brightest) } else { 1.0 };
        let differences = Differences::of(&sampled, &differences(&sampled, &shown, exposure));
        Ok(Measured { differences, size: job.size, ms: 1e3 * begun.elapsed().as_secs_f64() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relit::view::tests::view;
    use crate::subject::Subject;
    use spectral_cli::Basis;

    #[test]
    fn sampling_has_no_error_five_have_little_and_rgb_has_much() {
        let view = view("color-checker --environment FL4 --bands 3");
        let job = view.job([320, 240]);
        let mut pictures = Pictures::new(&view.stage).expect("executors");
        let mut measured =
            |colors| pictures.measure(RelitJob { colors, ..job.clone() }).expect("measured").differences;
        assert_eq!(measured(Colors::Sampled).max, 0.0);
        let five = measured(Colors::Spectral(Basis::Optimal, 5));
        assert!(five.mean > 1e-3 && five.mean < 0.15 && five.max < 0.6, "{five:?}");
        let rgb = measured(Colors::Rgb);
        assert!(rgb.mean > 5.0 && rgb.max > 15.0, "{rgb:?}");
    }
}
