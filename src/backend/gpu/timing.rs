//! How long the passes took, by the device's own clock.

use super::device::Gpu;
use crate::error::Result;

/// Begin and end of projection, and of resolving.
const STAMPS: u32 = 4;
const BYTES: u64 = 8 * STAMPS as u64;

pub(super) struct Timing {
    pub(super) stamps: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    out: wgpu::Buffer,
    /// Nanoseconds a tick.
    period: f32,
}

impl Timing {
    /// `None` where passes cannot be timed.
    pub(super) fn new(gpu: &Gpu) -> Result<Option<Self>> {
        use wgpu::BufferUsages as U;
        if !gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY) {
            return Ok(None);
        }
        let stamps = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("times"),
            ty: wgpu::QueryType::Timestamp,
            count: STAMPS,
        });
        Ok(Some(Self {
            stamps,
            resolved: gpu.buffer("times", BYTES, U::QUERY_RESOLVE | U::COPY_SRC)?,
            out: gpu.buffer("times", BYTES, U::MAP_READ | U::COPY_DST)?,
            period: gpu.queue.get_timestamp_period(),
        }))
    }

    pub(super) fn copy_out(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.stamps, 0..STAMPS, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.out, 0, BYTES);
    }

    /// Of projection with drawing, and of resolving.
    pub(super) fn milliseconds(&self, gpu: &Gpu) -> Result<[f64; 2]> {
        let period = f64::from(self.period) * 1e-6;
        gpu.read::<u64, _>(&self.out, BYTES, |ticks| {
            [0, 2].map(|i| ticks[i + 1].saturating_sub(ticks[i]) as f64 * period)
        })
    }
}
