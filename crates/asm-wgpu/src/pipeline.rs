//! One pipeline per pass, made when a plan first names it and kept for later plans.

use std::collections::HashMap;

use frame_plan::{ExecuteError, PassInfo, PassKind, PassSet, Plan};

use crate::conv;
use crate::device::{EXECUTOR, Gpu};

/// A pass's pipeline and the layout of its bind group.
pub(crate) struct PassPipeline {
    pub(crate) layout: wgpu::BindGroupLayout,
    pub(crate) kind: PipelineKind,
}

pub(crate) enum PipelineKind {
    Compute(wgpu::ComputePipeline),
    Render(wgpu::RenderPipeline),
}

/// Pipelines by pass name.
#[derive(Default)]
pub(crate) struct Pipelines(HashMap<&'static str, PassPipeline>);

impl Pipelines {
    /// Make the pipelines that a validated plan needs and that are not there yet.
    pub(crate) fn prepare(&mut self, gpu: &Gpu, passes: &PassSet, plan: &Plan) -> Result<(), ExecuteError> {
        let mut wanted = Vec::new();
        plan.for_each_pass(&mut |step| wanted.extend(passes.get(&step.pass)));
        for info in wanted {
            if !self.0.contains_key(info.name) {
                self.0.insert(info.name, create(gpu, info)?);
            }
        }
        Ok(())
    }

    /// The pipeline of a prepared pass.
    pub(crate) fn get(&self, pass: &str) -> &PassPipeline {
        self.0.get(pass).expect("prepared with the plan")
    }
}

fn create(gpu: &Gpu, info: &'static PassInfo) -> Result<PassPipeline, ExecuteError> {
    gpu.scoped(|| {
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(info.name),
            source: wgpu::ShaderSource::Wgsl(info.source().into()),
        });
        let mut entries = Vec::new();
        if info.params_bytes > 0 {
            entries.push(conv::params_entry(info));
        }
        entries.extend((0..).zip(info.bindings).map(|(i, binding)| conv::layout_entry(info, i, binding)));
        gpu.count(|made| made.pipelines += 1);
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(info.name),
            entries: &entries,
        });
        let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(info.name),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let kind = match info.kind {
            PassKind::Compute { .. } => PipelineKind::Compute(compute(gpu, info, &module, &pipeline_layout)),
            PassKind::Draw { .. } => PipelineKind::Render(render(gpu, info, &module, &pipeline_layout)),
        };
        Ok(PassPipeline { layout, kind })
    })
    .map_err(|error| match error {
        ExecuteError::Device { reason, .. } => {
            ExecuteError::Shader { executor: EXECUTOR, pass: info.name.into(), reason }
        }
        other => other,
    })
}

fn compute(
    gpu: &Gpu,
    info: &PassInfo,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
) -> wgpu::ComputePipeline {
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(info.name),
        layout: Some(layout),
        module,
        entry_point: Some(info.name),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

fn render(
    gpu: &Gpu,
    info: &PassInfo,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
) -> wgpu::RenderPipeline {
    let PassKind::Draw { targets, depth, cull, additive, .. } = info.kind else {
        unreachable!("called for draws only")
    };
    let targets: Vec<_> = targets
        .iter()
        .map(|&format| {
            Some(wgpu::ColorTargetState {
                format: conv::texture_format(format),
                blend: additive.then_some(conv::ADDITIVE),
                write_mask: wgpu::ColorWrites::ALL,
            })
        })
        .collect();
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(info.name),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(&format!("{}_vertex", info.name)),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            front_face: wgpu::FrontFace::Ccw,
            cull_mode: conv::cull_mode(cull),
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil: depth.map(conv::depth_state),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(&format!("{}_fragment", info.name)),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
