//! Folders of ours that hold other people's programs and libraries.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Environment variables for child processes.
pub(crate) type Environment = Vec<(&'static str, OsString)>;

/// Where the dynamic linker looks first.
const LIBRARY_PATH: &str = "LD_LIBRARY_PATH";

/// Fill a folder beside `root`, and put it into `root`'s place only when it is whole.
///
/// # Errors
/// What `fill` says; an unwritable folder.
pub(crate) fn create(root: &Path, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let parent = root.parent().context("an unpacked folder has a parent")?;
    fs::create_dir_all(parent).with_context(|| format!("cannot create {}", parent.display()))?;
    let partial = root.with_extension(format!("partial-{}", std::process::id()));
    // What an interrupted run of the same process number left.
    let _ = fs::remove_dir_all(&partial);
    let made = fs::create_dir(&partial)
        .with_context(|| format!("cannot create {}", partial.display()))
        .and_then(|()| fill(&partial))
        .and_then(|()| {
            if root.exists() {
                fs::remove_dir_all(root)?;
            }
            fs::rename(&partial, root).with_context(|| format!("cannot create {}", root.display()))
        });
    if made.is_err() {
        // What could not be created cannot be removed either: the first error is the one to tell.
        let _ = fs::remove_dir_all(&partial);
    }
    made
}

/// Put the libraries of a folder before those that processes with `environment` find now.
pub(crate) fn put_libraries_first(root: &Path, environment: &mut Environment) {
    let set = environment.iter().position(|(name, _)| *name == LIBRARY_PATH);
    let now = match set {
        Some(i) => environment.swap_remove(i).1,
        None => env::var_os(LIBRARY_PATH).unwrap_or_default(),
    };
    let rest = env::split_paths(&now).filter(|path| !path.as_os_str().is_empty());
    // Only a path with a colon in it cannot be joined, and no loader could be told about that one.
    let all = env::join_paths(library_folders(root).into_iter().chain(rest)).unwrap_or(now.clone());
    environment.push((LIBRARY_PATH, all));
}

/// Folders of `root` that hold shared libraries: packages use `usr/lib`, `lib`, and one folder a platform in each.
fn library_folders(root: &Path) -> Vec<PathBuf> {
    let mut folders: Vec<_> = files_under(root)
        .iter()
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with("lib") && name.contains(".so")
        })
        .filter_map(|path| path.parent())
        .filter(|folder| folder.strip_prefix(root).is_ok_and(|f| f.components().count() <= 3))
        .map(Path::to_path_buf)
        .collect();
    folders.sort();
    folders.dedup();
    folders
}

/// All files below a folder, symbolic links included; folders that cannot be read count as empty.
pub(crate) fn files_under(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => files.extend(files_under(&entry.path())),
            _ => files.push(entry.path()),
        }
    }
    files.sort();
    files
}
