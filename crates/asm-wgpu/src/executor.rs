//! [`WgpuExecutor`].

use std::collections::{HashMap, VecDeque};

use frame_plan::device::{Float32, Uses};
use frame_plan::{
    DeviceInfo, ExecuteError, Executor, Limits, Made, ParamsId, PassSet, Plan, ResourceId, StepTime,
};

use crate::adapter::{WgpuOptions, choose};
use crate::command::{Program, Source};
use crate::device::Gpu;
use crate::pipeline::Pipelines;
use crate::readback::{self, Watched};
use crate::resources::{Held, ParamsBuffer, allocate, check_import};
use crate::ring::FRAMES_IN_FLIGHT;
use crate::timing::Timing;
use crate::upload::Uploads;

/// Runs plans on a wgpu device.
///
/// `prepare` makes everything; a frame is one encoder and one submission, and waits for nothing but the one three frames before
/// it. A host that owns the device makes the executor with
/// [`WgpuExecutor::from_host`], hands its own textures and buffers over by name, and puts the frame into its own encoder
/// with [`WgpuExecutor::record`].
pub struct WgpuExecutor {
    gpu: Gpu,
    passes: PassSet,
    pipelines: Pipelines,
    imports: HashMap<String, Held>,
    prepared: Option<Prepared>,
    /// Frames of ours that may be unfinished, the oldest first.
    submitted: VecDeque<wgpu::SubmissionIndex>,
}

struct Prepared {
    /// Without initial contents.
    plan: Plan,
    uses: Vec<Uses>,
    resources: Vec<Held>,
    params: ParamsBuffer,
    program: Program,
    /// The host has handed over something else since `program` was made.
    outdated: bool,
    uploads: Uploads,
    timing: Option<Timing>,
    watched: Option<Watched>,
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
        Self {
            gpu,
            passes,
            pipelines: Pipelines::default(),
            imports: HashMap::new(),
            prepared: None,
            submitted: VecDeque::with_capacity(FRAMES_IN_FLIGHT),
        }
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
            let index = id.0 as usize;
            check_import(&prepared.plan.resources[index], &held, prepared.uses[index])?;
            if let Held::Buffer(old) = std::mem::replace(&mut prepared.resources[index], held.clone()) {
                prepared.uploads.writes.forget(|target| *target == old);
            }
            prepared.outdated = true;
        }
        self.imports.insert(name.to_owned(), held);
        Ok(())
    }

    /// Record a frame into a host's encoder instead of submitting it. Parameters and buffers written before apply to it. Submit
    /// each encoder, in the order in which they were recorded.
    ///
    /// # Errors
    /// As [`Executor::execute`]; errors of the recorded commands themselves come when the host finishes its encoder.
    pub fn record(&mut self, encoder: &mut wgpu::CommandEncoder) -> Result<(), ExecuteError> {
        self.gpu.check()?;
        let Self { gpu, passes, pipelines, prepared, .. } = self;
        let prepared = prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        gpu.scoped(|| prepared.record(gpu, passes, pipelines, encoder))
    }

    /// Refuse what only some devices can do.
    fn check_features(&self, plan: &Plan) -> Result<(), ExecuteError> {
        let features = self.gpu.device.features();
        Float32::check(plan, &self.passes, |what, _| {
            features.contains(match what {
                Float32::Blend => wgpu::Features::FLOAT32_BLENDABLE,
                Float32::Filter => wgpu::Features::FLOAT32_FILTERABLE,
            })
        })
    }
}

impl Prepared {
    fn record(
        &mut self,
        gpu: &Gpu,
        passes: &PassSet,
        pipelines: &Pipelines,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<(), ExecuteError> {
        if self.outdated {
            let Self { plan, resources, params, .. } = self;
            self.program = Program::new(&Source { gpu, plan, passes, pipelines, resources, params });
            self.outdated = false;
        }
        self.uploads.record(gpu, encoder)?;
        self.program.record(encoder, self.timing.as_ref());
        if let Some(timing) = &mut self.timing {
            timing.resolve(encoder);
        }
        if let Some(watched) = &mut self.watched {
            watched.record(encoder, &self.plan, &self.resources)?;
        }
        Ok(())
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
            let uses = Uses::of(plan, passes);
            let resources = allocate(gpu, plan, &uses, imports)?;
            let params = ParamsBuffer::new(gpu, &plan.params);
            let source = Source { gpu, plan, passes, pipelines, resources: &resources, params: &params };
            let program = Program::new(&source);
            let timing = Timing::new(gpu, plan.step_names(), program.names_with_passes(plan));
            let uploads = Uploads::new(gpu, plan, &params);
            Ok(Prepared {
                plan: plan.without_contents(),
                uses,
                resources,
                params,
                program,
                outdated: false,
                uploads,
                timing,
                watched: None,
            })
        })?;
        // Hand the initial contents to the device now, so that the copies of them are freed.
        self.gpu.queue.submit([]);
        self.prepared = Some(prepared);
        self.gpu.check()
    }

    fn set_params(&mut self, params: ParamsId, bytes: &[u8]) -> Result<(), ExecuteError> {
        let prepared = self.prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        prepared.plan.check_params_write(params, bytes)?;
        let held = &mut prepared.plan.params[params.0 as usize].bytes;
        if held != bytes
            && let Some(buffer) = &prepared.params.buffer
        {
            held.copy_from_slice(bytes);
            let (offset, padded) = prepared.params.layout.padded(params, bytes);
            prepared.uploads.writes.push(buffer.clone(), offset, padded);
        }
        Ok(())
    }

    fn write_buffer(
        &mut self,
        buffer: ResourceId,
        offset_bytes: u64,
        bytes: &[u8],
    ) -> Result<(), ExecuteError> {
        let prepared = self.prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        prepared.plan.check_buffer_write(buffer, offset_bytes, bytes)?;
        if let Held::Buffer(held) = &prepared.resources[buffer.0 as usize] {
            prepared.uploads.writes.push(held.clone(), offset_bytes, bytes);
        }
        Ok(())
    }

    fn execute(&mut self) -> Result<(), ExecuteError> {
        self.gpu.check()?;
        let Self { gpu, passes, pipelines, prepared, submitted, .. } = self;
        let prepared = prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        if submitted.len() == FRAMES_IN_FLIGHT
            && let Some(oldest) = submitted.pop_front()
        {
            gpu.wait_for(oldest)?;
        }
        gpu.scoped(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            prepared.record(gpu, passes, pipelines, &mut encoder)?;
            submitted.push_back(gpu.queue.submit([encoder.finish()]));
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

    fn watch(&mut self, resources: &[ResourceId]) -> Result<(), ExecuteError> {
        self.gpu.check()?;
        let prepared = self.prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        let watched = self.gpu.scoped(|| Watched::new(&self.gpu, &prepared.plan, resources))?;
        prepared.watched = Some(watched);
        Ok(())
    }

    fn latest(&mut self, resource: ResourceId) -> Option<&[u8]> {
        let watched = self.prepared.as_mut()?.watched.as_mut()?;
        // A failed poll leaves things as they are; the next call of the executor reports it.
        let _ = self.gpu.device.poll(wgpu::PollType::Poll);
        watched.collect();
        watched.latest(resource)
    }

    fn made(&self) -> Made {
        self.gpu.made()
    }

    fn step_times(&mut self) -> Vec<StepTime> {
        let timing = self.prepared.as_mut().and_then(|p| p.timing.as_mut());
        timing.map_or_else(Vec::new, |timing| timing.latest(&self.gpu))
    }
}
