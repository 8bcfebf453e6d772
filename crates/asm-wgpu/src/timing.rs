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

/// Queries for the steps of a plan that run passes.
pub(crate) struct Timing {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    slots: Vec<Slot>,
    /// Steps with queries: step i of these writes queries 2 i and 2 i + 1.
    names: Vec<String>,
    nanoseconds_per_tick: f64,
    frame: u64,
    latest: Vec<StepTime>,
}

struct Slot {
    buffer: wgpu::Buffer,
    state: Arc<AtomicU8>,
    frame: u64,
}

impl Timing {
    /// Queries for steps of these names; none if the device has no timestamps.
    pub(crate) fn new(gpu: &Gpu, mut names: Vec<String>) -> Option<Self> {
        names.truncate(wgpu::QUERY_SET_MAX_QUERIES as usize / 2);
        if names.is_empty() || !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let count = names.len() as u32 * 2;
        let size = u64::from(count) * TIMESTAMP_BYTES;
        let buffer = |label, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        Some(Self {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("step times"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: buffer("step times", wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            slots: (0..SLOTS)
                .map(|_| Slot {
                    buffer: buffer(
                        "step times read back",
                        wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                    ),
                    state: Arc::new(AtomicU8::new(FREE)),
                    frame: 0,
                })
                .collect(),
            names,
            nanoseconds_per_tick: f64::from(gpu.queue.get_timestamp_period()),
            frame: 0,
            latest: Vec::new(),
        })
    }

    /// The query set, and the indices of the first and last timestamp of timed step `step`, if it has any.
    pub(crate) fn queries(&self, step: u32) -> Option<(&wgpu::QuerySet, u32, u32)> {
        ((step as usize) < self.names.len()).then_some((&self.queries, step * 2, step * 2 + 1))
    }

    /// Record the way of this frame's timestamps to the host, unless all slots are still on their way.
    pub(crate) fn resolve(&mut self, encoder: &mut wgpu::CommandEncoder) {
        self.collect();
        self.frame += 1;
        let Some(slot) = self.slots.iter_mut().find(|s| s.state.load(Ordering::Acquire) == FREE) else {
            return;
        };
        slot.frame = self.frame;
        slot.state.store(PENDING, Ordering::Release);
        encoder.resolve_query_set(&self.queries, 0..self.names.len() as u32 * 2, &self.resolved, 0);
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
                self.latest = self
                    .names
                    .iter()
                    .zip(ticks.chunks_exact(2))
                    .map(|(name, pair)| StepTime {
                        name: name.clone(),
                        milliseconds: pair[1].saturating_sub(pair[0]) as f64
                            * self.nanoseconds_per_tick
                            * 1e-6,
                    })
                    .collect();
            }
            slot.buffer.unmap();
            slot.state.store(FREE, Ordering::Release);
        }
    }
}
