//! A scene's surfels on the device.

use rayon::prelude::*;

use super::device::Gpu;
use crate::error::Result;
use crate::geometry::look::packed_normal;
use crate::scene::prepared::PreparedScene;

/// In the order of the scene; a list each, so that none is larger than a binding may be.
pub(super) struct SceneBuffers {
    /// Of the scene's surfels.
    pub(super) version: u64,
    /// x, y, z and radius.
    pub(super) place: [wgpu::Buffer; 4],
    /// Two halves of an octahedron's net.
    pub(super) normals: wgpu::Buffer,
    /// Red and green as halves, and blue: in two lists, which are as long as a binding may be.
    pub(super) radiance: [wgpu::Buffer; 2],
}

/// Surfels packed and sent at a time: that bounds the memory besides theirs.
const SENT: usize = 1 << 20;

impl SceneBuffers {
    pub(super) fn new(gpu: &Gpu, scene: &PreparedScene) -> Result<Self> {
        let surfels = &scene.surfels;
        let count = surfels.len();
        let empty = || {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
            gpu.buffer("surfels", count as u64 * 4, usage)
        };
        let numbers = |list: &[f32]| -> Result<wgpu::Buffer> {
            let buffer = empty()?;
            send(gpu, &buffer, count, |range| list[range].to_vec())?;
            Ok(buffer)
        };
        let words = |of: &(dyn Fn(usize) -> u32 + Sync)| -> Result<wgpu::Buffer> {
            let buffer = empty()?;
            send(gpu, &buffer, count, |range| range.into_par_iter().map(of).collect())?;
            Ok(buffer)
        };
        Ok(Self {
            version: scene.surfel_version,
            place: [
                numbers(&surfels.x)?,
                numbers(&surfels.y)?,
                numbers(&surfels.z)?,
                numbers(&surfels.extent)?,
            ],
            normals: words(&|i| packed_normal(surfels.normals[i]))?,
            radiance: [
                words(&|i| {
                    let [r, g, _] = surfels.radiance[i].to_array();
                    packed_half(r) | packed_half(g) << 16
                })?,
                words(&|i| surfels.radiance[i].z.to_bits())?,
            ],
        })
    }
}

fn send<T: bytemuck::Pod>(
    gpu: &Gpu,
    buffer: &wgpu::Buffer,
    count: usize,
    part: impl Fn(std::ops::Range<usize>) -> Vec<T>,
) -> Result<()> {
    for first in (0..count).step_by(SENT) {
        let values = part(first..(first + SENT).min(count));
        gpu.checked(|| {
            gpu.queue.write_buffer(buffer, first as u64 * 4, bytemuck::cast_slice(&values));
            // Sent before the next part is made.
            gpu.queue.submit([]);
        })?;
    }
    Ok(())
}

/// The nearest half (IEEE 754 binary16); what is negative or no number is 0, what is too large the largest.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "16 bits")]
pub(super) fn packed_half(value: f32) -> u32 {
    const MOST: f32 = 65504.0;
    const LEAST_NORMAL: f32 = 6.103_515_6e-5; // 2^-14
    let v = if value > 0.0 { value.min(MOST) } else { 0.0 };
    if v < LEAST_NORMAL {
        // Multiples of 2^-24.
        return (v * 16_777_216.0).round() as u32;
    }
    // To even, at the 13 bits that a half has not.
    let bits = v.to_bits();
    let rounded = bits + 0xfff + (bits >> 13 & 1);
    ((rounded >> 13) - (112 << 10)).min(0x7bff)
}
