//! Surfels where none should be.

use super::super::{eye, looks, near, shape};
use super::*;

#[test]
fn surfels_at_one_point() {
    for point in [Vec3::new(1.2, 0.3, 1.5), Vec3::new(-0.4, 2.0, 0.3)] {
        let points = vec![point; 2000];
        let world = surfels(&ball(), &points, looks(EYE, DVec3::ZERO));
        assert_paths("one point", &world, &points, 40);
    }
    // One surfel is as many.
    let points = [Vec3::new(1.2, 0.3, 1.5)];
    let world = surfels(&ball(), &points, looks(EYE, DVec3::ZERO));
    assert_paths("one surfel", &world, &points, 40);
}

#[test]
fn surfels_on_a_line() {
    for (name, points) in [
        ("across", line(Vec3::new(-1.5, 0.2, 1.2), Vec3::new(1.5, 0.4, 1.4))),
        ("along an axis", line(Vec3::new(0.7, -2.0, 1.0), Vec3::new(0.7, 2.0, 1.0))),
        ("out of the mirror", line(Vec3::new(0.1, 0.1, 0.2), Vec3::new(0.5, 0.8, 2.5))),
    ] {
        let world = surfels(&ball(), &points, looks(EYE, DVec3::ZERO));
        assert_paths(name, &world, &points, 2500);
    }
}

/// A kernel is so many times as wide as its surfel's disk.
const KERNEL: f32 = 1.3 * 1.5;

#[test]
fn surfels_in_the_mirror() {
    let mesh = ball();
    let middles = mesh.triangles().iter().map(|t| {
        let [a, b, c] = t.map(|i| mesh.positions()[i as usize]);
        (a + b + c) / 3.0
    });
    let points: Vec<Vec3> = mesh.positions().iter().copied().chain(middles).collect();
    let eye = looks(EYE, DVec3::ZERO);
    let (prepared, _) = surfels(&mesh, &points, eye);
    for (way, _, planes) in drawn(&prepared) {
        let covered = covered(&planes);
        let disks = way.splat == Splat::Disk;
        let blocks = disks && way.settings.is_empty();
        let focal_px = super::super::eye(&prepared, SIZE[0], SIZE[1]).focal_px;
        // How far from a pixel what it shows may be seen: the vertices lie so far apart that disks are nearly as large as any may be
        // in cells, eight pixels. In blocks they have the size that they have.
        let most = |i: usize, at: DVec3| match (blocks, disks) {
            (true, _) => {
                let radius = KERNEL * prepared.surfels.extent[planes.surfel[i] as usize];
                f64::from(radius * focal_px) / (at - EYE).length() + 2.0
            }
            (false, true) => 8.0,
            (false, false) => 2.0,
        };
        let far = covered.iter().filter(|&&i| {
            let at = Vec3::from(planes.position[i]).as_dvec3();
            (project(&eye, at) - centre(i)).abs().max_element() > most(i, at)
        });
        let far = far.count();
        assert!(
            far <= if disks { covered.len() / 500 } else { 0 },
            "{way:?}: {far} of {} pixels show another place",
            covered.len()
        );
    }
}

#[test]
fn surfels_behind_the_eye() {
    for point in [Vec3::new(0.9, 0.6, 6.0), Vec3::new(-2.0, 1.0, 40.0)] {
        let points = vec![point; 500];
        let world = surfels(&ball(), &points, looks(EYE, DVec3::ZERO));
        assert_paths("behind the eye", &world, &points, 40);
    }
}

#[test]
fn what_no_ray_reaches() {
    let eye = looks(DVec3::new(0.3, 0.2, 3.0), DVec3::ZERO);
    let behind = line(Vec3::new(-0.5, 0.1, -0.3), Vec3::new(0.5, -0.2, -2.0));
    let inside = line(Vec3::new(-0.4, 0.0, 0.1), Vec3::new(0.4, 0.2, 0.3));
    let away = looks(DVec3::new(0.3, 0.2, 3.0), DVec3::new(0.3, 0.2, 9.0));
    let front = line(Vec3::new(-0.5, 0.1, 1.0), Vec3::new(0.5, -0.2, 2.0));
    let plane = (*shape("plane", 200)).clone();
    for (name, mirror, points, eye) in [
        ("behind a plane", &plane, &behind, eye),
        ("within a ball", &ball(), &inside, eye),
        ("a mirror behind the eye", &ball(), &front, away),
    ] {
        for (way, picture, planes) in drawn(&surfels(mirror, points, eye).0) {
            assert_eq!(covered(&planes), Vec::<usize>::new(), "{name}, {way:?}");
            assert!(picture.rgb.iter().all(|c| near(c, &SKY, 1e-6)), "{name}, {way:?}");
            let seen = planes.mirror.iter().filter(|&&m| m == 0).count();
            assert_eq!(seen > 0, name != "a mirror behind the eye", "{name}");
        }
    }
}

/// The device draws degenerate worlds as the CPU does.
#[cfg(feature = "gpu")]
#[test]
fn on_the_gpu() {
    use catoptric::backend::gpu::{Gpu, Options};
    let one = vec![Vec3::new(1.2, 0.3, 1.5); 500];
    let thin = line(Vec3::new(-1.5, 0.2, 1.2), Vec3::new(1.5, 0.4, 1.4));
    for points in [one, thin] {
        let (scene, _) = surfels(&ball(), &points, looks(EYE, DVec3::ZERO));
        // Blocks are the CPU's alone.
        let ways = &WAYS[1..5];
        for (way, _, cpu) in drawn_by(&scene, ways) {
            let gpu = match Gpu::new(Options::default()) {
                Ok(gpu) => gpu,
                Err(error) => {
                    let required = std::env::var("CATOPTRIC_REQUIRE_GPU").is_ok_and(|v| v == "1");
                    assert!(!required, "{error}");
                    return;
                }
            };
            let c3rc = method(way.method).unwrap();
            let mut params = Params::defaults(c3rc.info().params);
            for (name, value) in way.settings {
                params.set(c3rc.info().param(name), value).unwrap();
            }
            let mut renderer = Renderer::on(Box::new(gpu));
            let eye = eye(&scene, SIZE[0], SIZE[1]);
            renderer.render(&scene, &eye, c3rc, &params, true, &Context::default()).unwrap();
            let planes = renderer.planes().unwrap();
            sound(way, renderer.picture(), planes);
            let all = cpu.coverage.iter().zip(&planes.coverage);
            let apart = all.filter(|(a, b)| (*a - *b).abs() > 0.02).count();
            assert!(apart <= covered(&cpu).len() / 20, "{way:?}: {apart} pixels differ");
        }
    }
}
