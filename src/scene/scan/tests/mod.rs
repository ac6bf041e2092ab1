//! Clouds against closed forms.

mod files;
mod meshes;
mod spread;
mod truth;

use glam::{DVec3, Vec3};

use super::gather::Points;
use super::*;
use crate::scene::sample::hash;

/// A random number in 0..1.
fn unit(word: u64) -> f64 {
    (hash(word) >> 11) as f64 / (1_u64 << 53) as f64
}

#[expect(clippy::cast_possible_truncation, reason = "rounded")]
fn unit32(word: u64) -> f32 {
    unit(word) as f32
}

fn of(positions: Vec<Vec3>) -> Points {
    Points { positions, ..Points::default() }
}

fn made(positions: &[Vec3], most: usize) -> PointCloud {
    let wanted = CloudOptions { most, ..CloudOptions::default() };
    surfels(of(positions.to_vec()), &wanted, &Context::default()).unwrap()
}

fn places(cloud: &PointCloud) -> Vec<Vec3> {
    (0..cloud.surfels.len()).map(|i| cloud.surfels.position(i)).collect()
}

/// White noise on the unit square of the ground.
fn noise(count: u64) -> Vec<Vec3> {
    (0..count).map(|i| Vec3::new(unit32(2 * i), 0.0, unit32(2 * i + 1))).collect()
}

#[test]
fn duplicates_go_and_the_first_stays() {
    let mut points = of(noise(1000));
    points.positions.extend(noise(500));
    points.colors = (0..1500).map(|i| Vec3::splat(if i < 1000 { 0.25 } else { 0.5 })).collect();
    let cloud = surfels(points, &CloudOptions::default(), &Context::default()).unwrap();
    assert_eq!(cloud.counts, CloudCounts { read: 1500, duplicates: 500, ..Default::default() });
    assert!(cloud.has_colors && cloud.surfels.albedo.iter().all(|c| *c == Vec3::splat(0.25)));
    let same = made(&vec![Vec3::X; 5000], 100);
    assert_eq!((same.surfels.len(), same.counts.duplicates), (1, 4999));
}

/// Whatever there is: few points, points on a line, far from zero, tiny, huge.
#[test]
fn degenerate_clouds_are_surfels_too() {
    for count in 1..40_u8 {
        let line: Vec<Vec3> = (0..count).map(|i| Vec3::X * f32::from(i)).collect();
        let found = made(&line, 1000);
        assert_eq!(found.surfels.len(), usize::from(count));
    }
    let square = noise(2000);
    for scale in [1e-30, 1e-10, 1.0, 1e10, 1e14] {
        let scaled: Vec<Vec3> = square.iter().map(|p| *p * scale).collect();
        let found = made(&scaled, 500).surfels;
        assert!((480..=500).contains(&found.len()), "{scale}: {}", found.len());
        assert!(found.normals.iter().all(|n| n.y > 0.99), "{scale}");
        assert!(found.extent.iter().all(|e| e.is_finite() && *e >= 0.0), "{scale}");
        assert_eq!(found.x.len(), found.len() + PADDING);
    }
}

#[test]
fn outliers_go_whatever_the_density_and_nothing_else_does() {
    // Sixteen times as dense on one half.
    let mut points: Vec<Vec3> = noise(60_000);
    points
        .iter_mut()
        .for_each(|p| p.x = if p.x < 0.05 { p.x * 10.0 } else { 0.5 + (p.x - 0.05) * 0.526 });
    let found = made(&points, usize::MAX);
    // Those at the jump from one half to the other.
    assert!(found.counts.outliers <= 10, "{:?}", found.counts);
    let stray = found.counts.outliers;
    // Above the sparse half and the dense one, alone and five together.
    let spacing = [(0.5_f32 / 3000.0).sqrt(), (0.5_f32 / 57_000.0).sqrt()];
    for (x, spacing) in [(0.25, spacing[0]), (0.75, spacing[1])] {
        for i in 0..20 {
            points.push(Vec3::new(x, 8.0 * spacing, 0.025 + 0.05 * i as f32));
        }
        for i in 0..5 {
            points.push(Vec3::new(x, -10.0 * spacing, 0.5 + 0.1 * i as f32 * spacing));
        }
    }
    let found = made(&points, usize::MAX);
    assert!((50 + stray..=53 + stray).contains(&found.counts.outliers), "{:?}", found.counts);
    assert!(places(&found).iter().all(|p| p.y == 0.0));
}

#[test]
fn open_sheets_face_up_and_closed_ones_outward() {
    let cx = Context::default();
    let mut points = noise(5_000);
    let ball = |i: u64| {
        let (z, turn) = (2.0 * unit32(3 * i) - 1.0, std::f32::consts::TAU * unit32(3 * i + 1));
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * turn.cos(), r * turn.sin(), z) + Vec3::X * 3.0
    };
    points.extend((0..5_000).map(ball));
    for up in [Vec3::Y, Vec3::NEG_Y] {
        let wanted = CloudOptions { up, ..CloudOptions::default() };
        let found = surfels(of(points.clone()), &wanted, &cx).unwrap();
        for (i, p) in places(&found).into_iter().enumerate() {
            let truth = if p.x < 1.5 { up } else { (p - Vec3::X * 3.0).normalize_or(up) };
            assert!(found.surfels.normals[i].dot(truth) > 0.95, "{p}");
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let points = noise(400_000);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool.install(|| made(&points, 50_000));
        let bits = |v: &Vec3| v.to_array().map(f32::to_bits);
        let normals: Vec<_> = found.surfels.normals.iter().map(bits).collect();
        let places: Vec<_> = places(&found).iter().map(bits).collect();
        let extents: Vec<_> = found.surfels.extent.iter().map(|e| e.to_bits()).collect();
        (normals, places, extents)
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
}

#[test]
fn it_can_be_cancelled_anywhere() {
    struct After(std::sync::Mutex<(usize, Option<Context>)>);
    impl crate::context::Progress for After {
        fn report(&self, _stage: &str, done: f64) {
            assert!((0.0..=1.0).contains(&done));
            let mut left = self.0.lock().unwrap();
            left.0 = left.0.saturating_sub(1);
            if left.0 == 0
                && let Some(cx) = &left.1
            {
                cx.cancel_flag().store(true, std::sync::atomic::Ordering::Relaxed);
            }
        }
    }
    let points = noise(50_000);
    for steps in 1.. {
        let after = std::sync::Arc::new(After(std::sync::Mutex::new((steps, None))));
        let cx = Context::new(after.clone());
        after.0.lock().unwrap().1 = Some(cx.clone());
        let wanted = CloudOptions { most: 5_000, ..CloudOptions::default() };
        match surfels(of(points.clone()), &wanted, &cx) {
            Err(crate::Error::Cancelled) => {}
            Ok(_) => {
                assert!(steps > 10, "{steps} reports");
                break;
            }
            Err(e) => panic!("{e}"),
        }
    }
}

#[test]
fn places_far_from_zero_keep_their_digits() {
    let far = DVec3::new(4.5e6, -5.7e5, 312.0);
    let exact: Vec<DVec3> = (0..1000_u32)
        .map(|i| far + DVec3::new(f64::from(i % 32), f64::from(i / 32), 0.25) * 0.125)
        .collect();
    let (offset, local) = gather::place(&exact);
    for (p, local) in exact.iter().zip(&local) {
        assert_eq!(offset + local.as_dvec3(), *p);
    }
    // A cloud about zero stays as it is.
    let (offset, _) = gather::place(&[DVec3::ONE, -DVec3::ONE]);
    assert_eq!(offset, DVec3::ZERO);
}
