//! Heights from and to OpenEXR files.

use std::path::Path;

use exr::prelude::*;

use crate::error::PondError;
use crate::height_field::HeightField;

impl HeightField {
    /// The channel `h`, `Y` or `Z` of an EXR file, or its only channel, as heights in metres; the file's first row is the one of
    /// the smallest y.
    ///
    /// # Errors
    /// A file that cannot be read or has no such channel, heights that are NaN or infinite, a pond without extent.
    pub fn from_exr(path: &Path, extent_m: [f64; 2]) -> std::result::Result<Self, PondError> {
        let failed = |problem: String| PondError::File { path: path.to_path_buf(), problem };
        let image = read_first_flat_layer_from_file(path)
            .map_err(|error| failed(format!("cannot be read as an EXR of heights: {error}")))?;
        let layer = &image.layer_data;
        let channels = &layer.channel_data.list;
        let named = |name: &str| channels.iter().find(|c| c.name.eq(name));
        let channel = match channels.as_slice() {
            [only] => only,
            _ => ["h", "Y", "Z"].into_iter().find_map(named).ok_or_else(|| {
                let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
                failed(format!(
                    "has the channels {}; heights must be `h`, `Y`, `Z` or the only one",
                    names.join(", ")
                ))
            })?,
        };
        let heights_m = channel.sample_data.values_as_f32().map(f64::from).collect();
        let size = [layer.size.width(), layer.size.height()];
        Self::from_values(size, extent_m, heights_m).map_err(|error| match error {
            PondError::Setting { .. } => error,
            _ => failed(error.to_string()),
        })
    }

    /// Write the heights, metres, as the 32-bit channel `h`.
    ///
    /// # Errors
    /// What the file system says.
    pub fn to_exr(&self, path: &Path) -> std::result::Result<(), PondError> {
        let failed = |problem: String| PondError::File { path: path.to_path_buf(), problem };
        self.check()?;
        let samples = self.heights_m.iter().map(|&h| h as f32).collect();
        let channel = AnyChannel::new("h", FlatSamples::F32(samples));
        let layer = Layer::new(
            (self.size[0], self.size[1]),
            LayerAttributes::default(),
            Encoding::SMALL_LOSSLESS,
            AnyChannels::sort(std::iter::once(channel).collect()),
        );
        Image::from_layer(layer)
            .write()
            .to_file(path)
            .map_err(|error| failed(format!("cannot be written: {error}")))
    }
}
