//! A file that appears whole or not at all.
//!
//! Writability is probed when the target is chosen, which is before the long computation; the content goes to a
//! temporary file beside the target and is renamed over it when it is complete. So a failure never destroys an
//! older file, and a reader never sees half a new one. Devices and pipes (`/dev/stdout`) cannot be renamed over:
//! they get the complete content in one go.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Cursor, Seek, Write};
use std::path::{Path, PathBuf};

/// A place to write to that was found writable.
#[derive(Debug)]
pub struct AtomicFile {
    path: PathBuf,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// Written beside and renamed; `target` has symbolic links resolved, so that a link stays a link.
    Regular { folder: PathBuf, target: PathBuf },
    /// A device or pipe, written directly.
    Device,
}

/// What content is written into.
pub trait WriteSeek: Write + Seek {}
impl<T: Write + Seek> WriteSeek for T {}

impl AtomicFile {
    /// Choose `path` as the target and check that it can be written, leaving nothing behind.
    ///
    /// # Errors
    /// A missing or unwritable folder, a folder or a read-only file in the place of the target.
    pub fn new(path: &Path) -> io::Result<Self> {
        let target = match fs::canonicalize(path) {
            Ok(target) => target,
            Err(e) if e.kind() == io::ErrorKind::NotFound => path.to_path_buf(),
            Err(e) => return Err(e),
        };
        let kind = match fs::metadata(&target) {
            Ok(found) if found.is_dir() => {
                return Err(io::Error::new(io::ErrorKind::IsADirectory, "there is a folder of that name"));
            }
            Ok(found) if !found.is_file() => {
                // Opening a pipe would wait for its reader, and closing it again would tell that reader it is over.
                if !is_pipe(&found) {
                    OpenOptions::new().write(true).open(&target)?;
                }
                Kind::Device
            }
            Ok(found) if found.permissions().readonly() => {
                return Err(io::Error::new(io::ErrorKind::PermissionDenied, "the file there is read-only"));
            }
            _ => {
                let Some(name) = target.file_name() else {
                    return Err(io::Error::new(
                        io::ErrorKind::InvalidInput,
                        "that is not the name of a file",
                    ));
                };
                let folder = match target.parent() {
                    Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
                    _ => PathBuf::from("."),
                };
                let folder = fs::canonicalize(&folder).map_err(|error| match error.kind() {
                    kind @ io::ErrorKind::NotFound => {
                        io::Error::new(kind, format!("there is no folder {}", folder.display()))
                    }
                    _ => error,
                })?;
                Kind::Regular { target: folder.join(name), folder }
            }
        };
        let file = Self { path: path.to_path_buf(), kind };
        if let Kind::Regular { folder, .. } = &file.kind {
            // Dropped at once: a run that is interrupted during the computation leaves nothing behind.
            temporary_in(folder)?;
        }
        Ok(file)
    }

    /// The path as the user gave it.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Is it a device or a pipe, whose name says nothing about the format?
    #[must_use]
    pub fn is_device(&self) -> bool {
        matches!(self.kind, Kind::Device)
    }

    /// Would one overwrite the other?
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        match (&self.kind, &other.kind) {
            (Kind::Regular { target: a, .. }, Kind::Regular { target: b, .. }) => a == b,
            _ => false,
        }
    }

    /// Let `content` write everything, then put it in place.
    ///
    /// # Errors
    /// What `content` returns, or what the file system says; the target is then what it was before.
    pub fn write<E: From<io::Error>>(
        &self,
        content: impl FnOnce(&mut dyn WriteSeek) -> Result<(), E>,
    ) -> Result<(), E> {
        match &self.kind {
            Kind::Regular { folder, target } => {
                let mut temporary = temporary_in(folder)?;
                let mut writer = BufWriter::new(temporary.as_file_mut());
                content(&mut writer)?;
                writer.flush()?;
                drop(writer);
                temporary.persist(target).map_err(|e| e.error)?;
            }
            Kind::Device => {
                let mut bytes = Cursor::new(Vec::new());
                content(&mut bytes)?;
                let mut device = OpenOptions::new().write(true).open(&self.path)?;
                device.write_all(bytes.get_ref())?;
                device.flush()?;
            }
        }
        Ok(())
    }
}

#[cfg(unix)]
fn is_pipe(found: &fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    found.file_type().is_fifo()
}

#[cfg(not(unix))]
fn is_pipe(_: &fs::Metadata) -> bool {
    false
}

/// A temporary file with the permissions that a new file would have; removed when dropped.
fn temporary_in(folder: &Path) -> io::Result<tempfile::NamedTempFile<File>> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".spectral-").suffix(".tmp");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The umask is applied on top.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}
