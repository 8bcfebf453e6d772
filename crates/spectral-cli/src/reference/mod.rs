//! `--method reference`: the f64 oracle.

mod bake;
mod picture;

use std::ops::RangeInclusive;

use frame_plan::cpu::CpuExecutor;
use frame_plan::{DeviceInfo, Executor, PassSet};
use spectral_core::observer::VISIBLE_NM;
use spectral_reference::ReferenceError;

pub(crate) use bake::bake;
pub(crate) use picture::render;

use crate::args::RunArgs;
use crate::error::CliError;
use crate::messages;
use crate::values::Size;

/// Why the reference runs where it does.
const REASON: &str = "the reference runs on the CPU only";

/// Cells of the visible range that the oracle takes, as many as it is wide in 5 nm to as many as in 1 nm.
const CELLS: RangeInclusive<usize> = 80..=400;

/// As many cells as were asked for, or the nearest number that the oracle takes.
fn cells(asked: usize) -> usize {
    asked.clamp(*CELLS.start(), *CELLS.end())
}

/// The width of so many equal cells of the visible range, or of the nearest number that the oracle takes, with a
/// warning.
fn step_nm(wavelengths: Option<usize>) -> Option<f64> {
    let asked = wavelengths?;
    let cells = cells(asked);
    if cells != asked {
        messages::warn(&format!(
            "--wavelengths {asked}: --method reference samples the spectrum in {} to {} cells (5 to 1 nm), {cells} are \
             used",
            CELLS.start(),
            CELLS.end()
        ));
    }
    Some((VISIBLE_NM.1 - VISIBLE_NM.0) / cells as f64)
}

/// Refuse what would not fit, with the numbers.
fn check_memory(size: Size, bytes_per_texel: u64, usable_bytes: u64) -> Result<(), CliError> {
    let needed_bytes = size.texels() * bytes_per_texel;
    if needed_bytes <= usable_bytes {
        return Ok(());
    }
    let gib = |bytes: u64| bytes as f64 / f64::from(1 << 30);
    let problem = format!(
        "--size {size} would take about {:.1} GiB of memory, and {:.1} GiB may be used here: choose a smaller one",
        gib(needed_bytes),
        gib(usable_bytes)
    );
    Err(CliError::Failed(problem))
}

/// Say so if a noise target was not met by the time it had cost as much as it may.
fn warn_of_noise(target: Option<f64>, reached: f64, cost: &str) {
    if let Some(target) = target.filter(|target| reached > *target) {
        messages::warn(&format!("noise {target} is not reached: {reached:.4} after {cost}"));
    }
}

fn error(error: ReferenceError) -> CliError {
    match error {
        ReferenceError::Setting { .. } | ReferenceError::Size { .. } => CliError::usage(error),
        _ => CliError::failed(error),
    }
}

/// The processor and threads, named as the CPU executor names them.
fn device(run: &RunArgs) -> Result<DeviceInfo, CliError> {
    let executor = CpuExecutor::new(PassSet(&[]), run.device.threads).map_err(CliError::failed)?;
    let driver = concat!("spectral-reference ", env!("CARGO_PKG_VERSION")).into();
    Ok(DeviceInfo { driver, ..executor.info().clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_that_do_not_fit_into_memory_are_refused_with_the_numbers() {
        let size = Size { width: 8192, height: 8192 };
        assert!(check_memory(size, 640, 64 << 30).is_ok());
        let message = check_memory(size, 640, 16 << 30).expect_err("too large").to_string();
        assert!(
            message.contains("8192x8192") && message.contains("40.0 GiB") && message.contains("16.0 GiB"),
            "{message}"
        );
    }

    #[test]
    fn wavelengths_are_cells_of_the_visible_range() {
        assert_eq!(step_nm(None), None);
        assert_eq!(step_nm(Some(80)), Some(5.0));
        assert_eq!(step_nm(Some(400)), Some(1.0));
        assert_eq!([1, 79, 80, 81, 400, 401, usize::MAX].map(cells), [80, 80, 80, 81, 400, 400, 400]);
    }
}
