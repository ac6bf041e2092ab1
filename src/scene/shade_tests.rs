//! Truth: shadows of spheres in closed form, and surfaces that must not shadow themselves.

use glam::{DQuat, DVec3, Vec3};

use super::{Sun, SurfacePoint, bake, shade};
use crate::accel::TriangleBvh;
use crate::accel::triangle_bvh::tests::{Random, sphere};
use crate::context::Context;
use crate::geometry::{Similarity, Surfels};
use crate::scene::description::Light;

fn light(to_sun: Vec3) -> Light {
    Light { to_sun: to_sun.normalize_or(Vec3::Y), sun: Vec3::ONE, ambient: Vec3::splat(0.25) }
}

/// A square of two triangles, facing up.
fn square(center: Vec3, half: f32) -> [[Vec3; 3]; 2] {
    let corner = |x: f32, z: f32| center + Vec3::new(x * half, 0.0, z * half);
    let [a, b, c, d] = [corner(-1., -1.), corner(-1., 1.), corner(1., 1.), corner(1., -1.)];
    [[a, b, c], [a, c, d]]
}

fn surfels(points: impl IntoIterator<Item = (Vec3, Vec3)>, extent: f32) -> Surfels {
    let mut made = Surfels::default();
    for (p, n) in points {
        made.x.push(p.x);
        made.y.push(p.y);
        made.z.push(p.z);
        made.normals.push(n);
        made.albedo.push(Vec3::ONE);
        made.radiance.push(Vec3::NAN);
        made.extent.push(extent);
    }
    made
}

#[test]
fn a_sphere_on_the_ground_has_its_closed_form_shadow_up_to_the_contact() {
    let radius = 0.3;
    for to_sun in [Vec3::Y, Vec3::new(1.0, 2.0, 0.5), Vec3::new(-2.0, 1.0, 0.3)] {
        let light = light(to_sun);
        let mut triangles = sphere(Vec3::Y * radius, radius, 150, 300);
        triangles.extend(square(Vec3::ZERO, 3.0));
        let bvh = TriangleBvh::build(&triangles);
        let mut random = Random(1);
        let ground: Vec<Vec3> = (0..40_000)
            .map(|i| {
                // A third of them close to the contact.
                let spread = if i % 3 == 0 { 0.02 } else { 1.2 };
                (random.vector() * spread).with_y(0.0)
            })
            .collect();
        let mut made = surfels(ground.iter().map(|&p| (p, Vec3::Y)), 0.004);
        let range = 0..made.len();
        bake(&mut made, range, &Similarity::IDENTITY, 0.0, &bvh, &light, &Context::default())
            .unwrap();
        let (mut dark, mut bright, mut wrong) = (0, 0, 0);
        for (p, radiance) in ground.iter().zip(&made.radiance) {
            let to_center = Vec3::Y * radius - *p;
            let miss = to_center.cross(light.to_sun).length();
            // The mesh is a hair smaller than the sphere, and shadow rays start a hair above the ground.
            if (miss - radius).abs() < 0.005 * radius {
                continue;
            }
            let shadowed = miss < radius && to_center.dot(light.to_sun) > 0.0;
            let expected = shade(Vec3::ONE, Vec3::Y, !shadowed, &light);
            wrong += usize::from(*radiance != expected);
            *(if shadowed { &mut dark } else { &mut bright }) += 1;
        }
        assert_eq!(wrong, 0, "of {dark} dark and {bright} bright, sun {to_sun}");
        assert!(dark > 5_000 && bright > 5_000);
    }
}

/// Random points of a mesh about the origin, with the normals of a smooth sphere.
fn on_sphere(triangles: &[[Vec3; 3]], count: usize) -> Vec<(Vec3, Vec3)> {
    let mut random = Random(2);
    (0..count)
        .map(|i| {
            let [a, b, c] = triangles[i % triangles.len()];
            let (mut u, mut v) = (random.unit(), random.unit());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let [na, nb, nc] = [a, b, c].map(|p| p.normalize_or(Vec3::Y));
            let normal = na * (1.0 - u - v) + nb * u + nc * v;
            (a * (1.0 - u - v) + b * u + c * v, normal.normalize_or(Vec3::Y))
        })
        .collect()
}

#[test]
fn the_lit_side_has_no_acne_and_no_teeth() {
    for (rows, extent) in [(8, 1e-4), (20, 1e-4), (20, 0.02), (200, 0.002)] {
        let triangles = sphere(Vec3::ZERO, 1.0, rows, 2 * rows);
        let bvh = TriangleBvh::build(&triangles);
        let light = light(Vec3::new(0.3, 0.8, -0.4));
        let points: Vec<SurfacePoint> = on_sphere(&triangles, 20_000)
            .into_iter()
            .map(|(position, normal)| SurfacePoint { position, normal, extent })
            .collect();
        let visible = Sun::new(&bvh, &light).visible(&points);
        for (point, visible) in points.iter().zip(visible) {
            let facing = point.normal.dot(light.to_sun);
            assert_eq!(visible, facing > 0.0, "n·l {facing} in {rows} rows, extent {extent}");
        }
    }
    let ground = square(Vec3::new(50.0, 3.0, 0.0), 20.0);
    let bvh = TriangleBvh::build(&ground);
    let mut random = Random(3);
    let points: Vec<SurfacePoint> = (0..10_000)
        .map(|_| SurfacePoint {
            position: Vec3::new(50.0, 3.0, 0.0) + (19.0 * random.vector()).with_y(0.0),
            normal: Vec3::Y,
            extent: 0.0,
        })
        .collect();
    for to_sun in [Vec3::Y, Vec3::new(1.0, 0.01, 0.2)] {
        assert!(Sun::new(&bvh, &light(to_sun)).visible(&points).iter().all(|v| *v));
    }
}

#[test]
fn a_plate_shades_the_ground_under_a_low_sun() {
    let mut triangles = square(Vec3::ZERO, 5.0).to_vec();
    triangles.extend(square(Vec3::Y * 0.1, 1.0));
    let bvh = TriangleBvh::build(&triangles);
    let below = SurfacePoint { position: Vec3::ZERO, normal: Vec3::Y, extent: 0.01 };
    let beside = SurfacePoint { position: Vec3::X * -1.5, ..below };
    let light = light(Vec3::new(1.0, 0.3, 0.0));
    assert_eq!(Sun::new(&bvh, &light).visible(&[below, beside]), [false, true]);
}

#[test]
fn a_moved_object_is_shaded_where_it_is() {
    let to_scene = Similarity {
        rotation: DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2),
        translation: DVec3::new(4.0, 1.0, -2.0),
        scale: 2.0,
    };
    // Locally below the origin, looking along -z; in the scene above a ball, looking up.
    let mut made = surfels([(Vec3::ZERO, Vec3::NEG_Z), (Vec3::X, Vec3::NEG_Z)], 0.01);
    let bvh = TriangleBvh::build(&sphere(Vec3::new(4.0, 3.0, -2.0), 0.5, 30, 60));
    let light = light(Vec3::Y);
    bake(&mut made, 0..2, &to_scene, 0.0, &bvh, &light, &Context::default()).unwrap();
    assert_eq!(made.radiance[0], light.ambient, "under the ball");
    assert!(made.radiance[1].distance(light.ambient + light.sun) < 1e-6, "beside it");
    let before = made.radiance[1];
    made.radiance[1] = Vec3::NAN;
    bake(&mut made, 0..1, &to_scene, 0.0, &bvh, &light, &Context::default()).unwrap();
    assert!(made.radiance[1].is_nan() && before.is_finite(), "only the range is touched");
}

#[test]
fn cancelling_stops_it() {
    let cx = Context::default();
    cx.cancel_flag().store(true, std::sync::atomic::Ordering::Relaxed);
    let mut made = surfels([(Vec3::ZERO, Vec3::Y)], 0.01);
    let bvh = TriangleBvh::build(&[]);
    let result = bake(&mut made, 0..1, &Similarity::IDENTITY, 0.0, &bvh, &light(Vec3::Y), &cx);
    assert!(matches!(result, Err(crate::Error::Cancelled)));
}
