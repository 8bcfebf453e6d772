//! `spectral devices`: what can run plans on this machine.

use std::fmt::Write;

use asm_core::PASSES;
use frame_plan::cpu::CpuExecutor;
use frame_plan::{DeviceInfo, DeviceType, Executor};
use serde::Serialize;

use crate::args::DevicesArgs;
use crate::error::CliError;
use crate::{backend, messages, targets};

/// One executor on one device.
#[derive(Serialize)]
struct Entry {
    /// Executor id, as `--backend` takes it.
    id: &'static str,
    status: Status,
    /// Name of the device, as `--adapter` takes it; empty if there is none.
    device: String,
    driver: String,
    /// What it computes on; null if there is none.
    device_type: Option<DeviceType>,
    /// What that means, or why it is missing.
    reason: String,
}

#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
enum Status {
    /// Opened and ready.
    Available,
    /// The adapter is there and gives no device.
    Failed,
    /// No adapter.
    Missing,
}

#[derive(Serialize)]
struct Report {
    executors: Vec<Entry>,
    /// What `--backend auto` takes.
    auto: &'static str,
}

pub(crate) fn run(args: &DevicesArgs) -> Result<(), CliError> {
    let mut executors = vec![cpu()];
    let (wgpu, auto) = wgpu();
    executors.extend(wgpu);
    executors.extend(vulkan());
    let report = Report { executors, auto };
    messages::print(&if args.json { targets::json_text(&report)? } else { table(&report) })
}

fn cpu() -> Entry {
    match CpuExecutor::new(PASSES, None) {
        Ok(executor) => entry("cpu", Status::Available, executor.info(), "always there".into()),
        Err(error) => entry("cpu", Status::Failed, &DeviceInfo::default(), error.to_string()),
    }
}

/// Every adapter that wgpu knows, each opened to see whether it works, and what `auto` makes of them.
fn wgpu() -> (Vec<Entry>, &'static str) {
    let adapters = asm_wgpu::adapters();
    let auto = if backend::auto(&adapters).is_ok() { "wgpu" } else { "cpu" };
    (entries("wgpu", &adapters, |name| backend::wgpu(Some(name)).map(drop)), auto)
}

/// Every device that the Vulkan executor can run on, each opened to see whether it works.
fn vulkan() -> Vec<Entry> {
    entries("vulkan", &asm_vulkan::adapters(), |name| backend::vulkan(&backend::SCENES, Some(name)).map(drop))
}

/// What opening each adapter by its name says, or that there is none.
fn entries(
    id: &'static str,
    adapters: &[DeviceInfo],
    open: impl Fn(String) -> Result<(), String>,
) -> Vec<Entry> {
    if adapters.is_empty() {
        let reason = format!(
            "{id} finds no adapter: install a GPU driver, or let `cargo xtask driver` fetch a software one"
        );
        return vec![entry(id, Status::Missing, &DeviceInfo::default(), reason)];
    }
    let entry = |info: &DeviceInfo| match open(info.device.clone()) {
        Ok(()) => entry(id, Status::Available, info, words(info.device_type).into()),
        Err(problem) => entry(id, Status::Failed, info, problem),
    };
    adapters.iter().map(entry).collect()
}

const fn words(device_type: DeviceType) -> &'static str {
    match device_type {
        DeviceType::Cpu => "software driver, runs on the CPU",
        DeviceType::Integrated => "integrated GPU",
        DeviceType::Discrete => "discrete GPU",
        DeviceType::Virtual => "virtual GPU",
        DeviceType::Other => "GPU of a kind that its driver does not state",
    }
}

fn entry(id: &'static str, status: Status, info: &DeviceInfo, reason: String) -> Entry {
    let device_type = (!info.device.is_empty()).then_some(info.device_type);
    Entry { id, status, device: info.device.clone(), driver: info.driver.clone(), device_type, reason }
}

fn table(report: &Report) -> String {
    let mut text = String::new();
    for Entry { id, status, device, driver, reason, .. } in &report.executors {
        let status = match status {
            Status::Available => "available",
            Status::Failed => "failed",
            Status::Missing => "missing",
        };
        let name =
            [device.as_str(), driver].into_iter().filter(|n| !n.is_empty()).collect::<Vec<_>>().join(", ");
        let name = if name.is_empty() { reason.clone() } else { format!("{name}: {reason}") };
        writeln!(text, "{id:<6} {status:<10} {name}").expect("a String takes everything");
    }
    writeln!(text, "--backend auto takes {}", report.auto).expect("a String takes everything");
    text
}
