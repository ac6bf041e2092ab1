//! A scene's environment on the device: the nodes of a panorama. See `shaders/scene/environment.wgsl`.

use std::sync::Arc;

use super::device::Gpu;
use crate::error::Result;
use crate::scene::description::Environment;
use crate::scene::environment::image::EnvironmentImage;

/// Faces of a cube as layers of a texture, which does not count among the few storage buffers of core WebGPU.
pub(super) struct Panorama {
    /// Whose; none for environments without.
    image: Option<Arc<EnvironmentImage>>,
    pub(super) view: wgpu::TextureView,
}

fn image_of(environment: &Environment) -> Option<&Arc<EnvironmentImage>> {
    match environment {
        Environment::Image(image) => Some(image),
        Environment::Constant(_) | Environment::Sky { .. } => None,
    }
}

impl Panorama {
    /// Whether it is that of this environment.
    pub(super) fn is_of(&self, environment: &Environment) -> bool {
        match (&self.image, image_of(environment)) {
            (Some(own), Some(other)) => Arc::ptr_eq(own, other),
            (own, other) => own.is_none() && other.is_none(),
        }
    }

    pub(super) fn new(gpu: &Gpu, environment: &Environment) -> Result<Self> {
        let image = image_of(environment).cloned();
        let side = image.as_ref().map_or(1, |image| image.cells() + 1);
        let face = wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 };
        gpu.allocations.set(gpu.allocations.get() + 1);
        let texture = gpu.checked(|| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("panorama"),
                size: wgpu::Extent3d { depth_or_array_layers: 6, ..face },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba32Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            })
        })?;
        let nodes = image.as_ref().map_or(&[][..], |image| image.nodes());
        for (layer, nodes) in (0..).zip(nodes.chunks((side * side) as usize)) {
            let texels: Vec<[f32; 4]> = nodes.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
            gpu.checked(|| {
                gpu.queue.write_texture(
                    wgpu::TexelCopyTextureInfo {
                        texture: &texture,
                        mip_level: 0,
                        origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
                        aspect: wgpu::TextureAspect::All,
                    },
                    bytemuck::cast_slice(&texels),
                    wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(side * 16),
                        rows_per_image: Some(side),
                    },
                    face,
                );
                // Sent before the next face is made.
                gpu.queue.submit([]);
            })?;
        }
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        Ok(Self { image, view })
    }
}
