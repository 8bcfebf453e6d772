//! What the race found, as JSON and as tables.

use std::path::Path;

use anyhow::Result;
use serde::Serialize;
use xtask::whole_file;

use super::budgets::{About, PeerResult, Reached};
use super::ours::OurResult;
use super::{SIZE, TARGETS, WAVELENGTHS};
use crate::bench::Args;
use crate::bench::report::{digits, line};

/// The light that everybody should find.
pub(super) struct Truth {
    /// Y per texel.
    pub(super) y: Vec<f64>,
    /// RMS of what is left of its own error, by the mean of Y.
    standard_error: f64,
}

impl Truth {
    /// Mean of two independent halves.
    pub(super) fn of([a, b]: &[Vec<[f64; 3]>; 2]) -> Self {
        let y: Vec<f64> = a.iter().zip(b).map(|(a, b)| 0.5 * (a[1] + b[1])).collect();
        let mut truth = Self { y, standard_error: 0.0 };
        truth.standard_error = truth.error(a.iter().map(|xyz| xyz[1]));
        truth
    }

    /// RMS of the difference by the mean, less what is the truth's own.
    pub(super) fn error(&self, y: impl Iterator<Item = f64>) -> f64 {
        let count = self.y.len() as f64;
        let mean = self.y.iter().sum::<f64>() / count;
        let square = y.zip(&self.y).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / count / (mean * mean);
        (square - self.standard_error.powi(2)).max(0.0).sqrt()
    }
}

/// Everything.
#[derive(Serialize)]
pub(super) struct Race {
    command: String,
    device: String,
    threads: usize,
    wavelengths: usize,
    /// Of the truth's Y, by the mean.
    standard_error: f64,
    pub(super) peers: Vec<PeerResult>,
    pub(super) ours: Vec<OurResult>,
}

impl Race {
    /// Before anybody has run.
    pub(super) fn new(truth: &Truth, threads: usize, args: &Args) -> Self {
        Self {
            command: format!(
                "cargo xtask bench --peers --rounds {} --peer-seconds {}",
                args.rounds, args.peer_seconds
            ),
            device: processor(),
            threads,
            wavelengths: WAVELENGTHS,
            standard_error: truth.standard_error,
            peers: Vec::new(),
            ours: Vec::new(),
        }
    }

    /// Writes both files into `folder`; the Markdown is returned.
    pub(super) fn write(&self, folder: &Path) -> Result<String> {
        let markdown = self.markdown();
        whole_file::write(&folder.join("peers.json"), serde_json::to_string_pretty(self)?.as_bytes())?;
        whole_file::write(&folder.join("peers.md"), markdown.as_bytes())?;
        Ok(markdown)
    }

    /// Our fastest setting that is good enough.
    fn fastest(&self, method: &str, target: f64) -> Option<&OurResult> {
        let enough = self.ours.iter().filter(|ours| ours.method == method && ours.error <= target);
        enough.min_by(|a, b| a.ms.total_cmp(&b.ms))
    }

    /// Setting and time, or how far off the best is.
    fn words(&self, ours: Option<&OurResult>) -> String {
        let Some(ours) = ours else {
            let footprints = self.ours.iter().filter(|ours| ours.method == "footprint");
            let best = footprints.map(|ours| ours.error).fold(f64::MAX, f64::min);
            return format!("none: the best has {:.2} % | -", 100.0 * best);
        };
        let OurResult { scene, wavelengths, emission_size: side, ms, .. } = ours;
        format!("`{scene}` N = {wavelengths}, {side} x {side} | {} ms", digits(*ms))
    }

    fn markdown(&self) -> String {
        let mut text = format!(
            "`{}`: {}, {} threads, {SIZE} x {SIZE} texels; the standard error of the exact light is {:.2} %.\n\n\
             | RMS of Y by its mean | {} | by processor time |\n|---|{}\n",
            self.command,
            self.device,
            self.threads,
            100.0 * self.standard_error,
            ["setting".to_owned(), "time".to_owned()]
                .into_iter()
                .chain(
                    self.peers.iter().map(|p| format!("{} {} by footprint", p.about.name, p.about.version))
                )
                .collect::<Vec<_>>()
                .join(" | "),
            "---|".repeat(3 + self.peers.len())
        );
        for (i, target) in TARGETS.into_iter().enumerate() {
            let ours = self.fastest("footprint", target);
            let reached: Vec<&Reached> = self.peers.iter().map(|p| &p.reached[i]).collect();
            let walls = reached.iter().map(|r| {
                let sign = if r.extrapolated { "~" } else { "" };
                format!("{sign}{} s", digits(r.seconds))
                    + &ours.map_or_else(String::new, |ours| format!(": {:.0} x", 1e3 * r.seconds / ours.ms))
            });
            let cpu = reached.iter().map(|r| {
                let ms = ours.and_then(|ours| ours.cpu_ms);
                ms.map_or_else(|| "-".into(), |ms| format!("{:.0} x", 1e3 * r.cpu_seconds / ms))
            });
            line(
                &mut text,
                format_args!(
                    "| {} % | {} | {} | {} |",
                    100.0 * target,
                    self.words(ours),
                    walls.collect::<Vec<_>>().join(" | "),
                    cpu.collect::<Vec<_>>().join(", ")
                ),
            );
        }
        self.add_details(&mut text);
        text
    }

    fn add_details(&self, text: &mut String) {
        text.push_str("\n| peer | M photons | s | s of processors | error |\n|---|---|---|---|---|\n");
        for peer in &self.peers {
            for budget in &peer.budgets {
                line(
                    text,
                    format_args!(
                        "| {} {} | {:.1} | {} | {} | {:.2} % |",
                        peer.about.name,
                        peer.about.version,
                        1e-6 * budget.photons as f64,
                        digits(budget.seconds),
                        digits(budget.cpu_seconds),
                        100.0 * budget.error
                    ),
                );
            }
        }
        text.push_str("\n| ours | setting | ms | ms of processors | error |\n|---|---|---|---|---|\n");
        for ours in &self.ours {
            line(
                text,
                format_args!(
                    "| {} {} | `{}`, {} x {} | {} | {} | {:.2} % |",
                    ours.method,
                    ours.wavelengths,
                    ours.scene,
                    ours.emission_size,
                    ours.emission_size,
                    digits(ours.ms),
                    ours.cpu_ms.map_or_else(|| "-".into(), digits),
                    100.0 * ours.error
                ),
            );
        }
        for peer in &self.peers {
            let About { name, version, how } = &peer.about;
            line(text, format_args!("\n{name} {version}: {how}; error ~ photons^{:.2}.", peer.slope));
        }
    }
}

/// As the system calls it.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_truths_own_noise_is_taken_off() {
        let xyz = |y: f64| [0.0, y, 0.0];
        let truth = Truth::of(&[vec![xyz(1.1), xyz(0.9)], vec![xyz(0.9), xyz(1.1)]]);
        assert_eq!(truth.y, [1.0, 1.0]);
        assert!((truth.standard_error - 0.1).abs() < 1e-12);
        // 3-4-5.
        let error = truth.error([1.125, 0.875].into_iter());
        assert!((error - 0.075).abs() < 1e-12, "{error}");
    }
}
