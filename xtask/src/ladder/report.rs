//! The price list as data, and written as `ladder.json`, `ladder.csv`, `ladder.html` and `ladder.svg`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use asm_core::{GapFilling, Refraction};
use serde::Serialize;
use xtask::executor_entry::{ExecutorEntry, Status};
use xtask::sabotage::Sabotage;
use xtask::subject::Subject;
use xtask::whole_file;

use super::control::Control;
use super::front::{Halving, Price};
use super::measure::{Problem, Row};
use super::truth::{Noise, Truth};
use super::{Effort, page, plot, pond, prt};

/// Everything that one run measured.
#[derive(Serialize)]
pub(super) struct Ladder {
    /// Executors of the project, run or not.
    pub(super) executors: Vec<ExecutorEntry>,
    /// What was spoiled on purpose.
    pub(super) sabotage: Option<Sabotage>,
    /// Spoiled rungs, which must be farther from the oracle.
    pub(super) controls: Vec<Control>,
    /// What each scene's rungs are held against.
    pub(super) scenes: Vec<SceneEntry>,
    /// The price list.
    pub(super) rows: Vec<Row>,
    /// What each pond's rungs are held against.
    pub(super) ponds: Vec<pond::Entry>,
    /// Their price list.
    pub(super) pond_rows: Vec<pond::Row>,
    /// What each relit figure's rungs are held against.
    pub(super) figures: Vec<prt::Entry>,
    /// Their price list.
    pub(super) figure_rows: Vec<prt::Row>,
    /// Texels across and down of every receiver.
    receiver_size: [u32; 2],
    /// Pixels across and down of every picture.
    picture_size: [u32; 2],
    /// How long all of it took, seconds.
    pub(super) seconds: f64,
    #[serde(skip)]
    pub(super) effort: Effort,
}

/// A scene's oracle and what its front says.
#[derive(Serialize)]
pub(super) struct SceneEntry {
    pub(super) name: String,
    /// Layer that is compared.
    pub(super) layer: Option<&'static str>,
    /// The oracle's own.
    pub(super) noise: Option<Noise>,
    /// What halving the error costs, one sentence an executor.
    pub(super) halving: Vec<String>,
    /// Why there is no oracle.
    pub(super) problem: Option<String>,
}

impl SceneEntry {
    /// Of a scene whose rungs are these.
    pub(super) fn new(subject: &Subject, truth: &Truth, rows: &[Row]) -> Self {
        let sentence = |rows: &[Row]| {
            let on_front = rows.iter().filter(|row| row.on_delta_e_front);
            let prices: Vec<_> = on_front.filter_map(Row::delta_e_price).collect();
            format!("on {}, {}", rows[0].executor, Halving::along(&prices).sentence("mean ΔE"))
        };
        Self {
            name: subject.name.clone(),
            layer: Some(truth.layer.name()),
            noise: Some(truth.noise.clone()),
            halving: rows.chunk_by(|a, b| a.executor == b.executor).map(sentence).collect(),
            problem: None,
        }
    }

    /// Of a scene that cannot be judged.
    pub(super) fn without_truth(subject: &Subject, problem: String) -> Self {
        eprintln!("  {problem}");
        let name = subject.name.clone();
        Self { name, layer: None, noise: None, halving: Vec::new(), problem: Some(problem) }
    }
}

impl Ladder {
    /// Before anything is measured.
    pub(super) fn new(effort: Effort, sabotage: Option<Sabotage>) -> Self {
        Self {
            executors: Vec::new(),
            sabotage,
            controls: Vec::new(),
            scenes: Vec::new(),
            rows: Vec::new(),
            ponds: Vec::new(),
            pond_rows: Vec::new(),
            figures: Vec::new(),
            figure_rows: Vec::new(),
            receiver_size: effort.receiver_size,
            picture_size: effort.picture_size,
            seconds: 0.0,
            effort,
        }
    }

    /// Rungs of scenes, ponds and figures, on all executors.
    pub(super) fn rungs(&self) -> usize {
        self.rows.len() + self.pond_rows.len() + self.figure_rows.len()
    }

    /// Rungs that a device or a method cannot do.
    pub(super) fn refused(&self) -> usize {
        let problems = self.rows.iter().map(|row| &row.problem);
        let of_ponds = self.pond_rows.iter().map(|row| &row.problem);
        let of_figures = self.figure_rows.iter().map(|row| &row.problem);
        let all = problems.chain(of_ponds).chain(of_figures);
        all.filter(|problem| matches!(problem, Some(Problem::Refused(_)))).count()
    }

    /// What a person should be told went wrong, one line each; empty if all is well.
    pub(super) fn failures(&self, skips_fail: bool) -> Vec<String> {
        let executors = self.executors.iter().filter_map(|e| {
            let fails = e.status == Status::Failed || (skips_fail && e.status == Status::Skipped);
            let reason = e.reason.as_deref().unwrap_or("no reason given");
            fails.then(|| format!("executor {} {}: {reason}", e.name, e.status.word()))
        });
        let scenes = self.scenes.iter().filter_map(|s| Some(format!("{}: {}", s.name, s.problem.as_ref()?)));
        let rows = self.rows.iter().filter_map(|row| {
            let problem = row.problem.as_ref().filter(|problem| problem.is_failure() && !row.spoiled)?;
            Some(format!("{} {} {}: {}", row.scene, row.executor, row.rung, problem.text()))
        });
        let ponds = self.ponds.iter().filter_map(|p| Some(format!("{}: {}", p.name, p.problem.as_ref()?)));
        let pond_rows = self.pond_rows.iter().filter_map(|row| {
            let problem = row.problem.as_ref().filter(|problem| problem.is_failure() && !row.spoiled)?;
            Some(format!("{} {} {}: {}", row.pond, row.executor, row.rung, problem.text()))
        });
        let figures =
            self.figures.iter().filter_map(|f| Some(format!("{}: {}", f.name, f.problem.as_ref()?)));
        let figure_rows = self.figure_rows.iter().filter_map(|row| {
            let problem = row.problem.as_ref().filter(|problem| problem.is_failure() && !row.spoiled)?;
            Some(format!("{} {} {}: {}", row.figure, row.executor, row.rung, problem.text()))
        });
        let unnoticed = self.controls.iter().filter(|c| !c.failed).map(|c| {
            format!("control `{}` should be farther from the oracle and is not: {}", c.name, c.found)
        });
        let nothing = (self.rungs() == 0).then(|| "no rung was measured".to_owned());
        let prices = scenes.chain(rows).chain(ponds).chain(pond_rows).chain(figures).chain(figure_rows);
        executors.chain(prices).chain(unnoticed).chain(nothing).chain(self.sabotaged()).collect()
    }

    /// Sabotage is a failure, noticed or not.
    fn sabotaged(&self) -> Option<String> {
        let what = self.sabotage?.description();
        let noticed = self.controls.iter().filter(|control| control.failed).count();
        Some(match self.controls.len() {
            0 => format!("nothing to spoil: no plan has a place for `{what}`"),
            all => {
                format!(
                    "{what}: {noticed} of {all} spoiled rungs are farther from the oracle than as they were"
                )
            }
        })
    }

    /// Rows of a scene.
    pub(super) fn rows_of<'a>(&'a self, scene: &'a str) -> impl Iterator<Item = &'a Row> {
        self.rows.iter().filter(move |row| row.scene == scene)
    }

    /// A scene's prices in mean CIEDE2000.
    pub(super) fn delta_e_plot(&self, scene: &str) -> plot::Plot {
        self.plot(scene, "mean CIEDE2000, net of noise", Row::delta_e_price, |row| row.on_delta_e_front)
    }

    /// A scene's prices in RMS of Y.
    pub(super) fn rms_plot(&self, scene: &str) -> plot::Plot {
        self.plot(scene, "relative RMS of Y, net of noise", Row::rms_price, |row| row.on_rms_front)
    }

    fn plot(
        &self,
        scene: &str,
        error: &'static str,
        price: impl Fn(&Row) -> Option<Price>,
        on_front: impl Fn(&Row) -> bool,
    ) -> plot::Plot {
        let point = |row: &Row| {
            let (method, executor) = (row.rung.method.name(), row.executor);
            let label = format!("{}, {}", row.rung.wavelengths, row.rung.emission_size);
            Some(plot::Point { price: price(row)?, method, executor, on_front: on_front(row), label })
        };
        plot::Plot { title: scene.to_owned(), error, points: self.rows_of(scene).filter_map(point).collect() }
    }

    /// Write all of it into `folder`, which exists; returns the page's path.
    pub(super) fn write(&self, folder: &Path) -> Result<PathBuf> {
        let plots: Vec<_> = self.scenes.iter().map(|scene| self.delta_e_plot(&scene.name)).collect();
        let svg = plot::svg(&plots, 3, &page::FAMILY)?;
        let pond_plots: Vec<_> = self.ponds.iter().map(|pond| self.pond_plot(pond.name)).collect();
        let figure_plots: Vec<_> = self.figures.iter().map(|figure| self.figure_plot(figure.name)).collect();
        let files = [
            ("ladder.json", serde_json::to_string_pretty(self)?),
            ("ladder.csv", self.csv()?),
            ("ladder.html", page::page(self)?),
            ("ladder.svg", svg),
            ("ladder-pond.svg", plot::svg(&pond_plots, 3, &pond::FAMILY)?),
            ("ladder-prt.svg", plot::svg(&figure_plots, 2, &prt::FAMILY)?),
        ];
        for (name, text) in &files {
            whole_file::write(&folder.join(name), text.as_bytes())?;
        }
        Ok(folder.join("ladder.html"))
    }

    fn csv(&self) -> Result<String> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for row in &self.rows {
            writer.serialize(CsvRow::of(row))?;
        }
        for row in &self.pond_rows {
            writer.serialize(CsvRow::of_pond(row))?;
        }
        for row in &self.figure_rows {
            writer.serialize(CsvRow::of_figure(row))?;
        }
        String::from_utf8(writer.into_inner()?).context("text")
    }
}

/// A row without anything nested; the last columns are the ponds' and the figures'.
#[derive(Default, Serialize)]
struct CsvRow<'a> {
    scene: &'a str,
    executor: &'a str,
    method: &'a str,
    wavelengths: Option<u32>,
    emission_size: Option<u32>,
    emission: Option<String>,
    refraction: Option<Refraction>,
    gap_filling: Option<GapFilling>,
    map_size: Option<u32>,
    ms: Option<f64>,
    ms_fastest: Option<f64>,
    ms_slowest: Option<f64>,
    photons: Option<u64>,
    net_delta_e: Option<f64>,
    net_rms: Option<f64>,
    hidden_by_noise: Option<bool>,
    delta_e_mean: Option<f64>,
    delta_e_p95: Option<f64>,
    rms: Option<f64>,
    rms_64: Option<f64>,
    total_y: Option<f64>,
    all_light_delta_e_mean: Option<f64>,
    all_light_rms: Option<f64>,
    flip: Option<f64>,
    picture_ms: Option<f64>,
    on_delta_e_front: bool,
    on_rms_front: bool,
    spoiled: bool,
    problem: &'a str,
    samples: Option<usize>,
    kernel_samples: Option<usize>,
    target_error: Option<f64>,
    terms: Option<usize>,
    plan_ms: Option<f64>,
    coefficients: Option<usize>,
    bands: Option<usize>,
    cie94_mean: Option<f64>,
    cie94_max: Option<f64>,
    vertex_ms: Option<f64>,
    shade_ms: Option<f64>,
    on_cie94_front: bool,
}

impl<'a> CsvRow<'a> {
    fn of(row: &'a Row) -> Self {
        let outcome = row.outcome.as_ref();
        Self {
            scene: &row.scene,
            executor: row.executor,
            method: row.rung.method.name(),
            wavelengths: Some(row.rung.wavelengths),
            emission_size: Some(row.rung.emission_size),
            emission: Some(row.rung.emission_word()),
            refraction: Some(row.rung.refraction),
            gap_filling: Some(row.rung.gap_filling),
            map_size: Some(row.rung.map_size),
            ms: outcome.map(|o| o.frame.ms),
            ms_fastest: outcome.map(|o| o.frame.range_ms[0]),
            ms_slowest: outcome.map(|o| o.frame.range_ms[1]),
            photons: outcome.map(|o| o.photons),
            net_delta_e: outcome.and_then(|o| Some(o.net_delta_e?.error)),
            net_rms: outcome.map(|o| o.net_rms.error),
            hidden_by_noise: outcome.map(|o| o.net_rms.hidden || o.net_delta_e.is_some_and(|net| net.hidden)),
            delta_e_mean: outcome.and_then(|o| o.error.delta_e_mean),
            delta_e_p95: outcome.and_then(|o| o.error.delta_e_p95),
            rms: outcome.map(|o| o.error.rms),
            rms_64: outcome.map(|o| o.error.rms_64),
            total_y: outcome.map(|o| o.error.total_y),
            all_light_delta_e_mean: outcome.and_then(|o| o.all_light.as_ref()?.delta_e_mean),
            all_light_rms: outcome.and_then(|o| Some(o.all_light.as_ref()?.rms)),
            flip: outcome.and_then(|o| o.flip),
            picture_ms: outcome.and_then(|o| Some(o.picture_frame.as_ref()?.ms)),
            on_delta_e_front: row.on_delta_e_front,
            on_rms_front: row.on_rms_front,
            spoiled: row.spoiled,
            problem: row.problem.as_ref().map_or("", Problem::text),
            ..Self::default()
        }
    }

    /// Of a pond; its RMS has no noise to be taken off.
    fn of_pond(row: &'a pond::Row) -> Self {
        let outcome = row.outcome.as_ref();
        let (kernel_samples, target_error, emission_size) = match row.rung {
            pond::Rung::Convolution { kernel_samples } => (kernel_samples, None, None),
            pond::Rung::LowRank { target_error } => (None, Some(target_error), None),
            pond::Rung::Photon { emission_size } => (None, None, Some(emission_size)),
        };
        Self {
            scene: row.pond,
            executor: row.executor,
            method: row.rung.method(),
            emission_size,
            ms: outcome.map(|o| o.frame.ms),
            ms_fastest: outcome.map(|o| o.frame.range_ms[0]),
            ms_slowest: outcome.map(|o| o.frame.range_ms[1]),
            rms: outcome.map(|o| o.error.rms),
            total_y: outcome.map(|o| o.error.total_y),
            on_rms_front: row.on_front,
            spoiled: row.spoiled,
            problem: row.problem.as_ref().map_or("", Problem::text),
            samples: Some(row.samples),
            kernel_samples,
            target_error,
            terms: row.terms,
            plan_ms: Some(row.make_ms),
            ..Self::default()
        }
    }

    /// Of a relit figure; its reference has no noise either.
    fn of_figure(row: &'a prt::Row) -> Self {
        let outcome = row.outcome.as_ref();
        Self {
            scene: row.figure,
            executor: row.executor,
            method: row.rung.way.basis(),
            ms: outcome.map(|o| o.frame.ms),
            ms_fastest: outcome.map(|o| o.frame.range_ms[0]),
            ms_slowest: outcome.map(|o| o.frame.range_ms[1]),
            delta_e_mean: outcome.map(|o| o.error.delta_e_mean),
            delta_e_p95: outcome.map(|o| o.error.delta_e_p95),
            rms: outcome.map(|o| o.error.rms),
            spoiled: row.spoiled,
            problem: row.problem.as_ref().map_or("", Problem::text),
            coefficients: Some(row.rung.way.coefficients()),
            bands: Some(row.rung.bands.count()),
            cie94_mean: outcome.map(|o| o.error.cie94_mean),
            cie94_max: outcome.map(|o| o.error.cie94_max),
            vertex_ms: outcome.and_then(|o| o.vertex_ms),
            shade_ms: outcome.and_then(|o| o.shade_ms),
            on_cie94_front: row.on_front,
            ..Self::default()
        }
    }
}
