//! PNG: 8-bit sRGB, marked as such.

use std::io::Write;

use png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};

use super::atomic_file::AtomicFile;
use crate::values::Size;

/// The file of an sRGB-encoded picture, row-major from the top row, for instance to embed it in a report.
///
/// # Errors
/// If `srgb` has another number of texels than `size`.
pub fn bytes(size: Size, srgb: &[[u8; 3]]) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    encode(&mut bytes, size, srgb)?;
    Ok(bytes)
}

/// Write an sRGB-encoded picture, row-major from the top row.
///
/// # Errors
/// What the file system says; the target is then what it was before.
pub fn write(file: &AtomicFile, size: Size, srgb: &[[u8; 3]]) -> Result<(), EncodingError> {
    file.write(|content| encode(content, size, srgb))
}

fn encode(content: impl Write, size: Size, srgb: &[[u8; 3]]) -> Result<(), EncodingError> {
    let mut encoder = Encoder::new(content, size.width, size.height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(srgb.as_flattened())?;
    writer.finish()
}
