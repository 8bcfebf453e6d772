//! Where things lie in the workspace.

use std::env;
use std::path::{Path, PathBuf};

/// The workspace's root folder.
///
/// Cargo states this package's folder when it runs the program; a program started by hand falls back to
/// where it was built.
pub(crate) fn workspace_root() -> PathBuf {
    let package =
        env::var_os("CARGO_MANIFEST_DIR").map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from);
    package.parent().map_or_else(|| package.clone(), Path::to_path_buf)
}

/// Where everything generated goes; never part of a commit.
pub(crate) fn target() -> PathBuf {
    workspace_root().join("target")
}
