//! Pictures in the window, texel by texel. egui's own shader filters, tints and blends: without a graphics card that takes
//! longer than some of the pictures.

use std::sync::Arc;

use eframe::egui::{ColorImage, Painter, Rect, Shape};
use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait, RenderState};
use eframe::{egui, egui_wgpu, wgpu};

/// A picture that replaces what is under it.
#[derive(Clone)]
pub(super) struct Blit {
    /// Which of the pictures that are shown together.
    slot: usize,
    /// Another number for another picture.
    version: u64,
    picture: Arc<ColorImage>,
}

/// What pictures are drawn with; lives with egui's renderer.
struct Blitter {
    pipeline: wgpu::RenderPipeline,
    format: wgpu::TextureFormat,
    slots: Vec<Option<Slot>>,
}

/// A picture on the device.
struct Slot {
    version: u64,
    texture: wgpu::Texture,
    group: wgpu::BindGroup,
}

/// Makes a window able to show [`Blit`]s up to the returned side, px.
pub(super) fn install(state: &RenderState) -> u32 {
    let blitter = Blitter::new(&state.device, state.target_format);
    state.renderer.write().callback_resources.insert(blitter);
    state.device.limits().max_texture_dimension_2d
}

impl Blit {
    pub(super) fn new(slot: usize, version: u64, picture: ColorImage) -> Self {
        Self { slot, version, picture: Arc::new(picture) }
    }

    /// Fills `rect` as far as the painter's clip rectangle reaches.
    pub(super) fn paint(&self, painter: &Painter, rect: Rect) {
        painter.add(Shape::Callback(Callback::new_paint_callback(rect, self.clone())));
    }
}

impl Blitter {
    fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("blit"),
            source: wgpu::ShaderSource::Wgsl(include_str!("../../shaders/viewer/blit.wgsl").into()),
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("blit"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(target.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        // A target that encodes wants linear light.
        let format = match target.is_srgb() {
            true => wgpu::TextureFormat::Rgba8UnormSrgb,
            false => wgpu::TextureFormat::Rgba8Unorm,
        };
        Self { pipeline, format, slots: Vec::new() }
    }

    fn slot(&self, device: &wgpu::Device, size: wgpu::Extent3d, version: u64) -> Slot {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("blit"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("blit"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&view),
            }],
        });
        Slot { version, texture, group }
    }
}

impl CallbackTrait for Blit {
    /// Uploads the picture if that has not been done.
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _: &egui_wgpu::ScreenDescriptor,
        _: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let Some(blitter) = resources.get_mut::<Blitter>() else { return Vec::new() };
        let [width, height] = self.picture.size.map(|side| u32::try_from(side).unwrap_or(u32::MAX));
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let slots = blitter.slots.len().max(self.slot + 1);
        blitter.slots.resize_with(slots, || None);
        let slot = match blitter.slots[self.slot].take() {
            Some(slot) if slot.version == self.version => slot,
            old => {
                let fits = old.filter(|old| old.texture.size() == size);
                let slot = match fits {
                    Some(slot) => Slot { version: self.version, ..slot },
                    None => blitter.slot(device, size, self.version),
                };
                let layout = wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(4 * width),
                    rows_per_image: Some(height),
                };
                let to = slot.texture.as_image_copy();
                queue.write_texture(to, self.picture.as_raw(), layout, size);
                slot
            }
        };
        blitter.slots[self.slot] = Some(slot);
        Vec::new()
    }

    fn paint(
        &self,
        _: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        let Some(blitter) = resources.get::<Blitter>() else { return };
        let Some(Some(slot)) = blitter.slots.get(self.slot) else { return };
        pass.set_pipeline(&blitter.pipeline);
        pass.set_bind_group(0, &slot.group, &[]);
        pass.draw(0..3, 0..1);
    }
}
