//! Truth: every triangle tried in f64, and shapes without gaps.

use std::f32::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::{Hit, Ray, TriangleBvh};

/// A closed sphere of `2·columns·(rows - 1)` triangles that face outwards.
pub(crate) fn sphere(center: Vec3, radius: f32, rows: u32, columns: u32) -> Vec<[Vec3; 3]> {
    let corner = |row: u32, column: u32| {
        let (sin, cos) = (PI * row as f32 / rows as f32).sin_cos();
        let around = TAU * (column % columns) as f32 / columns as f32;
        let sin = if row == 0 || row == rows { 0.0 } else { sin };
        center + radius * Vec3::new(sin * around.sin(), cos, sin * around.cos())
    };
    let mut triangles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let [a, b] = [corner(row, column), corner(row, column + 1)];
            let [c, d] = [corner(row + 1, column), corner(row + 1, column + 1)];
            if row > 0 {
                triangles.push([a, d, b]);
            }
            if row + 1 < rows {
                triangles.push([a, c, d]);
            }
        }
    }
    triangles
}

/// Numbers from 0 to 1, the same in every run (SplitMix64).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    /// In the cube from -1 to 1.
    pub(crate) fn vector(&mut self) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| 2.0 * self.unit() - 1.0))
    }
}

/// The nearest hit in f64, and whether another decision is within rounding.
fn brute_force(triangles: &[[Vec3; 3]], ray: &Ray) -> (Option<(u32, f64)>, bool) {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let mut best: Option<(u32, f64)> = None;
    let mut close_call = false;
    for (i, corners) in (0..).zip(triangles) {
        let [a, b, c] = corners.map(|p| p.as_dvec3() - origin);
        let volumes = [b.cross(c), c.cross(a), a.cross(b)].map(|f: DVec3| f.dot(direction));
        let sum: f64 = volumes.iter().sum();
        let least = volumes.iter().fold(f64::INFINITY, |m, v| m.min(v / sum));
        let normal = (b - a).cross(c - a);
        let t = normal.dot(a) / normal.dot(direction);
        let inside = t >= f64::from(ray.t_min) && t <= f64::from(ray.t_max);
        close_call |= least.abs() < 1e-4 && inside;
        close_call |= [ray.t_min, ray.t_max].iter().any(|&e| (f64::from(e) - t).abs() < 1e-5);
        if least >= 0.0 && inside && best.is_none_or(|(_, nearest)| t < nearest) {
            best = Some((i, t));
        }
    }
    (best, close_call)
}

fn random_triangles(random: &mut Random, count: usize) -> Vec<[Vec3; 3]> {
    (0..count)
        .map(|i| {
            let size = if i % 50 == 0 { 1.5 } else { 0.15 };
            let center = random.vector();
            std::array::from_fn(|_| center + size * random.vector())
        })
        .collect()
}

#[test]
fn finds_what_trying_every_triangle_finds() {
    let mut random = Random(1);
    let triangles = random_triangles(&mut random, 1_000);
    let bvh = TriangleBvh::build(&triangles);
    let rays: Vec<Ray> = (0..4_000)
        .map(|i| {
            let ray = Ray::new(1.5 * random.vector(), random.vector() * 3.0);
            let (a, b) = (random.unit(), random.unit());
            if i % 2 == 0 { ray } else { Ray { t_min: a.min(b), t_max: a.max(b), ..ray } }
        })
        .collect();
    let mut hits = vec![None; rays.len()];
    let mut occluded = vec![false; rays.len()];
    bvh.trace_closest(&rays, &mut hits);
    bvh.trace_occluded(&rays, &mut occluded);
    let (mut met, mut skipped) = (0, 0);
    for ((ray, hit), occluded) in rays.iter().zip(&hits).zip(occluded) {
        let (truth, close_call) = brute_force(&triangles, ray);
        skipped += usize::from(close_call);
        if close_call {
            continue;
        }
        met += usize::from(truth.is_some());
        assert_eq!(hit.map(|h| h.triangle), truth.map(|t| t.0), "{ray:?}");
        assert_eq!(occluded, truth.is_some(), "{ray:?}");
        let single = bvh.closest(ray.origin, ray.direction, ray.t_min, ray.t_max);
        assert_eq!(single, *hit, "one by one and as a batch");
        if let (Some(hit), Some((triangle, t))) = (hit, truth) {
            assert!((f64::from(hit.t) - t).abs() < 1e-5, "{} instead of {t}", hit.t);
            let [a, b, c] = triangles[triangle as usize];
            let w = hit.barycentrics;
            let point = a * w[0] + b * w[1] + c * w[2];
            assert!(point.distance(ray.at(hit.t)) < 1e-4, "weights {w:?}");
        }
    }
    assert!(met > 1_000 && skipped < 200, "{met} hits, {skipped} skipped");
}

#[test]
fn no_ray_slips_through_a_closed_surface() {
    for (center, radius) in [(Vec3::ZERO, 1.0), (Vec3::new(30.0, -7.0, 4.0), 0.5)] {
        let triangles = sphere(center, radius, 150, 300);
        let bvh = TriangleBvh::build(&triangles);
        let mut rays = Vec::new();
        let mut random = Random(2);
        for [a, b, c] in &triangles {
            let from = center + radius * (2.0 * random.vector() + Vec3::new(0.0, 0.0, 6.0));
            let edge = a.lerp(*b, random.unit());
            // At a corner, at an edge and through the inside of the triangle.
            for target in [*a, edge, (*a + *b + *c) / 3.0] {
                rays.push((Ray::new(from, target - from), true));
                rays.push((Ray::new(center, target - center), false));
            }
        }
        let mut hits = vec![None; rays.len()];
        let alone: Vec<Ray> = rays.iter().map(|(ray, _)| *ray).collect();
        bvh.trace_closest(&alone, &mut hits);
        let mut leaks = 0;
        for ((ray, outside), hit) in rays.iter().zip(hits) {
            let to_center = (ray.at(1.0) - center).dot(ray.direction) / ray.direction.length();
            // Only targets on the near side, well off the silhouette, are met first.
            let first = !outside || to_center < -0.1 * radius;
            leaks += usize::from(first && hit.is_none_or(|hit| (hit.t - 1.0).abs() > 1e-3));
        }
        assert_eq!(leaks, 0, "of {} rays at radius {radius}", rays.len());
    }
}

#[test]
fn the_same_at_every_scale() {
    let triangles = sphere(Vec3::new(0.1, 0.2, 0.3), 1.0, 20, 40);
    let unscaled = TriangleBvh::build(&triangles);
    for exponent in [-40, -20, 30] {
        let scale = 2f32.powi(exponent);
        let bvh =
            TriangleBvh::build(&triangles.iter().map(|t| t.map(|p| p * scale)).collect::<Vec<_>>());
        let mut random = Random(3);
        for _ in 0..500 {
            let (origin, direction) = (2.0 * random.vector(), random.vector());
            let expected = unscaled.closest(origin, direction, 0.0, 10.0);
            let found = bvh.closest(origin * scale, direction * scale, 0.0, 10.0);
            assert_eq!(found, expected);
        }
    }
}

#[test]
fn meets_what_is_very_near() {
    let wall = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let far = [Vec3::Z * 3.0, Vec3::new(1.0, 0.0, 3.0), Vec3::new(0.0, 1.0, 3.0)];
    let bvh = TriangleBvh::build(&[far, wall]);
    let hit = bvh.closest(Vec3::new(0.25, 0.25, -2e-6), Vec3::Z, 0.0, f32::INFINITY);
    assert_eq!(hit.map(|h| (h.triangle, h.t)), Some((1, 2e-6)));
}

#[test]
fn of_equal_triangles_the_first_counts() {
    let mut random = Random(4);
    let mut triangles = random_triangles(&mut random, 300);
    triangles.extend_from_within(..);
    let bvh = TriangleBvh::build(&triangles);
    let hits: Vec<Hit> = (0..500)
        .filter_map(|_| bvh.closest(random.vector(), random.vector(), 0.0, f32::INFINITY))
        .collect();
    assert!(hits.len() > 100 && hits.iter().all(|hit| hit.triangle < 300));
}

#[test]
fn the_same_for_any_number_of_threads() {
    let triangles = sphere(Vec3::ZERO, 1.0, 100, 200);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let bvh = TriangleBvh::build(&triangles);
            let mut random = Random(5);
            let rays: Vec<Ray> =
                (0..5_000).map(|_| Ray::new(3.0 * random.vector(), random.vector())).collect();
            let mut hits = vec![None; rays.len()];
            bvh.trace_closest(&rays, &mut hits);
            hits
        })
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn nothing_and_nonsense_are_met_by_no_ray() {
    let nan = [Vec3::NAN, Vec3::X, Vec3::Y];
    let line = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0];
    for triangles in [vec![], vec![nan], vec![line; 20], vec![nan, line]] {
        let bvh = TriangleBvh::build(&triangles);
        assert!(bvh.bounds().is_empty());
        assert!(bvh.closest(Vec3::NEG_Z, Vec3::Z, 0.0, f32::INFINITY).is_none());
        assert!(!bvh.occluded(Vec3::NEG_Z, Vec3::Z, 0.0, f32::INFINITY));
    }
    let bvh = TriangleBvh::build(&[nan, [Vec3::NEG_ONE, Vec3::X, Vec3::Y], line]);
    assert_eq!(bvh.closest(Vec3::NEG_Z * 3.0, Vec3::Z, 0.0, 9.0).map(|h| h.triangle), Some(1));
    for direction in [Vec3::ZERO, Vec3::NAN, Vec3::splat(1e30), Vec3::INFINITY] {
        assert!(bvh.closest(Vec3::NEG_Z * 3.0, direction, 0.0, f32::INFINITY).is_none());
    }
    assert!(bvh.closest(Vec3::NAN, Vec3::Z, 0.0, f32::INFINITY).is_none());
    assert!(!bvh.occluded(Vec3::NEG_Z * 3.0, Vec3::Z, 0.0, -1.0));
}
