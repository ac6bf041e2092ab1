//! Reflected rays through our tree against a bare `obvhs` loop over the same rays.
//!
//! Every ratio against the ray tracer is void if this one falls below 0.9. It is printed first (interleaved
//! A B A B, medians); Criterion then times each on its own.

use std::f32::consts::TAU;
use std::hint::black_box;
use std::time::{Duration, Instant};

use catoptric::accel::{Ray, TriangleBvh, triangle_bvh::CHUNK};
use catoptric::camera::{Eye, eye::ImageSize, mirror_ray::reflect};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DVec3, Vec2, Vec3};
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use rayon::prelude::*;

/// A trefoil tube with waves on it, of 2·`around`·`along` triangles.
fn knot(along: u32, around: u32) -> Vec<[Vec3; 3]> {
    let center = |s: f32| {
        let (sin2, cos2) = (2.0 * s).sin_cos();
        let (sin3, cos3) = (3.0 * s).sin_cos();
        0.3 * Vec3::new((2.0 + cos3) * cos2, (2.0 + cos3) * sin2, sin3)
    };
    let corner = |i: u32, k: u32| {
        let (s, a) =
            (TAU * (i % along) as f32 / along as f32, TAU * (k % around) as f32 / around as f32);
        let tangent = (center(s + 1e-3) - center(s - 1e-3)).normalize_or(Vec3::X);
        let side = tangent.cross(Vec3::Z).normalize_or(Vec3::X);
        let radius = 0.17 + 0.01 * (60.0 * s).sin() * (9.0 * a).sin();
        center(s) + radius * (side * a.cos() + tangent.cross(side) * a.sin())
    };
    let mut triangles = Vec::new();
    for i in 0..along {
        for k in 0..around {
            let [a, b, c, d] =
                [corner(i, k), corner(i + 1, k), corner(i + 1, k + 1), corner(i, k + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

/// The rays that a ball beside the knot reflects, in tiles of 8 x 8 pixels.
fn reflected(size: ImageSize) -> Vec<Ray> {
    let (ball, radius) = (DVec3::new(-1.6, 0.0, 0.6), 0.9);
    let eye = Eye::new(DVec3::new(-0.7, 0.5, 3.2), ball, DVec3::Y, 0.6, size);
    let eye = eye.expect("an eye before the ball");
    let tiles =
        (0..size.height).step_by(8).flat_map(|y| (0..size.width).step_by(8).map(move |x| (x, y)));
    let pixels = tiles.flat_map(|(x, y)| (0..64).map(move |k| (x + k % 8, y + k / 8)));
    let ray = |(x, y): (u32, u32)| {
        let view = eye.ray_through_px(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)).as_dvec3();
        let view = view.normalize_or(DVec3::Z);
        let to_eye = eye.position.as_dvec3() - ball;
        let b = to_eye.dot(view);
        let root = (b * b - to_eye.length_squared() + radius * radius).sqrt();
        let point = eye.position.as_dvec3() - view * (b + root);
        let direction = reflect(view, (point - ball) / radius);
        root.is_finite().then(|| Ray::new(point.as_vec3(), direction.as_vec3()))
    };
    pixels.filter_map(ray).collect()
}

/// What `obvhs` offers, with its triangles in the order of its leaves.
struct Bare {
    wide: (CwBvh, Vec<RtTriangle>),
    binary: (Bvh2, Vec<RtTriangle>),
    rays: Vec<obvhs::ray::Ray>,
}

impl Bare {
    fn new(triangles: &[[Vec3; 3]], rays: &[Ray]) -> Self {
        let triangles: Vec<Triangle> = triangles
            .iter()
            .map(|t| t.map(Into::into))
            .map(|[v0, v1, v2]| Triangle { v0, v1, v2 })
            .collect();
        let params = BvhBuildParams { pre_split: true, ..BvhBuildParams::medium_build() };
        let wide = BvhBuildParams { max_prims_per_leaf: 3, ..params };
        let wide = build_cwbvh_from_tris(&triangles, wide, &mut Duration::default());
        let binary = build_bvh2_from_tris(&triangles, params, &mut Duration::default());
        let in_order = |order: &[u32]| -> Vec<RtTriangle> {
            order.iter().map(|&i| RtTriangle::from(&triangles[i as usize])).collect()
        };
        let (a, b) = (in_order(&wide.primitive_indices), in_order(&binary.primitive_indices));
        let ray = |r: &Ray| obvhs::ray::Ray::new_inf(r.origin.into(), r.direction.into());
        Self { wide: (wide, a), binary: (binary, b), rays: rays.iter().map(ray).collect() }
    }

    fn trace_wide(&self, hits: &mut [RayHit]) {
        let (tree, triangles) = &self.wide;
        self.rays.par_chunks(CHUNK).zip(hits.par_chunks_mut(CHUNK)).for_each(|(rays, hits)| {
            for (ray, hit) in rays.iter().zip(hits) {
                *hit = RayHit::none();
                tree.ray_traverse(*ray, hit, |ray, id| triangles[id].intersect(ray));
            }
        });
    }

    fn trace_binary(&self, hits: &mut [RayHit]) {
        let (tree, triangles) = &self.binary;
        self.rays.par_chunks(CHUNK).zip(hits.par_chunks_mut(CHUNK)).for_each(|(rays, hits)| {
            for (ray, hit) in rays.iter().zip(hits) {
                *hit = RayHit::none();
                tree.ray_traverse(*ray, hit, |ray, id| triangles[id].intersect(ray));
            }
        });
    }
}

fn time(run: impl FnOnce()) -> f64 {
    let start = Instant::now();
    run();
    start.elapsed().as_secs_f64() * 1e3
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn rays(criterion: &mut Criterion) {
    let triangles = knot(2_000, 125);
    let rays = reflected(ImageSize { width: 1280, height: 720 });
    let mut ours = None;
    let build_ms = time(|| ours = Some(TriangleBvh::build(&triangles)));
    let ours = ours.expect("just built");
    let bare = Bare::new(&triangles, &rays);
    let mut our_hits = vec![None; rays.len()];
    let mut bare_hits = vec![RayHit::none(); rays.len()];

    let mut times = [Vec::new(), Vec::new(), Vec::new()];
    for _ in 0..31 {
        times[0].push(time(|| bare.trace_wide(&mut bare_hits)));
        times[1].push(time(|| ours.trace_closest(&rays, &mut our_hits)));
        times[2].push(time(|| bare.trace_binary(&mut bare_hits)));
    }
    let met = our_hits.iter().flatten().count();
    assert!(met > rays.len() / 20, "only {met} rays meet the knot");
    let differing = our_hits.iter().zip(&bare_hits).filter(|(a, b)| {
        let t = a.map_or(f32::INFINITY, |hit| hit.t);
        t != b.t && (t - b.t).abs() > 1e-4
    });
    println!(
        "{} triangles (built in {build_ms:.0} ms), {} rays, {met} meet them, {} differ",
        triangles.len(),
        rays.len(),
        differing.count()
    );
    let best_bare = times[0].iter().zip(&times[2]).map(|(wide, binary)| wide.min(*binary));
    let ratio = median(best_bare.zip(&times[1]).map(|(bare, ours)| bare / ours).collect());
    let [wide, ours_ms, binary] = times.map(median);
    println!("bare wide {wide:.2} ms, bare binary {binary:.2} ms, ours {ours_ms:.2} ms");
    println!("our rate / the better bare rate: {ratio:.2} (at least 0.9)");

    let mut group = criterion.benchmark_group("reflected rays");
    group.throughput(Throughput::Elements(rays.len() as u64)).sample_size(20);
    group.bench_function("bare wide", |b| b.iter(|| bare.trace_wide(black_box(&mut bare_hits))));
    group
        .bench_function("bare binary", |b| b.iter(|| bare.trace_binary(black_box(&mut bare_hits))));
    group
        .bench_function("ours", |b| b.iter(|| ours.trace_closest(&rays, black_box(&mut our_hits))));
    group.finish();
}

criterion_group!(benches, rays);
criterion_main!(benches);
