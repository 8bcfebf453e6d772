//! Files that are written whole or not at all.

use std::path::Path;

use anyhow::{Context, Result};
use spectral_cli::output::atomic_file::AtomicFile;

/// Readers see the old file or the new one.
///
/// # Errors
/// If the folder or the file cannot be written; nothing half-written stays.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    AtomicFile::new(path)
        .and_then(|file| file.write(|content| content.write_all(bytes)))
        .with_context(|| format!("cannot write {}", path.display()))
}
