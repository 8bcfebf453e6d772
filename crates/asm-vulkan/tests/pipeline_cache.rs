//! Compiled pipelines on disk.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;

use std::fs;
use std::path::{Path, PathBuf};

use asm_vulkan::{VulkanExecutor, VulkanOptions};
use frame_plan::Executor;
use passes::*;

fn executor(folder: &Path) -> Option<VulkanExecutor> {
    let options = VulkanOptions { pipeline_cache: Some(folder.into()), ..device::options() };
    device::made_or_skipped(VulkanExecutor::new(device::compiled(PASSES), &options))
}

fn output(gpu: &mut VulkanExecutor) -> Vec<u8> {
    device::run(gpu, &scale_plan(), "output")
}

fn only_file(folder: &Path) -> PathBuf {
    let files: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(files.len(), 1, "{files:?}");
    files[0].clone()
}

#[test]
fn pipelines_are_kept_for_the_next_run() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("made on demand");
    let Some(mut first) = executor(&folder) else { return };
    assert_eq!(first.cached_pipeline_bytes(), 0);
    let wanted = output(&mut first);
    let kept = first.cached_pipeline_bytes();
    assert!(kept > 0 && fs::metadata(only_file(&folder)).unwrap().len() > kept as u64);
    drop(first);

    let mut second = executor(&folder).unwrap();
    assert_eq!(second.cached_pipeline_bytes(), kept, "found before anything is compiled");
    assert_eq!(output(&mut second), wanted);
}

#[test]
fn damaged_files_are_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let Some(mut first) = executor(folder.path()) else { return };
    let wanted = output(&mut first);
    let file = only_file(folder.path());
    let whole = fs::read(&file).unwrap();
    let mut damaged = whole.clone();
    *damaged.last_mut().unwrap() ^= 0x55;
    for contents in [&damaged[..], &whole[..whole.len() / 2], b""] {
        fs::write(&file, contents).unwrap();
        let mut next = executor(folder.path()).unwrap();
        assert_eq!(next.cached_pipeline_bytes(), 0);
        assert_eq!(output(&mut next), wanted);
        assert!(next.cached_pipeline_bytes() > 0, "written anew");
        assert!(fs::read(&file).unwrap().len() > contents.len().min(whole.len() / 2));
    }
}

#[test]
fn folders_that_cannot_be_written_cost_nothing_but_time() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a file, not a folder");
    fs::write(&file, "").unwrap();
    let Some(mut gpu) = executor(&file) else { return };
    gpu.prepare(&scale_plan()).unwrap();
    assert_eq!(gpu.cached_pipeline_bytes(), 0);
}
