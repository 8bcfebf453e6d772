//! The oracle's program, by its sources: results of another are not its results.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};
use xtask::kept::hex;

use crate::unpacked::files_under;

/// What the oracle's result depends on, below the workspace's root.
const SOURCES: [&str; 4] =
    ["crates/spectral-core", "crates/spectral-scene", "crates/spectral-reference", "Cargo.lock"];

/// A hash of all of them.
pub(super) fn oracle_version(root: &Path) -> Result<String> {
    let mut hasher = Sha256::new();
    for source in SOURCES {
        let path = root.join(source);
        let files = if path.is_dir() { files_under(&path) } else { vec![path] };
        for file in files {
            let bytes = fs::read(&file).with_context(|| format!("cannot read {}", file.display()))?;
            hasher.update(file.strip_prefix(root).unwrap_or(&file).to_string_lossy().as_bytes());
            hasher.update((bytes.len() as u64).to_le_bytes());
            hasher.update(bytes);
        }
    }
    Ok(hex(hasher))
}
