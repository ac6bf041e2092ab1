//! Cells: every pixel that may see an object has one camera, whose ray and deviation are the exact ray.

use catoptric::Context;
use catoptric::backend::cpu::finish::{mirror_surfaces, object_surfaces};
use catoptric::camera::mirror_ray::{RaySource, reflected_ray};
use catoptric::camera::{Eye, RayScale};
use catoptric::frame::Renderer;
use catoptric::geometry::Similarity;
use catoptric::methods::{FrameInput, Params, method};
use catoptric::plan::{CELL_SLACK_PX, CameraInstance, Pass, Plan};
use catoptric::scene::PreparedScene;
use catoptric::visibility::{NONE_ID, Scratch, Visibility};
use glam::{DMat2, DVec2, DVec3, Vec2};

use super::{BLUE, RED, eye, looks, moved, object, prepared, scene, shape, turned};

/// A mirror with objects about it, one of them turned and scaled.
fn setting(mirror: &str) -> PreparedScene {
    let wave = object("wave", shape("wave", 2000), moved(DVec3::new(1.4, 0.6, 0.8)), RED);
    let place = Similarity { scale: 0.4, ..turned(DVec3::ONE, 40.0, DVec3::new(-1.5, 0.9, 1.2)) };
    let knot = object("knot", shape("knot", 2000), place, BLUE);
    let mirror = (shape(mirror, 3000), Similarity::IDENTITY);
    let eye = looks(DVec3::new(0.3, 1.0, 3.4), DVec3::ZERO);
    prepared(&scene(mirror, vec![wave, knot], eye), 20_000)
}

/// Values of a camera's linear forms where it is seen at a place of its patch's rectangle.
fn at_px(camera: &CameraInstance, px: DVec2) -> DVec3 {
    let [x, y, w] = camera.screen.map(|form| DVec3::from_array(form.map(f64::from)));
    // (x - px w)·(1, b2, b3) = 0, and so for y.
    let (r, s) = (x - w * px.x, y - w * px.y);
    let b = DMat2::from_cols(DVec2::new(r.y, s.y), DVec2::new(r.z, s.z)).inverse()
        * -DVec2::new(r.x, s.x);
    DVec3::new(1.0, b.x, b.y)
}

/// How many pixels see an object, and which share of the cameras' pixels is far from their exact rays without deviations.
fn check(scene: &PreparedScene, eye: &Eye) -> (usize, f64) {
    let mut visibility = Visibility::default();
    visibility.update(
        eye,
        &mirror_surfaces(scene),
        &object_surfaces(scene),
        &mut Scratch::default(),
    );
    let c3rc = method("c3rc").unwrap();
    let mut params = Params::defaults(c3rc.info().params);
    for (id, value) in [("cameras", "cells"), ("splat", "ellipse"), ("detail", "1")] {
        params.set(c3rc.info().param(id), value).unwrap();
    }
    let made = c3rc.prepare(scene, &params, &Context::default()).unwrap();
    let mut plan = Plan::default();
    c3rc.plan(FrameInput { scene, eye, visibility: &visibility }, &made, &params, &mut plan)
        .unwrap();
    let Some(Pass::Splat(pass)) = plan.passes.first() else { panic!("no splats") };

    let width = eye.size.width;
    let mut owners = vec![0; eye.size.pixels()];
    let mut far = 0;
    for (i, patch) in pass.patches.iter().enumerate() {
        let camera = &pass.cameras[pass.patch_cameras[i] as usize];
        assert_eq!(camera.patch as usize, i);
        let first = patch.own.unwrap().first_pixel as usize;
        let [left, top] = patch.rect.min;
        let mut owned = 0;
        for y in top..patch.rect.max[1] {
            for x in left..patch.rect.max[0] {
                if !patch.owns(&visibility, &pass.pixels.rows, x, y) {
                    continue;
                }
                owned += 1;
                let pixel = (y * width + x) as usize;
                owners[pixel] += 1;
                let id = visibility.mirror_ids[pixel];
                assert_ne!(id, NONE_ID, "not a mirror's");
                let [column, row] = [x - left, y - top].map(|v| f64::from(v) + 0.5);
                let at = at_px(camera, DVec2::new(column, row));
                let own = DVec3::from_array(
                    camera.direction.map(|form| DVec3::from_array(form.map(f64::from)).dot(at)),
                );
                let offset = ((y - top) * patch.rect.width() + x - left) as usize;
                let beside = pass.pixels.deviations[first + offset].map(f64::from);
                let px = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let mirror = scene.mirror_triangle(id);
                let (_, exact) =
                    reflected_ray(eye, px, &mirror, RaySource::Surface, RayScale::EyeDistance)
                        .unwrap();
                let exact = exact.as_dvec3();
                let angle = (own + DVec3::from_array(beside)).angle_between(exact);
                assert!(angle < 2e-4, "{x}, {y}: {angle} rad beside the exact ray");
                // The camera alone, in pixels at infinity.
                let step = at_px(camera, DVec2::new(column + 1.0, row + 1.0));
                let next = DVec3::from_array(
                    camera.direction.map(|form| DVec3::from_array(form.map(f64::from)).dot(step)),
                );
                let px_angle = next.angle_between(own) / std::f64::consts::SQRT_2;
                far += usize::from(
                    own.angle_between(exact) > 2.0 * f64::from(CELL_SLACK_PX) * px_angle,
                );
            }
        }
        assert_eq!(owned, patch.pixels);
    }
    // Whatever a ray meets an object from has a camera.
    let mut renderer = Renderer::new();
    let raytrace = method("raytrace").unwrap();
    let params = Params::defaults(raytrace.info().params);
    renderer.render(scene, eye, raytrace, &params, true, &Context::default()).unwrap();
    let truth = renderer.planes().unwrap();
    let mut seeing = 0;
    for (i, &count) in owners.iter().enumerate() {
        assert!(count <= 1, "pixel {i} has {count} cameras");
        if truth.coverage[i] > 0.0 {
            seeing += 1;
            assert_eq!(count, 1, "pixel {i} sees an object and has no camera");
        }
    }
    (seeing, far as f64 / owners.iter().sum::<usize>() as f64)
}

#[test]
fn every_pixel_that_sees_an_object_has_its_exact_ray() {
    for mirror in ["sphere", "goblet", "wave", "bowl", "teapot"] {
        let scene = setting(mirror);
        for (width, height) in [(330, 200), (61, 37)] {
            let (seeing, far) = check(&scene, &eye(&scene, width, height));
            assert!(seeing > 5, "{mirror}: only {seeing} of {width} x {height}");
            // Where rays change much faster in one direction, that angle says little of the other.
            assert!(far < 0.2, "{mirror}: {far} of the cameras' pixels are far off");
        }
    }
}
