//! A scene's surfels on the device.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::device::Gpu;
use crate::error::Result;
use crate::scene::prepared::PreparedScene;

/// In the order of the scene; a list each, so that none is larger than a binding may be.
pub(super) struct SceneBuffers {
    /// Of the scene's surfels.
    pub(super) version: u64,
    /// x, y, z and radius.
    pub(super) place: [wgpu::Buffer; 4],
    /// Two halves of an octahedron's net.
    pub(super) normals: wgpu::Buffer,
    /// Three numbers of nine bits and their exponent.
    pub(super) radiance: wgpu::Buffer,
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
            radiance: words(&|i| packed_radiance(surfels.radiance[i]))?,
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

/// A unit vector as a place on the unfolded octahedron (Cigolle et al. 2014, "oct32").
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "16 bits")]
pub(super) fn packed_normal(n: Vec3) -> u32 {
    let sum = n.abs().element_sum();
    if !(sum > 0.0) {
        return 0;
    }
    let p = Vec2::new(n.x, n.y) / sum;
    let folded = if n.z < 0.0 {
        let sign = |v: f32| if v >= 0.0 { 1.0 } else { -1.0 };
        Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    } else {
        p
    };
    let half = |v: f32| u32::from((v.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    half(folded.x) | half(folded.y) << 16
}

/// Bits of a mantissa, and what their exponent is counted from.
const MANTISSA: i32 = 9;
const BIAS: i32 = 15;

/// Radiance with one exponent for all three; what is negative or no number is black.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "few bits")]
pub(super) fn packed_radiance(radiance: Vec3) -> u32 {
    const MOST: f32 = 65408.0; // 511/512 · 2^16
    let c = radiance.to_array().map(|v| if v > 0.0 { v.min(MOST) } else { 0.0 });
    let most = c[0].max(c[1]).max(c[2]);
    if most == 0.0 {
        return 0;
    }
    // The power of two above the largest.
    let mut exponent = ((most.to_bits() >> 23) as i32 - 126).max(-BIAS);
    let scaled = |v: f32, exponent: i32| (v * f32::powi(2.0, MANTISSA - exponent)).round() as u32;
    if scaled(most, exponent) > 511 {
        exponent += 1;
    }
    let [r, g, b] = c.map(|v| scaled(v, exponent));
    r | g << 9 | b << 18 | ((exponent + BIAS) as u32) << 27
}
