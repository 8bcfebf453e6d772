//! The oracle's program, by its sources: results of another are not its results.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};
use xtask::kept::hex;

use crate::unpacked::files_under;

/// The oracle's package, and the folders of all that is ours in it, below the workspace's root.
const PACKAGE: &str = "spectral-reference";
const SOURCES: [&str; 3] = ["crates/spectral-core", "crates/spectral-scene", "crates/spectral-reference"];

/// A hash of our sources and of the versions of all others'.
pub(super) fn oracle_version(root: &Path) -> Result<String> {
    let read = |file: &Path| fs::read(file).with_context(|| format!("cannot read {}", file.display()));
    let mut hasher = Sha256::new();
    for file in SOURCES.iter().flat_map(|source| files_under(&root.join(source))) {
        let bytes = read(&file)?;
        hasher.update(file.strip_prefix(root).unwrap_or(&file).to_string_lossy().as_bytes());
        hasher.update((bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    }
    let lock = read(&root.join("Cargo.lock"))?;
    for package in packages_below(PACKAGE, &String::from_utf8_lossy(&lock)) {
        hasher.update(package.as_bytes());
        hasher.update(b"\n");
    }
    Ok(hex(hasher))
}

/// All that a package depends on, itself included, as `name version`, by the text of `Cargo.lock`.
fn packages_below(package: &str, lock: &str) -> BTreeSet<String> {
    let mut versions: BTreeMap<&str, Vec<(String, Vec<&str>)>> = BTreeMap::new();
    for block in lock.split("[[package]]").skip(1) {
        let value = |key: &str| {
            let line = block.lines().find_map(|line| line.strip_prefix(key))?;
            line.strip_prefix(" = \"")?.strip_suffix('"')
        };
        let (Some(name), Some(version)) = (value("name"), value("version")) else { continue };
        // ` "name",` or, where there are several versions, ` "name version",`
        let needs = block.lines().filter_map(|line| line.strip_prefix(" \"")?.strip_suffix("\","));
        versions.entry(name).or_default().push((format!("{name} {version}"), needs.collect()));
    }
    let mut found = BTreeSet::new();
    let mut open = vec![package];
    while let Some(wanted) = open.pop() {
        let name = wanted.split(' ').next().unwrap_or(wanted);
        for (full, needs) in versions.get(name).into_iter().flatten() {
            if (wanted == name || wanted == full) && found.insert(full.clone()) {
                open.extend(needs);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOCK: &str = r#"
version = 4

[[package]]
name = "oracle"
version = "0.1.0"
dependencies = [
 "maths 0.2.0",
 "threads",
]

[[package]]
name = "maths"
version = "0.1.0"

[[package]]
name = "maths"
version = "0.2.0"
source = "registry"

[[package]]
name = "threads"
version = "1.0.0"
dependencies = [
 "queue",
]

[[package]]
name = "queue"
version = "3.0.0"
dependencies = [
 "threads",
]

[[package]]
name = "window"
version = "9.0.0"
dependencies = [
 "oracle",
]
"#;

    #[test]
    fn what_the_oracle_needs_is_found_and_nothing_else() {
        let found = packages_below("oracle", LOCK);
        assert_eq!(
            found.iter().map(String::as_str).collect::<Vec<_>>(),
            ["maths 0.2.0", "oracle 0.1.0", "queue 3.0.0", "threads 1.0.0"]
        );
        assert!(packages_below("nothing", LOCK).is_empty());
    }

    #[test]
    fn the_workspace_has_the_oracle_in_its_lock() {
        let root = crate::paths::workspace_root();
        let lock = fs::read_to_string(root.join("Cargo.lock")).expect("a lock");
        let found = packages_below(PACKAGE, &lock);
        for name in ["spectral-reference ", "spectral-core ", "glam ", "rayon "] {
            assert!(found.iter().any(|package| package.starts_with(name)), "{name}: {found:?}");
        }
        assert!(!found.iter().any(|package| package.starts_with("wgpu ")), "{found:?}");
        assert_eq!(oracle_version(&root).expect("a version").len(), 64);
    }
}
