//! SciPy's side: a script that waits for requests.

use std::io::{BufRead, BufReader, Lines, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result};
use caustic_heightfield::{HeightField, Pond};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// The script.
const SCRIPT: (&str, &str) = ("scipy_pond.py", include_str!("scipy_pond.py"));
/// What its lines begin with; libraries print, too.
const MARK: &str = "PEER ";

/// What the script is told; lengths in metres.
#[derive(Serialize)]
pub(super) struct Job {
    side: usize,
    extent_m: f64,
    depth_m: f64,
    eta: f64,
    extinction_per_m: f64,
    scattering: f64,
    light: [f64; 3],
    /// Samples from a kernel's middle to its edge.
    radius: usize,
    threads: usize,
    /// File of f32.
    heights: PathBuf,
}

impl Job {
    /// Heights go into `folder`.
    pub(super) fn new(
        surface: &HeightField,
        pond: &Pond,
        radius: usize,
        threads: usize,
        folder: &Path,
    ) -> Result<Self> {
        let heights = folder.join("heights.f32");
        let bytes: Vec<u8> = surface.heights_m.iter().flat_map(|h| (*h as f32).to_le_bytes()).collect();
        std::fs::write(&heights, bytes)?;
        Ok(Self {
            side: surface.size[0],
            extent_m: surface.extent_m[0],
            depth_m: pond.depth_m,
            eta: pond.eta(),
            extinction_per_m: pond.extinction_per_m,
            scattering: pond.scattering,
            light: pond.unit_light_direction(),
            radius,
            threads,
            heights,
        })
    }
}

/// What one floor took.
#[derive(Clone, Copy, Deserialize)]
pub(super) struct Times {
    /// Passes 1 to 5.
    pub(super) surface_ms: f64,
    /// Pass 6.
    pub(super) sums_ms: f64,
}

#[derive(Clone, Deserialize)]
struct Versions {
    scipy: String,
    numpy: String,
}

/// The running script.
pub(super) struct Scipy {
    process: Child,
    requests: ChildStdin,
    answers: Lines<BufReader<ChildStdout>>,
    out: PathBuf,
    versions: Versions,
}

impl Scipy {
    pub(super) fn start(python: &Path, job: &Job, folder: &Path) -> Result<Self> {
        let (script, told) = (folder.join(SCRIPT.0), folder.join("job.json"));
        std::fs::write(&script, SCRIPT.1)?;
        std::fs::write(&told, serde_json::to_string_pretty(job)?)?;
        let mut process = Command::new(python)
            .arg("-u")
            .args([&script, &told])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .context("Python cannot be started")?;
        let requests = process.stdin.take().context("a pipe")?;
        let mut answers = BufReader::new(process.stdout.take().context("a pipe")?).lines();
        let versions = answer(&mut answers)?;
        Ok(Self { process, requests, answers, out: folder.join("floor.f32"), versions })
    }

    /// Of SciPy and NumPy.
    pub(super) fn versions(&self) -> (String, String) {
        (self.versions.scipy.clone(), self.versions.numpy.clone())
    }

    /// Compute once more.
    pub(super) fn time(&mut self) -> Result<Times> {
        writeln!(self.requests, r#"{{"out": null}}"#)?;
        answer(&mut self.answers)
    }

    /// The floor.
    pub(super) fn floor(&mut self) -> Result<Vec<f64>> {
        writeln!(self.requests, "{}", serde_json::json!({ "out": self.out }))?;
        let _: Times = answer(&mut self.answers)?;
        let bytes = std::fs::read(&self.out)?;
        Ok(bytes.as_chunks::<4>().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect())
    }
}

impl Drop for Scipy {
    fn drop(&mut self) {
        // It would end by itself when its requests do; nobody waits for that.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn answer<T: DeserializeOwned>(answers: &mut Lines<BufReader<ChildStdout>>) -> Result<T> {
    for line in answers {
        if let Some(answer) = line?.strip_prefix(MARK) {
            return Ok(serde_json::from_str(answer)?);
        }
    }
    anyhow::bail!("SciPy's script ended without an answer")
}
