//! What changes between frames, on its way to the device with the next one.
//!
//! `Queue::write_buffer` would do, but makes a buffer for each call.

use frame_plan::device::Writes;
use frame_plan::{ExecuteError, Plan};

use crate::device::{Gpu, device_error};
use crate::resources::ParamsBuffer;
use crate::ring::{FRAMES_IN_FLIGHT, Mapped};

/// Room for writes is made beforehand up to this size; a frame that writes more makes it when it comes.
const MOST_BYTES_BEFOREHAND: u64 = 16 << 20;

/// Writes of the host since the last frame, and the buffers they go over in.
pub(crate) struct Uploads {
    pub(crate) writes: Writes<wgpu::Buffer>,
    ring: Vec<Mapped>,
}

impl Uploads {
    /// With room from the start for new values of everything that `plan` has given values.
    pub(crate) fn new(gpu: &Gpu, plan: &Plan, params: &ParamsBuffer) -> Self {
        let bytes = plan.rewritable_bytes(&params.layout).min(MOST_BYTES_BEFOREHAND);
        let places = if bytes > 0 { FRAMES_IN_FLIGHT } else { 0 };
        Self {
            writes: Writes::with_capacity(bytes as usize),
            ring: (0..places).map(|_| staging(gpu, bytes)).collect(),
        }
    }

    /// Record all writes into a frame.
    pub(crate) fn record(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<(), ExecuteError> {
        if self.writes.is_empty() {
            return Ok(());
        }
        let needed = self.writes.bytes().len() as u64;
        let staging = place(gpu, &mut self.ring, needed);
        let mut view = staging
            .buffer
            .get_mapped_range_mut(..needed)
            .map_err(|e| device_error(format!("writing: {e}")))?;
        view.copy_from_slice(self.writes.bytes());
        drop(view);
        staging.give();
        for write in self.writes.all() {
            let (from, len) = (write.start as u64, write.len as u64);
            encoder.copy_buffer_to_buffer(&staging.buffer, from, &write.target, write.offset, len);
        }
        staging.take_back(encoder);
        self.writes.clear();
        Ok(())
    }
}

/// A buffer of the host's with room for so many bytes. There are more in the end if a host lets more frames be on their way, and
/// larger ones if it writes more at once.
fn place<'a>(gpu: &Gpu, ring: &'a mut Vec<Mapped>, needed: u64) -> &'a Mapped {
    let at = ring.iter().position(Mapped::is_ready).unwrap_or(ring.len());
    if ring.get(at).is_none_or(|mapped| mapped.buffer.size() < needed) {
        let replaced = at..(at + 1).min(ring.len());
        ring.splice(replaced, [staging(gpu, needed.next_power_of_two())]);
    }
    &ring[at]
}

fn staging(gpu: &Gpu, bytes: u64) -> Mapped {
    Mapped::for_writing(gpu, "writes", bytes.next_multiple_of(wgpu::MAP_ALIGNMENT))
}
