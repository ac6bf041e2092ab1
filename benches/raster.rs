//! How long it takes to see a scene directly: triangles about the size of a sample, and a furnished room.

use std::f32::consts::{PI, TAU};
use std::hint::black_box;

use catoptric::camera::Eye;
use catoptric::camera::eye::ImageSize;
use catoptric::visibility::{Scratch, SurfaceMesh, Visibility};
use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DVec3, Vec3, dvec3, vec3};

struct Surface {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// A sphere of 2·columns·(rows - 1) triangles with a wavy surface.
    fn sphere(center: Vec3, radius: f32, columns: u32, rows: u32) -> Self {
        let place = |row: u32, column: u32| {
            let polar = PI * row as f32 / rows as f32;
            let angle = TAU * column as f32 / columns as f32;
            let wave = 1.0 + 0.1 * (9.0 * polar).sin() * (7.0 * angle).sin();
            let [x, z] = [angle.cos(), angle.sin()].map(|c| c * polar.sin());
            center + vec3(x, polar.cos(), z) * radius * wave
        };
        let cells = |rows: u32| (0..rows).flat_map(move |row| (0..columns).map(move |c| (row, c)));
        let positions = cells(rows + 1).map(|(row, column)| place(row, column)).collect();
        let at = |row: u32, column: u32| row * columns + column % columns;
        let mut triangles = Vec::new();
        for (row, column) in cells(rows) {
            if row > 0 {
                triangles.push([at(row, column), at(row, column + 1), at(row + 1, column + 1)]);
            }
            if row + 1 < rows {
                triangles.push([at(row, column), at(row + 1, column + 1), at(row + 1, column)]);
            }
        }
        Self { positions, triangles }
    }

    /// A box of twelve triangles, to be seen from inside.
    fn walls(half: f32) -> Self {
        let positions = (0..8_u8)
            .map(|i| vec3(f32::from(i & 1), f32::from(i >> 1 & 1), f32::from(i >> 2)) * 2.0 - 1.0)
            .map(|corner| corner * half)
            .collect();
        let sides =
            [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Self { positions, triangles }
    }

    fn mesh(&self) -> SurfaceMesh<'_> {
        SurfaceMesh { positions: &self.positions, triangles: &self.triangles, encloses: None }
    }
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("visibility");
    group.sample_size(20);
    let mirror = Surface::sphere(Vec3::ZERO, 0.8, 50, 41);
    let scan = Surface::sphere(vec3(0.9, -0.2, 0.5), 0.5, 660, 661);
    let mut room: Vec<Surface> = (0..30_u8)
        .map(|i| {
            let place = vec3(0.61, 0.37, 0.83) * f32::from(i);
            Surface::sphere((place.fract() - 0.5) * 5.0, 0.3, 30, 29)
        })
        .collect();
    room.push(Surface::walls(3.0));
    let scenes = [("871k triangles", vec![scan]), ("room", room)];
    for (width, height) in [(1280, 720), (3840, 2160)] {
        let size = ImageSize { width, height };
        let from = dvec3(-0.6, 0.9, 2.9);
        let Some(eye) = Eye::new(from, DVec3::ZERO, DVec3::Y, 0.785, size) else { continue };
        for (name, objects) in &scenes {
            let objects: Vec<SurfaceMesh> = objects.iter().map(Surface::mesh).collect();
            let (mut out, mut scratch) = (Visibility::default(), Scratch::default());
            group.bench_function(format!("{name}, {height} rows"), |bencher| {
                bencher.iter(|| {
                    out.update(&eye, &[mirror.mesh()], black_box(&objects), &mut scratch);
                    black_box(out.mirror_ids.last());
                });
            });
        }
    }
    group.finish();
}

criterion_group!(raster, benches);
criterion_main!(raster);
