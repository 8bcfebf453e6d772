//! Where floors go: one file, numbered files, or an animation. All of it appears, or nothing.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use caustic_heightfield::numbered_name;
use png::EncodingError;

use super::color::{Image, Pixels};
use crate::error::CliError;
use crate::output::atomic_file::AtomicFile;
use crate::output::exr::{Channel, ExrImage};
use crate::output::png::{self as png_file, Animation};
use crate::picture::Picture;
use crate::targets::{self, ImageFormat};
use crate::values::{Exposure, Size};

/// Where floors go.
pub(super) enum Output {
    One(AtomicFile, ImageFormat),
    Numbered(Vec<AtomicFile>, ImageFormat),
    Animation(AtomicFile),
}

/// Frames and the time between them.
#[derive(Clone, Copy)]
pub(super) struct Series {
    pub(super) frames: usize,
    pub(super) step_s: f64,
}

impl Output {
    /// A file for one floor; for a series the name of an `.apng`, or one with `#` signs for the frames' numbers.
    ///
    /// # Errors
    /// Names with other extensions, files that cannot be written.
    pub(super) fn new(path: &Path, series: Option<Series>) -> Result<Self, CliError> {
        let Some(series) = series else {
            let (file, format) = targets::picture(path)?;
            return Ok(Self::One(file, format));
        };
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("apng")) {
            return targets::any(path).map(Self::Animation);
        }
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let mut files = Vec::with_capacity(series.frames);
        let mut format = ImageFormat::Exr;
        for frame in 0..series.frames {
            let Some(name) = numbered_name(name, frame) else {
                return Err(CliError::Usage(format!(
                    "--output {}: a series goes to files with # signs for the frames' numbers, as in floor-####.exr or .png, or to \
                     one .apng",
                    path.display()
                )));
            };
            let (file, of_file) = targets::picture(&path.with_file_name(name))?;
            files.push(file);
            format = of_file;
        }
        Ok(Self::Numbered(files, format))
    }

    /// The statistics' file, none of these.
    ///
    /// # Errors
    /// A file that is, or that cannot be written.
    pub(super) fn stats(&self, path: Option<&Path>) -> Result<Option<AtomicFile>, CliError> {
        let files = match self {
            Self::One(file, _) | Self::Animation(file) => std::slice::from_ref(file),
            Self::Numbered(files, _) => files,
        };
        files.iter().try_fold(None, |_, file| targets::stats(path, file))
    }

    /// Write all floors, each made when its turn comes; `exposure` is for pictures, and auto is what the first frame asks for.
    ///
    /// # Errors
    /// What `floor` says, or the file system; nothing is written then.
    pub(super) fn write(
        &self,
        series: Series,
        exposure: Exposure,
        mut floor: impl FnMut(usize) -> Result<Image, CliError>,
    ) -> Result<(), CliError> {
        let mut screen = Screen { exposure };
        match self {
            Self::One(file, format) => {
                let image = floor(0)?;
                write_image(image, *format, &mut screen, file, file.path())
            }
            Self::Numbered(files, format) => {
                let folder = folder_of(files[0].path());
                let failed = |error: io::Error| CliError::write(folder, &error);
                let unfinished =
                    tempfile::Builder::new().prefix(".spectral-").tempdir_in(folder).map_err(failed)?;
                let mut finished: Vec<(PathBuf, &Path)> = Vec::with_capacity(files.len());
                for (frame, file) in files.iter().enumerate() {
                    let name = file.path().file_name().unwrap_or_default();
                    let image = floor(frame)?;
                    let waiting = AtomicFile::new(&unfinished.path().join(name)).map_err(failed)?;
                    write_image(image, *format, &mut screen, &waiting, file.path())?;
                    finished.push((waiting.path().to_path_buf(), file.path()));
                }
                for (waiting, path) in finished {
                    fs::rename(&waiting, path).map_err(|error| CliError::write(path, &error))?;
                }
                Ok(())
            }
            Self::Animation(file) => {
                let first = floor(0)?;
                let shape = Animation { size: size_of(&first), frames: series.frames, step_s: series.step_s };
                let mut first = Some(first);
                let frames = |frame: usize| -> Result<Vec<[u8; 3]>, Unwritten> {
                    let image = match first.take() {
                        Some(image) => image,
                        None => floor(frame).map_err(Unwritten::Frame)?,
                    };
                    screen.srgb8(image).map_err(Unwritten::Frame)
                };
                png_file::write_animation(file, shape, frames).map_err(|error| match error {
                    Unwritten::Frame(error) => error,
                    Unwritten::File(error) => unwritable(file.path(), error),
                })
            }
        }
    }
}

/// Why an animation was not written.
enum Unwritten {
    /// There was no frame.
    Frame(CliError),
    /// There was no file.
    File(EncodingError),
}

impl From<io::Error> for Unwritten {
    fn from(error: io::Error) -> Self {
        Self::File(error.into())
    }
}

impl From<EncodingError> for Unwritten {
    fn from(error: EncodingError) -> Self {
        Self::File(error)
    }
}

/// What all pictures of a series are exposed with.
struct Screen {
    exposure: Exposure,
}

impl Screen {
    fn srgb8(&mut self, image: Image) -> Result<Vec<[u8; 3]>, CliError> {
        let picture = Picture { size: size_of(&image), xyz: image.pixels.xyz() };
        picture.check()?;
        let display = picture.display(self.exposure);
        // One exposure for a series: it would flicker.
        self.exposure = Exposure::Factor(display.exposure);
        Ok(picture.srgb8(&display))
    }
}

fn write_image(
    image: Image,
    format: ImageFormat,
    screen: &mut Screen,
    file: &AtomicFile,
    path: &Path,
) -> Result<(), CliError> {
    let size = size_of(&image);
    match format {
        ImageFormat::Exr => exr(image).write(file).map_err(|error| unwritable(path, error)),
        ImageFormat::Png => {
            png_file::write(file, size, &screen.srgb8(image)?).map_err(|error| unwritable(path, error))
        }
    }
}

fn unwritable(path: &Path, error: impl std::fmt::Display) -> CliError {
    CliError::failed(format!("cannot write {}: {error}", path.display()))
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

fn size_of(image: &Image) -> Size {
    let [width, height] = image.size.map(|side| side as u32);
    Size { width, height }
}

fn exr(image: Image) -> ExrImage {
    let size = size_of(&image);
    let channel = |name: &str, samples: Vec<f32>| Channel { name: name.into(), samples };
    let channels = match &image.pixels {
        Pixels::Y(values) => vec![channel("Y", values.iter().map(|&y| y as f32).collect())],
        Pixels::Xyz(values) => ["X", "Y", "Z"]
            .into_iter()
            .enumerate()
            .map(|(c, name)| channel(name, values.iter().map(|xyz| xyz[c] as f32).collect()))
            .collect(),
    };
    ExrImage {
        size,
        channels,
        comments: "Irradiance on the floor of a pond, Y in the unit of the light's; with dispersion as CIE XYZ. Row 0 is the \
                   smallest y, column 0 the smallest x.",
        rgb_space: None,
    }
}
