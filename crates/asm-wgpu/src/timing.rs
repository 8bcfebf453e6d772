//! Times per step from timestamp queries, read back without waiting: they come a frame late.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use frame_plan::StepTime;

use crate::device::Gpu;

/// Frames whose times may be on their way at once.
const SLOTS: usize = 3;
/// Bytes of a timestamp.
const TIMESTAMP_BYTES: u64 = 8;

/// States of a slot's mapping.
const FREE: u8 = 0;
const PENDING: u8 = 1;
const READY: u8 = 2;

/// Timestamp queries of a plan's steps.
pub(crate) struct Timing {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    slots: Vec<Slot>,
    marks: Marks,
    names: Vec<String>,
    nanoseconds_per_tick: f64,
    frame: u64,
    latest: Vec<StepTime>,
}

/// Where timestamps are written.
enum Marks {
    /// Before the first and after every step.
    BetweenSteps {
        /// Software devices (Mesa's, after a draw) write a timestamp only when the next one is asked for: ask twice.
        repeats: u32,
    },
    /// At the begin and end of passes, where the device can do no more.
    InPasses,
}

impl Marks {
    /// Queries for so many steps.
    const fn queries(&self, steps: u32) -> u32 {
        match self {
            Self::BetweenSteps { repeats } => (steps + 1) * *repeats,
            Self::InPasses => steps * 2,
        }
    }

    /// Queries at the begin and the end of a step.
    const fn of_step(&self, i: usize) -> [usize; 2] {
        match self {
            Self::BetweenSteps { repeats } => [i * *repeats as usize, (i + 1) * *repeats as usize],
            Self::InPasses => [2 * i, 2 * i + 1],
        }
    }
}

struct Slot {
    buffer: wgpu::Buffer,
    state: Arc<AtomicU8>,
    frame: u64,
}

impl Timing {
    /// Queries for a plan's top-level steps, of which those in `with_passes` run passes; none if the device has no timestamps.
    pub(crate) fn new(gpu: &Gpu, mut steps: Vec<String>, with_passes: Vec<String>) -> Option<Self> {
        let features = gpu.device.features();
        let most = wgpu::QUERY_SET_MAX_QUERIES as usize;
        let (marks, names) = if features.contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS) {
            let software = gpu.device.adapter_info().device_type == wgpu::DeviceType::Cpu;
            let repeats = if software { 2 } else { 1 };
            steps.truncate(most / repeats as usize - 1);
            (Marks::BetweenSteps { repeats }, steps)
        } else if features.contains(wgpu::Features::TIMESTAMP_QUERY) {
            steps = with_passes;
            steps.truncate(most / 2);
            (Marks::InPasses, steps)
        } else {
            return None;
        };
        if names.is_empty() {
            return None;
        }
        let count = marks.queries(names.len() as u32);
        let size = u64::from(count) * TIMESTAMP_BYTES;
        let resolved = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        let read_back = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let slot = || Slot {
            buffer: buffer(gpu, "step times read back", size, read_back),
            state: Arc::new(AtomicU8::new(FREE)),
            frame: 0,
        };
        Some(Self {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("step times"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: buffer(gpu, "step times", size, resolved),
            slots: (0..SLOTS).map(|_| slot()).collect(),
            marks,
            names,
            nanoseconds_per_tick: f64::from(gpu.queue.get_timestamp_period()),
            frame: 0,
            latest: Vec::new(),
        })
    }

    /// The query set, and the indices of the first and last timestamp of the i-th step that has passes, if they write them.
    pub(crate) fn in_passes(&self, i: u32) -> Option<(&wgpu::QuerySet, u32, u32)> {
        let timed = matches!(self.marks, Marks::InPasses) && (i as usize) < self.names.len();
        timed.then_some((&self.queries, i * 2, i * 2 + 1))
    }

    /// Record the timestamp between step `i - 1` and step `i`, if it is written there.
    pub(crate) fn mark(&self, encoder: &mut wgpu::CommandEncoder, i: u32) {
        let Marks::BetweenSteps { repeats } = self.marks else { return };
        if i as usize <= self.names.len() {
            for repeat in 0..repeats {
                encoder.write_timestamp(&self.queries, i * repeats + repeat);
            }
        }
    }

    /// Record the way of this frame's timestamps to the host, unless all slots are still on their way.
    pub(crate) fn resolve(&mut self, encoder: &mut wgpu::CommandEncoder) {
        self.collect();
        self.frame += 1;
        let count = self.marks.queries(self.names.len() as u32);
        let Some(slot) = self.slots.iter_mut().find(|s| s.state.load(Ordering::Acquire) == FREE) else {
            return;
        };
        slot.frame = self.frame;
        slot.state.store(PENDING, Ordering::Release);
        encoder.resolve_query_set(&self.queries, 0..count, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &slot.buffer, 0, None);
        let state = Arc::clone(&slot.state);
        encoder.map_buffer_on_submit(&slot.buffer, wgpu::MapMode::Read, .., move |result| {
            state.store(if result.is_ok() { READY } else { FREE }, Ordering::Release);
        });
    }

    /// Times of the last frame that has finished; waits only if none has yet.
    pub(crate) fn latest(&mut self, gpu: &Gpu) -> Vec<StepTime> {
        // A failed poll leaves the times as they are; the next call of the executor reports it.
        let _ = gpu.device.poll(wgpu::PollType::Poll);
        self.collect();
        if self.latest.is_empty() && self.frame > 0 && gpu.wait().is_ok() {
            self.collect();
        }
        self.latest.clone()
    }

    /// Take over what has arrived.
    fn collect(&mut self) {
        let mut arrived: Vec<_> =
            self.slots.iter_mut().filter(|s| s.state.load(Ordering::Acquire) == READY).collect();
        arrived.sort_by_key(|slot| slot.frame);
        for slot in arrived {
            if let Ok(view) = slot.buffer.get_mapped_range(..) {
                let ticks: Vec<u64> =
                    view.chunks_exact(TIMESTAMP_BYTES as usize).map(bytemuck::pod_read_unaligned).collect();
                let step = |(i, name): (usize, &String)| {
                    let [begin, end] = self.marks.of_step(i).map(|query| ticks[query]);
                    let nanoseconds = end.saturating_sub(begin) as f64 * self.nanoseconds_per_tick;
                    StepTime { name: name.clone(), milliseconds: nanoseconds * 1e-6 }
                };
                self.latest = self.names.iter().enumerate().map(step).collect();
            }
            slot.buffer.unmap();
            slot.state.store(FREE, Ordering::Release);
        }
    }
}

fn buffer(gpu: &Gpu, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage,
        mapped_at_creation: false,
    })
}
