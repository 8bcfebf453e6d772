//! The steps of a plan as commands that only have to be recorded.

use std::collections::HashMap;

use frame_plan::{
    BindingKind, Bound, Load, PassInfo, PassSet, PassStep, Plan, ResourceId, ResourceKind, Step, Subresource,
    Target, Targets,
};

use crate::conv;
use crate::device::Gpu;
use crate::pipeline::{PipelineKind, Pipelines};
use crate::resources::{Held, ParamsBuffer};
use crate::timing::Timing;

/// Colour targets of a pass are at most this many.
const MAX_TARGETS: usize = 4;

/// All steps of a plan, with their pipelines, bind groups and views.
pub(crate) struct Program {
    steps: Vec<TopLevelStep>,
}

/// A step of the plan, and how many before it run passes, if it runs any.
struct TopLevelStep {
    commands: Vec<Command>,
    with_passes: Option<u32>,
}

enum Command {
    /// Dispatches that share a compute pass; wgpu puts barriers between them.
    Compute(Vec<Dispatch>),
    Draw(Box<Draw>),
    ClearBuffer(wgpu::Buffer),
    CopyBuffer {
        source: wgpu::Buffer,
        source_offset: u64,
        target: wgpu::Buffer,
        target_offset: u64,
        size: u64,
    },
    CopyTexture {
        source: wgpu::Texture,
        from: Subresource,
        target: wgpu::Texture,
        to: Subresource,
    },
}

impl Command {
    const fn is_pass(&self) -> bool {
        matches!(self, Self::Compute(_) | Self::Draw(_))
    }
}

struct Dispatch {
    pipeline: wgpu::ComputePipeline,
    bindings: Bindings,
    groups: Count<[u32; 3]>,
}

struct Draw {
    pipeline: wgpu::RenderPipeline,
    bindings: Bindings,
    color: Vec<(wgpu::TextureView, Load)>,
    depth: Option<(wgpu::TextureView, Load)>,
    /// Vertices and instances.
    counts: Count<[u32; 2]>,
}

/// A bind group, and the offset of the uniform block if there is one.
struct Bindings {
    group: wgpu::BindGroup,
    offset: Option<u32>,
}

enum Count<T> {
    Known(T),
    Indirect(wgpu::Buffer, u64),
}

/// What commands are made from.
pub(crate) struct Source<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) plan: &'a Plan,
    pub(crate) passes: &'a PassSet,
    pub(crate) pipelines: &'a Pipelines,
    pub(crate) resources: &'a [Held],
    pub(crate) params: &'a ParamsBuffer,
}

impl Program {
    pub(crate) fn new(source: &Source<'_>) -> Self {
        let mut builder = Builder { source, groups: HashMap::new(), views: HashMap::new() };
        let mut count = 0..;
        let steps = source
            .plan
            .steps
            .iter()
            .map(|step| {
                let mut commands = Vec::new();
                builder.add(step, 0, &mut commands);
                let with_passes = if commands.iter().any(Command::is_pass) { count.next() } else { None };
                TopLevelStep { commands, with_passes }
            })
            .collect();
        Self { steps }
    }

    /// Names of the steps that run passes, in order.
    pub(crate) fn names_with_passes(&self, plan: &Plan) -> Vec<String> {
        let names = plan.step_names().into_iter().zip(&self.steps);
        names.filter(|(_, step)| step.with_passes.is_some()).map(|(name, _)| name).collect()
    }

    /// Record a frame.
    pub(crate) fn record(&self, encoder: &mut wgpu::CommandEncoder, timing: Option<&Timing>) {
        for (i, step) in (0..).zip(&self.steps) {
            if let Some(timing) = timing {
                timing.mark(encoder, i);
            }
            let first = step.commands.iter().position(Command::is_pass);
            let last = step.commands.iter().rposition(Command::is_pass);
            let queries = timing.zip(step.with_passes).and_then(|(timing, i)| timing.in_passes(i));
            for (i, command) in step.commands.iter().enumerate() {
                let times = queries.map(|(set, begin, end)| Times {
                    set,
                    begin: (Some(i) == first).then_some(begin),
                    end: (Some(i) == last).then_some(end),
                });
                command.record(encoder, times);
            }
        }
        if let Some(timing) = timing {
            timing.mark(encoder, self.steps.len() as u32);
        }
    }
}

/// Where a pass writes its timestamps.
struct Times<'a> {
    set: &'a wgpu::QuerySet,
    begin: Option<u32>,
    end: Option<u32>,
}

impl Command {
    fn record(&self, encoder: &mut wgpu::CommandEncoder, times: Option<Times<'_>>) {
        match self {
            Self::Compute(dispatches) => {
                let timestamp_writes = times.filter(|t| t.begin.or(t.end).is_some()).map(|times| {
                    wgpu::ComputePassTimestampWrites {
                        query_set: times.set,
                        beginning_of_pass_write_index: times.begin,
                        end_of_pass_write_index: times.end,
                    }
                });
                let mut pass = encoder
                    .begin_compute_pass(&wgpu::ComputePassDescriptor { label: None, timestamp_writes });
                for dispatch in dispatches {
                    pass.set_pipeline(&dispatch.pipeline);
                    pass.set_bind_group(0, &dispatch.bindings.group, dispatch.bindings.offset.as_slice());
                    match &dispatch.groups {
                        Count::Known([x, y, z]) => pass.dispatch_workgroups(*x, *y, *z),
                        Count::Indirect(buffer, offset) => pass.dispatch_workgroups_indirect(buffer, *offset),
                    }
                }
            }
            Self::Draw(draw) => draw.record(encoder, times),
            Self::ClearBuffer(buffer) => encoder.clear_buffer(buffer, 0, None),
            Self::CopyBuffer { source, source_offset, target, target_offset, size } => {
                encoder.copy_buffer_to_buffer(source, *source_offset, target, *target_offset, *size);
            }
            Self::CopyTexture { source, from, target, to } => {
                let size = wgpu::Extent3d { depth_or_array_layers: 1, ..source.size() };
                encoder.copy_texture_to_texture(
                    copy_info(source, *from),
                    copy_info(target, *to),
                    size.mip_level_size(from.base_mip, source.dimension()),
                );
            }
        }
    }
}

fn copy_info(texture: &wgpu::Texture, part: Subresource) -> wgpu::TexelCopyTextureInfo<'_> {
    wgpu::TexelCopyTextureInfo {
        texture,
        mip_level: part.base_mip,
        origin: wgpu::Origin3d { z: part.base_layer, ..wgpu::Origin3d::ZERO },
        aspect: wgpu::TextureAspect::All,
    }
}

impl Draw {
    fn record(&self, encoder: &mut wgpu::CommandEncoder, times: Option<Times<'_>>) {
        let color: [_; MAX_TARGETS] = std::array::from_fn(|i| {
            self.color.get(i).map(|(view, load)| wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: conv::color_load(*load), store: wgpu::StoreOp::Store },
            })
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &color[..self.color.len()],
            depth_stencil_attachment: self.depth.as_ref().map(|(view, load)| {
                wgpu::RenderPassDepthStencilAttachment {
                    view,
                    depth_ops: Some(wgpu::Operations {
                        load: conv::depth_load(*load),
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }
            }),
            timestamp_writes: times.filter(|t| t.begin.or(t.end).is_some()).map(|times| {
                wgpu::RenderPassTimestampWrites {
                    query_set: times.set,
                    beginning_of_pass_write_index: times.begin,
                    end_of_pass_write_index: times.end,
                }
            }),
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings.group, self.bindings.offset.as_slice());
        match &self.counts {
            Count::Known([vertices, instances]) => pass.draw(0..*vertices, 0..*instances),
            Count::Indirect(buffer, offset) => pass.draw_indirect(buffer, *offset),
        }
    }
}

/// Makes commands; equal bind groups and views are made once.
struct Builder<'a> {
    source: &'a Source<'a>,
    groups: HashMap<(&'static str, Vec<Bound>), wgpu::BindGroup>,
    views: HashMap<(ResourceId, Subresource, bool), wgpu::TextureView>,
}

impl Builder<'_> {
    fn add(&mut self, step: &Step, iteration: u32, commands: &mut Vec<Command>) {
        match step {
            Step::Dispatch { pass, groups } => {
                if !groups.contains(&0) {
                    self.add_dispatch(pass, Count::Known(*groups), iteration, commands);
                }
            }
            Step::DispatchIndirect { pass, arguments, offset_bytes } => {
                let count = Count::Indirect(self.buffer(*arguments), *offset_bytes);
                self.add_dispatch(pass, count, iteration, commands);
            }
            Step::Draw { pass, targets, vertices, instances } => {
                let draw = self.draw(pass, targets, Count::Known([*vertices, *instances]), iteration);
                commands.push(draw);
            }
            Step::DrawIndirect { pass, targets, arguments, offset_bytes } => {
                let counts = Count::Indirect(self.buffer(*arguments), *offset_bytes);
                let draw = self.draw(pass, targets, counts, iteration);
                commands.push(draw);
            }
            Step::ClearBuffer { buffer } => commands.push(Command::ClearBuffer(self.buffer(*buffer))),
            Step::CopyBuffer { source, source_offset_bytes, target, target_offset_bytes, size_bytes } => {
                commands.push(Command::CopyBuffer {
                    source: self.buffer(*source),
                    source_offset: *source_offset_bytes,
                    target: self.buffer(*target),
                    target_offset: *target_offset_bytes,
                    size: *size_bytes,
                })
            }
            Step::CopyTexture { source, source_part, target, target_part } => {
                commands.push(Command::CopyTexture {
                    source: self.texture(*source),
                    from: *source_part,
                    target: self.texture(*target),
                    to: *target_part,
                });
            }
            Step::Repeat { iterations, .. } => {
                for (iteration, steps) in (0..).zip(iterations) {
                    steps.iter().for_each(|step| self.add(step, iteration, commands));
                }
            }
        }
    }

    fn add_dispatch(
        &mut self,
        step: &PassStep,
        groups: Count<[u32; 3]>,
        iteration: u32,
        commands: &mut Vec<Command>,
    ) {
        let bindings = self.bindings(step, iteration);
        let PipelineKind::Compute(pipeline) = &self.source.pipelines.get(&step.pass).kind else {
            unreachable!("validated as a compute pass")
        };
        let dispatch = Dispatch { pipeline: pipeline.clone(), bindings, groups };
        match commands.last_mut() {
            Some(Command::Compute(dispatches)) => dispatches.push(dispatch),
            _ => commands.push(Command::Compute(vec![dispatch])),
        }
    }

    fn draw(
        &mut self,
        step: &PassStep,
        targets: &Targets,
        counts: Count<[u32; 2]>,
        iteration: u32,
    ) -> Command {
        let bindings = self.bindings(step, iteration);
        let PipelineKind::Render(pipeline) = &self.source.pipelines.get(&step.pass).kind else {
            unreachable!("validated as a draw pass")
        };
        Command::Draw(Box::new(Draw {
            pipeline: pipeline.clone(),
            bindings,
            color: targets.color.iter().map(|t| (self.target(t), t.load)).collect(),
            depth: targets.depth.as_ref().map(|t| (self.target(t), t.load)),
            counts,
        }))
    }

    fn bindings(&mut self, step: &PassStep, iteration: u32) -> Bindings {
        let info = self.source.passes.get(&step.pass).expect("validated pass name");
        let offset = step.params.map(|id| self.source.params.layout.offset(id, iteration));
        let key = (info.name, step.bindings.clone());
        if let Some(group) = self.groups.get(&key) {
            return Bindings { group: group.clone(), offset };
        }
        let group = self.bind_group(info, step);
        self.groups.insert(key, group.clone());
        Bindings { group, offset }
    }

    fn bind_group(&mut self, info: &'static PassInfo, step: &PassStep) -> wgpu::BindGroup {
        let views: Vec<_> = info
            .bindings
            .iter()
            .zip(&step.bindings)
            .map(|(binding, bound)| {
                let array = matches!(binding.kind, BindingKind::Texture { array: true, .. });
                match self.source.resources[bound.resource.0 as usize] {
                    Held::Texture(_) | Held::View(_) => Some(self.view(bound.resource, bound.part, array)),
                    Held::Buffer(_) | Held::Sampler(_) => None,
                }
            })
            .collect();
        let mut entries = Vec::with_capacity(views.len() + 1);
        if let (Some(buffer), true) = (&self.source.params.buffer, info.params_bytes > 0) {
            entries.push(wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer,
                    offset: 0,
                    size: wgpu::BufferSize::new(u64::from(info.params_bytes)),
                }),
            });
        }
        for ((i, bound), view) in (0..).zip(&step.bindings).zip(&views) {
            let resource = match (&self.source.resources[bound.resource.0 as usize], view) {
                (_, Some(view)) => wgpu::BindingResource::TextureView(view),
                (Held::Buffer(buffer), _) => buffer.as_entire_binding(),
                (Held::Sampler(sampler), _) => wgpu::BindingResource::Sampler(sampler),
                (Held::Texture(_) | Held::View(_), None) => unreachable!("textures have views"),
            };
            entries.push(wgpu::BindGroupEntry { binding: info.binding_index(i), resource });
        }
        self.source.gpu.count(|made| made.bindings += 1);
        self.source.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(info.name),
            layout: &self.source.pipelines.get(info.name).layout,
            entries: &entries,
        })
    }

    fn view(&mut self, id: ResourceId, part: Option<Subresource>, array: bool) -> wgpu::TextureView {
        let texture = match &self.source.resources[id.0 as usize] {
            Held::Texture(texture) => texture,
            Held::View(view) => return view.clone(),
            Held::Buffer(_) | Held::Sampler(_) => unreachable!("validated as a texture"),
        };
        let ResourceKind::Texture { layers, mips, .. } = self.source.plan.resources[id.0 as usize].kind
        else {
            unreachable!("validated as a texture")
        };
        let part = part.unwrap_or(Subresource { base_mip: 0, mips, base_layer: 0, layers });
        let create = || {
            self.source.gpu.count(|made| made.bindings += 1);
            texture.create_view(&conv::view_descriptor(part, array))
        };
        self.views.entry((id, part, array)).or_insert_with(create).clone()
    }

    fn target(&mut self, target: &Target) -> wgpu::TextureView {
        let part = Subresource { base_mip: target.mip, mips: 1, base_layer: target.layer, layers: 1 };
        self.view(target.texture, Some(part), false)
    }

    fn buffer(&self, id: ResourceId) -> wgpu::Buffer {
        match &self.source.resources[id.0 as usize] {
            Held::Buffer(buffer) => buffer.clone(),
            _ => unreachable!("validated as a buffer"),
        }
    }

    fn texture(&self, id: ResourceId) -> wgpu::Texture {
        match &self.source.resources[id.0 as usize] {
            Held::Texture(texture) => texture.clone(),
            _ => unreachable!("views are refused where they are copied"),
        }
    }
}
