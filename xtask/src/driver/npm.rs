//! SwiftShader from an npm package that carries driver, loader and manifest, for systems without apt.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};

use crate::tool;

/// A headless browser's package, in a version that is known to hold the driver; nothing else in it is unpacked, and none of its
/// scripts run.
const PACKAGE: &str = "@sparticuz/chromium@153.0.0";

/// Where the driver is in the package: a tar archive under Brotli.
const ARCHIVE: &str = "package/bin/swiftshader.tar.br";

/// Brotli is part of Node's standard library, and npm does not come without Node.
const UNPACK_BROTLI: &str = "const fs = require('fs'), zlib = require('zlib'); \
     fs.writeFileSync(process.argv[2], zlib.brotliDecompressSync(fs.readFileSync(process.argv[1])))";

/// Download and unpack into `folder`.
///
/// # Errors
/// No npm, node or tar, no network, or a package that no longer holds the driver.
pub(super) fn fetch(folder: &Path) -> Result<()> {
    let packed = tool::run(
        Command::new("npm")
            .args(["pack", "--silent", "--ignore-scripts", "--fetch-retries=1", PACKAGE])
            .current_dir(folder),
    )?;
    let file = packed.lines().last().context("npm pack named no file")?.trim().to_owned();
    tool::run(Command::new("tar").args(["-xzf", &file, ARCHIVE]).current_dir(folder))?;
    tool::run(Command::new("node").args(["-e", UNPACK_BROTLI, ARCHIVE, "driver.tar"]).current_dir(folder))?;
    tool::run(Command::new("tar").args(["-xf", "driver.tar"]).current_dir(folder))?;
    for leftover in [file.as_str(), "driver.tar"] {
        std::fs::remove_file(folder.join(leftover))?;
    }
    std::fs::remove_dir_all(folder.join("package"))?;
    Ok(())
}
