//! The steps of a plan as commands that only have to be recorded.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;
use frame_plan::{
    BindingKind, Bound, ExecuteError, Load, PassInfo, PassKind, PassSet, PassStep, Plan, ResourceId,
    ResourceKind, Step, Subresource, Target, Targets, TextureFormat,
};

use crate::barrier::{Access, Slot, Tracker, Use};
use crate::conv;
use crate::descriptor::{self, Entry};
use crate::device::{Gpu, device_error};
use crate::object::Owned;
use crate::pipeline::Pipelines;
use crate::resources::{Held, ParamsBuffer};
use crate::timing::Timing;
use crate::upload::layers;

/// Colour targets of a pass are at most this many.
const MAX_TARGETS: usize = 4;

/// All steps of a plan, with their descriptor sets and views.
pub(crate) struct Program {
    steps: Vec<Vec<Recordable>>,
    /// What commands refer to.
    _views: HashMap<ViewKey, Owned<vk::ImageView>>,
    _pool: Option<Owned<vk::DescriptorPool>>,
}

/// Part of a texture, and whether shaders see it as an array.
type ViewKey = (ResourceId, Subresource, bool);

/// A command and what it uses.
struct Recordable {
    uses: Vec<Use>,
    command: Command,
}

enum Command {
    Dispatch { pass: Bindings, groups: Count<[u32; 3]> },
    Draw(Box<Draw>),
    ClearBuffer(ResourceId),
    CopyBuffer { source: ResourceId, target: ResourceId, region: vk::BufferCopy },
    CopyTexture { source: ResourceId, target: ResourceId, region: vk::ImageCopy },
}

struct Draw {
    pass: Bindings,
    color: Vec<Attachment>,
    depth: Option<Attachment>,
    size: [u32; 2],
    /// Vertices and instances.
    counts: Count<[u32; 2]>,
}

struct Attachment {
    view: TargetView,
    layout: vk::ImageLayout,
    load: vk::AttachmentLoadOp,
    clear: vk::ClearValue,
}

enum TargetView {
    Ours(vk::ImageView),
    /// The view that the host has handed over with its image.
    Hosts(ResourceId),
}

/// A pipeline, its descriptor set, and the offset of the uniform block if there is one.
struct Bindings {
    pipeline: vk::Pipeline,
    layout: vk::PipelineLayout,
    set: vk::DescriptorSet,
    offset: Option<u32>,
}

enum Count<T> {
    Known(T),
    Indirect(ResourceId, u64),
}

/// What commands are made from.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) gpu: &'a Arc<Gpu>,
    pub(crate) plan: &'a Plan,
    pub(crate) passes: &'a PassSet,
    pub(crate) pipelines: &'a Pipelines,
    pub(crate) resources: &'a [Held],
    pub(crate) params: &'a ParamsBuffer,
}

/// What commands are recorded into and with.
pub(crate) struct Recording<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) commands: vk::CommandBuffer,
    pub(crate) resources: &'a [Held],
    pub(crate) tracker: &'a mut Tracker,
}

impl Program {
    pub(crate) fn new(source: &Source<'_>) -> Result<Self, ExecuteError> {
        let mut builder =
            Builder { source: *source, sets: HashMap::new(), views: HashMap::new(), pool: None };
        builder.create_pool()?;
        let mut steps = Vec::new();
        for step in &source.plan.steps {
            let mut commands = Vec::new();
            builder.add(step, 0, &mut commands)?;
            steps.push(commands);
        }
        Ok(Self { steps, _views: builder.views, _pool: builder.pool })
    }

    /// Record a frame.
    pub(crate) fn record(&self, recording: &mut Recording<'_>, timing: Option<&Timing>) {
        for (i, step) in (0..).zip(&self.steps) {
            if let Some(timing) = timing {
                timing.mark(recording.gpu, recording.commands, i);
            }
            for recordable in step {
                recordable.uses.iter().for_each(|next| recording.tracker.follow(next));
                recording.tracker.record(&recording.gpu.device, recording.commands);
                recording.command(&recordable.command);
            }
        }
        if let Some(timing) = timing {
            timing.mark(recording.gpu, recording.commands, self.steps.len() as u32);
        }
    }
}

impl Recording<'_> {
    fn command(&self, command: &Command) {
        let (device, commands) = (&self.gpu.device, self.commands);
        match command {
            Command::Dispatch { pass, groups } => {
                self.bind(pass, vk::PipelineBindPoint::COMPUTE);
                // SAFETY: the commands are being recorded outside of any rendering, pipeline and set are bound; the plan's
                // validation keeps counts and ranges inside limits and buffers, its passes clamp what they write as counts.
                unsafe {
                    match groups {
                        Count::Known([x, y, z]) => device.cmd_dispatch(commands, *x, *y, *z),
                        Count::Indirect(buffer, offset) => {
                            device.cmd_dispatch_indirect(commands, self.buffer(*buffer), *offset);
                        }
                    }
                }
            }
            Command::Draw(draw) => self.draw(draw),
            Command::ClearBuffer(buffer) => {
                // SAFETY: the commands are being recorded; the buffer is a copy target and its size a multiple of 4.
                unsafe { device.cmd_fill_buffer(commands, self.buffer(*buffer), 0, vk::WHOLE_SIZE, 0) }
            }
            Command::CopyBuffer { source, target, region } => {
                let (source, target) = (self.buffer(*source), self.buffer(*target));
                // SAFETY: the commands are being recorded; validated ranges of two buffers made for it.
                unsafe { device.cmd_copy_buffer(commands, source, target, &[*region]) }
            }
            Command::CopyTexture { source, target, region } => {
                let (from, to) = (Access::COPY_FROM.layout, Access::COPY_TO.layout);
                let (source, target) = (self.image(*source), self.image(*target));
                // SAFETY: the commands are being recorded; validated levels of images made for it, in these layouts.
                unsafe { device.cmd_copy_image(commands, source, from, target, to, &[*region]) }
            }
        }
    }

    fn bind(&self, pass: &Bindings, point: vk::PipelineBindPoint) {
        let (device, commands) = (&self.gpu.device, self.commands);
        // SAFETY: the commands are being recorded; pipeline, layout and set belong together and are alive, the offset is that
        // of a block in the parameters' buffer.
        unsafe {
            device.cmd_bind_pipeline(commands, point, pass.pipeline);
            device.cmd_bind_descriptor_sets(
                commands,
                point,
                pass.layout,
                0,
                &[pass.set],
                pass.offset.as_slice(),
            );
        }
    }

    fn draw(&self, draw: &Draw) {
        let (device, commands) = (&self.gpu.device, self.commands);
        let color: [_; MAX_TARGETS] = std::array::from_fn(|i| {
            draw.color.get(i).map_or_else(vk::RenderingAttachmentInfo::default, |a| self.attachment(a))
        });
        let depth = draw.depth.as_ref().map(|a| self.attachment(a));
        let [width, height] = draw.size;
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let mut rendering = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&color[..draw.color.len()]);
        if let Some(depth) = &depth {
            rendering = rendering.depth_attachment(depth);
        }
        // SAFETY: the commands are being recorded outside of any rendering; the views are alive, of this size and in the layouts
        // they name, the pipeline was made for their formats; counts as in a dispatch.
        unsafe {
            device.cmd_begin_rendering(commands, &rendering);
            set_viewport(device, commands, draw.size);
            self.bind(&draw.pass, vk::PipelineBindPoint::GRAPHICS);
            match &draw.counts {
                Count::Known([vertices, instances]) => device.cmd_draw(commands, *vertices, *instances, 0, 0),
                Count::Indirect(buffer, offset) => {
                    device.cmd_draw_indirect(commands, self.buffer(*buffer), *offset, 1, 0);
                }
            }
            device.cmd_end_rendering(commands);
        }
    }

    fn attachment(&self, attachment: &Attachment) -> vk::RenderingAttachmentInfo<'static> {
        let view = match attachment.view {
            TargetView::Ours(view) => view,
            TargetView::Hosts(id) => match &self.resources[id.0 as usize] {
                Held::HostImage(host) => host.view.unwrap_or_default(),
                _ => unreachable!("made for a host's view"),
            },
        };
        vk::RenderingAttachmentInfo::default()
            .image_view(view)
            .image_layout(attachment.layout)
            .load_op(attachment.load)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(attachment.clear)
    }

    fn buffer(&self, id: ResourceId) -> vk::Buffer {
        self.resources[id.0 as usize].buffer().expect("validated as a buffer")
    }

    fn image(&self, id: ResourceId) -> vk::Image {
        self.resources[id.0 as usize].image().expect("validated as a texture")
    }
}

/// Draw over a whole target whose y points down while clip space's points up: the viewport's height is negative.
///
/// # Safety
/// `commands` are being recorded.
pub(crate) unsafe fn set_viewport(device: &ash::Device, commands: vk::CommandBuffer, size: [u32; 2]) {
    let [width, height] = size.map(|s| s as f32);
    let viewport = vk::Viewport { x: 0.0, y: height, width, height: -height, min_depth: 0.0, max_depth: 1.0 };
    let extent = vk::Extent2D { width: size[0], height: size[1] };
    let scissor = vk::Rect2D { offset: vk::Offset2D::default(), extent };
    // SAFETY: as the function demands; the viewport is within the limits that the target's size was checked against.
    unsafe {
        device.cmd_set_viewport(commands, 0, &[viewport]);
        device.cmd_set_scissor(commands, 0, &[scissor]);
    }
}

/// Makes commands; equal descriptor sets and views are made once.
struct Builder<'a> {
    source: Source<'a>,
    sets: HashMap<(&'static str, Vec<Bound>), vk::DescriptorSet>,
    views: HashMap<ViewKey, Owned<vk::ImageView>>,
    pool: Option<Owned<vk::DescriptorPool>>,
}

impl Builder<'_> {
    /// A pool with room for a set per step that runs a pass.
    fn create_pool(&mut self) -> Result<(), ExecuteError> {
        let mut seen = HashMap::new();
        self.source.plan.for_each_pass(&mut |step| {
            let info = self.source.passes.get(&step.pass).expect("validated pass name");
            seen.insert((info.name, &step.bindings), info);
        });
        let infos: Vec<_> = seen.into_values().collect();
        self.pool = descriptor::pool(self.source.gpu, &infos)?;
        Ok(())
    }

    fn add(
        &mut self,
        step: &Step,
        iteration: u32,
        commands: &mut Vec<Recordable>,
    ) -> Result<(), ExecuteError> {
        match step {
            Step::Dispatch { pass, groups } => {
                if !groups.contains(&0) {
                    commands.push(self.dispatch(pass, Count::Known(*groups), iteration)?);
                }
            }
            Step::DispatchIndirect { pass, arguments, offset_bytes } => {
                let mut dispatch =
                    self.dispatch(pass, Count::Indirect(*arguments, *offset_bytes), iteration)?;
                dispatch.uses.push(whole(*arguments, Access::ARGUMENTS));
                commands.push(dispatch);
            }
            Step::Draw { pass, targets, vertices, instances } => {
                commands.push(self.draw(pass, targets, Count::Known([*vertices, *instances]), iteration)?);
            }
            Step::DrawIndirect { pass, targets, arguments, offset_bytes } => {
                let counts = Count::Indirect(*arguments, *offset_bytes);
                let mut draw = self.draw(pass, targets, counts, iteration)?;
                draw.uses.push(whole(*arguments, Access::ARGUMENTS));
                commands.push(draw);
            }
            Step::ClearBuffer { buffer } => commands.push(Recordable {
                uses: vec![whole(*buffer, Access::CLEAR)],
                command: Command::ClearBuffer(*buffer),
            }),
            Step::CopyBuffer { source, source_offset_bytes, target, target_offset_bytes, size_bytes } => {
                if *size_bytes > 0 {
                    let region = vk::BufferCopy::default()
                        .src_offset(*source_offset_bytes)
                        .dst_offset(*target_offset_bytes)
                        .size(*size_bytes);
                    commands.push(Recordable {
                        uses: vec![whole(*source, Access::COPY_FROM), whole(*target, Access::COPY_TO)],
                        command: Command::CopyBuffer { source: *source, target: *target, region },
                    });
                }
            }
            Step::CopyTexture { source, source_part, target, target_part } => {
                let (format, [width, height]) = self.texture(*source, source_part.base_mip);
                let region = vk::ImageCopy::default()
                    .src_subresource(layers(format, *source_part))
                    .dst_subresource(layers(format, *target_part))
                    .extent(vk::Extent3D { width, height, depth: 1 });
                commands.push(Recordable {
                    uses: vec![
                        part(*source, *source_part, Access::COPY_FROM),
                        part(*target, *target_part, Access::COPY_TO),
                    ],
                    command: Command::CopyTexture { source: *source, target: *target, region },
                });
            }
            Step::Repeat { iterations, .. } => {
                for (iteration, steps) in (0..).zip(iterations) {
                    steps.iter().try_for_each(|step| self.add(step, iteration, commands))?;
                }
            }
        }
        Ok(())
    }

    fn dispatch(
        &mut self,
        step: &PassStep,
        groups: Count<[u32; 3]>,
        iteration: u32,
    ) -> Result<Recordable, ExecuteError> {
        let (pass, uses) = self.bindings(step, iteration)?;
        Ok(Recordable { uses, command: Command::Dispatch { pass, groups } })
    }

    fn draw(
        &mut self,
        step: &PassStep,
        targets: &Targets,
        counts: Count<[u32; 2]>,
        iteration: u32,
    ) -> Result<Recordable, ExecuteError> {
        let (pass, mut uses) = self.bindings(step, iteration)?;
        let info = self.source.passes.get(&step.pass).expect("validated pass name");
        let adds = matches!(info.kind, PassKind::Draw { additive: true, .. });
        let mut color = Vec::new();
        let mut size = [0; 2];
        for target in &targets.color {
            let (format, target_size) = self.texture(target.texture, target.mip);
            size = target_size;
            let (load, clear) = conv::color_load(format, target.load);
            let access = Access::color_target(adds || target.load == Load::Keep);
            uses.push(part(target.texture, target_part(target), access));
            let view = self.target(target)?;
            color.push(Attachment { view, layout: access.layout, load, clear });
        }
        let mut depth = None;
        if let Some(target) = &targets.depth {
            let (_, target_size) = self.texture(target.texture, target.mip);
            size = target_size;
            let (load, clear) = conv::depth_load(target.load);
            let access = Access::depth_target();
            uses.push(part(target.texture, target_part(target), access));
            depth = Some(Attachment { view: self.target(target)?, layout: access.layout, load, clear });
        }
        let draw = Draw { pass, color, depth, size, counts };
        Ok(Recordable { uses, command: Command::Draw(Box::new(draw)) })
    }

    /// What a pass binds, and its uses of that.
    fn bindings(&mut self, step: &PassStep, iteration: u32) -> Result<(Bindings, Vec<Use>), ExecuteError> {
        let info = self.source.passes.get(&step.pass).expect("validated pass name");
        let pipeline = self.source.pipelines.get(info.name);
        let (pipeline, layout) = (pipeline.pipeline.raw(), pipeline.layout.raw());
        let offset = step.params.map(|id| self.source.params.layout.offset(id, iteration));
        let key = (info.name, step.bindings.clone());
        let set = match self.sets.get(&key) {
            Some(set) => *set,
            None => {
                let set = self.set(info, step)?;
                self.sets.insert(key, set);
                set
            }
        };
        Ok((Bindings { pipeline, layout, set, offset }, uses(info, step)))
    }

    fn set(&mut self, info: &'static PassInfo, step: &PassStep) -> Result<vk::DescriptorSet, ExecuteError> {
        let mut entries = Vec::new();
        if let (Some(buffer), true) = (&self.source.params.buffer, info.params_bytes > 0) {
            entries.push(Entry::Params(buffer.raw(), u64::from(info.params_bytes)));
        }
        for (binding, bound) in info.bindings.iter().zip(&step.bindings) {
            let held = &self.source.resources[bound.resource.0 as usize];
            entries.push(match binding.kind {
                BindingKind::Read | BindingKind::ReadAtomic | BindingKind::Write | BindingKind::Atomic => {
                    Entry::Buffer(held.buffer().expect("validated as a buffer"))
                }
                BindingKind::Texture { array, .. } => {
                    Entry::Sampled(self.view(bound.resource, bound.part, array)?)
                }
                BindingKind::DepthTexture => Entry::Sampled(self.view(bound.resource, bound.part, false)?),
                BindingKind::StorageTexture { .. } => {
                    Entry::Storage(self.view(bound.resource, bound.part, false)?)
                }
                BindingKind::Sampler { .. } => match held {
                    Held::Sampler(sampler) => Entry::Sampler(sampler.raw()),
                    _ => unreachable!("validated as a sampler"),
                },
            });
        }
        let pool = self.pool.as_ref().ok_or_else(|| device_error("no descriptor pool".into()))?;
        let layout = &self.source.pipelines.get(info.name).set_layout;
        let set = descriptor::set(self.source.gpu, pool, layout)?;
        descriptor::write(self.source.gpu, set, &entries);
        Ok(set)
    }

    fn view(
        &mut self,
        id: ResourceId,
        part: Option<Subresource>,
        array: bool,
    ) -> Result<vk::ImageView, ExecuteError> {
        let ResourceKind::Texture { format, layers, mips, .. } =
            self.source.plan.resources[id.0 as usize].kind
        else {
            unreachable!("validated as a texture")
        };
        let part = part.unwrap_or(Subresource { base_mip: 0, mips, base_layer: 0, layers });
        if let Some(view) = self.views.get(&(id, part, array)) {
            return Ok(view.raw());
        }
        let image = self.source.resources[id.0 as usize].image().expect("validated as a texture");
        let view = descriptor::view(self.source.gpu, image, format, part, array)?;
        let raw = view.raw();
        self.views.insert((id, part, array), view);
        Ok(raw)
    }

    fn target(&mut self, target: &Target) -> Result<TargetView, ExecuteError> {
        match &self.source.resources[target.texture.0 as usize] {
            Held::HostImage(host) if host.view.is_some() && (target.mip, target.layer) == (0, 0) => {
                Ok(TargetView::Hosts(target.texture))
            }
            _ => self.view(target.texture, Some(target_part(target)), false).map(TargetView::Ours),
        }
    }

    /// Format of a texture and size of a level.
    fn texture(&self, id: ResourceId, mip: u32) -> (TextureFormat, [u32; 2]) {
        match self.source.plan.resources[id.0 as usize].kind {
            ResourceKind::Texture { format, size, .. } => (format, size.map(|s| (s >> mip).max(1))),
            _ => unreachable!("validated as a texture"),
        }
    }
}

const fn target_part(target: &Target) -> Subresource {
    Subresource { base_mip: target.mip, mips: 1, base_layer: target.layer, layers: 1 }
}

const fn whole(resource: ResourceId, access: Access) -> Use {
    Use { slot: Slot::Resource(resource.0 as usize), part: None, access }
}

const fn part(resource: ResourceId, part: Subresource, access: Access) -> Use {
    Use { slot: Slot::Resource(resource.0 as usize), part: Some(part), access }
}

/// What the shaders of a step do with its resources.
fn uses(info: &PassInfo, step: &PassStep) -> Vec<Use> {
    let stages = |kind| pipeline_stages(conv::stages(info, kind));
    let mut uses = Vec::new();
    if step.params.is_some() {
        let access = Access::params(pipeline_stages(conv::all_stages(info)));
        uses.push(Use { slot: Slot::Params, part: None, access });
    }
    for (binding, bound) in info.bindings.iter().zip(&step.bindings) {
        let stages = stages(binding.kind);
        let access = match binding.kind {
            BindingKind::Read | BindingKind::ReadAtomic => Access::read(stages),
            BindingKind::Write | BindingKind::Atomic => Access::write(stages),
            BindingKind::Texture { .. } | BindingKind::DepthTexture => Access::sampled(stages),
            BindingKind::StorageTexture { .. } => Access::storage_image(stages),
            BindingKind::Sampler { .. } => continue,
        };
        uses.push(Use { slot: Slot::Resource(bound.resource.0 as usize), part: bound.part, access });
    }
    uses
}

fn pipeline_stages(stages: vk::ShaderStageFlags) -> vk::PipelineStageFlags2 {
    [
        (vk::ShaderStageFlags::COMPUTE, vk::PipelineStageFlags2::COMPUTE_SHADER),
        (vk::ShaderStageFlags::VERTEX, vk::PipelineStageFlags2::VERTEX_SHADER),
        (vk::ShaderStageFlags::FRAGMENT, vk::PipelineStageFlags2::FRAGMENT_SHADER),
    ]
    .into_iter()
    .filter(|(stage, _)| stages.contains(*stage))
    .fold(vk::PipelineStageFlags2::NONE, |all, (_, stage)| all | stage)
}
