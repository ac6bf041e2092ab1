//! Buffers on the device that frames reuse.

use super::device::Gpu;
use crate::camera::eye::ImageSize;
use crate::error::Result;

/// A buffer that grows and never shrinks.
pub(super) struct Grown {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: Option<wgpu::Buffer>,
}

impl Grown {
    pub(super) fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { label, usage, buffer: None }
    }

    /// Makes room for so many bytes, and some more.
    pub(super) fn hold(&mut self, gpu: &Gpu, bytes: u64) -> Result<()> {
        if self.buffer.as_ref().is_none_or(|b| b.size() < bytes) {
            self.buffer = None;
            let roomy = gpu.buffer(self.label, bytes + bytes / 2, self.usage);
            self.buffer = Some(roomy.or_else(|_| gpu.buffer(self.label, bytes, self.usage))?);
        }
        Ok(())
    }

    pub(super) fn buffer(&self) -> &wgpu::Buffer {
        self.buffer.as_ref().expect("it holds something")
    }
}

/// What depends on the picture's size only.
pub(super) struct PictureBuffers {
    size: ImageSize,
    capacity: u32,
    /// The pass's numbers.
    pub(super) frame: wgpu::Buffer,
    /// Heads of the pixels' lists, or of their keys.
    pub(super) heads: wgpu::Buffer,
    /// Keys' second halves.
    pub(super) tails: Option<wgpu::Buffer>,
    /// Entries of lists, and what is blended of them.
    pub(super) entries: Option<[wgpu::Buffer; 3]>,
    /// Radiance and coverage.
    pub(super) reflection: wgpu::Buffer,
    /// Depth and surfel.
    pub(super) nearest: wgpu::Buffer,
    /// On the CPU's side.
    pub(super) colors_out: wgpu::Buffer,
    pub(super) nearest_out: wgpu::Buffer,
    pub(super) count: wgpu::Buffer,
    /// What the rasteriser believes to draw on.
    pub(super) target: wgpu::TextureView,
}

impl PictureBuffers {
    pub(super) fn new(gpu: &Gpu, size: ImageSize, capacity: u32, lists: bool) -> Result<Self> {
        use wgpu::BufferUsages as U;
        let pixels = size.pixels() as u64;
        let own = U::STORAGE | U::COPY_SRC;
        let out = U::MAP_READ | U::COPY_DST;
        // Keys of 64 bits, or of 32 and their count.
        let heads = gpu.buffer("the pixels", pixels * 8 + 8, own | U::COPY_DST)?;
        let side = gpu.limits.max_texture_dimension_2d;
        let extent = wgpu::Extent3d {
            width: size.width.min(side),
            height: size.height.min(side),
            depth_or_array_layers: 1,
        };
        let texture = gpu.checked(|| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("target"),
                size: extent,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: TARGET,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        })?;
        Ok(Self {
            size,
            capacity,
            frame: gpu.buffer("frame", 64, U::UNIFORM | U::COPY_DST)?,
            heads,
            tails: match lists {
                true => None,
                false => Some(gpu.buffer("the pixels", pixels * 4 + 4, own | U::COPY_DST)?),
            },
            entries: match lists {
                true => Some([
                    gpu.buffer(
                        "splats of all pixels",
                        u64::from(capacity) * ENTRY_BYTES as u64,
                        own,
                    )?,
                    gpu.buffer("the pixels", pixels * 16, own)?,
                    gpu.buffer("the pixels", pixels * 16, own)?,
                ]),
                false => None,
            },
            reflection: gpu.buffer("the pixels", pixels * 16, own | U::COPY_DST)?,
            nearest: gpu.buffer("the pixels", pixels * 8, own)?,
            colors_out: gpu.buffer("the pixels", pixels * 16, out)?,
            nearest_out: gpu.buffer("the pixels", pixels * 8, out)?,
            count: gpu.buffer("count", 16, out)?,
            target: texture.create_view(&wgpu::TextureViewDescriptor::default()),
        })
    }

    /// Whether they are those of such a picture.
    pub(super) fn fits(&self, size: ImageSize, capacity: u32, lists: bool) -> bool {
        let room = !lists || capacity <= self.capacity;
        self.size == size && lists == self.entries.is_some() && room
    }

    pub(super) fn size(&self) -> ImageSize {
        self.size
    }

    pub(super) fn copy_out(&self, encoder: &mut wgpu::CommandEncoder, planes: bool) {
        let pixels = self.size.pixels() as u64;
        encoder.copy_buffer_to_buffer(&self.reflection, 0, &self.colors_out, 0, pixels * 16);
        if planes {
            encoder.copy_buffer_to_buffer(&self.nearest, 0, &self.nearest_out, 0, pixels * 8);
        }
    }
}

/// Of `Entry` in `shaders/splat/lists.wgsl`.
pub(super) const ENTRY_BYTES: usize = 20;

/// Of the target that nothing is written to.
pub(super) const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;
