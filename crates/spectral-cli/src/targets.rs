//! Where a command writes, chosen and found writable before the work begins.

use std::path::Path;

use serde::Serialize;

use crate::error::CliError;
use crate::output::atomic_file::AtomicFile;

/// What an image file can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ImageFormat {
    Exr,
    Png,
}

/// The file of `render`, by its extension.
pub(crate) fn picture(path: &Path) -> Result<(AtomicFile, ImageFormat), CliError> {
    let (file, format) = with_extension("--output", path, &["exr", "png"])?;
    Ok((file, [ImageFormat::Exr, ImageFormat::Png][format]))
}

/// The file of `bake`.
pub(crate) fn exr(path: &Path) -> Result<AtomicFile, CliError> {
    Ok(with_extension("--output", path, &["exr"])?.0)
}

/// The file of `export`.
pub(crate) fn glb(path: &Path) -> Result<AtomicFile, CliError> {
    Ok(with_extension("--output", path, &["glb"])?.0)
}

/// A picture for the screen, by the option that names it.
pub(crate) fn png(option: &str, path: &Path) -> Result<AtomicFile, CliError> {
    Ok(with_extension(option, path, &["png"])?.0)
}

/// A file of any name.
pub(crate) fn any(path: &Path) -> Result<AtomicFile, CliError> {
    AtomicFile::new(path).map_err(|error| CliError::write(path, &error))
}

/// The statistics' file, another one than `output`.
pub(crate) fn stats(path: Option<&Path>, output: &AtomicFile) -> Result<Option<AtomicFile>, CliError> {
    let Some(path) = path else { return Ok(None) };
    let stats = any(path)?;
    if stats.is_same(output) {
        return Err(CliError::Usage(format!("--output and --stats are the same file, {}", path.display())));
    }
    Ok(Some(stats))
}

/// A writable file whose extension is one of `extensions`, and which. Devices have none and take the first.
fn with_extension(option: &str, path: &Path, extensions: &[&str]) -> Result<(AtomicFile, usize), CliError> {
    let extension = path.extension().unwrap_or_default();
    if let Some(format) = extensions.iter().position(|e| extension.eq_ignore_ascii_case(e)) {
        return Ok((any(path)?, format));
    }
    match AtomicFile::new(path) {
        Ok(file) if file.is_device() => Ok((file, 0)),
        _ => {
            let expected = extensions.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(" or ");
            let problem =
                format!("{option} {}: expected the name of a file that ends in {expected}", path.display());
            Err(CliError::Usage(problem))
        }
    }
}

/// Write `value` as JSON that people can read too.
pub(crate) fn write_json(file: &AtomicFile, value: &impl Serialize) -> Result<(), CliError> {
    let text = json_text(value)?;
    file.write(|content| content.write_all(text.as_bytes()))
        .map_err(|error| CliError::write(file.path(), &error))
}

/// `value` as indented JSON with a newline at its end.
pub(crate) fn json_text(value: &impl Serialize) -> Result<String, CliError> {
    let mut text = serde_json::to_string_pretty(value).map_err(CliError::failed)?;
    text.push('\n');
    Ok(text)
}
