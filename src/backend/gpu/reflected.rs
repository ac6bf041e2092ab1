//! Triangles between images on the device: its rasteriser says which triangle each pixel shows, and where on it.
//!
//! The frontmost back faces of the mirror go into a depth texture, the mirror's own pixels into the stencil, then the
//! triangles are drawn (Roger & Holzschuch section 3.3.6).

use glam::Vec3;

use super::buffers::Grown;
use super::device::Gpu;
use super::pipelines::module;
use super::shaders;
use crate::backend::cpu::search::raster::{Drawing, Hit};
use crate::error::Result;

/// As `View` in `shaders/passes/reflected.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct View {
    pub(super) position: [f32; 3],
    pub(super) focal_px: f32,
    pub(super) right: [f32; 3],
    pub(super) near: f32,
    pub(super) up: [f32; 3],
    pub(super) farthest: f32,
    pub(super) forward: [f32; 3],
    pub(super) on_mirror: u32,
    pub(super) size: [f32; 2],
    pub(super) first: u32,
    pub(super) end: u32,
}

/// A triangle and two weights, or zero.
const SHOWN: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;
const BACKS: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth24PlusStencil8;
/// Rows of a copied texture begin at multiples of this.
const ROW_BYTES: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;
/// Bytes of a pixel of [`SHOWN`].
const PIXEL_BYTES: u32 = 16;
/// Of the part's own pixels in the stencil.
const OWN: u32 = 1;

/// Everything for it on one device.
pub(super) struct Rasteriser {
    backs: wgpu::RenderPipeline,
    own: wgpu::RenderPipeline,
    triangles: wgpu::RenderPipeline,
    view: wgpu::Buffer,
    corners: Grown,
    indices: Grown,
    ids: Grown,
    out: Grown,
    targets: Option<Targets>,
}

/// What a picture is drawn on.
struct Targets {
    size: [u32; 2],
    shown: wgpu::Texture,
    backs: wgpu::TextureView,
    depth: wgpu::TextureView,
}

/// What is drawn: corners with their distances, and triangles.
struct Geometry {
    corners: Vec<[f32; 4]>,
    indices: Vec<u32>,
    /// Of each triangle: the object's index, and its own there.
    names: Vec<(usize, usize)>,
}

impl Rasteriser {
    pub(super) fn new(gpu: &Gpu) -> Result<Self> {
        use wgpu::BufferUsages as U;
        let text = shaders::reflected();
        let (backs, own, triangles) = gpu.checked(|| {
            let module = module(gpu, &text);
            let order = depth(DEPTH, Some(wgpu::StencilOperation::Keep));
            let mark = wgpu::DepthStencilState {
                depth_write_enabled: Some(false),
                depth_compare: Some(wgpu::CompareFunction::Always),
                ..depth(DEPTH, Some(wgpu::StencilOperation::Replace))
            };
            (
                pipeline(gpu, &module, "back_corner", None, depth(BACKS, None)),
                pipeline(gpu, &module, "whole_picture", Some(("own_pixels", false)), mark),
                pipeline(gpu, &module, "image_corner", Some(("show_triangle", true)), order),
            )
        })?;
        let stored = U::STORAGE | U::COPY_DST;
        Ok(Self {
            backs,
            own,
            triangles,
            view: gpu.buffer("view", size_of::<View>() as u64, U::UNIFORM | U::COPY_DST)?,
            corners: Grown::new("images", stored),
            indices: Grown::new("triangles between images", stored),
            ids: Grown::new("the pixels", stored),
            out: Grown::new("the pixels", U::MAP_READ | U::COPY_DST),
            targets: None,
        })
    }

    /// Which triangle each pixel of the part shows; `None` if the picture is larger than the device's textures.
    pub(super) fn draw(&mut self, gpu: &Gpu, drawing: &Drawing<'_>) -> Result<Option<Vec<Hit>>> {
        let size = [drawing.eye.size.width, drawing.eye.size.height];
        if size.iter().any(|&side| side > gpu.limits.max_texture_dimension_2d) {
            return Ok(None);
        }
        let images = Geometry::images(drawing);
        let backs = if drawing.on_mirror { Geometry::backs(drawing) } else { Geometry::empty() };
        if self.targets.as_ref().is_none_or(|targets| targets.size != size) {
            self.targets = None;
            self.targets = Some(Targets::new(gpu, size)?);
        }
        self.run(gpu, view(drawing, [&images, &backs]), [&images, &backs], drawing)?;
        let row = row_words(size);
        let words = row * size[1] as usize;
        let hits = gpu.read::<u32, _>(self.out.buffer(), words as u64 * 4, |words| {
            let width = size[0] as usize;
            let pixels = words.chunks(row).flat_map(|row| row.chunks(4).take(width)).enumerate();
            let hit = |(pixel, found): (usize, &[u32])| {
                let (object, triangle) = *images.names.get(found[0].checked_sub(1)? as usize)?;
                let [b, c] = [f32::from_bits(found[1]), f32::from_bits(found[2])];
                Some(Hit { pixel, object, triangle, weights: [1.0 - b - c, b, c] })
            };
            pixels.filter_map(hit).collect()
        })?;
        Ok(Some(hits))
    }

    fn run(
        &mut self,
        gpu: &Gpu,
        view: View,
        [images, backs]: [&Geometry; 2],
        drawing: &Drawing<'_>,
    ) -> Result<()> {
        let Targets { size, shown, backs: backs_view, depth } =
            self.targets.as_ref().expect("they were made");
        let bytes = row_words(*size) as u64 * 4 * u64::from(size[1]);
        self.out.hold(gpu, bytes)?;
        let ids: &[u8] = bytemuck::cast_slice(&drawing.visibility.mirror_ids);
        send(gpu, &mut self.ids, ids)?;
        let backs_view = backs_view.clone();
        gpu.checked(|| gpu.queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&view)))?;
        // Both draws read the same buffers: the queue keeps their writes and submissions in order.
        send(gpu, &mut self.corners, bytemuck::cast_slice(&backs.corners))?;
        send(gpu, &mut self.indices, bytemuck::cast_slice(&backs.indices))?;
        gpu.checked(|| {
            let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &self.backs.get_bind_group_layout(0),
                entries: &entries([
                    (0, self.view.as_entire_binding()),
                    (1, self.corners.buffer().as_entire_binding()),
                    (2, self.indices.buffer().as_entire_binding()),
                ]),
            });
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("back faces"),
                    depth_stencil_attachment: Some(cleared(&backs_view, false)),
                    ..Default::default()
                });
                pass.set_pipeline(&self.backs);
                pass.set_bind_group(0, &group, &[]);
                pass.draw(0..count(backs.indices.len()), 0..1);
            }
            gpu.queue.submit([encoder.finish()]);
        })?;
        send(gpu, &mut self.corners, bytemuck::cast_slice(&images.corners))?;
        send(gpu, &mut self.indices, bytemuck::cast_slice(&images.indices))?;
        gpu.checked(|| {
            let own = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &self.own.get_bind_group_layout(0),
                entries: &entries([
                    (0, self.view.as_entire_binding()),
                    (3, self.ids.buffer().as_entire_binding()),
                ]),
            });
            let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &self.triangles.get_bind_group_layout(0),
                entries: &entries([
                    (0, self.view.as_entire_binding()),
                    (1, self.corners.buffer().as_entire_binding()),
                    (2, self.indices.buffer().as_entire_binding()),
                    (4, wgpu::BindingResource::TextureView(&backs_view)),
                ]),
            });
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("reflected triangles"),
                    color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                        view: &shown.create_view(&Default::default()),
                        depth_slice: None,
                        resolve_target: None,
                        ops: wgpu::Operations {
                            load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                            store: wgpu::StoreOp::Store,
                        },
                    })],
                    depth_stencil_attachment: Some(cleared(depth, true)),
                    ..Default::default()
                });
                pass.set_stencil_reference(OWN);
                pass.set_pipeline(&self.own);
                pass.set_bind_group(0, &own, &[]);
                pass.draw(0..3, 0..1);
                pass.set_pipeline(&self.triangles);
                pass.set_bind_group(0, &group, &[]);
                pass.draw(0..count(images.indices.len()), 0..1);
            }
            let extent =
                wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 };
            encoder.copy_texture_to_buffer(
                shown.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: self.out.buffer(),
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(4 * count(row_words(*size))),
                        rows_per_image: None,
                    },
                },
                extent,
            );
            gpu.queue.submit([encoder.finish()]);
        })
    }
}

impl Targets {
    fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self> {
        use wgpu::TextureUsages as U;
        let texture = |label, format, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        gpu.checked(|| {
            let view = |texture: wgpu::Texture| texture.create_view(&Default::default());
            Self {
                size,
                shown: texture("triangles shown", SHOWN, U::RENDER_ATTACHMENT | U::COPY_SRC),
                backs: view(texture(
                    "back faces",
                    BACKS,
                    U::RENDER_ATTACHMENT | U::TEXTURE_BINDING,
                )),
                depth: view(texture("depth", DEPTH, U::RENDER_ATTACHMENT)),
            }
        })
    }
}

impl Geometry {
    fn empty() -> Self {
        Self { corners: vec![[0.0; 4]], indices: Vec::new(), names: Vec::new() }
    }

    /// All triangles that are drawn.
    fn images(drawing: &Drawing<'_>) -> Self {
        let mut all = Self::empty();
        let before = |p: Vec3| (p - drawing.eye.position).dot(drawing.eye.forward) > 0.0;
        for (k, object) in drawing.objects.iter().enumerate() {
            let base = count(all.corners.len());
            all.corners.extend(
                object.places.iter().zip(&object.distances).map(|(p, &d)| [p.x, p.y, p.z, d]),
            );
            for (i, triangle) in object.triangles.iter().enumerate() {
                let places = triangle.map(|corner| object.places[corner as usize]);
                // Images on the mirror are before the eye, or their search did not end.
                let drawn =
                    places.iter().all(|p| p.is_finite() && (!drawing.on_mirror || before(*p)));
                if drawn {
                    all.indices.extend(triangle.map(|corner| base + corner));
                    all.names.push((k, i));
                }
            }
        }
        all
    }

    /// The mirror's back faces.
    fn backs(drawing: &Drawing<'_>) -> Self {
        let positions = &drawing.scene.mirrors[drawing.part.mirror].positions;
        Self {
            corners: positions.iter().map(|p| [p.x, p.y, p.z, 0.0]).collect(),
            indices: drawing.back_faces().into_iter().flatten().collect(),
            names: Vec::new(),
        }
    }
}

fn view(drawing: &Drawing<'_>, geometry: [&Geometry; 2]) -> View {
    let eye = drawing.eye;
    let depth = |i: &u32, g: &Geometry| {
        let [x, y, z, _] = g.corners[*i as usize];
        (Vec3::new(x, y, z) - eye.position).dot(eye.forward)
    };
    let depths = geometry.into_iter().flat_map(|g| g.indices.iter().map(move |i| depth(i, g)));
    let nearest = depths.filter(|&d| d > 0.0).fold(f32::MAX, f32::min);
    View {
        position: eye.position.to_array(),
        focal_px: eye.focal_px,
        right: eye.right.to_array(),
        // Half of it, so that the nearest corner is not cut by rounding.
        near: 0.5 * nearest.min(1e30),
        up: eye.up.to_array(),
        farthest: drawing.farthest(),
        forward: eye.forward.to_array(),
        on_mirror: u32::from(drawing.on_mirror),
        size: [eye.size.width as f32, eye.size.height as f32],
        first: drawing.part.triangles.start,
        end: drawing.part.triangles.end,
    }
}

/// Words of a row of the copied picture.
fn row_words([width, _]: [u32; 2]) -> usize {
    ((width * PIXEL_BYTES).next_multiple_of(ROW_BYTES) / 4) as usize
}

fn count(n: usize) -> u32 {
    u32::try_from(n).expect("buffers are smaller")
}

fn send(gpu: &Gpu, buffer: &mut Grown, bytes: &[u8]) -> Result<()> {
    buffer.hold(gpu, bytes.len() as u64)?;
    gpu.checked(|| gpu.queue.write_buffer(buffer.buffer(), 0, bytes))
}

fn entries<const N: usize>(
    list: [(u32, wgpu::BindingResource<'_>); N],
) -> [wgpu::BindGroupEntry<'_>; N] {
    list.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
}

/// A depth test, and what becomes of the stencil where it is passed: the part's own pixels are marked, then asked for.
fn depth(
    format: wgpu::TextureFormat,
    stencil: Option<wgpu::StencilOperation>,
) -> wgpu::DepthStencilState {
    let compare = match stencil {
        Some(wgpu::StencilOperation::Keep) => wgpu::CompareFunction::Equal,
        _ => wgpu::CompareFunction::Always,
    };
    let face = wgpu::StencilFaceState {
        compare,
        fail_op: wgpu::StencilOperation::Keep,
        depth_fail_op: wgpu::StencilOperation::Keep,
        pass_op: stencil.unwrap_or(wgpu::StencilOperation::Keep),
    };
    let bits = if stencil.is_some() { OWN } else { 0 };
    wgpu::DepthStencilState {
        format,
        depth_write_enabled: Some(true),
        depth_compare: Some(wgpu::CompareFunction::Less),
        stencil: match stencil {
            Some(_) => {
                wgpu::StencilState { front: face, back: face, read_mask: bits, write_mask: bits }
            }
            None => wgpu::StencilState::default(),
        },
        bias: wgpu::DepthBiasState::default(),
    }
}

fn cleared(view: &wgpu::TextureView, stencil: bool) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations {
            load: wgpu::LoadOp::Clear(1.0),
            store: wgpu::StoreOp::Store,
        }),
        stencil_ops: stencil.then_some(wgpu::Operations {
            load: wgpu::LoadOp::Clear(0),
            store: wgpu::StoreOp::Discard,
        }),
    }
}

/// A fragment stage writes to [`SHOWN`] or, like the picture of own pixels, to the stencil only.
fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    vertex: &str,
    fragment: Option<(&str, bool)>,
    depth: wgpu::DepthStencilState,
) -> wgpu::RenderPipeline {
    let target = |writes: bool| {
        let write_mask = if writes { wgpu::ColorWrites::ALL } else { wgpu::ColorWrites::empty() };
        Some(wgpu::ColorTargetState { format: SHOWN, blend: None, write_mask })
    };
    let targets = [target(fragment.is_some_and(|(_, writes)| writes))];
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(vertex),
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(depth),
        multisample: wgpu::MultisampleState::default(),
        fragment: fragment.map(|(name, _)| wgpu::FragmentState {
            module,
            entry_point: Some(name),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
