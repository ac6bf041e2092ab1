//! Normals of points on known surfaces.

use super::*;
use crate::geometry::Mesh;
use crate::scene::builtin;
use crate::scene::description::Paint;
use crate::scene::sample::sample;

/// Points and their true normals.
type Truth = (Vec<Vec3>, Vec<Vec3>);

fn even(mesh: &Mesh, count: usize) -> Truth {
    let s = sample(mesh, &Paint::Vertex, count, 1, &Context::default()).unwrap();
    ((0..count).map(|i| s.position(i)).collect(), s.normals)
}

/// White noise on the surface.
fn random(mesh: &Mesh, count: u64) -> Truth {
    let mut ends: Vec<f64> = (0..mesh.triangles().len()).map(|t| mesh.triangle_area(t)).collect();
    for i in 1..ends.len() {
        ends[i] += ends[i - 1];
    }
    (0..count)
        .map(|k| {
            let x = unit(3 * k) * ends[ends.len() - 1];
            let t = ends.partition_point(|&end| end <= x);
            let (mut u, mut v) = (unit(3 * k + 1), unit(3 * k + 2));
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let [a, b, c] = mesh.corners(t).map(|p| p.as_dvec3());
            let n = mesh.triangles()[t].map(|i| mesh.normals()[i as usize].as_dvec3());
            let n = n[0] * (1.0 - u - v) + n[1] * u + n[2] * v;
            ((a + (b - a) * u + (c - a) * v).as_vec3(), n.normalize_or(DVec3::Y).as_vec3())
        })
        .unzip()
}

/// Shakes points by up to half a mean spacing along each axis, a sixth in the mean.
fn noisy((points, normals): Truth, mesh: &Mesh) -> Truth {
    let spacing = (mesh.area() / points.len() as f64).sqrt();
    let shake = |i: u64| (unit(i + (1 << 40)) + unit(i + (1 << 41)) - 1.0) * 0.5 * spacing;
    let moved = points.iter().zip(0..).map(|(p, i): (_, u64)| {
        p.as_dvec3() + DVec3::new(shake(3 * i), shake(3 * i + 1), shake(3 * i + 2))
    });
    (moved.map(|p| p.as_vec3()).collect(), normals)
}

/// How good estimated normals are.
#[derive(Debug)]
struct Found {
    /// Part that is on the wrong side.
    wrong: f64,
    /// Angle to the truth, degrees: of half of them, and of 95 of a hundred.
    median: f32,
    p95: f32,
}

impl Found {
    fn of((points, truth): &Truth) -> Self {
        let cloud = made(points, usize::MAX);
        assert!(cloud.counts.outliers * 10_000 <= points.len(), "{:?}", cloud.counts);
        // The order is another one.
        let bits = |p: Vec3| p.to_array().map(f32::to_bits);
        let of: std::collections::HashMap<_, _> =
            points.iter().zip(truth).map(|(p, n)| (bits(*p), *n)).collect();
        let cosines = places(&cloud).into_iter().zip(&cloud.surfels.normals);
        let cosines: Vec<f32> = cosines.map(|(p, n)| n.dot(of[&bits(p + Vec3::ZERO)])).collect();
        let wrong = cosines.iter().filter(|c| **c < 0.0).count() as f64 / cosines.len() as f64;
        let angle = |c: &f32| c.abs().min(1.0).acos().to_degrees();
        let mut angles: Vec<f32> = cosines.iter().map(angle).collect();
        angles.sort_by(f32::total_cmp);
        let count = angles.len();
        Self { wrong, median: angles[count / 2], p95: angles[count * 95 / 100] }
    }
}

/// Measured figures are about two thirds of the bounds.
#[test]
fn normals_of_closed_shapes_point_outward() {
    for (name, triangles, wrong, median, p95) in [
        ("sphere", 40_000, 0.0, 1.2, 2.0),
        ("torus", 40_000, 0.0, 1.2, 2.5),
        ("knot", 100_000, 0.0, 2.5, 7.0),
        ("cube", 12, 1e-4, 0.1, 6.0),
        ("teapot", 100_000, 4e-3, 1.5, 11.0),
    ] {
        let mesh = builtin::shape(name, Some(triangles)).unwrap();
        for (kind, truth) in [("even", even(&mesh, 40_000)), ("random", random(&mesh, 40_000))] {
            let found = Found::of(&truth);
            println!("{name}, {kind}: {found:?}");
            assert!(
                found.wrong <= wrong && found.median < median && found.p95 < p95,
                "{name}, {kind}: {found:?}"
            );
        }
        let found = Found::of(&noisy(random(&mesh, 40_000), &mesh));
        println!("{name}, noisy: {found:?}");
        assert!(found.wrong < 6e-3 && found.median < 8.0, "{name}, noisy: {found:?}");
    }
}

/// The two sides of a sheet that is as thin as its points are apart, where they are even, and of thicker ones where they are
/// not. (White noise in a sheet as thin as that has no sides.)
#[test]
fn both_sides_of_a_thin_box_are_told_apart() {
    for (thickness, is_even, wrong) in
        [(0.005, true, 0.002), (0.015, true, 0.002), (0.015, false, 0.02), (0.03, false, 0.002)]
    {
        let stretched = builtin::shape("cube", None).unwrap();
        let squeeze = |p: &Vec3| *p * Vec3::new(1.0, thickness, 1.0);
        let mesh = Mesh::new(
            stretched.positions().iter().map(squeeze).collect(),
            vec![],
            vec![],
            stretched.triangles().to_vec(),
        )
        .unwrap();
        let truth = if is_even { even(&mesh, 80_000) } else { random(&mesh, 80_000) };
        // Its corners are smooth as a mesh: the sides tell.
        let half = truth.0.iter().map(|p| p.y).fold(0.0, f32::max);
        let low = truth.0.iter().map(|p| p.y).fold(half, f32::min);
        let middle = 0.5 * (half + low);
        let side = truth.0.iter().map(|p| Vec3::Y * (p.y - middle).signum()).collect();
        let found = Found::of(&(truth.0, side));
        println!("{thickness}, {is_even}: {found:?}");
        assert!(found.wrong < wrong, "{thickness}, {is_even}: {found:?}");
    }
}
