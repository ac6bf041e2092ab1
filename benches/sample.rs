//! Surface sampling: many small triangles and a few large ones.

use std::f32::consts::TAU;
use std::hint::black_box;

use catoptric::Context;
use catoptric::geometry::Mesh;
use catoptric::scene::description::Paint;
use catoptric::scene::sample::sample;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;

/// A knotted tube of 2·`along`·`around` triangles.
fn knot(along: u32, around: u32) -> Mesh {
    let center = |t: f32| {
        let (a, b) = (2.0 * t, 3.0 * t);
        Vec3::new((2.0 + b.cos()) * a.cos(), b.sin(), (2.0 + b.cos()) * a.sin())
    };
    let mut positions = Vec::new();
    for i in 0..along {
        let t = TAU * i as f32 / along as f32;
        let ahead = (center(t + 1e-3) - center(t - 1e-3)).normalize_or(Vec3::X);
        let (u, v) = ahead.any_orthonormal_pair();
        for j in 0..around {
            let (sin, cos) = (TAU * j as f32 / around as f32).sin_cos();
            positions.push(center(t) + 0.4 * (u * cos + v * sin));
        }
    }
    let at = |i: u32, j: u32| (i % along) * around + j % around;
    let cells = (0..along).flat_map(|i| (0..around).map(move |j| (i, j)));
    let triangles = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    Mesh::new(positions, vec![], vec![], triangles.collect()).expect("a tube has area")
}

fn wall() -> Mesh {
    let corners = vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Z, Vec3::Z];
    Mesh::new(corners, vec![], vec![], vec![[0, 2, 1], [0, 3, 2]]).expect("a square has area")
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sample");
    group.sample_size(10);
    let paint = Paint::Constant(Vec3::ONE);
    for (name, mesh, count) in [
        ("871,200 small triangles", knot(3_300, 132), 437_645),
        ("2 large triangles", wall(), 2_000_000),
    ] {
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(name, |bencher| {
            bencher.iter(|| sample(black_box(&mesh), &paint, count, 1, &Context::default()));
        });
    }
    group.finish();
}

criterion_group!(sampling, benches);
criterion_main!(sampling);
