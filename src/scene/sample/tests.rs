//! Sampling against closed forms and against white noise.

mod evenness;
mod shapes;

use self::shapes::{joined, moved, plane, sphere};
use super::*;

fn sampled(mesh: &Mesh, count: usize, seed: u64) -> Surfels {
    sample(mesh, &Paint::Constant(Vec3::ONE), count, seed, &Context::default()).unwrap()
}

fn positions(surfels: &Surfels) -> Vec<Vec3> {
    (0..surfels.len()).map(|i| surfels.position(i)).collect()
}

#[test]
fn counts_are_exact_and_arrays_padded() {
    let sphere = sphere(40, 20);
    for mesh in [&plane(1, 1), &sphere] {
        for count in [1, 2, 3, 7, 16, 100, 1000, 12_345] {
            let surfels = sampled(mesh, count, 5);
            assert_eq!(surfels.len(), count);
            for axis in [&surfels.x, &surfels.y, &surfels.z] {
                assert_eq!(axis.len(), count + PADDING);
            }
            for len in [surfels.albedo.len(), surfels.radiance.len(), surfels.extent.len()] {
                assert_eq!(len, count);
            }
            let disks = f64::from(surfels.extent[0]).powi(2) * std::f64::consts::PI * count as f64;
            assert!((disks / mesh.area() - 1.0).abs() < 1e-5, "{disks}");
        }
    }
}

/// Surfaces that lie a hundred times in one place, or whose points coincide in f32, end with exact counts.
#[test]
fn coincident_surfaces_end() {
    let sheets = joined(&vec![plane(3, 3); 100]);
    let surfels = sampled(&sheets, 20_000, 1);
    assert_eq!(surfels.len(), 20_000);
    let left = positions(&surfels).iter().filter(|p| p.x < 0.5).count();
    assert!((9_800..10_200).contains(&left), "{left} of 20000 on one half");

    let far = Vec3::splat(1.0e6);
    let corners = [Vec3::ZERO, Vec3::X * 0.0625, Vec3::Z * 0.0625].map(|p| p + far);
    let speck = Mesh::new(corners.to_vec(), vec![], vec![], vec![[0, 2, 1]]).unwrap();
    assert_eq!(sampled(&speck, 3_000, 1).len(), 3_000);
}

/// Specks apart from each other leave most blocks with less than a sample.
#[test]
fn dust_gets_exact_counts() {
    let speck = plane(1, 1);
    let place = |i: u32| {
        let i = i as f32;
        Vec3::new((i * 0.754_877).fract(), (i * 0.569_84).fract(), (i * 0.328).fract()) * 2_000.0
    };
    let dust: Vec<Mesh> = (0..300).map(|i| moved(&speck, place(i), i % 2 == 0)).collect();
    let dust = joined(&dust);
    for count in 1..400 {
        assert_eq!(sampled(&dust, count, 1).len(), count);
    }
    // Every speck has the same area.
    let mut each = [0; 300];
    for p in positions(&sampled(&dust, 9_000, 1)) {
        let near = (0..300)
            .min_by(|&a, &b| p.distance_squared(place(a)).total_cmp(&p.distance_squared(place(b))));
        each[near.unwrap() as usize] += 1;
    }
    assert!(each.iter().all(|n| (27..=33).contains(n)), "{each:?}");
}

#[test]
fn any_size_is_sampled() {
    for size in [1.0e-44, 1.0e-30, 1.0e-10, 1.0e10, 1.0e15] {
        let corners = vec![Vec3::ZERO, Vec3::Z * size, Vec3::X * size];
        let mesh = Mesh::new(corners, vec![], vec![], vec![[0, 1, 2]]).unwrap();
        let surfels = sampled(&mesh, 2_000, 1);
        assert_eq!(surfels.len(), 2_000);
        let inside = |p: &Vec3| p.is_finite() && p.min_element() >= 0.0 && p.max_element() <= size;
        assert!(positions(&surfels).iter().all(inside), "{size}");
        assert!(surfels.normals.iter().all(|n| n.distance(Vec3::Y) < 1e-5), "{size}");
    }
}

#[test]
fn degenerate_triangles_get_nothing() {
    let (mut corners, mut triangles) = (plane(1, 1).positions().to_vec(), vec![[0, 0, 1]]);
    triangles.extend(plane(1, 1).triangles());
    corners.extend([Vec3::splat(9.0), Vec3::splat(10.0), Vec3::splat(11.0)]);
    triangles.extend([[4, 5, 6], [4, 4, 4]]);
    let mesh = Mesh::new(corners, vec![], vec![], triangles).unwrap();
    assert!(positions(&sampled(&mesh, 5_000, 1)).iter().all(|p| p.y == 0.0));
}

#[test]
fn seed_decides_and_threads_do_not() {
    let mesh = joined(&[sphere(300, 150), plane(2, 1)]);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| sampled(&mesh, 20_000, 11))
    };
    let one = with(1);
    for threads in [2, 5] {
        let many = with(threads);
        assert_eq!(positions(&one), positions(&many));
        assert_eq!(one.normals, many.normals);
    }
    assert_ne!(positions(&one), positions(&sampled(&mesh, 20_000, 12)));
}

#[test]
fn normals_and_colors_are_interpolated() {
    let surfels = sampled(&sphere(200, 100), 5_000, 1);
    for (p, normal) in positions(&surfels).into_iter().zip(&surfels.normals) {
        assert!((normal.length() - 1.0).abs() < 1e-5);
        let exact = p.normalize_or(Vec3::Y);
        assert!(normal.distance(exact) < 1e-3, "{normal} instead of {exact}");
    }
    // Colours that are a linear function of the position must stay one.
    let plain = plane(3, 2);
    let color = |p: Vec3| Vec3::new(p.x, 1.0 - p.z, 0.25 + 0.5 * p.x);
    let colors = plain.positions().iter().map(|&p| color(p)).collect();
    let triangles = plain.triangles().to_vec();
    let mesh = Mesh::new(plain.positions().to_vec(), vec![], colors, triangles).unwrap();
    let surfels = sample(&mesh, &Paint::Vertex, 5_000, 1, &Context::default()).unwrap();
    for (p, albedo) in positions(&surfels).into_iter().zip(&surfels.albedo) {
        assert!(albedo.distance(color(p)) < 1e-5, "{albedo} at {p}");
    }
}

#[test]
fn normals_that_cancel_fall_back_to_the_face() {
    assert_eq!(unit_normal(Vec3::new(0.0, 3.0, 4.0), Vec3::Z), Vec3::new(0.0, 0.6, 0.8));
    assert_eq!(unit_normal(Vec3::ZERO, Vec3::Z), Vec3::Z);
    assert_eq!(unit_normal(Vec3::ZERO, Vec3::ZERO), Vec3::Y);
}

#[test]
fn bad_counts_and_cancellation_are_errors() {
    let (mesh, paint) = (plane(1, 1), Paint::Constant(Vec3::ONE));
    for count in [0, MOST + 1, usize::MAX] {
        let error = sample(&mesh, &paint, count, 1, &Context::default()).unwrap_err();
        assert!(error.to_string().contains(&format!("surfels: {count} of them")), "{error}");
    }
    let cx = Context::default();
    cx.cancel_flag().store(true, std::sync::atomic::Ordering::Relaxed);
    assert!(matches!(sample(&mesh, &paint, 10, 1, &cx), Err(Error::Cancelled)));
}

#[test]
fn shares_follow_area_and_density() {
    assert_eq!(allot(&[1.0, 3.0], &[1.0, 1.0], 400), [100, 300]);
    assert_eq!(allot(&[1.0, 3.0], &[3.0, 1.0], 400), [200, 200]);
    // Largest remainder: 33.33, 33.33, 33.33 and one left over; ties go to the first.
    assert_eq!(allot(&[1.0; 3], &[1.0; 3], 100), [34, 33, 33]);
    assert_eq!(allot(&[1.0, 2.0, 4.0], &[], 1000), [143, 286, 571]);
    // A speck gets its sixteen at the cost of the others.
    assert_eq!(allot(&[1.0, 1.0e-9, 1.0], &[1.0; 3], 1016), [500, 16, 500]);
    // Taking one out can push another below sixteen.
    assert_eq!(allot(&[0.0, 16.1, 83.9], &[1.0; 3], 100), [16, 16, 68]);
    assert_eq!(allot(&[f64::NAN, -1.0, 5.0], &[1.0; 3], 1000), [16, 16, 968]);
    assert_eq!(allot(&[1.0, 1.0], &[1.0; 2], 10), [16, 16]);
    assert_eq!(allot(&[0.0], &[1.0], 100), [16]);
    assert!(allot(&[], &[], 100).is_empty());
}
