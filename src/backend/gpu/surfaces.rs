//! Surfaces as the shaders see them directly: triangles, paints, the tree of what casts shadows, and which triangle each
//! sample shows.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::device::Gpu;
use super::records::Row;
use super::scene::packed_half;
use crate::error::Result;
use crate::geometry::look::packed_normal;
use crate::scene::description::{Paint, PatternKind};
use crate::scene::prepared::PreparedScene;
use crate::visibility::{NONE_ID, Visibility};

/// Rows of a surface: first id, –, paint, first of its corners' colours; tint or first colour, period; second colour; the
/// matrix from scene to local space, by row.
pub(super) const SURFACE_ROWS: u32 = 6;
/// How a surface is painted.
pub(super) const PAINTS: [(&str, u32); 5] =
    [("CONSTANT", 0), ("VERTEX", 1), ("CHECKER", 2), ("STRIPES", 3), ("RINGS", 4)];
/// Marks a pixel whose samples show several triangles.
const MIXED: u32 = 1 << 31;

/// A scene's triangles on the device.
pub(super) struct Surfaces {
    pub(super) version: u64,
    pub(super) triangles: wgpu::Buffer,
    pub(super) surfaces: wgpu::Buffer,
    pub(super) colors: wgpu::Buffer,
    pub(super) nodes: wgpu::Buffer,
    pub(super) obstacles: wgpu::Buffer,
    pub(super) scale: f32,
}

impl Surfaces {
    pub(super) fn new(gpu: &Gpu, scene: &PreparedScene, visibility: &Visibility) -> Result<Self> {
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
            let (paint, color, period, second) = match &object.paint {
                Paint::Vertex if object.mesh.colors().is_empty() => (0, Vec3::ONE, 0.0, Vec3::ONE),
                // Never looked at: see `compose`.
                Paint::Materials(_) => (0, Vec3::ONE, 0.0, Vec3::ONE),
                Paint::Constant(color) => (0, *color, 0.0, *color),
                Paint::Vertex => (1, Vec3::ONE, 0.0, Vec3::ONE),
                Paint::Pattern { kind, colors, period } => {
                    let paint = match kind {
                        PatternKind::Checker => 2,
                        PatternKind::Stripes => 3,
                        PatternKind::Rings => 4,
                    };
                    (paint, colors[0], *period, colors[1])
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

/// A word a pixel, then five for each pixel whose samples differ.
pub(super) fn list_samples(visibility: &Visibility, out: &mut Vec<u32>) {
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

fn bits(v: Vec3, w: f32) -> Row {
    v.extend(w).to_array().map(f32::to_bits)
}

const _: () = assert!(NONE_ID == u32::MAX, "the shaders' word for no triangle");
