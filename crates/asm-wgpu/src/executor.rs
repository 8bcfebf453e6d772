//! [`WgpuExecutor`].

use std::collections::HashMap;

use frame_plan::{
    BindingKind, DeviceInfo, ExecuteError, Executor, Limits, ParamsId, PassKind, PassSet, Plan, ResourceId,
    ResourceKind, StepTime, TextureFormat,
};

use crate::adapter::{WgpuOptions, choose};
use crate::command::{Program, Source};
use crate::device::Gpu;
use crate::pipeline::Pipelines;
use crate::readback;
use crate::resources::{Held, ParamsBuffer, Usages, allocate, check_import};
use crate::timing::Timing;

/// Runs plans on a wgpu device.
///
/// `prepare` makes everything; a frame is one encoder and one submission. A host that owns the device makes the executor with
/// [`WgpuExecutor::from_host`], hands its own textures and buffers over by name, and puts the frame into its own encoder
/// with [`WgpuExecutor::record`].
pub struct WgpuExecutor {
    gpu: Gpu,
    passes: PassSet,
    pipelines: Pipelines,
    imports: HashMap<String, Held>,
    prepared: Option<Prepared>,
}

struct Prepared {
    /// Without initial contents.
    plan: Plan,
    usages: Usages,
    resources: Vec<Held>,
    params: ParamsBuffer,
    program: Program,
    /// The host has handed over something else since `program` was made.
    outdated: bool,
    timing: Option<Timing>,
}

impl WgpuExecutor {
    /// An executor with a device of its own.
    ///
    /// # Errors
    /// [`ExecuteError::NoDevice`] if there is no such adapter or it gives no device.
    pub fn new(passes: PassSet, options: &WgpuOptions) -> Result<Self, ExecuteError> {
        Ok(Self::with_gpu(Gpu::open(&choose(options)?)?, passes))
    }

    /// An executor on a host's device.
    ///
    /// Its error and device-loss callbacks stay the host's. Step times need [`wgpu::Features::TIMESTAMP_QUERY`], and
    /// [`wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS`] for steps without passes and on software devices; draws with
    /// additive blending or filtering of 32-bit floats need [`wgpu::Features::FLOAT32_BLENDABLE`] or
    /// [`wgpu::Features::FLOAT32_FILTERABLE`].
    #[must_use]
    pub fn from_host(device: wgpu::Device, queue: wgpu::Queue, passes: PassSet) -> Self {
        Self::with_gpu(Gpu::of_host(device, queue), passes)
    }

    fn with_gpu(gpu: Gpu, passes: PassSet) -> Self {
        Self { gpu, passes, pipelines: Pipelines::default(), imports: HashMap::new(), prepared: None }
    }

    /// The device.
    #[must_use]
    pub const fn device(&self) -> &wgpu::Device {
        &self.gpu.device
    }

    /// The device's queue.
    #[must_use]
    pub const fn queue(&self) -> &wgpu::Queue {
        &self.gpu.queue
    }

    /// Pipelines made so far; plans that name the same passes share them.
    #[must_use]
    pub fn pipeline_count(&self) -> usize {
        self.pipelines.len()
    }

    /// A buffer of the prepared plan, for a host that goes on with it on the device.
    #[must_use]
    pub fn buffer(&self, id: ResourceId) -> Option<&wgpu::Buffer> {
        match self.prepared.as_ref()?.resources.get(id.0 as usize)? {
            Held::Buffer(buffer) => Some(buffer),
            _ => None,
        }
    }

    /// A texture of the prepared plan, for a host that goes on with it on the device. Its usages are those the plan needs.
    #[must_use]
    pub fn texture(&self, id: ResourceId) -> Option<&wgpu::Texture> {
        match self.prepared.as_ref()?.resources.get(id.0 as usize)? {
            Held::Texture(texture) => Some(texture),
            _ => None,
        }
    }

    /// Hand over the texture for the imported resource `name`, for the prepared plan and for later ones.
    ///
    /// # Errors
    /// [`ExecuteError::Usage`] if it does not fit the prepared plan: format, size, layers, levels, usages.
    pub fn import_texture(&mut self, name: &str, texture: wgpu::Texture) -> Result<(), ExecuteError> {
        self.import(name, Held::Texture(texture))
    }

    /// Hand over a view for the imported resource `name`, for the prepared plan and for later ones: level 0 of a texture with one
    /// layer. It can be a target or be bound, but not copied or read back. Hosts may hand over another view every frame
    /// (a swap chain's), at the price of new bind groups.
    ///
    /// # Errors
    /// [`ExecuteError::Usage`] if it does not fit the prepared plan: format, size, usages.
    pub fn import_texture_view(&mut self, name: &str, view: wgpu::TextureView) -> Result<(), ExecuteError> {
        self.import(name, Held::View(view))
    }

    /// Hand over the buffer for the imported resource `name`, for the prepared plan and for later ones.
    ///
    /// # Errors
    /// [`ExecuteError::Usage`] if it does not fit the prepared plan: size, usages.
    pub fn import_buffer(&mut self, name: &str, buffer: wgpu::Buffer) -> Result<(), ExecuteError> {
        self.import(name, Held::Buffer(buffer))
    }

    fn import(&mut self, name: &str, held: Held) -> Result<(), ExecuteError> {
        if let Some(prepared) = &mut self.prepared
            && let Some(id) = prepared.plan.imported(name)
        {
            let resource = &prepared.plan.resources[id.0 as usize];
            check_import(resource, &held, &prepared.usages, id)?;
            prepared.resources[id.0 as usize] = held.clone();
            prepared.outdated = true;
        }
        self.imports.insert(name.to_owned(), held);
        Ok(())
    }

    /// Record a frame into a host's encoder instead of submitting it. Parameters and buffers written before the encoder is
    /// submitted apply to it. Submit encoders in the order in which they were recorded.
    ///
    /// # Errors
    /// As [`Executor::execute`]; errors of the recorded commands themselves come when the host finishes its encoder.
    pub fn record(&mut self, encoder: &mut wgpu::CommandEncoder) -> Result<(), ExecuteError> {
        self.gpu.check()?;
        let Self { gpu, passes, pipelines, prepared, .. } = self;
        let prepared = prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        gpu.scoped(|| {
            prepared.record(gpu, passes, pipelines, encoder);
            Ok(())
        })
    }

    /// Refuse what only some devices can do.
    fn check_features(&self, plan: &Plan) -> Result<(), ExecuteError> {
        let mut problem = None;
        let features = self.gpu.device.features();
        let is_32_bit = |format| matches!(format, TextureFormat::R32Float | TextureFormat::Rgba32Float);
        plan.for_each_pass(&mut |step| {
            let Some(info) = self.passes.get(&step.pass) else { return };
            if let PassKind::Draw { targets, additive: true, .. } = info.kind
                && targets.iter().copied().any(is_32_bit)
                && !features.contains(wgpu::Features::FLOAT32_BLENDABLE)
            {
                problem = Some(format!("{step}: the device cannot blend 32-bit floats"));
            }
            for (binding, bound) in info.bindings.iter().zip(&step.bindings) {
                if let BindingKind::Texture { filter: true, .. } = binding.kind
                    && let ResourceKind::Texture { format, .. } =
                        plan.resources[bound.resource.0 as usize].kind
                    && is_32_bit(format)
                    && !features.contains(wgpu::Features::FLOAT32_FILTERABLE)
                {
                    problem =
                        Some(format!("{step}: the device cannot filter 32-bit floats ({})", binding.name));
                }
            }
        });
        match problem {
            None => Ok(()),
            Some(problem) => Err(ExecuteError::InvalidPlan { plan: plan.name.clone(), problem }),
        }
    }
}

impl Prepared {
    fn record(
        &mut self,
        gpu: &Gpu,
        passes: &PassSet,
        pipelines: &Pipelines,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        if self.outdated {
            let Self { plan, resources, params, .. } = self;
            self.program = Program::new(&Source { gpu, plan, passes, pipelines, resources, params });
            self.outdated = false;
        }
        self.program.record(encoder, self.timing.as_ref());
        if let Some(timing) = &mut self.timing {
            timing.resolve(encoder);
        }
    }
}

impl Executor for WgpuExecutor {
    fn info(&self) -> &DeviceInfo {
        &self.gpu.info
    }

    fn limits(&self) -> Limits {
        self.gpu.limits
    }

    fn prepare(&mut self, plan: &Plan) -> Result<(), ExecuteError> {
        self.gpu.check()?;
        plan.validate(&self.passes, &self.gpu.limits)?;
        self.check_features(plan)?;
        // The old plan's memory goes first: both together may be too much.
        self.prepared = None;
        self.pipelines.prepare(&self.gpu, &self.passes, plan)?;
        let Self { gpu, passes, pipelines, imports, .. } = self;
        let prepared = gpu.scoped(|| {
            let usages = Usages::of(plan, passes);
            let resources = allocate(gpu, plan, &usages, imports)?;
            let params = ParamsBuffer::new(gpu, &plan.params);
            let source = Source { gpu, plan, passes, pipelines, resources: &resources, params: &params };
            let program = Program::new(&source);
            let timing = Timing::new(gpu, plan.step_names(), program.names_with_passes(plan));
            let mut kept = plan.clone();
            kept.resources.iter_mut().for_each(|resource| resource.initial = None);
            Ok(Prepared { plan: kept, usages, resources, params, program, outdated: false, timing })
        })?;
        // Hand the initial contents to the device now, so that the copies of them are freed.
        self.gpu.queue.submit([]);
        self.prepared = Some(prepared);
        self.gpu.check()
    }

    fn set_params(&mut self, params: ParamsId, bytes: &[u8]) -> Result<(), ExecuteError> {
        let prepared = self.prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        prepared.plan.check_params_write(params, bytes)?;
        prepared.params.write(&self.gpu, params, bytes);
        Ok(())
    }

    fn write_buffer(
        &mut self,
        buffer: ResourceId,
        offset_bytes: u64,
        bytes: &[u8],
    ) -> Result<(), ExecuteError> {
        let prepared = self.prepared.as_ref().ok_or_else(ExecuteError::nothing_prepared)?;
        prepared.plan.check_buffer_write(buffer, offset_bytes, bytes)?;
        if let Held::Buffer(held) = &prepared.resources[buffer.0 as usize] {
            self.gpu.queue.write_buffer(held, offset_bytes, bytes);
        }
        Ok(())
    }

    fn execute(&mut self) -> Result<(), ExecuteError> {
        self.gpu.check()?;
        let Self { gpu, passes, pipelines, prepared, .. } = self;
        let prepared = prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        gpu.scoped(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            prepared.record(gpu, passes, pipelines, &mut encoder);
            gpu.queue.submit([encoder.finish()]);
            Ok(())
        })?;
        gpu.check()
    }

    fn read(&mut self, resource: ResourceId) -> Result<Vec<u8>, ExecuteError> {
        self.gpu.check()?;
        let prepared = self.prepared.as_ref().ok_or_else(ExecuteError::nothing_prepared)?;
        let info = prepared.plan.check_readable(resource)?;
        readback::read(&self.gpu, info, &prepared.resources[resource.0 as usize])
    }

    fn step_times(&mut self) -> Vec<StepTime> {
        let timing = self.prepared.as_mut().and_then(|p| p.timing.as_mut());
        timing.map_or_else(Vec::new, |timing| timing.latest(&self.gpu))
    }
}
