//! Compiled pipelines on disk, so that the next run need not compile them again.
//!
//! Drivers check that a cache is theirs, but not that it is whole: a file of ours says how long its contents are and what they
//! sum up to, and a damaged one is not handed over.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ash::vk;
use frame_plan::ExecuteError;

use crate::device::Gpu;
use crate::object::Owned;

/// First bytes of a file: what it is and of which version.
const MAGIC: [u8; 8] = *b"asmvkpc1";
/// Bytes before the contents: magic, length, checksum.
const HEADER_BYTES: usize = 24;

/// The device's pipeline cache, and the file it is kept in.
pub(crate) struct PipelineCache {
    raw: Owned<vk::PipelineCache>,
    file: Option<PathBuf>,
    /// What the file holds.
    saved: Vec<u8>,
}

impl PipelineCache {
    /// Start from the file of this device and driver in `folder`, if it is there and whole.
    pub(crate) fn new(gpu: &Arc<Gpu>, folder: Option<&Path>) -> Result<Self, ExecuteError> {
        let file = folder.map(|folder| folder.join(file_name(&gpu.pipeline_cache_uuid)));
        let saved = file.as_ref().and_then(|file| fs::read(file).ok()).and_then(|bytes| contents(&bytes));
        let saved = saved.unwrap_or_default();
        let create = vk::PipelineCacheCreateInfo::default().initial_data(&saved);
        // SAFETY: the data is what the driver of this identity once gave, or nothing; drivers check their own header.
        let raw = unsafe { gpu.device.create_pipeline_cache(&create, None) }
            .map_err(|e| gpu.error(e, "creating a pipeline cache"))?;
        Ok(Self { raw: Owned::new(gpu, raw), file, saved })
    }

    pub(crate) const fn raw(&self) -> vk::PipelineCache {
        self.raw.raw()
    }

    /// Bytes that were found on disk, or written there since.
    pub(crate) const fn saved_bytes(&self) -> usize {
        self.saved.len()
    }

    /// Write the cache to its file, if it has one and it has grown. Failing to do so costs time in the next run only.
    pub(crate) fn save(&mut self, gpu: &Gpu) {
        let Some(file) = &self.file else { return };
        // SAFETY: the cache is alive.
        let Ok(data) = (unsafe { gpu.device.get_pipeline_cache_data(self.raw.raw()) }) else { return };
        if data == self.saved {
            return;
        }
        // Through another name, so that no reader sees half of it.
        let part = file.with_extension(format!("{}.part", std::process::id()));
        let written = file.parent().map_or(Ok(()), fs::create_dir_all);
        let written = written.and_then(|()| fs::write(&part, with_header(&data)));
        match written.and_then(|()| fs::rename(&part, file)) {
            Ok(()) => self.saved = data,
            Err(_) => drop(fs::remove_file(part)),
        }
    }
}

fn file_name(uuid: &[u8]) -> String {
    let hex: String = uuid.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("vulkan-{hex}.bin")
}

fn with_header(data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u64).to_le_bytes();
    [&MAGIC[..], &length, &checksum(data).to_le_bytes(), data].concat()
}

/// What follows the header of a file, if the file is whole.
fn contents(bytes: &[u8]) -> Option<Vec<u8>> {
    let (header, data) = bytes.split_at_checked(HEADER_BYTES)?;
    (header == &with_header(data)[..HEADER_BYTES]).then(|| data.to_vec())
}

/// FNV-1a in 64 bits: finds damage, not malice.
fn checksum(data: &[u8]) -> u64 {
    data.iter()
        .fold(0xcbf2_9ce4_8422_2325, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::{contents, file_name, with_header};

    #[test]
    fn damaged_files_are_not_used() {
        let data = b"pipelines".to_vec();
        let file = with_header(&data);
        assert_eq!(contents(&file), Some(data));
        assert_eq!(contents(&[]), None);
        assert_eq!(contents(&file[..file.len() - 1]), None, "cut short");
        for i in 0..file.len() {
            let mut damaged = file.clone();
            damaged[i] ^= 1;
            assert_eq!(contents(&damaged), None, "byte {i}");
        }
    }

    #[test]
    fn devices_have_files_of_their_own() {
        assert_eq!(file_name(&[0, 171]), "vulkan-00ab.bin");
    }
}
