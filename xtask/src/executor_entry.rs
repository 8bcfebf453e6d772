//! What became of an executor in a run, for reports.

use frame_plan::{DeviceInfo, DeviceType, ExecuteError, Executor};
use serde::Serialize;

use crate::executors::{Candidate, Opened};
use crate::html::{escaped, push};

/// Whether an executor did its part.
#[derive(Serialize, Clone, Copy, PartialEq, Eq, Debug)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// On every plan it was given.
    Ran,
    /// The machine lacks what it needs.
    Skipped,
    /// It broke.
    Failed,
}

impl Status {
    /// As in the JSON.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Ran => "ran",
            Self::Skipped => "skipped",
            Self::Failed => "failed",
        }
    }
}

/// An executor and what became of it.
#[derive(Clone, Debug, Serialize)]
pub struct ExecutorEntry {
    /// `cpu`, `wgpu` or `vulkan`.
    pub id: &'static str,
    /// What checks call it.
    pub name: &'static str,
    /// Whether it ran.
    pub status: Status,
    /// Device name, if there is a device.
    pub device: String,
    /// Driver name and version, if there is one.
    pub driver: String,
    /// What it computes on, if there is a device.
    pub device_type: Option<DeviceType>,
    /// It snaps vertices to 2^-this of a texel, which sets the bounds of parity; null where it does not say.
    pub subpixel_bits: Option<u32>,
    /// Why it was skipped or failed.
    pub reason: Option<String>,
}

impl ExecutorEntry {
    /// With what became of opening it, told to the terminal; `missing` says why there may be no device, or is empty. The
    /// device is empty if it never started.
    pub fn of(
        candidate: &Candidate,
        opened: Opened,
        missing: &str,
    ) -> (Self, DeviceInfo, Option<Box<dyn Executor>>) {
        let mut entry = Self {
            id: candidate.id,
            name: candidate.name,
            status: Status::Ran,
            device: String::new(),
            driver: String::new(),
            device_type: None,
            subpixel_bits: None,
            reason: None,
        };
        let mut info = DeviceInfo::default();
        let executor = match opened {
            Ok(executor) => {
                info.clone_from(executor.info());
                entry.device.clone_from(&info.device);
                entry.driver.clone_from(&info.driver);
                entry.device_type = Some(info.device_type);
                entry.subpixel_bits = info.subpixel_bits;
                Some(executor)
            }
            Err(error) => {
                let no_device = matches!(error, ExecuteError::NoDevice { .. });
                entry.status = if no_device { Status::Skipped } else { Status::Failed };
                let hint = if missing.is_empty() { String::new() } else { format!("; {missing}") };
                entry.reason = Some(format!("{error}{hint}"));
                None
            }
        };
        eprintln!("{}: {}", entry.name, entry.reason.as_deref().unwrap_or(&entry.device));
        (entry, info, executor)
    }

    /// One line for the terminal.
    #[must_use]
    pub fn line(&self) -> String {
        let what = self.reason.as_deref().unwrap_or(&self.device);
        format!("{}: {}, {what}", self.name, self.status.word())
    }

    /// All of them as a table.
    pub fn table(html: &mut String, entries: &[Self]) {
        push(
            html,
            format_args!(
                "<table><tr><th>executor<th>status<th>device<th>driver<th>vertices snap to<th>reason"
            ),
        );
        for executor in entries {
            push(
                html,
                format_args!(
                    "<tr><td>{}<td>{}<td>{}<td>{}<td>{}<td>{}",
                    executor.name,
                    executor.status.word(),
                    escaped(&executor.device),
                    escaped(&executor.driver),
                    executor.subpixel_bits.map_or("–".into(), |bits| format!("2^-{bits} texel")),
                    escaped(executor.reason.as_deref().unwrap_or_default()),
                ),
            );
        }
        push(html, format_args!("</table>"));
    }
}
