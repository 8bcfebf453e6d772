//! Names, sizes and contents.

use std::collections::HashSet;

use super::{Check, Checker};
use crate::{Lifetime, Params, Resource, ResourceKind, TextureFormat};

/// Layers that WebGPU guarantees.
const MAX_LAYERS: u32 = 256;
/// Bytes of a uniform block that WebGPU guarantees.
const MAX_UNIFORM_BYTES: u32 = 64 << 10;

impl Checker<'_> {
    pub(super) fn resources(&self) -> Check {
        unique("resource", self.plan.resources.iter().map(|r| r.name.as_str()))?;
        unique("params", self.plan.params.iter().map(|p| p.name.as_str()))?;
        let mut total = 0_u64;
        for resource in &self.plan.resources {
            self.size(resource)?;
            contents(resource)?;
            total = total.saturating_add(resource.kind.bytes());
        }
        if total > self.limits.max_total_bytes {
            return Err(format!(
                "all resources together have {total} bytes, the limit is {}",
                self.limits.max_total_bytes
            ));
        }
        self.plan.params.iter().try_for_each(params)
    }

    fn size(&self, resource: &Resource) -> Check {
        let name = &resource.name;
        match resource.kind {
            ResourceKind::Buffer { size_bytes } => {
                if size_bytes == 0 || size_bytes % 4 != 0 {
                    return Err(format!(
                        "buffer {name:?} has {size_bytes} bytes, not a multiple of 4 above 0"
                    ));
                }
                if size_bytes > self.limits.max_buffer_bytes {
                    return Err(format!(
                        "buffer {name:?} has {size_bytes} bytes, the limit is {}",
                        self.limits.max_buffer_bytes
                    ));
                }
            }
            ResourceKind::Texture { size: [width, height], layers, mips, .. } => {
                let max = self.limits.max_texture_size;
                if width == 0 || height == 0 || width > max || height > max {
                    return Err(format!("texture {name:?} is {width} x {height}, allowed are 1 to {max}"));
                }
                if layers == 0 || layers > MAX_LAYERS {
                    return Err(format!(
                        "texture {name:?} has {layers} layers, allowed are 1 to {MAX_LAYERS}"
                    ));
                }
                let most = width.max(height).ilog2() + 1;
                if mips == 0 || mips > most {
                    return Err(format!("texture {name:?} has {mips} mip levels, allowed are 1 to {most}"));
                }
            }
            ResourceKind::Sampler { .. } => {}
        }
        Ok(())
    }
}

fn unique<'a>(what: &str, names: impl Iterator<Item = &'a str>) -> Check {
    let mut seen = HashSet::new();
    for name in names {
        if name.is_empty() {
            return Err(format!("a {what} has no name"));
        }
        if !seen.insert(name) {
            return Err(format!("two {what} entries are named {name:?}"));
        }
    }
    Ok(())
}

fn contents(resource: &Resource) -> Check {
    let name = &resource.name;
    if resource.readable && matches!(resource.kind, ResourceKind::Sampler { .. }) {
        return Err(format!("sampler {name:?} cannot be read back"));
    }
    let Some(initial) = &resource.initial else { return Ok(()) };
    let (got, wanted) = (initial.len() as u64, resource.kind.bytes());
    if got != wanted {
        return Err(format!("{name:?} starts with {got} bytes, but has {wanted}"));
    }
    if resource.lifetime == Lifetime::Imported {
        return Err(format!("{name:?} is imported and cannot have contents of its own"));
    }
    if matches!(resource.kind, ResourceKind::Texture { format: TextureFormat::Depth32Float, .. }) {
        return Err(format!("depth texture {name:?} cannot start with contents, clear it instead"));
    }
    Ok(())
}

fn params(params: &Params) -> Check {
    let (name, stride, bytes) = (&params.name, params.stride_bytes, params.bytes.len());
    if stride == 0 || stride % 16 != 0 || stride > MAX_UNIFORM_BYTES {
        return Err(format!(
            "params {name:?} have blocks of {stride} bytes, not a multiple of 16 up to {MAX_UNIFORM_BYTES}"
        ));
    }
    if bytes == 0 || bytes % stride as usize != 0 {
        return Err(format!("params {name:?} have {bytes} bytes, not a multiple of the block's {stride}"));
    }
    Ok(())
}
