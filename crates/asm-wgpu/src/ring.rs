//! Buffers that the host maps when the commands that use them are done, without anybody waiting.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use crate::device::Gpu;

/// Frames that may be on their way at once: one that runs, one that waits, one that is recorded.
pub(crate) const FRAMES_IN_FLIGHT: usize = 3;

/// The device's.
const FREE: u8 = 0;
/// Comes back with a submission.
const PENDING: u8 = 1;
/// Mapped.
const READY: u8 = 2;

/// A buffer that is the device's or the host's.
pub(crate) struct Mapped {
    pub(crate) buffer: wgpu::Buffer,
    mode: wgpu::MapMode,
    state: Arc<AtomicU8>,
}

impl Mapped {
    /// That brings bytes to the device; the host's to begin with.
    pub(crate) fn for_writing(gpu: &Gpu, label: &str, size: u64) -> Self {
        let usage = wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC;
        let buffer = gpu.mapped_buffer(label, size, usage);
        Self { buffer, mode: wgpu::MapMode::Write, state: Arc::new(AtomicU8::new(READY)) }
    }

    /// That brings bytes to the host; the device's to begin with.
    pub(crate) fn for_reading(gpu: &Gpu, label: &str, size: u64) -> Self {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let buffer = gpu.buffer(label, size, usage);
        Self { buffer, mode: wgpu::MapMode::Read, state: Arc::new(AtomicU8::new(FREE)) }
    }

    pub(crate) fn is_ready(&self) -> bool {
        self.state.load(Ordering::Acquire) == READY
    }

    fn is_free(&self) -> bool {
        self.state.load(Ordering::Acquire) == FREE
    }

    /// Leave it to the device.
    pub(crate) fn give(&self) {
        self.buffer.unmap();
        self.state.store(FREE, Ordering::Release);
    }

    /// Have it back once the encoder's commands are done.
    pub(crate) fn take_back(&self, encoder: &wgpu::CommandEncoder) {
        self.state.store(PENDING, Ordering::Release);
        let state = Arc::clone(&self.state);
        encoder.map_buffer_on_submit(&self.buffer, self.mode, .., move |result| {
            state.store(if result.is_ok() { READY } else { FREE }, Ordering::Release);
        });
    }
}

/// Buffers that bring what frames leave behind to the host, as many as frames may be on their way.
pub(crate) struct ReadBacks {
    slots: Vec<Slot>,
    frame: u64,
}

struct Slot {
    mapped: Mapped,
    /// The last frame that used it.
    frame: u64,
}

impl ReadBacks {
    pub(crate) fn new(gpu: &Gpu, label: &str, size: u64) -> Self {
        let slot = |_| Slot { mapped: Mapped::for_reading(gpu, label, size), frame: 0 };
        Self { slots: (0..FRAMES_IN_FLIGHT).map(slot).collect(), frame: 0 }
    }

    /// Frames that were recorded.
    pub(crate) const fn frames(&self) -> u64 {
        self.frame
    }

    /// The buffer for the frame that is recorded; none if all are still on their way.
    pub(crate) fn next(&mut self) -> Option<&Mapped> {
        self.frame += 1;
        let slot = self.slots.iter_mut().find(|slot| slot.mapped.is_free())?;
        slot.frame = self.frame;
        Some(&slot.mapped)
    }

    /// Call `see` with what has arrived, the newest last.
    pub(crate) fn collect(&mut self, mut see: impl FnMut(&[u8])) {
        let ready = |slots: &[Slot]| {
            let ready = slots.iter().enumerate().filter(|(_, slot)| slot.mapped.is_ready());
            ready.min_by_key(|(_, slot)| slot.frame).map(|(i, _)| i)
        };
        while let Some(oldest) = ready(&self.slots) {
            let mapped = &self.slots[oldest].mapped;
            if let Ok(view) = mapped.buffer.get_mapped_range(..) {
                see(&view);
            }
            mapped.give();
        }
    }
}
