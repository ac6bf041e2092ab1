//! The passes' pipelines for one shape of splats, and how a frame runs through them.

use super::Path;
use super::adapters::ATOMICS_64;
use super::buffers::{PictureBuffers, TARGET};
use super::device::Gpu;
use super::records::{CHUNK, Chunks};
use super::scene::SceneBuffers;
use super::shaders::{self, GROUPS};
use super::timing::Timing;
use crate::error::Result;
use crate::plan::SplatShape;

pub(super) struct Pipelines {
    pub(super) shape: SplatShape,
    splat_layout: wgpu::BindGroupLayout,
    resolve_layout: wgpu::BindGroupLayout,
    close_layout: wgpu::BindGroupLayout,
    /// One, or keys' two halves one after the other.
    vertex: Vec<wgpu::RenderPipeline>,
    compute: Vec<wgpu::ComputePipeline>,
    /// For what the vertex path, and the compute path, leave.
    resolve: [wgpu::ComputePipeline; 2],
    close: Option<wgpu::ComputePipeline>,
    /// Keys of 64 bits, on the compute path.
    wide: bool,
}

/// A frame's buffers as the passes see them.
pub(super) struct Groups {
    splat: wgpu::BindGroup,
    resolve: wgpu::BindGroup,
    close: Option<wgpu::BindGroup>,
}

/// A binding: who sees it, and whether it is written.
fn entry(
    binding: u32,
    stages: wgpu::ShaderStages,
    ty: wgpu::BufferBindingType,
) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: stages,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

const READ: wgpu::BufferBindingType = wgpu::BufferBindingType::Storage { read_only: true };
const WRITE: wgpu::BufferBindingType = wgpu::BufferBindingType::Storage { read_only: false };
const UNIFORM: wgpu::BufferBindingType = wgpu::BufferBindingType::Uniform;

impl Pipelines {
    pub(super) fn new(gpu: &Gpu, shape: SplatShape) -> Result<Self> {
        gpu.checked(|| Self::made(gpu, shape))
    }

    fn made(gpu: &Gpu, shape: SplatShape) -> Self {
        use wgpu::ShaderStages as S;
        let lists = shape == SplatShape::Ellipse;
        let wide = !lists && gpu.features.contains(ATOMICS_64);
        let layout = |label: &str, entries: &[wgpu::BindGroupLayoutEntry]| {
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(label),
                entries,
            })
        };
        let all = S::VERTEX | S::FRAGMENT | S::COMPUTE;
        let (places, pixels) = (S::VERTEX | S::COMPUTE, S::FRAGMENT | S::COMPUTE);
        let mut splat = vec![entry(0, all, UNIFORM), entry(1, all, READ)];
        splat.extend((2..7).map(|binding| entry(binding, places, READ)));
        splat.extend([entry(7, pixels, WRITE), entry(8, pixels, WRITE)]);
        let splat_layout = layout("splat", &splat);
        let mut resolve = vec![
            entry(0, S::COMPUTE, UNIFORM),
            entry(1, S::COMPUTE, READ),
            entry(2, S::COMPUTE, READ),
            entry(3, S::COMPUTE, WRITE),
            entry(5, S::COMPUTE, WRITE),
            entry(6, S::COMPUTE, READ),
            entry(7, S::COMPUTE, WRITE),
            entry(8, S::COMPUTE, WRITE),
        ];
        if lists {
            resolve.push(entry(4, S::COMPUTE, WRITE));
        }
        let resolve_layout = layout("resolve", &resolve);
        let close_layout = layout(
            "close",
            &[
                entry(0, S::COMPUTE, UNIFORM),
                entry(1, S::COMPUTE, READ),
                entry(2, S::COMPUTE, READ),
                entry(3, S::COMPUTE, READ),
                entry(4, S::COMPUTE, WRITE),
            ],
        );
        let compute = |text: &str, name: &str, layout| compute(gpu, text, name, Some(layout));
        let text = shaders::splat(shape, false, wide);
        let both = ["project_chunk", "project_chunk_again"];
        let names = if lists || wide { &both[..1] } else { &both[..] };
        let projections = names.iter().map(|name| compute(&text, name, &splat_layout)).collect();
        let resolved = if lists { "blend" } else { "resolve" };
        let resolve = [false, wide]
            .map(|wide| compute(&shaders::resolve(shape, wide), resolved, &resolve_layout));
        let fragments: &[&str] = if lists { &["cover"] } else { &["cover", "cover_again"] };
        let text = module(gpu, &shaders::splat(shape, true, false));
        let vertex = fragments
            .iter()
            .map(|name| rendering(gpu, &text, name, shape, &splat_layout))
            .collect();
        Self {
            shape,
            close: lists.then(|| compute(&shaders::close(), "close", &close_layout)),
            vertex,
            compute: projections,
            resolve,
            splat_layout,
            resolve_layout,
            close_layout,
            wide,
        }
    }

    pub(super) fn groups(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        plan: &wgpu::Buffer,
        picture: &PictureBuffers,
    ) -> Groups {
        let [x, y, z, extent] = &scene.place;
        let frame = &picture.frame;
        let second = match (&picture.entries, &picture.tails) {
            (Some([entries, ..]), _) => entries,
            (None, Some(tails)) => tails,
            (None, None) => unreachable!("one of them is there"),
        };
        let splat = [
            (0, frame),
            (1, plan),
            (2, x),
            (3, y),
            (4, z),
            (5, extent),
            (6, &scene.normals),
            (7, &picture.heads),
            (8, second),
        ];
        let mut resolve = vec![
            (0, frame),
            (1, plan),
            (2, &scene.radiance[0]),
            (6, &scene.radiance[1]),
            (5, &picture.nearest),
            (7, &picture.heads),
            (8, second),
        ];
        let mut close = None;
        if let Some([_, colors, layers]) = &picture.entries {
            resolve.extend([(3, colors), (4, layers)]);
            let buffers =
                [(0, frame), (1, plan), (2, colors), (3, layers), (4, &picture.reflection)];
            close = Some(group(gpu, &self.close_layout, &buffers));
        } else {
            resolve.push((3, &picture.reflection));
        }
        Groups {
            splat: group(gpu, &self.splat_layout, &splat),
            resolve: group(gpu, &self.resolve_layout, &resolve),
            close,
        }
    }

    /// Projection, drawing and resolving.
    pub(super) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        groups: &Groups,
        picture: &PictureBuffers,
        path: Path,
        chunks: Chunks,
        timing: Option<&Timing>,
    ) {
        match path {
            Path::Vertex => self.draw(encoder, groups, picture, chunks, timing),
            Path::Compute => {
                let passes = self.compute.len();
                for (i, pipeline) in self.compute.iter().enumerate() {
                    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                        label: Some("project"),
                        timestamp_writes: timing
                            .map(|timing| wgpu::ComputePassTimestampWrites {
                                query_set: &timing.stamps,
                                beginning_of_pass_write_index: (i == 0).then_some(0),
                                end_of_pass_write_index: (i + 1 == passes).then_some(1),
                            })
                            .filter(|w| {
                                w.beginning_of_pass_write_index.is_some()
                                    || w.end_of_pass_write_index.is_some()
                            }),
                    });
                    pass.set_pipeline(pipeline);
                    pass.set_bind_group(0, &groups.splat, &[]);
                    dispatch(&mut pass, chunks.all());
                }
            }
        }
        let wide = usize::from(path == Path::Compute && self.wide);
        let pixels = picture.size().width as usize * picture.size().height as usize;
        let tasks = u32::try_from(pixels.div_ceil(64)).unwrap_or(u32::MAX);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("resolve"),
            timestamp_writes: timing.map(|timing| wgpu::ComputePassTimestampWrites {
                query_set: &timing.stamps,
                beginning_of_pass_write_index: Some(2),
                end_of_pass_write_index: Some(3),
            }),
        });
        pass.set_pipeline(&self.resolve[wide]);
        pass.set_bind_group(0, &groups.resolve, &[]);
        dispatch(&mut pass, tasks);
        if let (Some(close), Some(group)) = (&self.close, &groups.close) {
            pass.set_pipeline(close);
            pass.set_bind_group(0, group, &[]);
            dispatch(&mut pass, tasks);
        }
    }

    /// One draw for all chunks of a kind.
    fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        groups: &Groups,
        picture: &PictureBuffers,
        chunks: Chunks,
        timing: Option<&Timing>,
    ) {
        let per_chunk = CHUNK * if self.shape == SplatShape::Square1 { 1 } else { 6 };
        let passes = self.vertex.len();
        for (i, pipeline) in self.vertex.iter().enumerate() {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("splat"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &picture.target,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Discard,
                    },
                })],
                timestamp_writes: timing
                    .map(|timing| wgpu::RenderPassTimestampWrites {
                        query_set: &timing.stamps,
                        beginning_of_pass_write_index: (i == 0).then_some(0),
                        end_of_pass_write_index: (i + 1 == passes).then_some(1),
                    })
                    .filter(|w| {
                        w.beginning_of_pass_write_index.is_some()
                            || w.end_of_pass_write_index.is_some()
                    }),
                ..Default::default()
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &groups.splat, &[]);
            let (single, all) = (chunks.single * per_chunk, chunks.all() * per_chunk);
            let images = if chunks.first_root { 1 } else { 3 };
            pass.draw(0..single, 0..1);
            pass.draw(single..all, 0..images);
        }
    }
}

/// A compute pipeline; without a layout it gets the one that its text says.
pub(super) fn compute(
    gpu: &Gpu,
    text: &str,
    name: &str,
    layout: Option<&wgpu::BindGroupLayout>,
) -> wgpu::ComputePipeline {
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: layout.map(|layout| pipeline_layout(gpu, layout)).as_ref(),
        module: &module(gpu, text),
        entry_point: Some(name),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

/// Buffers by binding.
pub(super) fn group<'a>(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    buffers: impl IntoIterator<Item = &'a (u32, &'a wgpu::Buffer)>,
) -> wgpu::BindGroup {
    let buffers = buffers.into_iter();
    bound(gpu, layout, buffers.map(|&(binding, buffer)| (binding, buffer.as_entire_binding())))
}

/// Anything by binding.
pub(super) fn bound<'a>(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    resources: impl IntoIterator<Item = (u32, wgpu::BindingResource<'a>)>,
) -> wgpu::BindGroup {
    let entries: Vec<_> = resources
        .into_iter()
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout,
        entries: &entries,
    })
}

fn pipeline_layout(gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> wgpu::PipelineLayout {
    gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    })
}

pub(super) fn module(gpu: &Gpu, text: &str) -> wgpu::ShaderModule {
    #[cfg(test)]
    let text = match gpu.mutant {
        Some([from, to]) => &text.replace(from, to),
        None => text,
    };
    gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(text.into()),
    })
}

pub(super) fn dispatch(pass: &mut wgpu::ComputePass<'_>, groups: u32) {
    pass.dispatch_workgroups(groups.min(GROUPS), groups.div_ceil(GROUPS), 1);
}

fn rendering(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    fragment: &str,
    shape: SplatShape,
    layout: &wgpu::BindGroupLayout,
) -> wgpu::RenderPipeline {
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: Some(&pipeline_layout(gpu, layout)),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("splat_corner"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: match shape {
                SplatShape::Square1 => wgpu::PrimitiveTopology::PointList,
                _ => wgpu::PrimitiveTopology::TriangleList,
            },
            ..Default::default()
        },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: TARGET,
                blend: None,
                write_mask: wgpu::ColorWrites::empty(),
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
