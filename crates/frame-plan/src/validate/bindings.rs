//! Bindings of a step against those of its pass.

use super::{Check, Checker};
use crate::{Binding, BindingKind, Bound, PassInfo, PassKind, PassStep, ResourceKind, TextureFormat};

impl Checker<'_> {
    pub(super) fn bindings(&self, info: &PassInfo, step: &PassStep) -> Check {
        if step.bindings.len() != info.bindings.len() {
            return Err(format!("{} bindings, the pass has {}", step.bindings.len(), info.bindings.len()));
        }
        let draws = matches!(info.kind, PassKind::Draw { .. });
        for (binding, bound) in info.bindings.iter().zip(&step.bindings) {
            let writes = matches!(binding.kind, BindingKind::Write | BindingKind::StorageTexture { .. });
            if draws && writes {
                return Err(format!("binding {:?}: draws only read, add to atomics, and draw", binding.name));
            }
            self.binding(binding, bound)
                .map_err(|problem| format!("binding {:?}: {problem}", binding.name))?;
        }
        Ok(())
    }

    fn binding(&self, binding: &Binding, bound: &Bound) -> Check {
        match binding.kind {
            BindingKind::Read | BindingKind::Write | BindingKind::Atomic | BindingKind::ReadAtomic => {
                let size = self.buffer(bound.resource)?;
                let max = self.limits.max_storage_binding_bytes;
                if size > max {
                    let name = &self.resource(bound.resource)?.name;
                    return Err(format!("buffer {name:?} has {size} bytes, a binding takes {max}"));
                }
                if bound.part.is_some() {
                    return Err("a buffer has no parts".into());
                }
                Ok(())
            }
            BindingKind::Texture { uint, array, .. } => {
                let texture = self.texture(bound.resource)?;
                if (texture.format == TextureFormat::R32Uint) != uint
                    || texture.format == TextureFormat::Depth32Float
                {
                    let wanted = if uint { "unsigned" } else { "float" };
                    return Err(format!("{:?} is {:?}, not {wanted}", texture.name, texture.format));
                }
                self.layers(bound, array)
            }
            BindingKind::DepthTexture => {
                let texture = self.texture(bound.resource)?;
                if texture.format != TextureFormat::Depth32Float {
                    return Err(format!("{:?} is {:?}, not depth", texture.name, texture.format));
                }
                self.layers(bound, false)
            }
            BindingKind::StorageTexture { format } => {
                let texture = self.texture(bound.resource)?;
                if texture.format != format {
                    return Err(format!("{:?} is {:?}, not {format:?}", texture.name, texture.format));
                }
                texture.single(bound.part).map(drop)
            }
            BindingKind::Sampler { filter } => self.sampler(bound, filter),
        }
    }

    fn layers(&self, bound: &Bound, array: bool) -> Check {
        let texture = self.texture(bound.resource)?;
        let part = texture.part(bound.part)?;
        if !array && part.layers != 1 {
            return Err(format!("{} layers of {:?} where one is needed", part.layers, texture.name));
        }
        Ok(())
    }

    fn sampler(&self, bound: &Bound, filter: bool) -> Check {
        let resource = self.resource(bound.resource)?;
        match resource.kind {
            ResourceKind::Sampler { linear: true, .. } if !filter => {
                Err(format!("{:?} is linear, but the pass does not filter", resource.name))
            }
            ResourceKind::Sampler { .. } => Ok(()),
            _ => Err(format!("{:?} is not a sampler", resource.name)),
        }
    }

    /// A buffer is either of atomics, in all passes, or of none.
    pub(super) fn atomics(&self) -> Check {
        let mut uses: Vec<Option<(bool, &str)>> = vec![None; self.plan.resources.len()];
        let mut problem = None;
        self.plan.for_each_pass(&mut |step| {
            let bindings = self.passes.get(&step.pass).map_or(&[][..], |p| p.bindings);
            for (binding, bound) in bindings.iter().zip(&step.bindings) {
                let atomic = match binding.kind {
                    BindingKind::Atomic | BindingKind::ReadAtomic => true,
                    BindingKind::Read | BindingKind::Write => false,
                    _ => continue,
                };
                let index = bound.resource.0 as usize;
                let (first, pass) = *uses[index].get_or_insert((atomic, &step.pass));
                if first != atomic && problem.is_none() {
                    let (with, without) = if first { (pass, &*step.pass) } else { (&*step.pass, pass) };
                    problem = Some(format!(
                        "buffer {:?} is bound as atomics by {with} and as plain words by {without}",
                        self.plan.resources[index].name
                    ));
                }
            }
        });
        problem.map_or(Ok(()), Err)
    }
}
