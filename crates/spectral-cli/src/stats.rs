//! What `--stats` writes.

use std::time::Instant;

use asm_core::{Price, Refraction};
use frame_plan::DeviceInfo;
use serde::Serialize;
use serde_json::{Map, Value};

use crate::choices::{Backend, Method};
use crate::error::CliError;
use crate::values::Size;

/// The statistics of one `bake` or `render`.
#[derive(Serialize)]
pub(crate) struct Stats<'a> {
    pub(crate) command: &'static str,
    pub(crate) version: &'static str,
    /// Name of the scene: bundled, or the file's stem.
    pub(crate) scene: &'a str,
    /// Receiver of a bake or camera of a picture.
    pub(crate) target: &'a str,
    pub(crate) size: Size,
    pub(crate) output: String,
    pub(crate) method: Method,
    pub(crate) refraction: Refraction,
    pub(crate) backend_asked: Backend,
    /// What the scene's file says that was not done.
    pub(crate) warnings: &'a [String],
    /// How a picture was brought onto the screen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) display: Option<Value>,
    #[serde(flatten)]
    pub(crate) work: Work,
    /// Wall time by task.
    pub(crate) times_ms: Map<String, Value>,
}

/// What a method says about its run.
#[derive(Serialize)]
pub(crate) struct Work {
    /// `cpu`, `wgpu` or `vulkan`.
    pub(crate) backend: String,
    /// Why this one.
    pub(crate) backend_reason: String,
    pub(crate) device: String,
    pub(crate) driver: String,
    /// The method's settings, defaults included.
    pub(crate) settings: Value,
    /// Photons, and what became of their flux.
    pub(crate) statistics: Value,
    /// Of the reference: estimated from independent randomisations.
    pub(crate) standard_error: Value,
    /// Of the rung that the price list chose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) price: Option<Price>,
}

impl Work {
    pub(crate) fn new(
        info: DeviceInfo,
        reason: String,
        settings: &impl Serialize,
        statistics: &impl Serialize,
        standard_error: &impl Serialize,
    ) -> Result<Self, CliError> {
        Ok(Self {
            backend: info.executor,
            backend_reason: reason,
            device: info.device,
            driver: info.driver,
            settings: json(settings)?,
            statistics: json(statistics)?,
            standard_error: json(standard_error)?,
            price: None,
        })
    }
}

/// A value as JSON.
pub(crate) fn json(value: &impl Serialize) -> Result<Value, CliError> {
    serde_json::to_value(value).map_err(CliError::failed)
}

/// Wall time of tasks that follow each other.
pub(crate) struct Stopwatch {
    start: Instant,
    lap: Instant,
    times_ms: Map<String, Value>,
}

impl Stopwatch {
    pub(crate) fn start() -> Self {
        let now = Instant::now();
        Self { start: now, lap: now, times_ms: Map::new() }
    }

    /// `task` is done; the next begins.
    pub(crate) fn did(&mut self, task: &str) {
        self.times_ms.insert(task.into(), milliseconds(self.lap).into());
        self.lap = Instant::now();
    }

    /// Since the start.
    pub(crate) fn total_ms(&self) -> f64 {
        milliseconds(self.start)
    }

    /// All tasks, and their `total`.
    pub(crate) fn finish(mut self) -> Map<String, Value> {
        self.times_ms.insert("total".into(), milliseconds(self.start).into());
        self.times_ms
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
