//! What `compare` found, as data, and written as `report.json` and `report.html`.

mod html;
mod picture;

use std::path::{Path, PathBuf};

use anyhow::Result;
use serde::Serialize;
use serde_json::Value;
use xtask::executor_entry::{ExecutorEntry, Status};
use xtask::sabotage::Sabotage;
use xtask::whole_file;

pub(crate) use picture::{Png, difference, shown};

/// Everything that one run of `compare` found.
#[derive(Serialize)]
pub(crate) struct Report {
    /// Executors of the project, run or not.
    pub(crate) executors: Vec<ExecutorEntry>,
    /// Why none ran on a second driver; null where there is one.
    pub(crate) no_second_driver: Option<String>,
    /// What was spoiled on purpose.
    pub(crate) sabotage: Option<Sabotage>,
    /// Plans that this changed; 0 without sabotage.
    pub(crate) spoiled_plans: usize,
    /// Comparisons that must fail.
    pub(crate) controls: Vec<Control>,
    /// Comparisons that must hold.
    pub(crate) checks: Vec<Check>,
    /// Texels across and down of every bake.
    pub(crate) map_size: [u32; 2],
    /// Pictures, oracle effort and notes.
    pub(crate) scenes: Vec<SceneEntry>,
    /// How long all of it took, seconds.
    pub(crate) seconds: f64,
}

/// A comparison with one input spoiled.
#[derive(Serialize)]
pub(crate) struct Control {
    /// Which check was repeated, and what was spoiled.
    pub(crate) name: String,
    /// It failed, as it must.
    pub(crate) failed: bool,
}

/// A comparison of two results.
#[derive(Serialize)]
pub(crate) struct Check {
    /// Scene name.
    pub(crate) scene: String,
    /// Method name.
    pub(crate) method: String,
    /// `direct`, `refracted`, `reflected`, `camera`, `floor` of a pond, or the lamp of a relit figure.
    pub(crate) layer: &'static str,
    /// Whose result.
    pub(crate) a: &'static str,
    /// Against whose.
    pub(crate) b: &'static str,
    /// Distance of a from b; null where there was nothing to compare.
    pub(crate) metrics: Value,
    /// What was asserted; null where the distance is only shown.
    pub(crate) bound: Value,
    /// Where `b` is the oracle: its own standard error, of `rms_64` in a layer and of `flip_mean` in a picture.
    pub(crate) oracle_standard_error: Option<f64>,
    /// At least half of the squared distance is that error: nothing is known about the method's own.
    pub(crate) within_oracle_noise: Option<bool>,
    /// Nothing is wrong.
    pub(crate) ok: bool,
    /// What is wrong, with the numbers.
    pub(crate) problems: Vec<String>,
}

/// One scene's part of the report.
#[derive(Serialize)]
pub(crate) struct SceneEntry {
    /// Scene name.
    pub(crate) name: String,
    /// Lines a reader should know: effort, standard error, time.
    pub(crate) notes: Vec<String>,
    /// Rows of pictures for the HTML.
    #[serde(skip)]
    pub(crate) rows: Vec<PictureRow>,
}

/// Pictures side by side.
pub(crate) struct PictureRow {
    /// What they show.
    pub(crate) title: String,
    /// Caption and picture.
    pub(crate) pictures: Vec<(String, Png)>,
}

impl Report {
    /// What a person should be told went wrong, one line each; empty if all is well.
    pub(crate) fn failures(&self, skips_fail: bool) -> Vec<String> {
        let executors = self.executors.iter().filter_map(|e| {
            let fails = e.status == Status::Failed || (skips_fail && e.status == Status::Skipped);
            let reason = e.reason.as_deref().unwrap_or("no reason given");
            fails.then(|| format!("executor {} {}: {reason}", e.name, e.status.word()))
        });
        let checks = self.checks.iter().filter(|c| !c.ok).map(|c| {
            format!(
                "{} {} {}: {} against {}: {}",
                c.scene,
                c.method,
                c.layer,
                c.a,
                c.b,
                c.problems.join("; ")
            )
        });
        let controls = self.controls.iter().filter(|c| !c.failed);
        let controls = controls.map(|c| format!("control `{}` should have failed and passed", c.name));
        let unspoiled = self.sabotage.filter(|_| self.spoiled_plans == 0);
        let unspoiled =
            unspoiled.map(|s| format!("nothing to spoil: no plan has a place for `{}`", s.description()));
        executors.chain(checks).chain(controls).chain(unspoiled).collect()
    }

    /// Write `report.json` and `report.html` into `folder`, which exists; returns the latter's path.
    ///
    /// # Errors
    /// If the folder cannot be written; nothing half-written stays.
    pub(crate) fn write(&self, folder: &Path, skips_fail: bool) -> Result<PathBuf> {
        whole_file::write(&folder.join("report.json"), serde_json::to_string_pretty(self)?.as_bytes())?;
        let page = folder.join("report.html");
        whole_file::write(&page, html::page(self, skips_fail).as_bytes())?;
        Ok(page)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(sabotage: Option<Sabotage>, spoiled_plans: usize) -> Report {
        Report {
            executors: Vec::new(),
            no_second_driver: None,
            controls: Vec::new(),
            sabotage,
            spoiled_plans,
            checks: Vec::new(),
            map_size: [1, 1],
            scenes: Vec::new(),
            seconds: 0.0,
        }
    }

    #[test]
    fn sabotage_that_spoils_nothing_is_a_failure_of_its_own() {
        assert!(report(None, 0).failures(true).is_empty());
        assert!(report(Some(Sabotage::Ior), 1).failures(true).is_empty());
        let failures = report(Some(Sabotage::Ior), 0).failures(false);
        assert!(failures.len() == 1 && failures[0].starts_with("nothing to spoil"), "{failures:?}");
        let folder = std::env::temp_dir().join(format!("spectral-report-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let page = report(Some(Sabotage::Ior), 0).write(&folder, false).expect("written");
        let text = std::fs::read_to_string(page).expect("a page");
        assert!(text.contains("nothing to spoil"), "{text}");
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}
