//! A peer at growing numbers of photons.

use std::io::{BufRead, BufReader, Lines, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result, ensure};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::TARGETS;
use super::report::Truth;

/// A budget is so many times the one before.
const GROWTH: u64 = 4;

/// What our lines begin with; libraries print, too.
const MARK: &str = "PEER ";

/// A script that waits for requests.
pub(super) struct Peer {
    process: Child,
    requests: ChildStdin,
    answers: Lines<BufReader<ChildStdout>>,
    out: PathBuf,
    about: About,
}

/// Who it is.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct About {
    pub(super) name: String,
    pub(super) version: String,
    pub(super) how: String,
}

#[derive(Serialize)]
struct Request<'a> {
    photons: u64,
    seed: u64,
    out: &'a Path,
}

/// What one picture of all wavelengths took.
#[derive(Clone, Copy, Debug, Deserialize)]
struct Answer {
    photons: u64,
    seconds: f64,
    cpu_seconds: f64,
}

/// A budget with what it brought.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Budget {
    pub(super) photons: u64,
    pub(super) seconds: f64,
    /// Of all threads: what other programs take from the cores does not count.
    pub(super) cpu_seconds: f64,
    /// RMS of Y by the mean, net of the truth's own error.
    pub(super) error: f64,
}

/// When a peer reaches an error.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Reached {
    pub(super) error: f64,
    pub(super) seconds: f64,
    pub(super) cpu_seconds: f64,
    /// Beyond the largest budget.
    pub(super) extrapolated: bool,
}

/// All of a peer's race.
#[derive(Debug, Serialize)]
pub(super) struct PeerResult {
    #[serde(flatten)]
    pub(super) about: About,
    pub(super) budgets: Vec<Budget>,
    /// Power of the photons with which the error falls: -1/2 where nothing but noise is left.
    pub(super) slope: f64,
    pub(super) reached: Vec<Reached>,
}

impl Peer {
    /// Start the script, which compiles what it has to before it says who it is.
    pub(super) fn start(command: &mut Command, folder: &Path) -> Result<Self> {
        let log = std::fs::File::create(folder.join("peer.log"))?;
        let mut process = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(log).spawn()?;
        let requests = process.stdin.take().context("a pipe to the peer")?;
        let answers = BufReader::new(process.stdout.take().context("a pipe from the peer")?).lines();
        let about = About { name: String::new(), version: String::new(), how: String::new() };
        let mut peer = Self { process, requests, answers, out: folder.join("picture.f64"), about };
        peer.about = peer.answer(folder)?;
        Ok(peer)
    }

    fn answer<T: DeserializeOwned>(&mut self, folder: &Path) -> Result<T> {
        for line in &mut self.answers {
            if let Some(text) = line?.strip_prefix(MARK) {
                return Ok(serde_json::from_str(text)?);
            }
        }
        let said = std::fs::read_to_string(folder.join("peer.log")).unwrap_or_default();
        anyhow::bail!("ended: {}", said.lines().last().unwrap_or("no message").trim())
    }

    /// Budgets until the next one would take longer than `most_seconds`, or the least error is reached.
    pub(super) fn race(
        &mut self,
        truth: &Truth,
        first_photons: u64,
        most_seconds: f64,
    ) -> Result<PeerResult> {
        let About { name, version, .. } = &self.about;
        eprintln!("{name} {version}");
        let mut budgets: Vec<Budget> = Vec::new();
        let mut photons = first_photons;
        loop {
            let budget = self.budget(truth, photons, budgets.len() as u64)?;
            eprintln!(
                "  {:.1} M photons, {:.2} s, {:.2} s of CPU: {:.2} %",
                1e-6 * budget.photons as f64,
                budget.seconds,
                budget.cpu_seconds,
                100.0 * budget.error
            );
            budgets.push(budget);
            photons *= GROWTH;
            let least = TARGETS.into_iter().fold(f64::MAX, f64::min);
            let longer = budget.seconds * GROWTH as f64 > most_seconds;
            if budget.error <= least || (longer && budgets.len() > 1) {
                break;
            }
        }
        let reached = TARGETS.iter().map(|&target| reach(&budgets, target)).collect();
        Ok(PeerResult { about: self.about.clone(), slope: slope(&budgets), reached, budgets })
    }

    fn budget(&mut self, truth: &Truth, photons: u64, seed: u64) -> Result<Budget> {
        let folder = self.out.parent().context("a folder")?.to_path_buf();
        let request = Request { photons, seed, out: &self.out };
        writeln!(self.requests, "{}", serde_json::to_string(&request)?)?;
        self.requests.flush()?;
        let answer: Answer = self.answer(&folder)?;
        let bytes = std::fs::read(&self.out)?;
        let (samples, rest) = bytes.as_chunks::<8>();
        ensure!(rest.is_empty() && samples.len() == 3 * truth.y.len(), "a picture of {} bytes", bytes.len());
        let y: Vec<f64> = samples.iter().map(|&b| f64::from_le_bytes(b)).skip(1).step_by(3).collect();
        // The peers' units are their own.
        let scale = truth.y.iter().sum::<f64>() / y.iter().sum::<f64>();
        ensure!(scale.is_finite(), "a black picture");
        let error = truth.error(y.iter().map(|y| y * scale));
        let Answer { photons, seconds, cpu_seconds } = answer;
        Ok(Budget { photons, seconds, cpu_seconds, error })
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Of the logarithms, from the smallest to the largest budget.
fn slope(budgets: &[Budget]) -> f64 {
    let [Some(first), Some(last)] = [budgets.first(), budgets.last()] else { return f64::NAN };
    (last.error / first.error).ln() / (last.photons as f64 / first.photons as f64).ln()
}

/// Noise falls with the root of the photons, and time is photons: from the smallest budget that is good enough, else from the largest.
fn reach(budgets: &[Budget], target: f64) -> Reached {
    let enough = budgets.iter().find(|budget| budget.error <= target);
    let largest = budgets.last().expect("every race has a budget");
    let budget = enough.unwrap_or(largest);
    let times = (budget.error / target).powi(2);
    Reached {
        error: target,
        seconds: budget.seconds * times,
        cpu_seconds: budget.cpu_seconds * times,
        extrapolated: enough.is_none(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn budget(photons: u64, error: f64) -> Budget {
        Budget { photons, seconds: photons as f64, cpu_seconds: 2.0 * photons as f64, error }
    }

    #[test]
    fn noise_falls_with_the_root() {
        let budgets = [budget(1, 0.08), budget(4, 0.04), budget(16, 0.02)];
        assert!((slope(&budgets) + 0.5).abs() < 1e-12);
        let [five, two, one] = TARGETS.map(|target| reach(&budgets, target));
        assert!((five.seconds - 2.56).abs() < 1e-9 && !five.extrapolated);
        assert!((two.seconds - 16.0).abs() < 1e-9 && !two.extrapolated);
        assert!((one.seconds - 64.0).abs() < 1e-9 && one.extrapolated);
        assert_eq!(one.cpu_seconds, 2.0 * one.seconds);
    }
}
