//! OpenEXR: one part, 32-bit float channels, lossless.

use exr::meta::attribute::Chromaticities;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    LineOrder, Text, Vec2, WritableImage,
};
use spectral_core::rgb::RgbSpace;
use spectral_scene::IrradianceMaps;

use super::atomic_file::AtomicFile;
use crate::values::Size;

/// A named plane of the image, row-major from the top row.
pub struct Channel {
    /// Full name, the layer in front of a dot: `Y`, `refracted.Y`.
    pub name: String,
    /// One value per texel.
    pub samples: Vec<f32>,
}

/// What goes into a file.
pub struct ExrImage {
    /// Width and height of every channel.
    pub size: Size,
    /// The planes, in any order.
    pub channels: Vec<Channel>,
    /// What the values mean, for people who open the file.
    pub comments: &'static str,
    /// Primaries and white of the channels R, G and B.
    pub rgb_space: Option<RgbSpace>,
}

impl ExrImage {
    /// Irradiance as `X Y Z` (the total) and `direct.X` ... `reflected.Z`; row 0 is v = 0, column 0 is u = 0.
    #[must_use]
    pub fn from_irradiance(maps: &IrradianceMaps) -> Self {
        let mut channels = planes("", "XYZ", maps.direct.len(), |i| {
            [0, 1, 2].map(|c| maps.direct[i][c] + maps.refracted[i][c] + maps.reflected[i][c])
        });
        let layers =
            [("direct.", &maps.direct), ("refracted.", &maps.refracted), ("reflected.", &maps.reflected)];
        for (layer, values) in layers {
            channels.extend(planes(layer, "XYZ", values.len(), |i| values[i]));
        }
        Self {
            size: Size { width: maps.width, height: maps.height },
            channels,
            comments: "Irradiance on the receiver's UV square as CIE XYZ, Y in lux, texel means: total, direct, \
                       refracted, reflected. Row 0 is v = 0, column 0 is u = 0.",
            rgb_space: None,
        }
    }

    /// A picture in linear sRGB (Rec. 709 primaries, D65), unclamped: colours outside the gamut have negative parts.
    #[must_use]
    pub fn from_linear_srgb(size: Size, linear_srgb: &[[f32; 3]]) -> Self {
        Self {
            size,
            channels: planes("", "RGB", linear_srgb.len(), |i| linear_srgb[i]),
            comments: "Scene-linear sRGB (Rec. 709 primaries, D65) without exposure or gamut map: spectral colours \
                       have negative parts.",
            rgb_space: Some(RgbSpace::SRGB),
        }
    }

    /// Write the file.
    ///
    /// # Errors
    /// Values that are no numbers or infinite; what the file system says. The target is then what it was before.
    pub fn write(self, file: &AtomicFile) -> Result<(), exr::error::Error> {
        for channel in &self.channels {
            let wrong = channel.samples.iter().filter(|v| !v.is_finite()).count();
            if wrong > 0 {
                let problem = format!("{wrong} values of channel {} are not finite", channel.name);
                return Err(exr::error::Error::Invalid(problem.into()));
            }
        }
        let size = Vec2(self.size.width as usize, self.size.height as usize);
        let list = self.channels.into_iter().map(|channel| {
            AnyChannel::new(Text::new_or_panic(channel.name), FlatSamples::F32(channel.samples))
        });
        // One line order whatever the number of threads: equal images make equal files.
        let encoding = Encoding {
            compression: Compression::ZIP16,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        let attributes = LayerAttributes {
            comments: Some(Text::new_or_panic(self.comments)),
            software_name: Some(Text::new_or_panic(concat!("spectral ", env!("CARGO_PKG_VERSION")))),
            ..LayerAttributes::default()
        };
        let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(list.collect()));
        let mut image = Image::from_layer(layer);
        image.attributes.chromaticities = self.rgb_space.as_ref().map(chromaticities);
        file.write(|content| image.write().to_buffered(content))
    }
}

fn planes(layer: &str, names: &str, texels: usize, value: impl Fn(usize) -> [f32; 3]) -> Vec<Channel> {
    let plane = |(c, name)| Channel {
        name: format!("{layer}{name}"),
        samples: (0..texels).map(|i| value(i)[c]).collect(),
    };
    names.chars().enumerate().map(plane).collect()
}

/// Chromaticities (x, y) of the primaries and the white, in the file format's f32.
fn chromaticities(space: &RgbSpace) -> Chromaticities {
    let xy = |[x, y]: [f64; 2]| Vec2(x as f32, y as f32);
    let [red, green, blue] = space.primaries_xy.map(xy);
    let [x, y, z] = space.white_xyz;
    Chromaticities { red, green, blue, white: xy([x / (x + y + z), y / (x + y + z)]) }
}
