//! [`VulkanExecutor`].

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use ash::vk;
use frame_plan::device::{Float32, Uses};
use frame_plan::spirv::SpirvPasses;
use frame_plan::{
    BindingKind, DeviceInfo, ExecuteError, Executor, Limits, Made, ParamsId, PassKind, Plan, ResourceId,
    StepTime,
};

use crate::adapter::{Instance, VulkanOptions};
use crate::barrier::{Access, Slot, Tracker, Use};
use crate::command::{Program, Recording, Source};
use crate::conv;
use crate::device::{Gpu, VulkanHost};
use crate::object::{Buffer, Commands};
use crate::pipeline::Pipelines;
use crate::readback::{self, Watched};
use crate::resources::{Held, HostBuffer, HostImage, Import, ParamsBuffer, allocate, check_import};
use crate::timing::Timing;
use crate::upload::{Uploads, fill};

/// Frames of ours that may be unfinished at once: one that runs, one that waits, one that is recorded.
const FRAMES_IN_FLIGHT: u32 = 3;

/// Runs plans on a Vulkan device.
///
/// `prepare` makes everything; a frame is one command buffer and one submission, and waits for nothing but the one
/// three frames before it, whose command buffer it takes. A host that owns the device makes the executor with
/// [`VulkanExecutor::from_host`], hands its own images and buffers over by name, and puts the frame into its own command
/// buffer with [`VulkanExecutor::record`].
pub struct VulkanExecutor {
    // Fields drop in this order.
    prepared: Option<Prepared>,
    /// Programs that frames may still run, and the number of the frame that no longer did.
    retired: Vec<(u64, Program)>,
    pipelines: Pipelines,
    frames: Vec<Frame>,
    /// Frames recorded so far.
    recorded: u64,
    imports: HashMap<String, Import>,
    passes: SpirvPasses,
    gpu: Arc<Gpu>,
}

/// A place in the ring of frames.
struct Frame {
    commands: Commands,
    /// The timeline's value when the last frame in this place is done, if it was ours to submit.
    done: Option<u64>,
}

struct Prepared {
    program: Program,
    /// Without initial contents.
    plan: Plan,
    uses: Vec<Uses>,
    resources: Vec<Held>,
    params: ParamsBuffer,
    tracker: Tracker,
    uploads: Uploads,
    /// The host has handed over something else since `program` was made.
    outdated: bool,
    /// A frame has run, so that the host's images are as frames leave them.
    has_run: bool,
    timing: Option<Timing>,
    read_back: Option<Buffer>,
    watched: Option<Watched>,
}

impl VulkanExecutor {
    /// An executor with a device of its own.
    ///
    /// # Errors
    /// [`ExecuteError::NoDevice`] if there is no such device.
    pub fn new(passes: SpirvPasses, options: &VulkanOptions) -> Result<Self, ExecuteError> {
        let instance = Instance::new(options.validation)?;
        let adapter = instance.choose(options.adapter.as_deref())?;
        let gpu = Gpu::open(instance, &adapter)?;
        Self::with_gpu(gpu, passes, FRAMES_IN_FLIGHT, options.pipeline_cache.as_deref())
    }

    /// An executor on a host's device.
    ///
    /// # Errors
    /// If the device is out of memory.
    ///
    /// # Safety
    /// The handles are valid and belong together, the device has what [`VulkanHost`] says, and they outlive the executor. While
    /// a method of the executor runs, and while it is dropped, nobody else uses the queue. When it is dropped, or is given
    /// another plan, no command buffer that it was recorded into waits to be submitted.
    pub unsafe fn from_host(host: VulkanHost, passes: SpirvPasses) -> Result<Self, ExecuteError> {
        let frames = host.frames_in_flight.max(1);
        Self::with_gpu(Gpu::of_host(host)?, passes, frames, None)
    }

    fn with_gpu(
        gpu: Arc<Gpu>,
        passes: SpirvPasses,
        frames: u32,
        cache_folder: Option<&Path>,
    ) -> Result<Self, ExecuteError> {
        let frame = |_| Ok(Frame { commands: Commands::new(&gpu)?, done: None });
        Ok(Self {
            prepared: None,
            retired: Vec::new(),
            pipelines: Pipelines::new(&gpu, cache_folder)?,
            frames: (0..frames).map(frame).collect::<Result<_, _>>()?,
            recorded: 0,
            imports: HashMap::new(),
            passes,
            gpu,
        })
    }

    /// The device.
    #[must_use]
    pub fn device(&self) -> &ash::Device {
        &self.gpu.device
    }

    /// The queue that frames are submitted to.
    #[must_use]
    pub fn queue(&self) -> vk::Queue {
        self.gpu.queue
    }

    pub(crate) const fn gpu(&self) -> &Arc<Gpu> {
        &self.gpu
    }

    /// How many frames may be unfinished at once.
    pub(crate) const fn frames_in_flight(&self) -> usize {
        self.frames.len()
    }

    /// Place in the ring of the frame that was recorded last.
    pub(crate) const fn last_place(&self) -> usize {
        (self.recorded.saturating_sub(1) % self.frames.len() as u64) as usize
    }

    /// Make a buffer of the prepared plan ready to be read by shaders in these stages, after the last frame.
    pub(crate) fn use_buffer(
        &mut self,
        commands: vk::CommandBuffer,
        id: ResourceId,
        stages: vk::PipelineStageFlags2,
    ) -> Result<vk::Buffer, ExecuteError> {
        let prepared = self.prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        let slot = Slot::Resource(id.0 as usize);
        let buffer = prepared.resources.get(id.0 as usize).and_then(Held::buffer);
        let buffer = buffer.ok_or_else(|| ExecuteError::Usage(format!("resource {} is no buffer", id.0)))?;
        prepared.tracker.follow(&Use { slot, part: None, access: Access::read(stages) });
        prepared.tracker.record(&self.gpu.device, commands);
        Ok(buffer)
    }

    /// Bytes of compiled pipelines that were found in, or written to, [`VulkanOptions::pipeline_cache`].
    #[must_use]
    pub const fn cached_pipeline_bytes(&self) -> usize {
        self.pipelines.cached_bytes()
    }

    /// Vulkan objects of the executor that are alive, by kind.
    #[must_use]
    pub fn live_objects(&self) -> Vec<(&'static str, usize)> {
        self.gpu.objects.live()
    }

    /// A buffer of the prepared plan, for a host that goes on with it on the device.
    #[must_use]
    pub fn buffer(&self, id: ResourceId) -> Option<vk::Buffer> {
        self.prepared.as_ref()?.resources.get(id.0 as usize)?.buffer()
    }

    /// An image of the prepared plan, for a host that goes on with it on the device. Its usages are those the plan needs.
    #[must_use]
    pub fn image(&self, id: ResourceId) -> Option<vk::Image> {
        self.prepared.as_ref()?.resources.get(id.0 as usize)?.image()
    }

    /// Hand over the image for the imported resource `name`, for the prepared plan and for later ones.
    ///
    /// # Errors
    /// [`ExecuteError::Usage`] if it does not fit the prepared plan: format, size, layers, levels, usages, layouts.
    ///
    /// # Safety
    /// The handles are valid, are what the rest says, and live until another image is handed over and the frames recorded before
    /// have finished. When a frame begins, the image is in its `layout_before`.
    pub unsafe fn import_image(&mut self, name: &str, image: HostImage) -> Result<(), ExecuteError> {
        self.import(name, Import::Image(image))
    }

    /// Hand over the buffer for the imported resource `name`, for the prepared plan and for later ones.
    ///
    /// # Errors
    /// [`ExecuteError::Usage`] if it does not fit the prepared plan: size, usages.
    ///
    /// # Safety
    /// The handle is valid, is what the rest says, and lives until another buffer is handed over and the frames recorded before
    /// have finished.
    pub unsafe fn import_buffer(&mut self, name: &str, buffer: HostBuffer) -> Result<(), ExecuteError> {
        self.import(name, Import::Buffer(buffer))
    }

    fn import(&mut self, name: &str, import: Import) -> Result<(), ExecuteError> {
        if let Some(prepared) = &mut self.prepared
            && let Some(id) = prepared.plan.imported(name)
        {
            let index = id.0 as usize;
            check_import(&prepared.plan.resources[index], &import, prepared.uses[index])?;
            // Views of the host's are looked up when a frame is recorded, anything else was written down.
            let looked_up = match (&prepared.resources[index], &import) {
                (Held::HostImage(old), Import::Image(new)) => {
                    old.view.is_some() && new.view.is_some() && !prepared.uses[index].binds_texture()
                }
                _ => false,
            };
            prepared.resources[index] = Held::from(import);
            prepared.outdated |= !looked_up;
            prepared.uploads.forget(Slot::Resource(index));
        }
        self.imports.insert(name.to_owned(), import);
        Ok(())
    }

    /// Record a frame into a host's command buffer instead of submitting it. Parameters and buffers written before apply to it.
    ///
    /// # Errors
    /// As [`Executor::execute`].
    ///
    /// # Safety
    /// The command buffer is being recorded outside of any rendering, for the queue's family; it is submitted once, to the
    /// queue, in the order in which frames are recorded and before the executor reads anything back. Of the frames
    /// recorded before, all but [`VulkanHost::frames_in_flight`] - 1 have finished.
    pub unsafe fn record(&mut self, commands: vk::CommandBuffer) -> Result<(), ExecuteError> {
        self.gpu.check()?;
        let place = self.free_place()?;
        self.record_frame(place, commands)?;
        self.frames[place].done = None;
        Ok(())
    }

    /// The next place in the ring, once its last frame is done.
    fn free_place(&mut self) -> Result<usize, ExecuteError> {
        let place = (self.recorded % self.frames.len() as u64) as usize;
        if let Some(value) = self.frames[place].done {
            self.gpu.wait(value)?;
        }
        Ok(place)
    }

    fn record_frame(&mut self, place: usize, commands: vk::CommandBuffer) -> Result<(), ExecuteError> {
        let Self { gpu, passes, pipelines, prepared, retired, recorded, frames, .. } = self;
        let prepared = prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        if prepared.outdated {
            let program = Program::new(&Source {
                gpu,
                plan: &prepared.plan,
                passes: &passes.passes,
                pipelines,
                resources: &prepared.resources,
                params: &prepared.params,
            })?;
            retired.push((*recorded, std::mem::replace(&mut prepared.program, program)));
            prepared.outdated = false;
        }
        prepared.record(gpu, commands, place)?;
        *recorded += 1;
        let frames = frames.len() as u64;
        retired.retain(|(since, _)| since + frames > *recorded);
        Ok(())
    }

    /// Refuse what only some devices can do.
    fn check_features(&self, plan: &Plan) -> Result<(), ExecuteError> {
        Float32::check(plan, &self.passes.passes, |what, format| {
            let (instance, physical) = (&self.gpu.instance, self.gpu.physical);
            // SAFETY: the device comes from this instance.
            let has =
                unsafe { instance.get_physical_device_format_properties(physical, conv::format(format)) };
            has.optimal_tiling_features.contains(match what {
                Float32::Blend => vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND,
                Float32::Filter => vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR,
            })
        })?;
        let mut problem = None;
        plan.for_each_pass(&mut |step| {
            if let Some(info) = self.passes.passes.get(&step.pass)
                && matches!(info.kind, PassKind::Draw { .. })
                && info.bindings.iter().any(|b| b.kind == BindingKind::Atomic)
                && !self.gpu.fragment_writes
            {
                problem = Some(format!("{step}: the device cannot write buffers from draws"));
            }
        });
        match problem {
            None => Ok(()),
            Some(problem) => Err(ExecuteError::InvalidPlan { plan: plan.name.clone(), problem }),
        }
    }

    fn make(&mut self, plan: &Plan) -> Result<Prepared, ExecuteError> {
        self.pipelines.prepare(&self.gpu, &self.passes, plan)?;
        let Self { gpu, passes, pipelines, imports, frames, .. } = self;
        let uses = Uses::of(plan, &passes.passes);
        let resources = allocate(gpu, plan, &uses, imports)?;
        let mut params = ParamsBuffer::new(gpu, &plan.params)?;
        let mut tracker = Tracker::new(plan, |i| resources[i].image().unwrap_or_default());
        fill(gpu, plan, &resources, &mut params, &mut tracker)?;
        let source =
            Source { gpu, plan, passes: &passes.passes, pipelines, resources: &resources, params: &params };
        let program = Program::new(&source)?;
        let timing = Timing::new(gpu, plan.step_names(), frames.len())?;
        let uploads = Uploads::new(gpu, plan, &params, frames.len())?;
        Ok(Prepared {
            program,
            plan: plan.without_contents(),
            uses,
            resources,
            params,
            tracker,
            uploads,
            outdated: false,
            has_run: false,
            timing,
            read_back: None,
            watched: None,
        })
    }
}

impl Prepared {
    fn record(
        &mut self,
        gpu: &Arc<Gpu>,
        commands: vk::CommandBuffer,
        place: usize,
    ) -> Result<(), ExecuteError> {
        if let Some(timing) = &mut self.timing {
            timing.begin(gpu, commands, place);
        }
        if let Some(watched) = &mut self.watched {
            watched.collect(place);
        }
        for (i, held) in self.resources.iter().enumerate() {
            match held {
                Held::HostImage(host) => self.tracker.hand_over(i, host.image, host.layout_before),
                Held::HostBuffer(_) => {
                    self.tracker.hand_over(i, vk::Image::null(), vk::ImageLayout::UNDEFINED);
                }
                _ => {}
            }
        }
        self.uploads.record(gpu, commands, place, &mut self.tracker)?;
        let Self { program, plan, resources, tracker, timing, watched, .. } = self;
        program.record(&mut Recording { gpu, commands, resources, tracker }, timing.as_ref());
        if let Some(watched) = watched {
            watched.record(gpu, commands, place, (plan, resources), tracker);
        }
        for (i, held) in self.resources.iter().enumerate() {
            match held {
                Held::HostImage(host) => self.tracker.hand_back(i, host.layout_after),
                Held::HostBuffer(_) => self.tracker.hand_back(i, vk::ImageLayout::UNDEFINED),
                _ => {}
            }
        }
        self.tracker.record(&gpu.device, commands);
        self.has_run = true;
        Ok(())
    }
}

impl Prepared {
    fn read(&mut self, gpu: &Arc<Gpu>, resource: ResourceId) -> Result<Vec<u8>, ExecuteError> {
        let index = resource.0 as usize;
        let Self { plan, resources, tracker, read_back, has_run, .. } = self;
        let mut leave_in = None;
        match &resources[index] {
            Held::HostImage(host) => {
                let layout = if *has_run { host.layout_after } else { host.layout_before };
                tracker.hand_over(index, host.image, layout);
                leave_in =
                    Some(if layout == vk::ImageLayout::UNDEFINED { host.layout_after } else { layout });
            }
            Held::HostBuffer(_) => {
                tracker.hand_over(index, vk::Image::null(), vk::ImageLayout::UNDEFINED);
            }
            _ => {}
        }
        let resource = (index, &plan.resources[index]);
        readback::read(gpu, resource, &resources[index], tracker, read_back, leave_in)
    }
}

impl Executor for VulkanExecutor {
    fn info(&self) -> &DeviceInfo {
        &self.gpu.info
    }

    fn limits(&self) -> Limits {
        self.gpu.limits
    }

    fn prepare(&mut self, plan: &Plan) -> Result<(), ExecuteError> {
        self.gpu.check()?;
        plan.validate(&self.passes.passes, &self.gpu.limits)?;
        self.check_features(plan)?;
        // The old plan's memory goes first, when no frame uses it any more: both together may be too much.
        self.gpu.idle();
        self.retired.clear();
        self.prepared = None;
        let prepared = self.make(plan)?;
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
            let target = buffer.raw();
            let (offset, padded) = prepared.params.layout.padded(params, bytes);
            prepared.uploads.push(Slot::Params, target, offset, padded);
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
        let index = buffer.0 as usize;
        if let Some(target) = prepared.resources[index].buffer() {
            prepared.uploads.push(Slot::Resource(index), target, offset_bytes, bytes);
        }
        Ok(())
    }

    fn execute(&mut self) -> Result<(), ExecuteError> {
        self.gpu.check()?;
        if self.prepared.is_none() {
            return Err(ExecuteError::nothing_prepared());
        }
        let place = self.free_place()?;
        let gpu = Arc::clone(&self.gpu);
        let commands = self.frames[place].commands.begin(&gpu)?;
        self.record_frame(place, commands)?;
        match self.frames[place].commands.end(&gpu) {
            Ok(value) => self.frames[place].done = Some(value),
            Err(error) => return Err(self.abandon(error)),
        }
        gpu.check()
    }

    fn read(&mut self, resource: ResourceId) -> Result<Vec<u8>, ExecuteError> {
        self.gpu.check()?;
        let prepared = self.prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        prepared.plan.check_readable(resource)?;
        let bytes = match prepared.read(&self.gpu, resource) {
            Ok(bytes) => bytes,
            Err(error) => return Err(self.abandon(error)),
        };
        self.collect();
        self.gpu.check()?;
        Ok(bytes)
    }

    fn watch(&mut self, resources: &[ResourceId]) -> Result<(), ExecuteError> {
        self.gpu.check()?;
        let prepared = self.prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        let watched = Watched::new(&self.gpu, &prepared.plan, resources, self.frames.len())?;
        // Frames may still write what was watched before.
        self.gpu.idle();
        prepared.watched = Some(watched);
        Ok(())
    }

    /// In a host's commands a frame counts as finished once its place is taken by the next.
    fn latest(&mut self, resource: ResourceId) -> Option<&[u8]> {
        self.collect();
        self.prepared.as_ref()?.watched.as_ref()?.latest(resource)
    }

    fn made(&self) -> Made {
        self.gpu.objects.made()
    }

    fn step_times(&mut self) -> Vec<StepTime> {
        self.collect();
        let Some(timing) = self.prepared.as_ref().and_then(|p| p.timing.as_ref()) else { return Vec::new() };
        if timing.latest().is_none()
            && let Some(value) = self.frames.iter().filter_map(|f| f.done).max()
            && self.gpu.wait(value).is_ok()
        {
            self.collect();
        }
        let timing = self.prepared.as_ref().and_then(|p| p.timing.as_ref());
        timing.and_then(Timing::latest).map_or_else(Vec::new, <[StepTime]>::to_vec)
    }
}

impl VulkanExecutor {
    /// Let go of a plan whose resources are not as they were recorded to be, since the commands did not run.
    fn abandon(&mut self, error: ExecuteError) -> ExecuteError {
        self.gpu.idle();
        self.prepared = None;
        error
    }

    /// Take over the times and the watched contents of the frames that are known to be done, the newest last.
    fn collect(&mut self) {
        let Self { gpu, frames, prepared, recorded, .. } = self;
        let Some(prepared) = prepared else { return };
        let count = frames.len();
        let oldest = (*recorded % count as u64) as usize;
        for place in (0..count).map(|i| (oldest + i) % count) {
            if !frames[place].done.is_some_and(|value| gpu.is_done(value)) {
                continue;
            }
            if let Some(timing) = &mut prepared.timing {
                timing.collect(gpu, place);
            }
            if let Some(watched) = &mut prepared.watched {
                watched.collect(place);
            }
        }
    }
}

impl Drop for VulkanExecutor {
    fn drop(&mut self) {
        self.gpu.idle();
    }
}
