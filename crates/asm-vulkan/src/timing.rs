//! Times per step from timestamp queries, fetched without waiting: they come a frame late.

use std::sync::Arc;

use ash::vk;
use frame_plan::{DeviceType, ExecuteError, StepTime};

use crate::device::Gpu;
use crate::object::Owned;

/// Timestamps before the first and after every step of a plan, for each frame that may be unfinished.
pub(crate) struct Timing {
    queries: Owned<vk::QueryPool>,
    /// Of the last frame that was taken over.
    times: Vec<StepTime>,
    /// One has been.
    taken: bool,
    /// Software devices (Mesa's, after a draw) write a timestamp only when the next one is asked for: ask twice.
    repeats: u32,
    nanoseconds_per_tick: f64,
    /// Bits of a timestamp that count.
    mask: u64,
    /// First query of the frame that is being recorded.
    first: u32,
    /// Times of the frame in each place of the ring have not been taken over yet.
    pending: Vec<bool>,
    ticks: Vec<u64>,
}

impl Timing {
    /// Queries for a plan's top-level steps and `frames` frames at once; none if the queue has no timestamps.
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        names: Vec<String>,
        frames: usize,
    ) -> Result<Option<Self>, ExecuteError> {
        if gpu.timestamp_bits == 0 || names.is_empty() {
            return Ok(None);
        }
        let repeats = if gpu.info.device_type == DeviceType::Cpu { 2 } else { 1 };
        let per_frame = (names.len() as u32 + 1) * repeats;
        let create = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(per_frame * frames as u32);
        // SAFETY: the description is whole, and the queue's timestamps were asked for above.
        let raw = unsafe { gpu.device.create_query_pool(&create, None) }
            .map_err(|e| gpu.error(e, "creating a query pool"))?;
        Ok(Some(Self {
            queries: Owned::new(gpu, raw),
            ticks: vec![0; per_frame as usize],
            times: names.into_iter().map(|name| StepTime { name, milliseconds: 0.0 }).collect(),
            taken: false,
            repeats,
            nanoseconds_per_tick: f64::from(gpu.properties.timestamp_period),
            mask: u64::MAX >> (64 - gpu.timestamp_bits.min(64)),
            first: 0,
            pending: vec![false; frames],
        }))
    }

    /// Take over the times of the finished frame at this place of the ring, and make it ready for the next one.
    pub(crate) fn begin(&mut self, gpu: &Gpu, commands: vk::CommandBuffer, frame: usize) {
        self.collect(gpu, frame);
        let per_frame = self.ticks.len() as u32;
        self.first = frame as u32 * per_frame;
        self.pending[frame] = true;
        // SAFETY: the commands are being recorded outside of any rendering; nothing pending uses these queries.
        unsafe { gpu.device.cmd_reset_query_pool(commands, self.queries.raw(), self.first, per_frame) }
    }

    /// Record the timestamp between step `i - 1` and step `i`.
    pub(crate) fn mark(&self, gpu: &Gpu, commands: vk::CommandBuffer, i: u32) {
        for repeat in 0..self.repeats {
            let query = self.first + i * self.repeats + repeat;
            let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
            // SAFETY: the commands are being recorded; the query was reset in `begin` and is written once.
            unsafe { gpu.device.cmd_write_timestamp2(commands, stage, self.queries.raw(), query) }
        }
    }

    /// Take over the times of the frame at this place of the ring, which has finished.
    pub(crate) fn collect(&mut self, gpu: &Gpu, frame: usize) {
        if !std::mem::take(&mut self.pending[frame]) {
            return;
        }
        let first = (frame * self.ticks.len()) as u32;
        let flags = vk::QueryResultFlags::TYPE_64;
        // SAFETY: the queries exist, and `ticks` has room for all of a frame.
        let result =
            unsafe { gpu.device.get_query_pool_results(self.queries.raw(), first, &mut self.ticks, flags) };
        if result.is_err() {
            // Nothing is known of a frame that a lost device, or a host that dropped its commands, never ran.
            return;
        }
        let repeats = self.repeats as usize;
        for (i, time) in self.times.iter_mut().enumerate() {
            let [begin, end] = [i * repeats, (i + 1) * repeats].map(|query| self.ticks[query]);
            let nanoseconds = (end.wrapping_sub(begin) & self.mask) as f64 * self.nanoseconds_per_tick;
            time.milliseconds = nanoseconds * 1e-6;
        }
        self.taken = true;
    }

    /// Times of the last frame that was taken over; none before the first.
    pub(crate) fn latest(&self) -> Option<&[StepTime]> {
        self.taken.then_some(&*self.times)
    }
}
