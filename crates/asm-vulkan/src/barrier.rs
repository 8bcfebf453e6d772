//! Barriers, derived from what commands do with resources.
//!
//! Every buffer, and every level of every layer of a texture, is a piece with a state: the last write, the reads that have seen
//! it, its layout. A command says how it uses which pieces; what must come between that use and the earlier ones follows. States
//! are kept from frame to frame, so that a frame also waits for just what it needs of the one before.

use ash::vk;
use frame_plan::{Plan, ResourceKind, Subresource, TextureFormat};

use crate::conv;
use crate::device::Gpu;

/// How a command uses a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Access {
    pub(crate) stages: vk::PipelineStageFlags2,
    pub(crate) access: vk::AccessFlags2,
    /// Of a texture.
    pub(crate) layout: vk::ImageLayout,
    pub(crate) writes: bool,
}

impl Access {
    const fn new(
        stages: vk::PipelineStageFlags2,
        access: vk::AccessFlags2,
        layout: vk::ImageLayout,
        writes: bool,
    ) -> Self {
        Self { stages, access, layout, writes }
    }

    pub(crate) const COPY_FROM: Self = Self::new(
        vk::PipelineStageFlags2::COPY,
        vk::AccessFlags2::TRANSFER_READ,
        vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        false,
    );
    pub(crate) const COPY_TO: Self = Self::new(
        vk::PipelineStageFlags2::COPY,
        vk::AccessFlags2::TRANSFER_WRITE,
        vk::ImageLayout::TRANSFER_DST_OPTIMAL,
        true,
    );
    /// Of a whole resource. Filling a buffer counts as a copy for some and as a clear for others.
    pub(crate) const CLEAR: Self = Self::new(
        vk::PipelineStageFlags2::ALL_TRANSFER,
        vk::AccessFlags2::TRANSFER_WRITE,
        vk::ImageLayout::TRANSFER_DST_OPTIMAL,
        true,
    );
    pub(crate) const ARGUMENTS: Self = Self::new(
        vk::PipelineStageFlags2::DRAW_INDIRECT,
        vk::AccessFlags2::INDIRECT_COMMAND_READ,
        vk::ImageLayout::UNDEFINED,
        false,
    );

    pub(crate) const fn params(stages: vk::PipelineStageFlags2) -> Self {
        Self::new(stages, vk::AccessFlags2::UNIFORM_READ, vk::ImageLayout::UNDEFINED, false)
    }

    /// A storage buffer that a shader reads.
    pub(crate) const fn read(stages: vk::PipelineStageFlags2) -> Self {
        Self::new(stages, vk::AccessFlags2::SHADER_STORAGE_READ, vk::ImageLayout::UNDEFINED, false)
    }

    /// A storage buffer that a shader writes, and may read.
    pub(crate) fn write(stages: vk::PipelineStageFlags2) -> Self {
        let access = vk::AccessFlags2::SHADER_STORAGE_READ | vk::AccessFlags2::SHADER_STORAGE_WRITE;
        Self::new(stages, access, vk::ImageLayout::UNDEFINED, true)
    }

    pub(crate) const fn sampled(stages: vk::PipelineStageFlags2) -> Self {
        let layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        Self::new(stages, vk::AccessFlags2::SHADER_SAMPLED_READ, layout, false)
    }

    pub(crate) const fn storage_image(stages: vk::PipelineStageFlags2) -> Self {
        Self::new(stages, vk::AccessFlags2::SHADER_STORAGE_WRITE, vk::ImageLayout::GENERAL, true)
    }

    /// A colour target whose contents are read where they are kept or added to.
    pub(crate) fn color_target(reads: bool) -> Self {
        let read = if reads { vk::AccessFlags2::COLOR_ATTACHMENT_READ } else { vk::AccessFlags2::NONE };
        Self::new(
            vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
            vk::AccessFlags2::COLOR_ATTACHMENT_WRITE | read,
            vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            true,
        )
    }

    pub(crate) fn depth_target() -> Self {
        Self::new(
            vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS,
            vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ
                | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE,
            vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
            true,
        )
    }
}

/// A command's use of a resource, or of part of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Use {
    pub(crate) slot: Slot,
    /// Of a texture; `None` means all of it.
    pub(crate) part: Option<Subresource>,
    pub(crate) access: Access,
}

/// What a use is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slot {
    /// A resource of the plan.
    Resource(usize),
    /// The buffer of all uniform blocks.
    Params,
}

/// What has happened to a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct State {
    write_stages: vk::PipelineStageFlags2,
    write_access: vk::AccessFlags2,
    /// Stages and accesses, all of the one with all of the other, that have seen the last write.
    read_stages: vk::PipelineStageFlags2,
    read_access: vk::AccessFlags2,
    layout: vk::ImageLayout,
}

impl State {
    const NEW: Self = Self {
        write_stages: vk::PipelineStageFlags2::NONE,
        write_access: vk::AccessFlags2::NONE,
        read_stages: vk::PipelineStageFlags2::NONE,
        read_access: vk::AccessFlags2::NONE,
        layout: vk::ImageLayout::UNDEFINED,
    };

    /// Somebody else has done something with it.
    const fn foreign(layout: vk::ImageLayout) -> Self {
        Self {
            write_stages: vk::PipelineStageFlags2::ALL_COMMANDS,
            write_access: vk::AccessFlags2::MEMORY_WRITE,
            read_stages: vk::PipelineStageFlags2::NONE,
            read_access: vk::AccessFlags2::NONE,
            layout,
        }
    }

    /// Take the next use in, and say what must come before it. `layout` is the one it needs.
    fn follow(&mut self, next: Access, layout: vk::ImageLayout) -> Option<Dependency> {
        let before = self.write_stages | self.read_stages;
        let seen = self.read_stages.contains(next.stages) && self.read_access.contains(next.access);
        let relayout = layout != self.layout;
        if !next.writes && !relayout {
            let unseen = !self.write_stages.is_empty() && !seen;
            self.read_stages |= next.stages;
            self.read_access |= next.access;
            return unseen.then_some(Dependency {
                src_stages: self.write_stages,
                src_access: self.write_access,
                dst_stages: self.read_stages,
                dst_access: self.read_access,
                old_layout: layout,
                new_layout: layout,
            });
        }
        let dependency = Dependency {
            src_stages: before,
            src_access: self.write_access,
            dst_stages: next.stages,
            dst_access: next.access,
            old_layout: self.layout,
            new_layout: layout,
        };
        *self = if next.writes {
            Self {
                write_stages: next.stages,
                write_access: next.access & WRITES,
                read_stages: vk::PipelineStageFlags2::NONE,
                read_access: vk::AccessFlags2::NONE,
                layout,
            }
        } else {
            // The change of layout writes, in the barrier itself: later readers in other stages wait for this one's.
            Self {
                write_stages: next.stages,
                write_access: vk::AccessFlags2::NONE,
                read_stages: next.stages,
                read_access: next.access,
                layout,
            }
        };
        (relayout || !before.is_empty()).then_some(dependency)
    }
}

const WRITES: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::SHADER_STORAGE_WRITE.as_raw()
        | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw()
        | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()
        | vk::AccessFlags2::TRANSFER_WRITE.as_raw()
        | vk::AccessFlags2::MEMORY_WRITE.as_raw(),
);

/// What a barrier orders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Dependency {
    src_stages: vk::PipelineStageFlags2,
    src_access: vk::AccessFlags2,
    dst_stages: vk::PipelineStageFlags2,
    dst_access: vk::AccessFlags2,
    old_layout: vk::ImageLayout,
    new_layout: vk::ImageLayout,
}

/// The states of all pieces of a plan, and the barriers that the next command needs.
pub(crate) struct Tracker {
    pieces: Vec<Pieces>,
    params: State,
    memory: vk::MemoryBarrier2<'static>,
    images: Vec<vk::ImageMemoryBarrier2<'static>>,
}

enum Pieces {
    Buffer(State),
    /// Level by level, all layers of each.
    Texture {
        image: vk::Image,
        format: TextureFormat,
        layers: u32,
        mips: u32,
        states: Vec<State>,
    },
    None,
}

impl Tracker {
    /// Nothing has happened yet. `image` gives the images of textures.
    pub(crate) fn new(plan: &Plan, image: impl Fn(usize) -> vk::Image) -> Self {
        let pieces = plan.resources.iter().enumerate().map(|(i, resource)| match resource.kind {
            ResourceKind::Buffer { .. } => Pieces::Buffer(State::NEW),
            ResourceKind::Texture { format, layers, mips, .. } => {
                let states = vec![State::NEW; (layers * mips) as usize];
                Pieces::Texture { image: image(i), format, layers, mips, states }
            }
            ResourceKind::Sampler { .. } => Pieces::None,
        });
        Self {
            pieces: pieces.collect(),
            params: State::NEW,
            memory: vk::MemoryBarrier2::default(),
            images: Vec::new(),
        }
    }

    /// A resource has another image, or the host has used it since: nothing but its layout is known.
    pub(crate) fn hand_over(&mut self, resource: usize, new_image: vk::Image, layout: vk::ImageLayout) {
        match &mut self.pieces[resource] {
            Pieces::Buffer(state) => *state = State::foreign(vk::ImageLayout::UNDEFINED),
            Pieces::Texture { image, states, .. } => {
                *image = new_image;
                states.fill(State::foreign(layout));
            }
            Pieces::None => {}
        }
    }

    /// The host may do anything with a resource from here on.
    pub(crate) fn hand_back(&mut self, resource: usize, layout: vk::ImageLayout) {
        let access = Access {
            stages: vk::PipelineStageFlags2::ALL_COMMANDS,
            access: vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE,
            layout,
            writes: true,
        };
        self.follow(&Use { slot: Slot::Resource(resource), part: None, access });
    }

    /// Take a use in, and add what must come before it to the next barrier.
    pub(crate) fn follow(&mut self, next: &Use) {
        let Self { pieces, params, memory, images } = self;
        let state = match next.slot {
            Slot::Params => params,
            Slot::Resource(resource) => match &mut pieces[resource] {
                Pieces::Buffer(state) => state,
                Pieces::Texture { image, format, layers, mips, states } => {
                    let whole = Subresource { base_mip: 0, mips: *mips, base_layer: 0, layers: *layers };
                    let part = next.part.unwrap_or(whole);
                    let place = ImagePlace { image: *image, aspect: conv::aspect(*format) };
                    follow_texture(states, *layers, part, next.access, |dependency, part| {
                        images.push(place.barrier(dependency, part));
                    });
                    return;
                }
                Pieces::None => return,
            },
        };
        if let Some(dependency) = state.follow(next.access, vk::ImageLayout::UNDEFINED) {
            memory.src_stage_mask |= dependency.src_stages;
            memory.src_access_mask |= dependency.src_access;
            memory.dst_stage_mask |= dependency.dst_stages;
            memory.dst_access_mask |= dependency.dst_access;
        }
    }

    /// Record the barrier that the uses since the last one need, if they need one.
    pub(crate) fn record(&mut self, device: &ash::Device, commands: vk::CommandBuffer) {
        let memory = [std::mem::take(&mut self.memory)];
        let needed = !memory[0].dst_stage_mask.is_empty();
        if !needed && self.images.is_empty() {
            return;
        }
        let dependency = vk::DependencyInfo::default()
            .memory_barriers(if needed { &memory } else { &[] })
            .image_memory_barriers(&self.images);
        // SAFETY: the command buffer is being recorded, outside of any rendering; the images are alive and in the layouts that
        // their states say.
        unsafe { device.cmd_pipeline_barrier2(commands, &dependency) };
        self.images.clear();
    }
}

/// Record the change of a host's colour image from one layout to another, between anything before and anything after.
pub(crate) fn color_image(
    gpu: &Gpu,
    commands: vk::CommandBuffer,
    image: vk::Image,
    (old_layout, new_layout): (vk::ImageLayout, vk::ImageLayout),
) {
    let dependency = Dependency {
        src_stages: vk::PipelineStageFlags2::ALL_COMMANDS,
        src_access: vk::AccessFlags2::MEMORY_WRITE,
        dst_stages: vk::PipelineStageFlags2::ALL_COMMANDS,
        dst_access: vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE,
        old_layout,
        new_layout,
    };
    let place = ImagePlace { image, aspect: vk::ImageAspectFlags::COLOR };
    let barriers = [place.barrier(dependency, Subresource::FIRST)];
    let dependency = vk::DependencyInfo::default().image_memory_barriers(&barriers);
    // SAFETY: the commands are being recorded outside of any rendering; the host's image is alive and in the old layout.
    unsafe { gpu.device.cmd_pipeline_barrier2(commands, &dependency) }
}

struct ImagePlace {
    image: vk::Image,
    aspect: vk::ImageAspectFlags,
}

impl ImagePlace {
    fn barrier(&self, dependency: Dependency, part: Subresource) -> vk::ImageMemoryBarrier2<'static> {
        vk::ImageMemoryBarrier2::default()
            .src_stage_mask(dependency.src_stages)
            .src_access_mask(dependency.src_access)
            .dst_stage_mask(dependency.dst_stages)
            .dst_access_mask(dependency.dst_access)
            .old_layout(dependency.old_layout)
            .new_layout(dependency.new_layout)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(self.image)
            .subresource_range(range(self.aspect, part))
    }
}

/// Take a use of part of a texture in; equal neighbours share a barrier.
fn follow_texture(
    states: &mut [State],
    layers: u32,
    part: Subresource,
    next: Access,
    mut barrier: impl FnMut(Dependency, Subresource),
) {
    let mut open: Option<(Dependency, Subresource)> = None;
    for mip in part.base_mip..part.base_mip + part.mips {
        for layer in part.base_layer..part.base_layer + part.layers {
            let state = &mut states[(mip * layers + layer) as usize];
            let Some(dependency) = state.follow(next, next.layout) else { continue };
            let piece = Subresource { base_mip: mip, mips: 1, base_layer: layer, layers: 1 };
            open = Some(match open.take() {
                Some((same, run)) if same == dependency && grows(&run, &piece) => (same, grown(run)),
                Some((other, run)) => {
                    barrier(other, run);
                    (dependency, piece)
                }
                None => (dependency, piece),
            });
        }
    }
    if let Some((dependency, run)) = open {
        barrier(dependency, run);
    }
}

/// Whether `piece` is the next layer of a run within a level.
const fn grows(run: &Subresource, piece: &Subresource) -> bool {
    run.base_mip == piece.base_mip && run.base_layer + run.layers == piece.base_layer
}

const fn grown(run: Subresource) -> Subresource {
    Subresource { layers: run.layers + 1, ..run }
}

/// Part of a texture, as Vulkan says it.
pub(crate) const fn range(aspect: vk::ImageAspectFlags, part: Subresource) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask: aspect,
        base_mip_level: part.base_mip,
        level_count: part.mips,
        base_array_layer: part.base_layer,
        layer_count: part.layers,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COMPUTE: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::COMPUTE_SHADER;
    const FRAGMENT: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::FRAGMENT_SHADER;
    const NO_LAYOUT: vk::ImageLayout = vk::ImageLayout::UNDEFINED;

    fn follow(state: &mut State, access: Access) -> Option<Dependency> {
        state.follow(access, NO_LAYOUT)
    }

    #[test]
    fn reads_wait_for_the_write_once() {
        let mut state = State::NEW;
        assert_eq!(follow(&mut state, Access::write(COMPUTE)), None, "the first use waits for nothing");
        let after_write = follow(&mut state, Access::read(COMPUTE)).unwrap();
        assert_eq!((after_write.src_stages, after_write.dst_stages), (COMPUTE, COMPUTE));
        assert_eq!(after_write.src_access, vk::AccessFlags2::SHADER_STORAGE_WRITE);
        assert_eq!(follow(&mut state, Access::read(COMPUTE)), None, "seen");
        let elsewhere = follow(&mut state, Access::read(FRAGMENT)).unwrap();
        assert!(elsewhere.dst_stages.contains(FRAGMENT));
        assert_eq!(elsewhere.src_stages, COMPUTE);
    }

    /// Two readers that see a write do not see it with each other's accesses.
    #[test]
    fn what_is_seen_is_seen_by_stage_and_access() {
        let mut state = State::NEW;
        follow(&mut state, Access::write(COMPUTE));
        follow(&mut state, Access::read(COMPUTE));
        let arguments = follow(&mut state, Access::ARGUMENTS).unwrap();
        assert!(arguments.dst_access.contains(vk::AccessFlags2::INDIRECT_COMMAND_READ));
        // The barrier above covers both stages with both accesses, so nothing is missing for this one.
        assert_eq!(follow(&mut state, Access::ARGUMENTS), None);
    }

    #[test]
    fn writes_wait_for_reads_and_writes() {
        let mut state = State::NEW;
        assert_eq!(follow(&mut state, Access::read(COMPUTE)), None);
        let after_read = follow(&mut state, Access::write(COMPUTE)).unwrap();
        assert_eq!((after_read.src_stages, after_read.src_access), (COMPUTE, vk::AccessFlags2::NONE));
        let after_write = follow(&mut state, Access::CLEAR).unwrap();
        assert_eq!(after_write.src_access, vk::AccessFlags2::SHADER_STORAGE_WRITE);
        assert_eq!(after_write.dst_stages, vk::PipelineStageFlags2::ALL_TRANSFER);
    }

    #[test]
    fn layouts_change_with_the_use() {
        let mut state = State::NEW;
        let access = Access::color_target(false);
        let first = state.follow(access, access.layout).unwrap();
        assert_eq!((first.old_layout, first.new_layout), (NO_LAYOUT, access.layout));
        assert_eq!(first.src_stages, vk::PipelineStageFlags2::NONE);
        let sampled = Access::sampled(COMPUTE);
        let second = state.follow(sampled, sampled.layout).unwrap();
        assert_eq!((second.old_layout, second.new_layout), (access.layout, sampled.layout));
        assert_eq!(state.follow(sampled, sampled.layout), None);
        let other_stage = Access::sampled(FRAGMENT);
        let third = state.follow(other_stage, sampled.layout).unwrap();
        assert_eq!((third.old_layout, third.new_layout), (sampled.layout, sampled.layout));
        assert_eq!(third.src_stages, COMPUTE, "through the stage that waited for the change of layout");
    }

    #[test]
    fn layers_in_one_state_share_a_barrier_and_levels_do_not() {
        let mut states = vec![State::NEW; 3 * 2];
        let mut barriers = Vec::new();
        let whole = Subresource { base_mip: 0, mips: 2, base_layer: 0, layers: 3 };
        follow_texture(&mut states, 3, whole, Access::COPY_TO, |_, part| barriers.push(part));
        assert_eq!(
            barriers.iter().map(|b| (b.base_mip, b.base_layer, b.layers)).collect::<Vec<_>>(),
            [(0, 0, 3), (1, 0, 3)]
        );
        barriers.clear();
        let one = Subresource { base_layer: 1, ..Subresource::FIRST };
        follow_texture(&mut states, 3, one, Access::sampled(COMPUTE), |_, _| {});
        follow_texture(&mut states, 3, whole, Access::sampled(COMPUTE), |_, part| barriers.push(part));
        let places: Vec<_> = barriers.iter().map(|b| (b.base_mip, b.base_layer, b.layers)).collect();
        assert_eq!(places, [(0, 0, 1), (0, 2, 1), (1, 0, 3)], "the layer in between has its layout");
    }
}
