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

/// What a moving picture is.
#[derive(Clone, Copy, Debug)]
pub struct Animation {
    /// Of every frame.
    pub size: Size,
    /// How many.
    pub frames: usize,
    /// Seconds that each is shown, to the millisecond.
    pub step_s: f64,
}

/// Write sRGB-encoded frames as an animated PNG that repeats for ever; `frame(i)` is asked for one after the other.
///
/// # Errors
/// What `frame` or the file system says; the target is then what it was before.
pub fn write_animation<E: From<std::io::Error> + From<EncodingError>>(
    file: &AtomicFile,
    animation: Animation,
    mut frame: impl FnMut(usize) -> Result<Vec<[u8; 3]>, E>,
) -> Result<(), E> {
    file.write(|content| {
        let mut encoder = rgb(content, animation.size);
        encoder.set_animated(animation.frames as u32, 0)?;
        encoder.set_frame_delay((1e3 * animation.step_s).round() as u16, 1000)?;
        let mut writer = encoder.write_header()?;
        for number in 0..animation.frames {
            writer.write_image_data(frame(number)?.as_flattened())?;
        }
        Ok(writer.finish()?)
    })
}

fn encode(content: impl Write, size: Size, srgb: &[[u8; 3]]) -> Result<(), EncodingError> {
    let mut writer = rgb(content, size).write_header()?;
    writer.write_image_data(srgb.as_flattened())?;
    writer.finish()
}

fn rgb<'a, W: Write>(content: W, size: Size) -> Encoder<'a, W> {
    let mut encoder = Encoder::new(content, size.width, size.height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    encoder
}
