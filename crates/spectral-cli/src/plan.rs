//! `spectral plan`: what a scene calls for, and what a bake and a picture of it would run.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};

use asm_core::{PASSES, Settings, bake_plan, render_plan};
use frame_plan::cpu::CpuExecutor;
use frame_plan::{Decision, Executor, Lifetime, Limits, Plan, ResourceKind};
use serde::Serialize;
use spectral_scene::{Effects, Scene};

use crate::args::{DEFAULT_BAKE_SIZE, DEFAULT_RENDER_SIZE, PlanArgs};
use crate::choices::Method;
use crate::error::CliError;
use crate::{messages, scene_argument, targets};

#[derive(Serialize)]
struct Report<'a> {
    scene: &'a str,
    method: Method,
    effects: Effects,
    plans: Vec<Summary>,
    /// Plans that could not be made, and why.
    problems: Vec<String>,
}

#[derive(Serialize)]
struct Summary {
    name: String,
    decisions: Vec<Decision>,
    /// Passes that run, with how often, in the order of their first run.
    steps: Vec<String>,
    resources: Vec<ResourceSummary>,
    total_bytes: u64,
}

#[derive(Serialize)]
struct ResourceSummary {
    name: String,
    kind: String,
    lifetime: Lifetime,
    bytes: u64,
}

pub(crate) fn run(args: &PlanArgs) -> Result<(), CliError> {
    let settings = args.plan.settings(args.method.of_plan()?, args.wavelengths, None);
    let opened = scene_argument::open(&args.scene)?;
    let scene = &opened.scene;
    let limits = CpuExecutor::new(PASSES, None).map_err(CliError::failed)?.limits();
    let mut report = Report {
        scene: &scene.name,
        method: args.method,
        effects: Effects::required_by(scene),
        plans: Vec::new(),
        problems: Vec::new(),
    };
    for plan in plans(scene, &settings, &limits) {
        match plan {
            Ok(plan) => report.plans.push(summary(plan)),
            Err(problem) => report.problems.push(problem),
        }
    }
    messages::print(&if args.json { targets::json_text(&report)? } else { report.to_string() })
}

/// A bake onto the main receiver and a picture by the first camera, in the sizes that `bake` and `render` have by default.
fn plans(scene: &Scene, settings: &Settings, limits: &Limits) -> [Result<Plan, String>; 2] {
    let size = DEFAULT_BAKE_SIZE;
    let receiver = scene.receiver("receiver").ok().or_else(|| scene.receivers().next());
    let bake =
        receiver.ok_or_else(|| "bake: no matt object has texture coordinates".to_owned()).and_then(|r| {
            let plan = bake_plan(scene, r, [size.width, size.height], settings, limits);
            plan.map(|p| p.plan).map_err(|e| format!("bake: {e}"))
        });
    let size = DEFAULT_RENDER_SIZE;
    let picture = render_plan(scene, 0, [size.width, size.height], settings, limits);
    [bake, picture.map(|p| p.plan).map_err(|e| format!("picture: {e}"))]
}

fn summary(plan: Plan) -> Summary {
    let mut runs: BTreeMap<String, (usize, u32)> = BTreeMap::new();
    for name in plan.step_names() {
        let order = runs.len();
        runs.entry(name).or_insert((order, 0)).1 += 1;
    }
    let mut steps: Vec<_> = runs.into_iter().collect();
    steps.sort_by_key(|(_, (order, _))| *order);
    let times = |(name, (_, count)): (String, (usize, u32))| {
        if count == 1 { name } else { format!("{name} ({count} times)") }
    };
    let resources: Vec<ResourceSummary> = plan
        .resources
        .iter()
        .map(|r| ResourceSummary {
            name: r.name.clone(),
            kind: kind(&r.kind),
            lifetime: r.lifetime,
            bytes: r.kind.bytes(),
        })
        .collect();
    Summary {
        name: plan.name,
        decisions: plan.decisions,
        steps: steps.into_iter().map(times).collect(),
        total_bytes: resources.iter().map(|r| r.bytes).sum(),
        resources,
    }
}

fn kind(kind: &ResourceKind) -> String {
    match *kind {
        ResourceKind::Buffer { .. } => "buffer".into(),
        ResourceKind::Sampler { .. } => "sampler".into(),
        ResourceKind::Texture { format, size: [width, height], layers, mips } => {
            let mut text = format!("{width}x{height} {format:?}");
            if layers > 1 {
                text += &format!(", {layers} layers");
            }
            if mips > 1 {
                text += &format!(", {mips} mips");
            }
            text
        }
    }
}

impl Display for Report<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "scene {}, method {}\n\neffects", self.scene, self.method.name())?;
        for (name, effect) in self.effects.iter() {
            writeln!(f, "  {name}: {}, {}", if effect.on { "on" } else { "off" }, effect.reason)?;
        }
        for plan in &self.plans {
            write!(f, "\n{plan}")?;
        }
        for problem in &self.problems {
            writeln!(f, "\nno plan for a {problem}")?;
        }
        Ok(())
    }
}

impl Display for Summary {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "plan: {}", self.name)?;
        for (title, kept) in [("kept", true), ("left out", false)] {
            writeln!(f, "  passes {title}")?;
            for decision in self.decisions.iter().filter(|d| d.kept == kept) {
                writeln!(f, "    {}: {}", decision.pass, decision.reason)?;
                for note in &decision.notes {
                    writeln!(f, "      {note}")?;
                }
            }
        }
        writeln!(f, "  steps")?;
        for step in &self.steps {
            writeln!(f, "    {step}")?;
        }
        writeln!(f, "  resources, {:.1} KiB", kibibytes(self.total_bytes))?;
        for resource in &self.resources {
            let ResourceSummary { name, kind, bytes, lifetime } = resource;
            let lifetime = format!("{lifetime:?}").to_lowercase();
            writeln!(f, "    {:>9.1} KiB  {name}: {kind}, {lifetime}", kibibytes(*bytes))?;
        }
        Ok(())
    }
}

fn kibibytes(bytes: u64) -> f64 {
    bytes as f64 / 1024.0
}
