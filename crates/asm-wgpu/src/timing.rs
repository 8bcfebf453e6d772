//! Times per step from timestamp queries, read back without waiting: they come a frame late.

use frame_plan::StepTime;

use crate::device::Gpu;
use crate::ring::ReadBacks;

/// Bytes of a timestamp.
const TIMESTAMP_BYTES: u64 = 8;

/// Timestamp queries of a plan's steps.
pub(crate) struct Timing {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    read_backs: ReadBacks,
    marks: Marks,
    names: Vec<String>,
    nanoseconds_per_tick: f64,
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
        gpu.count(|made| made.bindings += 1);
        Some(Self {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("step times"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: gpu.buffer("step times", size, resolved),
            read_backs: ReadBacks::new(gpu, "step times read back", size),
            marks,
            names,
            nanoseconds_per_tick: f64::from(gpu.queue.get_timestamp_period()),
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

    /// Record the way of this frame's timestamps to the host, unless all buffers are still on their way.
    pub(crate) fn resolve(&mut self, encoder: &mut wgpu::CommandEncoder) {
        self.collect();
        let count = self.marks.queries(self.names.len() as u32);
        let Some(read_back) = self.read_backs.next() else { return };
        encoder.resolve_query_set(&self.queries, 0..count, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &read_back.buffer, 0, None);
        read_back.take_back(encoder);
    }

    /// Times of the last frame that has finished; waits only if none has yet.
    pub(crate) fn latest(&mut self, gpu: &Gpu) -> Vec<StepTime> {
        // A failed poll leaves the times as they are; the next call of the executor reports it.
        let _ = gpu.device.poll(wgpu::PollType::Poll);
        self.collect();
        if self.latest.is_empty() && self.read_backs.frames() > 0 && gpu.wait().is_ok() {
            self.collect();
        }
        self.latest.clone()
    }

    /// Take over what has arrived.
    fn collect(&mut self) {
        let Self { read_backs, marks, names, nanoseconds_per_tick, latest, .. } = self;
        read_backs.collect(|bytes| {
            let ticks: Vec<u64> =
                bytes.chunks_exact(TIMESTAMP_BYTES as usize).map(bytemuck::pod_read_unaligned).collect();
            let step = |(i, name): (usize, &String)| {
                let [begin, end] = marks.of_step(i).map(|query| ticks[query]);
                let nanoseconds = end.saturating_sub(begin) as f64 * *nanoseconds_per_tick;
                StepTime { name: name.clone(), milliseconds: nanoseconds * 1e-6 }
            };
            *latest = names.iter().enumerate().map(step).collect();
        });
    }
}
