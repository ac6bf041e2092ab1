//! The rest of a frame on the device: environment, direct view, composition. See `shaders/look.wgsl`.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::buffers::Grown;
use super::device::Gpu;
use super::pipelines::{compute, dispatch, group};
use super::records::Row;
use super::scene::{packed_half, packed_normal};
use super::shaders;
use crate::camera::Eye;
use crate::camera::eye::ImageSize;
use crate::error::Result;
use crate::image::Picture;
use crate::scene::description::{Environment, Paint, PatternKind};
use crate::scene::prepared::PreparedScene;
use crate::scene::shade::Sun;
use crate::visibility::{NONE_ID, Visibility};

/// Rows of a surface: first id, –, paint, first of its corners' colours; tint or first colour, period; second colour; the
/// matrix from scene to local space, by row.
pub(super) const SURFACE_ROWS: u32 = 6;
/// How a surface is painted.
pub(super) const PAINTS: [(&str, u32); 5] =
    [("CONSTANT", 0), ("VERTEX", 1), ("CHECKER", 2), ("STRIPES", 3), ("RINGS", 4)];
/// Marks a pixel whose samples show several triangles.
const MIXED: u32 = 1 << 31;

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
    pub(super) is_sky: u32,
    pub(super) horizon: [f32; 3],
    pub(super) scale: f32,
    pub(super) ground: [f32; 3],
    pub(super) padding: u32,
}

/// A scene's triangles on the device.
struct SceneLook {
    version: u64,
    triangles: wgpu::Buffer,
    surfaces: wgpu::Buffer,
    colors: wgpu::Buffer,
    nodes: wgpu::Buffer,
    obstacles: wgpu::Buffer,
    scale: f32,
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
    scene: Option<SceneLook>,
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
            self.scene = Some(SceneLook::new(gpu, scene, visibility)?);
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
        scene: &SceneLook,
        own: &PictureLook,
        reflection: &wgpu::Buffer,
    ) -> [wgpu::BindGroup; 3] {
        let SceneLook { triangles, surfaces, colors, nodes, obstacles, .. } = scene;
        let common: [(u32, &wgpu::Buffer); 4] =
            [(0, &self.uniform), (1, self.samples.buffer()), (2, triangles), (3, surfaces)];
        let more: [&[(u32, &wgpu::Buffer)]; 3] = [
            &[(4, colors), (5, nodes), (6, obstacles), (9, &own.direct)],
            &[(7, reflection), (8, &own.completed)],
            &[(8, &own.completed), (9, &own.direct), (10, &own.picture)],
        ];
        [0, 1, 2].map(|i| {
            let layout = self.pipelines[i].get_bind_group_layout(0);
            group(gpu, &layout, common.iter().chain(more[i]))
        })
    }
}

impl PictureLook {
    fn new(gpu: &Gpu, size: ImageSize) -> Result<Self> {
        use wgpu::BufferUsages as U;
        let bytes = size.pixels() as u64 * 16;
        let own = || gpu.buffer("pixels", bytes, U::STORAGE | U::COPY_SRC);
        Ok(Self {
            size,
            completed: own()?,
            direct: own()?,
            picture: own()?,
            out: gpu.buffer("pixels", bytes, U::MAP_READ | U::COPY_DST)?,
        })
    }
}

/// A word a pixel, then five for each pixel whose samples differ.
fn list_samples(visibility: &Visibility, out: &mut Vec<u32>) {
    let samples = &visibility.samples;
    out.clear();
    out.resize(samples.len(), 0);
    let mixed = |ids: &[u32; 5]| ids.iter().any(|id| *id != ids[0]);
    let mut count = 0;
    for (to, ids) in out.iter_mut().zip(samples) {
        *to = ids[0];
        if mixed(ids) {
            *to = MIXED | count;
            count += 1;
        }
    }
    out.extend(samples.iter().filter(|ids| mixed(ids)).flatten());
}

impl SceneLook {
    fn new(gpu: &Gpu, scene: &PreparedScene, visibility: &Visibility) -> Result<Self> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let sent = |label: &str, bytes: &[u8]| -> Result<wgpu::Buffer> {
            let buffer = gpu.buffer(label, bytes.len() as u64, usage)?;
            gpu.checked(|| gpu.queue.write_buffer(&buffer, 0, bytes))?;
            Ok(buffer)
        };
        let mut triangles: Vec<Row> = Vec::new();
        let corner = |position: Vec3, normal: Vec3| {
            let [x, y, z] = position.to_array().map(f32::to_bits);
            [x, y, z, packed_normal(normal)]
        };
        for mirror in &scene.mirrors {
            for t in mirror.mesh.triangles() {
                let at = |i: u32| corner(mirror.positions[i as usize], mirror.normals[i as usize]);
                triangles.extend(t.map(at));
            }
        }
        let mut colors: Vec<[u32; 2]> = vec![[0; 2]];
        let mut surfaces: Vec<Row> = Vec::new();
        let first_ids = visibility.first_ids();
        for (mirror, first) in scene.mirrors.iter().zip(first_ids) {
            surfaces.push([*first, 0, 0, 0]);
            surfaces.push(bits(mirror.tint, 0.0));
            surfaces.resize(surfaces.len() + 4, [0; 4]);
        }
        for (object, first) in scene.objects.iter().zip(&first_ids[scene.mirrors.len()..]) {
            let rotated: Vec<Vec3> = object
                .mesh
                .normals()
                .par_iter()
                .map(|n| object.to_scene.direction(n.as_dvec3()).as_vec3().normalize_or(Vec3::Y))
                .collect();
            let rows = object.mesh.triangles().par_iter().flat_map_iter(|t| {
                t.map(|i| corner(object.positions[i as usize], rotated[i as usize]))
            });
            triangles.par_extend(rows);
            let (paint, color, period, second) = match object.paint {
                Paint::Vertex if object.mesh.colors().is_empty() => (0, Vec3::ONE, 0.0, Vec3::ONE),
                Paint::Constant(color) => (0, color, 0.0, color),
                Paint::Vertex => (1, Vec3::ONE, 0.0, Vec3::ONE),
                Paint::Pattern { kind, colors, period } => {
                    let paint = match kind {
                        PatternKind::Checker => 2,
                        PatternKind::Stripes => 3,
                        PatternKind::Rings => 4,
                    };
                    (paint, colors[0], period, colors[1])
                }
            };
            let offset = u32::try_from(colors.len()).expect("as few as triangles");
            surfaces.push([*first, 0, paint, offset]);
            surfaces.push(bits(color, period));
            surfaces.push(bits(second, 0.0));
            // Rows of the matrix to local space: what it makes of the axes, and of the origin.
            let local = |p: DVec3| object.to_scene.inverse_point(p);
            let zero = local(DVec3::ZERO);
            let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| local(axis) - zero);
            for k in 0..3 {
                surfaces
                    .push(bits(DVec3::from_array(axes.map(|a| a[k])).as_vec3(), zero.as_vec3()[k]));
            }
            if paint == 1 {
                let packed: Vec<[u32; 2]> = object
                    .mesh
                    .colors()
                    .iter()
                    .map(|c| [packed_half(c.x) | packed_half(c.y) << 16, packed_half(c.z)])
                    .collect();
                colors
                    .extend(object.mesh.triangles().iter().flatten().map(|&i| packed[i as usize]));
            }
        }
        let (nodes, obstacles, scale) = scene.triangles.parts();
        let scale = if obstacles.is_empty() { 0.0 } else { scale };
        Ok(Self {
            version: scene.placement_version,
            triangles: sent("triangles", bytemuck::cast_slice(&triangles))?,
            surfaces: sent("surfaces", bytemuck::cast_slice(&surfaces))?,
            colors: sent("colours", bytemuck::cast_slice(&colors))?,
            nodes: sent("the triangles' tree", bytemuck::cast_slice(nodes))?,
            obstacles: sent("triangles", bytemuck::cast_slice(&obstacles))?,
            scale,
        })
    }
}

fn bits(v: Vec3, w: f32) -> Row {
    v.extend(w).to_array().map(f32::to_bits)
}

fn uniform(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    white: f32,
    scale: f32,
) -> Uniform {
    let (is_sky, [zenith, horizon, ground]) = match scene.environment {
        Environment::Constant(color) => (0, [color; 3]),
        Environment::Sky { zenith, horizon, ground } => (1, [zenith, horizon, ground]),
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
        is_sky,
        horizon: horizon.to_array(),
        scale,
        ground: ground.to_array(),
        padding: 0,
    }
}

const _: () = assert!(NONE_ID == u32::MAX, "the shaders' word for no triangle");
