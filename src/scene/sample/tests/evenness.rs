//! How even the samples are, measured with kiddo. Distances are in mean spacings, the root of the area a
//! sample.

use std::num::NonZero;

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

use super::super::candidates::{hash, unit};
use super::shapes::{cube, joined, moved, plane, slivers, sphere, torus};
use super::{positions, sampled};
use crate::geometry::Mesh;

#[derive(Debug)]
struct Evenness {
    /// Clark & Evans: 1 for white noise on a plane, 2.15 for the hexagonal lattice.
    ratio: f32,
    /// Least distance of two samples.
    closest: f32,
    /// 99.9 % of the surface is nearer than this to a sample.
    gap: f32,
}

impl Evenness {
    fn of(mesh: &Mesh, samples: &[Vec3]) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "rounded")]
        let spacing = (mesh.area() / samples.len() as f64).sqrt() as f32;
        let points: Vec<[f32; 3]> = samples.iter().map(|p| p.to_array()).collect();
        let tree: ImmutableKdTree<f32, 3> = ImmutableKdTree::new_from_slice(&points).unwrap();
        let two = NonZero::new(2).unwrap();
        let neighbors: Vec<f32> = points
            .iter()
            .map(|p| tree.query(p).nearest_n::<SquaredEuclidean<f32>>(two).execute())
            .map(|found| found[1].distance.sqrt() / spacing)
            .collect();
        let mut gaps: Vec<f32> = noise(mesh, 50_000)
            .iter()
            .map(|p| tree.query(&p.to_array()).nearest_one::<SquaredEuclidean<f32>>().execute())
            .map(|found| found.distance.sqrt() / spacing)
            .collect();
        gaps.sort_by(f32::total_cmp);
        Self {
            ratio: 2.0 * neighbors.iter().sum::<f32>() / samples.len() as f32,
            closest: neighbors.iter().copied().fold(f32::INFINITY, f32::min),
            gap: gaps[gaps.len() * 999 / 1000],
        }
    }
}

impl Evenness {
    /// On a plane 1.62, 0.66 and 0.89 were measured.
    fn is_even(&self) -> bool {
        self.ratio > 1.58 && self.closest > 0.65 && self.gap < 1.0
    }
}

/// White noise on the surface.
fn noise(mesh: &Mesh, count: u64) -> Vec<Vec3> {
    let mut ends: Vec<f64> = (0..mesh.triangles().len()).map(|t| mesh.triangle_area(t)).collect();
    for i in 1..ends.len() {
        ends[i] += ends[i - 1];
    }
    let mut number = 77;
    let mut random = || {
        number += 1;
        unit(hash(number))
    };
    (0..count)
        .map(|_| {
            let x = random() * ends[ends.len() - 1];
            let triangle = ends.partition_point(|&end| end <= x);
            let (mut u, mut v) = (random(), random());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let [a, b, c] = mesh.corners(triangle).map(|p| p.as_dvec3());
            (a + (b - a) * u + (c - a) * v).as_vec3()
        })
        .collect()
}

/// The measure itself: white noise must come out as such.
#[test]
fn white_noise_is_not_even() {
    let mesh = plane(1, 1);
    let found = Evenness::of(&mesh, &noise(&mesh, 40_000));
    assert!((found.ratio - 1.0).abs() < 0.02, "{found:?}");
    assert!(found.closest < 0.05 && found.gap > 1.3, "{found:?}");
}

#[test]
fn samples_are_even_whatever_the_triangles() {
    let mixed = joined(&[plane(1, 1), moved(&plane(300, 300), Vec3::X, false)]);
    for (name, mesh, count) in [
        ("two triangles", plane(1, 1), 60_000),
        ("tiny triangles", plane(400, 400), 20_000),
        ("large beside tiny triangles", mixed, 60_000),
        ("slivers", slivers(30_000), 20_000),
        ("long slivers", plane(3_000, 1), 20_000),
        ("sphere", sphere(400, 200), 60_000),
        ("coarse sphere", sphere(32, 16), 60_000),
        ("torus", torus(800, 400), 60_000),
        ("cube", cube(), 60_000),
    ] {
        let found = Evenness::of(&mesh, &positions(&sampled(&mesh, count, 3)));
        println!("{name}: {found:?}");
        assert!(found.is_even(), "{name}: {found:?}");
    }
}

/// Equal areas get equal numbers, far closer than chance would have it.
#[test]
fn density_is_the_same_everywhere() {
    let mesh = joined(&[plane(1, 1), moved(&plane(300, 300), Vec3::X, false)]);
    let count = 100_000;
    let mut cells = vec![0_i32; 20 * 10];
    for p in positions(&sampled(&mesh, count, 9)) {
        let at = (p * 10.0).as_uvec3();
        cells[(at.x.min(19) * 10 + at.z.min(9)) as usize] += 1;
    }
    let wanted = 500;
    let variance = cells.iter().map(|n| (n - wanted).pow(2)).sum::<i32>() as f32 / 200.0;
    let (least, most) = (cells.iter().min().unwrap(), cells.iter().max().unwrap());
    println!("{least} to {most}, variance {variance}");
    // Chance: variance 500, and 430 to 570.
    assert!(variance < 50.0 && *least > 475 && *most < 525, "{least} to {most}, {variance}");
}

/// The strips along the edges hold neither gaps nor doubled samples. (Across the sharp edges of a cube
/// distances through space are shorter than along the surface: 0.89 was measured.)
#[test]
fn edges_do_not_show() {
    let count = 60_000;
    let half = 0.5 * (6.0 / count as f32).sqrt();
    let near_edge = |p: &Vec3| {
        // Two of the three coordinates lie within half a spacing of the end of their range.
        (0..3).filter(|&i| p[i].min(1.0 - p[i]) < half).count() >= 2
    };
    let found = positions(&sampled(&cube(), count, 4)).iter().filter(|p| near_edge(p)).count();
    // Each of the six sides has a frame of this area.
    let frame = 1.0 - (1.0 - 2.0 * half).powi(2);
    let ratio = found as f32 / (frame * count as f32);
    println!("at the edges of a cube: {ratio}");
    assert!((0.85..1.05).contains(&ratio), "{ratio}");

    let diagonal = |p: &&Vec3| (p.x + p.z - 1.0).abs() < 0.004;
    let found = positions(&sampled(&plane(1, 1), count, 4)).iter().filter(diagonal).count();
    let ratio = found as f32 / (count as f32 * (1.0 - 0.996_f32.powi(2)));
    println!("at the diagonal: {ratio}");
    assert!((0.9..1.1).contains(&ratio), "{ratio}");
}

/// A sheet much thinner than the spacing gets its full density on both sides.
#[test]
fn both_sides_of_a_thin_sheet_are_even() {
    let top = plane(200, 200);
    let below = Vec3::new(0.0, -0.0002, 0.0);
    let sheet = joined(&[top.clone(), moved(&top, below, true)]);
    let samples = positions(&sampled(&sheet, 40_000, 2));
    let (up, down): (Vec<Vec3>, Vec<Vec3>) = samples.into_iter().partition(|p| p.y == 0.0);
    for side in [up, down] {
        assert!(side.len().abs_diff(20_000) < 100, "{}", side.len());
        let found = Evenness::of(&top, &side);
        assert!(found.is_even(), "{found:?}");
    }
}
