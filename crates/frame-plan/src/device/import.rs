//! What hosts hand over.

use std::fmt::Debug;

use crate::{Resource, ResourceKind, TextureFormat};

/// A host's buffer or texture, with its format in the API's terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImportShape<F> {
    /// A buffer.
    Buffer {
        /// Its size.
        size_bytes: u64,
    },
    /// A 2-D texture.
    Texture {
        /// Texel format.
        format: F,
        /// Width and height of level 0.
        size: [u32; 2],
        /// Array layers.
        layers: u32,
        /// Mip levels.
        mips: u32,
    },
}

/// Why a host's resource cannot be the imported one, if it cannot.
pub fn import_problem<F: PartialEq + Debug>(
    resource: &Resource,
    got: &ImportShape<F>,
    format_of: impl Fn(TextureFormat) -> F,
) -> Option<String> {
    match (&resource.kind, got) {
        (ResourceKind::Buffer { size_bytes: wanted }, ImportShape::Buffer { size_bytes }) => {
            (size_bytes != wanted).then(|| format!("has {size_bytes} bytes, the plan wants {wanted}"))
        }
        (
            &ResourceKind::Texture {
                format: wanted,
                size: [wide, high],
                layers: least_layers,
                mips: least_mips,
            },
            ImportShape::Texture { format, size: [width, height], layers, mips },
        ) => {
            let wanted = format_of(wanted);
            if *format != wanted {
                Some(format!("is {format:?}, the plan wants {wanted:?}"))
            } else if [*width, *height] != [wide, high] {
                Some(format!("is {width} x {height}, the plan wants {wide} x {high}"))
            } else if *layers < least_layers || *mips < least_mips {
                Some(format!(
                    "has {layers} layers and {mips} levels, the plan wants {least_layers} and {least_mips}"
                ))
            } else {
                None
            }
        }
        _ => Some("is of another kind than the plan's".into()),
    }
}
