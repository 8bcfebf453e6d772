//! [`CpuExecutor`].

use std::collections::HashMap;
use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::raster::{SUBPIXEL_BITS, Scratch};
use super::step::Frame;
use super::storage::Storage;
use crate::{
    BindingKind, DeviceInfo, DeviceType, ExecuteError, Executor, Lifetime, Limits, Made, ParamsId, PassKind,
    PassSet, Plan, ResourceId, ResourceKind, StepTime, memory,
};

/// Runs the CPU mirrors of a plan's passes, steps in order, each in parallel on its own thread pool.
///
/// Results do not depend on the number of threads, as long as the mirrors' do not.
pub struct CpuExecutor {
    passes: PassSet,
    pool: ThreadPool,
    info: DeviceInfo,
    imports: HashMap<String, Vec<u8>>,
    prepared: Option<Prepared>,
    made: Made,
}

struct Prepared {
    /// Without initial contents.
    plan: Plan,
    storage: Vec<Storage>,
    scratch: Scratch,
    times: Vec<StepTime>,
    /// Watched resources, and what they held after the last frame.
    watched: Vec<(ResourceId, Vec<u8>)>,
}

impl CpuExecutor {
    /// An executor on `threads` threads, by default one per core.
    ///
    /// # Errors
    /// [`ExecuteError::NoDevice`] if the threads cannot be started.
    pub fn new(passes: PassSet, threads: Option<usize>) -> Result<Self, ExecuteError> {
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads.unwrap_or(0))
            .thread_name(|i| format!("mirror-{i}"))
            .build()
            .map_err(|e| ExecuteError::NoDevice { executor: "cpu", reason: e.to_string() })?;
        let info = DeviceInfo {
            executor: "cpu".into(),
            device: format!("{}, {} threads", processor(), pool.current_num_threads()),
            driver: concat!("frame-plan ", env!("CARGO_PKG_VERSION")).into(),
            device_type: DeviceType::Cpu,
            subpixel_bits: Some(SUBPIXEL_BITS),
        };
        Ok(Self { passes, pool, info, imports: HashMap::new(), prepared: None, made: Made::default() })
    }

    /// Hand over the contents of the imported resource `name`: a buffer's bytes, or a texture's texels, tightly packed, layer by
    /// layer with all levels of each. Takes effect at once if a plan that imports it is prepared, and for later plans.
    ///
    /// # Errors
    /// [`ExecuteError::Usage`] if the prepared plan imports `name` with another size.
    pub fn import(&mut self, name: &str, bytes: Vec<u8>) -> Result<(), ExecuteError> {
        if let Some(prepared) = &mut self.prepared
            && let Some(id) = prepared.plan.resource(name)
        {
            let resource = &prepared.plan.resources[id.0 as usize];
            if resource.lifetime == Lifetime::Imported {
                check_import(name, bytes.len() as u64, resource.kind.bytes())?;
                prepared.storage[id.0 as usize].write(0, &bytes);
            }
        }
        self.imports.insert(name.to_owned(), bytes);
        Ok(())
    }

    fn draws(&self, plan: &Plan) -> bool {
        let mut draws = false;
        plan.for_each_pass(&mut |step| {
            let info = self.passes.get(&step.pass);
            draws |= info.is_some_and(|p| matches!(p.kind, PassKind::Draw { .. }));
        });
        draws
    }

    fn prepared(&mut self) -> Result<&mut Prepared, ExecuteError> {
        self.prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)
    }
}

fn check_import(name: &str, got: u64, wanted: u64) -> Result<(), ExecuteError> {
    if got == wanted {
        return Ok(());
    }
    Err(ExecuteError::Usage(format!("imported resource {name:?} has {got} bytes, the plan wants {wanted}")))
}

impl Executor for CpuExecutor {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn limits(&self) -> Limits {
        Limits {
            max_texture_size: 16_384,
            max_storage_binding_bytes: 1 << 32,
            max_buffer_bytes: 1 << 32,
            max_groups_per_dimension: 65_535,
            max_total_bytes: memory::usable_bytes(),
        }
    }

    fn prepare(&mut self, plan: &Plan) -> Result<(), ExecuteError> {
        plan.validate(&self.passes, &self.limits())?;
        for resource in plan.resources.iter().filter(|r| r.lifetime == Lifetime::Imported) {
            let bytes = self.imports.get(&resource.name).ok_or_else(|| {
                ExecuteError::Usage(format!("imported resource {:?} was not handed over", resource.name))
            })?;
            check_import(&resource.name, bytes.len() as u64, resource.kind.bytes())?;
        }
        self.prepared = None;
        let atomic = atomic_buffers(plan, &self.passes);
        let mut storage: Vec<_> =
            plan.resources.iter().zip(&atomic).map(|(r, &atomic)| Storage::new(r, atomic)).collect();
        for (resource, storage) in plan.resources.iter().zip(&mut storage) {
            if resource.lifetime == Lifetime::Imported {
                storage.write(0, &self.imports[&resource.name]);
            }
        }
        let times = plan.step_names().into_iter().map(|name| StepTime { name, milliseconds: 0.0 }).collect();
        let scratch = if self.draws(plan) { Scratch::for_draws() } else { Scratch::default() };
        for storage in &storage {
            match storage {
                Storage::Buffer(_) | Storage::Atomic(_) => self.made.buffers += 1,
                Storage::Texture(_) => self.made.textures += 1,
                Storage::Sampler => {}
            }
            self.made.bytes += storage.size_bytes();
        }
        self.made.bytes += scratch.size_bytes();
        let plan = plan.without_contents();
        self.prepared = Some(Prepared { plan, storage, scratch, times, watched: Vec::new() });
        Ok(())
    }

    fn set_params(&mut self, params: ParamsId, bytes: &[u8]) -> Result<(), ExecuteError> {
        let plan = &mut self.prepared()?.plan;
        plan.check_params_write(params, bytes)?;
        plan.params[params.0 as usize].bytes.copy_from_slice(bytes);
        Ok(())
    }

    fn write_buffer(
        &mut self,
        buffer: ResourceId,
        offset_bytes: u64,
        bytes: &[u8],
    ) -> Result<(), ExecuteError> {
        let prepared = self.prepared()?;
        prepared.plan.check_buffer_write(buffer, offset_bytes, bytes)?;
        prepared.storage[buffer.0 as usize].write(offset_bytes as usize, bytes);
        Ok(())
    }

    fn execute(&mut self) -> Result<(), ExecuteError> {
        let max_groups = self.limits().max_groups_per_dimension;
        let prepared = self.prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        let scratch_bytes = prepared.scratch.size_bytes();
        let mut frame = Frame {
            passes: self.passes,
            params: &prepared.plan.params,
            storage: &mut prepared.storage,
            scratch: &mut prepared.scratch,
            max_groups,
        };
        for (step, time) in prepared.plan.steps.iter().zip(&mut prepared.times) {
            let start = Instant::now();
            self.pool.install(|| frame.run(step, 0));
            time.milliseconds = start.elapsed().as_secs_f64() * 1e3;
        }
        self.made.bytes += prepared.scratch.size_bytes() - scratch_bytes;
        for (resource, bytes) in &mut prepared.watched {
            prepared.storage[resource.0 as usize].copy_to(bytes);
        }
        Ok(())
    }

    fn read(&mut self, resource: ResourceId) -> Result<Vec<u8>, ExecuteError> {
        let prepared = self.prepared()?;
        prepared.plan.check_readable(resource)?;
        let mut bytes = Vec::new();
        prepared.storage[resource.0 as usize].copy_to(&mut bytes);
        Ok(bytes)
    }

    fn watch(&mut self, resources: &[ResourceId]) -> Result<(), ExecuteError> {
        let prepared = self.prepared.as_mut().ok_or_else(ExecuteError::nothing_prepared)?;
        let mut watched = Vec::new();
        for &resource in resources {
            let size = prepared.plan.check_readable(resource)?.read_bytes();
            watched.push((resource, Vec::with_capacity(size as usize)));
            self.made.buffers += 1;
            self.made.bytes += size;
        }
        prepared.watched = watched;
        Ok(())
    }

    fn latest(&mut self, resource: ResourceId) -> Option<&[u8]> {
        let (_, bytes) = self.prepared.as_ref()?.watched.iter().find(|(watched, _)| *watched == resource)?;
        (!bytes.is_empty()).then_some(bytes)
    }

    /// Memory of resources, of what is watched, and of draws. Nothing is compiled; what mirrors take from the heap while they run
    /// is theirs.
    fn made(&self) -> Made {
        self.made
    }

    fn step_times(&mut self) -> Vec<StepTime> {
        self.prepared.as_ref().map_or_else(Vec::new, |p| p.times.clone())
    }
}

/// Which resources some step binds as atomics.
fn atomic_buffers(plan: &Plan, passes: &PassSet) -> Vec<bool> {
    let mut atomic = vec![false; plan.resources.len()];
    plan.for_each_pass(&mut |step| {
        let bindings = passes.get(&step.pass).map_or(&[][..], |p| p.bindings);
        for (binding, bound) in bindings.iter().zip(&step.bindings) {
            if matches!(binding.kind, BindingKind::Atomic | BindingKind::ReadAtomic)
                && matches!(plan.resources[bound.resource.0 as usize].kind, ResourceKind::Buffer { .. })
            {
                atomic[bound.resource.0 as usize] = true;
            }
        }
    });
    atomic
}

/// The processor's name, where the system tells it.
fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| std::env::consts::ARCH.into(), |(_, name)| name.trim().into())
}
