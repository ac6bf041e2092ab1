//! The rest of a frame on the device: environment, direct view, composition. See `shaders/look.wgsl`.

use glam::Vec3;
use rayon::prelude::*;

use super::buffers::Grown;
use super::device::Gpu;
use super::environment::Panorama;
use super::pipelines::{bound, compute, dispatch};
use super::shaders;
use super::surfaces::{Surfaces, list_samples};
use crate::camera::Eye;
use crate::camera::eye::ImageSize;
use crate::error::Result;
use crate::image::Picture;
use crate::scene::description::Environment;
use crate::scene::prepared::PreparedScene;
use crate::scene::shade::Sun;
use crate::visibility::Visibility;

/// As `Look` in `shaders/look.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Uniform {
    pub(super) eye: [f32; 3],
    pub(super) white: f32,
    pub(super) right: [f32; 3],
    pub(super) width: u32,
    pub(super) up: [f32; 3],
    pub(super) height: u32,
    pub(super) forward: [f32; 3],
    pub(super) surfaces: u32,
    pub(super) to_sun: [f32; 3],
    pub(super) mirrors: u32,
    pub(super) sun: [f32; 3],
    pub(super) mirror_triangles: u32,
    pub(super) ambient: [f32; 3],
    pub(super) apart: f32,
    pub(super) zenith: [f32; 3],
    pub(super) environment: u32,
    pub(super) horizon: [f32; 3],
    pub(super) scale: f32,
    pub(super) ground: [f32; 3],
    pub(super) padding: u32,
}

/// What depends on the picture's size.
struct PictureLook {
    size: ImageSize,
    completed: wgpu::Buffer,
    direct: wgpu::Buffer,
    picture: wgpu::Buffer,
    out: wgpu::Buffer,
}

/// Everything for it on one device.
pub(super) struct Composer {
    pipelines: [wgpu::ComputePipeline; 3],
    uniform: wgpu::Buffer,
    samples: Grown,
    list: Vec<u32>,
    scene: Option<Surfaces>,
    panorama: Option<Panorama>,
    picture: Option<PictureLook>,
    /// Of these buffers: made when there were so many.
    groups: Option<(usize, [wgpu::BindGroup; 3])>,
}

impl Composer {
    pub(super) fn new(gpu: &Gpu) -> Result<Self> {
        use wgpu::BufferUsages as U;
        let pipelines =
            gpu.checked(|| shaders::looks().map(|(text, name)| compute(gpu, &text, name, None)))?;
        Ok(Self {
            pipelines,
            uniform: gpu.buffer("frame", size_of::<Uniform>() as u64, U::UNIFORM | U::COPY_DST)?,
            samples: Grown::new("samples", U::STORAGE | U::COPY_DST),
            list: Vec::new(),
            scene: None,
            panorama: None,
            picture: None,
            groups: None,
        })
    }

    /// Composes the picture over `reflection`, which is on the device.
    #[expect(clippy::too_many_arguments, reason = "all of a frame")]
    pub(super) fn compose(
        &mut self,
        gpu: &Gpu,
        scene: &PreparedScene,
        eye: &Eye,
        visibility: &Visibility,
        reflection: &wgpu::Buffer,
        white: f32,
        mirrors: Option<&mut Vec<Vec3>>,
        picture: &mut Picture,
    ) -> Result<()> {
        let size = visibility.size;
        let version = scene.placement_version;
        if self.scene.as_ref().is_none_or(|s| s.version != version) {
            self.scene = None;
            self.scene = Some(Surfaces::new(gpu, scene, visibility)?);
        }
        if self.panorama.as_ref().is_none_or(|p| !p.is_of(&scene.environment)) {
            self.panorama = None;
            self.panorama = Some(Panorama::new(gpu, &scene.environment)?);
        }
        if self.picture.as_ref().is_none_or(|p| p.size != size) {
            self.picture = None;
            self.picture = Some(PictureLook::new(gpu, size)?);
        }
        list_samples(visibility, &mut self.list);
        self.samples.hold(gpu, size_of_val(&self.list[..]) as u64)?;
        let scene_look = self.scene.as_ref().expect("it was uploaded");
        let own = self.picture.as_ref().expect("it was made");
        let uniform = uniform(scene, eye, visibility, white, scene_look.scale);
        let bytes = size.pixels() as u64 * 16;
        let made = gpu.allocations.get();
        if self.groups.as_ref().is_none_or(|(count, _)| *count != made) {
            let groups = gpu.checked(|| self.groups_of(gpu, scene_look, own, reflection))?;
            self.groups = Some((made, groups));
        }
        let groups = &self.groups.as_ref().expect("they were made").1;
        gpu.checked(|| {
            gpu.queue.write_buffer(self.samples.buffer(), 0, bytemuck::cast_slice(&self.list));
            gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let tasks = u32::try_from(size.pixels().div_ceil(64)).unwrap_or(u32::MAX);
            {
                let descriptor = wgpu::ComputePassDescriptor::default();
                let mut pass = encoder.begin_compute_pass(&descriptor);
                for (pipeline, group) in self.pipelines.iter().zip(groups) {
                    pass.set_pipeline(pipeline);
                    pass.set_bind_group(0, group, &[]);
                    dispatch(&mut pass, tasks);
                }
            }
            encoder.copy_buffer_to_buffer(&own.picture, 0, &own.out, 0, bytes);
            gpu.queue.submit([encoder.finish()]);
        })?;
        picture.width = size.width;
        picture.height = size.height;
        gpu.read::<[f32; 4], _>(&own.out, bytes, |colors| {
            colors.par_iter().map(|&[r, g, b, _]| [r, g, b]).collect_into_vec(&mut picture.rgb);
        })?;
        let Some(mirrors) = mirrors else { return Ok(()) };
        gpu.checked(|| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&own.completed, 0, &own.out, 0, bytes);
            gpu.queue.submit([encoder.finish()]);
        })?;
        gpu.read::<[f32; 4], _>(&own.out, bytes, |colors| {
            let rgb = colors.par_iter().map(|&[r, g, b, _]| Vec3::new(r, g, b));
            rgb.collect_into_vec(mirrors);
        })
    }
}

impl Composer {
    fn groups_of(
        &self,
        gpu: &Gpu,
        scene: &Surfaces,
        own: &PictureLook,
        reflection: &wgpu::Buffer,
    ) -> [wgpu::BindGroup; 3] {
        let Surfaces { triangles, surfaces, colors, nodes, obstacles, .. } = scene;
        let panorama = self.panorama.as_ref().expect("it was uploaded");
        let common: [(u32, &wgpu::Buffer); 4] =
            [(0, &self.uniform), (1, self.samples.buffer()), (2, triangles), (3, surfaces)];
        let more: [&[(u32, &wgpu::Buffer)]; 3] = [
            &[(4, colors), (5, nodes), (6, obstacles), (9, &own.direct)],
            &[(7, reflection), (8, &own.completed)],
            &[(8, &own.completed), (9, &own.direct), (10, &own.picture)],
        ];
        [0, 1, 2].map(|i| {
            let layout = self.pipelines[i].get_bind_group_layout(0);
            let buffers = common.iter().chain(more[i]);
            let buffers = buffers.map(|&(binding, buffer)| (binding, buffer.as_entire_binding()));
            let panorama = (11, wgpu::BindingResource::TextureView(&panorama.view));
            bound(gpu, &layout, buffers.chain([panorama]))
        })
    }
}

impl PictureLook {
    fn new(gpu: &Gpu, size: ImageSize) -> Result<Self> {
        use wgpu::BufferUsages as U;
        let bytes = size.pixels() as u64 * 16;
        let own = || gpu.buffer("the pixels", bytes, U::STORAGE | U::COPY_SRC);
        Ok(Self {
            size,
            completed: own()?,
            direct: own()?,
            picture: own()?,
            out: gpu.buffer("the pixels", bytes, U::MAP_READ | U::COPY_DST)?,
        })
    }
}

fn uniform(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    white: f32,
    scale: f32,
) -> Uniform {
    let (environment, [zenith, horizon, ground]) = match scene.environment {
        Environment::Constant(color) => (0, [color; 3]),
        Environment::Sky { zenith, horizon, ground } => (1, [zenith, horizon, ground]),
        Environment::Image(_) => (2, [Vec3::ZERO; 3]),
    };
    let count = |n: usize| u32::try_from(n).expect("as few as triangles");
    Uniform {
        eye: eye.position.to_array(),
        // WGSL promises nothing about infinities.
        white: white.min(f32::MAX),
        right: (eye.right / eye.focal_px).to_array(),
        width: eye.size.width,
        up: (eye.up / eye.focal_px).to_array(),
        height: eye.size.height,
        forward: eye.forward.to_array(),
        surfaces: count(visibility.first_ids().len() - 1),
        to_sun: scene.light.to_sun.to_array(),
        mirrors: count(scene.mirrors.len()),
        sun: scene.light.sun.to_array(),
        mirror_triangles: visibility.mirror_triangles(),
        ambient: scene.light.ambient.to_array(),
        apart: Sun::new(&scene.triangles, &scene.light).apart,
        zenith: zenith.to_array(),
        environment,
        horizon: horizon.to_array(),
        scale,
        ground: ground.to_array(),
        padding: 0,
    }
}
