//! Milliseconds of warm frames.

use std::time::{Duration, Instant};

use frame_plan::{ExecuteError, Executor, Plan, ResourceId};

/// A batch is at least so long, so that waiting for its end and reading a few bytes does not count.
const BATCH: Duration = Duration::from_millis(300);

/// Most frames of a batch.
const MOST_FRAMES: u32 = 256;

/// A prepared plan whose frames are timed in batches.
pub struct WarmFrames {
    wait: ResourceId,
    frames: u32,
}

impl WarmFrames {
    /// Run so many frames: the first ones of a device load shaders and touch memory. `plan` is prepared.
    ///
    /// # Errors
    /// Those of the executor; a plan of which nothing can be read has no end to wait for.
    pub fn warm_up(plan: &Plan, executor: &mut dyn Executor, frames: u32) -> Result<(), ExecuteError> {
        batch(executor, smallest_readable(plan)?, frames).map(drop)
    }

    /// Find out with one frame how many make a batch. `plan` is prepared and warm.
    ///
    /// # Errors
    /// As [`Self::warm_up`].
    pub fn of(plan: &Plan, executor: &mut dyn Executor) -> Result<Self, ExecuteError> {
        let wait = smallest_readable(plan)?;
        let once = batch(executor, wait, 1)?;
        let frames =
            (BATCH.as_secs_f64() / once.as_secs_f64().max(1e-6)).ceil().clamp(1.0, f64::from(MOST_FRAMES));
        Ok(Self { wait, frames: frames as u32 })
    }

    /// A batch of so many frames. `plan` is prepared and warm.
    ///
    /// # Errors
    /// [`ExecuteError::Usage`] if nothing of the plan can be read, so that it has no end to wait for.
    pub fn with_batch(plan: &Plan, frames: u32) -> Result<Self, ExecuteError> {
        Ok(Self { wait: smallest_readable(plan)?, frames })
    }

    /// Frames of a batch.
    #[must_use]
    pub fn batch(&self) -> u32 {
        self.frames
    }

    /// Milliseconds per frame of one batch, to the end of its last.
    ///
    /// # Errors
    /// Those of the executor.
    pub fn round_ms(&self, executor: &mut dyn Executor) -> Result<f64, ExecuteError> {
        Ok(1e3 * batch(executor, self.wait, self.frames)?.as_secs_f64() / f64::from(self.frames))
    }
}

/// Time of so many frames, to the end of the last.
fn batch(executor: &mut dyn Executor, wait: ResourceId, frames: u32) -> Result<Duration, ExecuteError> {
    let start = Instant::now();
    for _ in 0..frames {
        executor.execute()?;
    }
    executor.read(wait)?;
    Ok(start.elapsed())
}

/// What is quickest to wait for.
fn smallest_readable(plan: &Plan) -> Result<ResourceId, ExecuteError> {
    let resources = plan.resources.iter().enumerate().filter(|(_, r)| r.readable);
    let smallest = resources.min_by_key(|(_, r)| r.kind.bytes());
    let (i, _) =
        smallest.ok_or_else(|| ExecuteError::Usage("nothing of the plan can be read back".into()))?;
    Ok(ResourceId(i as u32))
}

/// The middle value, or the mean of the two in the middle; 0 of none.
#[must_use]
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[middle],
        _ => 0.5 * (values[middle - 1] + values[middle]),
    }
}

/// The smallest and the largest.
#[must_use]
pub fn range(values: &[f64]) -> [f64; 2] {
    [values.iter().copied().fold(f64::MAX, f64::min), values.iter().copied().fold(0.0, f64::max)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_stand_in_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(median(Vec::new()), 0.0);
    }
}
