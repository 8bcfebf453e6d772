//! Running steps: binding resources to mirrors, copies and clears.

use std::sync::Mutex;

use super::mirror::Slot;
use super::raster::{self, ColorTarget, Drawing, Ranges, Scratch, Surface};
use super::storage::{Image, Memory, Storage, Texture};
use super::texture::encode;
use super::{MirrorArgs, StorageTextureMut, TextureView};
use crate::{
    BindingKind, Load, Params, PassInfo, PassKind, PassSet, PassStep, ResourceId, Step, Subresource, Target,
    Targets,
};

/// Memory that a step writes, taken out of the storage so that the rest can be lent for reading.
enum Taken {
    Buffer(usize, Memory),
    Image(usize, usize, Image),
}

/// What a frame runs on.
pub(super) struct Frame<'a> {
    pub(super) passes: PassSet,
    pub(super) params: &'a [Params],
    pub(super) storage: &'a mut [Storage],
    pub(super) scratch: &'a mut Scratch,
    pub(super) max_groups: u32,
}

impl Frame<'_> {
    /// Run a step; `iteration` counts in the innermost repeat.
    pub(super) fn run(&mut self, step: &Step, iteration: usize) {
        match step {
            Step::Dispatch { pass, groups } => self.dispatch(pass, *groups, iteration),
            Step::DispatchIndirect { pass, arguments, offset_bytes } => {
                let groups = self.words(*arguments, *offset_bytes).map(|g: u32| g.min(self.max_groups));
                self.dispatch(pass, groups, iteration);
            }
            Step::Draw { pass, targets, vertices, instances } => {
                let ranges =
                    Ranges { vertices: *vertices, instances: *instances, first_vertex: 0, first_instance: 0 };
                self.draw(pass, targets, ranges, iteration);
            }
            Step::DrawIndirect { pass, targets, arguments, offset_bytes } => {
                let [vertices, instances, first_vertex, first_instance] =
                    self.words(*arguments, *offset_bytes);
                self.draw(
                    pass,
                    targets,
                    Ranges { vertices, instances, first_vertex, first_instance },
                    iteration,
                );
            }
            Step::ClearBuffer { buffer } => self.storage[buffer.0 as usize].clear(),
            Step::CopyBuffer { source, source_offset_bytes, target, target_offset_bytes, size_bytes } => {
                let (source, target) = self.pair(*source, *target);
                let (from, to) = (*source_offset_bytes as usize, *target_offset_bytes as usize);
                target.copy_from(to, source, from, *size_bytes as usize);
            }
            Step::CopyTexture { source, source_part, target, target_part } => {
                self.copy_texture(*source, source_part, *target, target_part);
            }
            Step::Repeat { iterations, .. } => {
                for (iteration, steps) in iterations.iter().enumerate() {
                    steps.iter().for_each(|step| self.run(step, iteration));
                }
            }
        }
    }

    fn words<const N: usize>(&self, buffer: ResourceId, offset_bytes: u64) -> [u32; N] {
        let storage = &self.storage[buffer.0 as usize];
        std::array::from_fn(|i| storage.word(offset_bytes as usize + 4 * i))
    }

    fn pair(&mut self, source: ResourceId, target: ResourceId) -> (&Storage, &mut Storage) {
        let [source, target] = self
            .storage
            .get_disjoint_mut([source.0 as usize, target.0 as usize])
            .expect("validation excludes copies within one buffer");
        (source, target)
    }

    fn texture(&mut self, id: ResourceId) -> &mut Texture {
        texture_mut(self.storage, id.0 as usize)
    }

    fn copy_texture(&mut self, source: ResourceId, from: &Subresource, target: ResourceId, to: &Subresource) {
        let texture = self.texture(source);
        let index = texture.image_index(from.base_mip, from.base_layer);
        let image = std::mem::take(&mut texture.images[index]);
        let texture = self.texture(target);
        let target_index = texture.image_index(to.base_mip, to.base_layer);
        let copy = &mut texture.images[target_index];
        copy.texels.bytes_mut().copy_from_slice(image.texels.bytes());
        self.texture(source).images[index] = image;
    }

    fn dispatch(&mut self, step: &PassStep, groups: [u32; 3], iteration: usize) {
        let info = self.info(step);
        let PassKind::Compute { mirror, .. } = info.kind else { unreachable!("validated as a compute pass") };
        if groups.contains(&0) {
            return;
        }
        let mut taken = self.take(info, step);
        mirror(&self.args(info, step, groups, iteration, &mut taken));
        self.put_back(taken);
    }

    fn draw(&mut self, step: &PassStep, targets: &Targets, ranges: Ranges, iteration: usize) {
        let info = self.info(step);
        let PassKind::Draw { depth, cull, additive, vertex, fragment, .. } = info.kind else {
            unreachable!("validated as a draw pass")
        };
        let mut color: Vec<_> = targets.color.iter().map(|t| self.take_target(t)).collect();
        let mut depth_target = targets.depth.as_ref().map(|t| self.take_target(t));
        let mut scratch = std::mem::take(self.scratch);
        let mut taken = self.take(info, step);
        {
            let args = self.args(info, step, [0; 3], iteration, &mut taken);
            let size = color.first().or(depth_target.as_ref()).map_or([0; 2], |image| image.size);
            let formats = targets.color.iter().map(|t| self.format(t.texture));
            let mut surface = Surface {
                size,
                color: color
                    .iter_mut()
                    .zip(formats)
                    .map(|(image, format)| ColorTarget { format, texels: image.texels.bytes_mut() })
                    .collect(),
                depth: depth_target.as_mut().map(|image| image.texels.bytes_mut()),
            };
            let drawing = Drawing { args: &args, vertex, fragment, cull, depth, additive };
            raster::draw(&drawing, ranges, &mut surface, &mut scratch);
        }
        self.put_back(taken);
        *self.scratch = scratch;
        for (target, image) in targets.color.iter().zip(color).chain(targets.depth.iter().zip(depth_target)) {
            let texture = self.texture(target.texture);
            let index = texture.image_index(target.mip, target.layer);
            texture.images[index] = image;
        }
    }

    fn format(&self, id: ResourceId) -> crate::TextureFormat {
        texture(self.storage, id.0 as usize).format
    }

    fn info(&self, step: &PassStep) -> &'static PassInfo {
        self.passes.get(&step.pass).expect("validated pass name")
    }

    /// Take a target's image out, cleared if it asks for that.
    fn take_target(&mut self, target: &Target) -> Image {
        let texture = self.texture(target.texture);
        let format = texture.format;
        let index = texture.image_index(target.mip, target.layer);
        let mut image = std::mem::take(&mut texture.images[index]);
        if let Load::Clear(value) = target.load {
            for texel in image.texels.bytes_mut().chunks_exact_mut(format.bytes_per_texel() as usize) {
                encode(format, value, texel);
            }
        }
        image
    }

    /// Take what the step writes out of the storage, in binding order.
    fn take(&mut self, info: &PassInfo, step: &PassStep) -> Vec<Taken> {
        let mut taken = Vec::new();
        for (binding, bound) in info.bindings.iter().zip(&step.bindings) {
            let index = bound.resource.0 as usize;
            match (binding.kind, &mut self.storage[index]) {
                (BindingKind::Write, Storage::Buffer(memory)) => {
                    taken.push(Taken::Buffer(index, std::mem::take(memory)));
                }
                (BindingKind::StorageTexture { .. }, Storage::Texture(texture)) => {
                    let part = bound.part.unwrap_or(texture.whole());
                    let image = texture.image_index(part.base_mip, part.base_layer);
                    taken.push(Taken::Image(index, image, std::mem::take(&mut texture.images[image])));
                }
                _ => {}
            }
        }
        taken
    }

    fn put_back(&mut self, taken: Vec<Taken>) {
        for taken in taken {
            match taken {
                Taken::Buffer(index, memory) => self.storage[index] = Storage::Buffer(memory),
                Taken::Image(index, image, texels) => {
                    texture_mut(self.storage, index).images[image] = texels;
                }
            }
        }
    }

    fn args<'b>(
        &'b self,
        info: &'static PassInfo,
        step: &PassStep,
        groups: [u32; 3],
        iteration: usize,
        taken: &'b mut [Taken],
    ) -> MirrorArgs<'b> {
        let params = step.params.map_or(&[][..], |id| {
            let params = &self.params[id.0 as usize];
            let stride = params.stride_bytes as usize;
            let block = if params.bytes.len() == stride { 0 } else { iteration };
            &params.bytes[block * stride..(block + 1) * stride]
        });
        let mut taken = taken.iter_mut();
        let slots = info
            .bindings
            .iter()
            .zip(&step.bindings)
            .map(|(binding, bound)| {
                let index = bound.resource.0 as usize;
                let slot = match (binding.kind, &self.storage[index]) {
                    (BindingKind::Write | BindingKind::StorageTexture { .. }, _) => match taken.next() {
                        Some(Taken::Buffer(_, memory)) => Slot::Write(Mutex::new(Some(memory.bytes_mut()))),
                        Some(Taken::Image(_, _, image)) => {
                            let format = texture(self.storage, index).format;
                            Slot::StorageTexture(Mutex::new(Some(StorageTextureMut::new(format, image))))
                        }
                        None => unreachable!("every written binding was taken"),
                    },
                    (_, Storage::Buffer(memory)) => Slot::Read(memory.bytes()),
                    (_, Storage::Atomic(words)) => Slot::Atomic(words),
                    (_, Storage::Texture(texture)) => {
                        Slot::Texture(TextureView::new(texture, bound.part.unwrap_or(texture.whole())))
                    }
                    (_, Storage::Sampler) => Slot::Sampler,
                };
                (binding.name, slot)
            })
            .collect();
        MirrorArgs { pass: info.name, groups, params, slots }
    }
}

fn texture(storage: &[Storage], index: usize) -> &Texture {
    match &storage[index] {
        Storage::Texture(texture) => texture,
        _ => unreachable!("validated as a texture"),
    }
}

fn texture_mut(storage: &mut [Storage], index: usize) -> &mut Texture {
    match &mut storage[index] {
        Storage::Texture(texture) => texture,
        _ => unreachable!("validated as a texture"),
    }
}
