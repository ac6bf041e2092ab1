//! The replay against the culler and the backend, and its geometry against the exact rays.

use std::sync::Arc;

use glam::{DQuat, DVec3, Vec2, Vec3};

use super::replay::Replay;
use super::*;
use crate::backend::Backend;
use crate::backend::cpu::{Cpu, finish};
use crate::camera::RayScale;
use crate::camera::eye::ImageSize;
use crate::camera::mirror_ray::{RaySource, reflected_ray, weights_on_line};
use crate::context::Context;
use crate::geometry::Similarity;
use crate::methods::c3rc;
use crate::plan::{Batch, Reflection};
use crate::scene::description::{Environment, EyeDescription, Light, Mirror, Object, Paint, Scene};
use crate::scene::{PrepareOptions, builtin};
use crate::visibility::{NONE_ID, Scratch};

/// A coarse bowl with a knot about its focus, whose points are seen several times, a smaller mirror before it, and a
/// turned ball, which is closed.
fn scene(surfels: usize) -> PreparedScene {
    let mesh = |name: &str, triangles| Arc::new(builtin::shape(name, Some(triangles)).unwrap());
    let at = |x: f64, y: f64, z: f64, scale: f64| Similarity {
        translation: DVec3::new(x, y, z),
        rotation: DQuat::from_rotation_x(0.3 * x),
        scale,
    };
    let object = |name: &str, transform| Object {
        name: name.into(),
        mesh: mesh(name, 2000),
        source: None,
        points: None,
        transform,
        paint: Paint::Constant(Vec3::splat(0.5)),
        density: 1.0,
    };
    let mirror = |name: &str, triangles, transform| Mirror {
        name: name.into(),
        mesh: mesh(name, triangles),
        source: None,
        transform,
        tint: Vec3::ONE,
        proxy: None,
    };
    let scene = Scene {
        name: "test".into(),
        eye: EyeDescription {
            position: DVec3::new(0.3, 2.2, 3.4),
            target: DVec3::new(0.1, 0.6, 0.2),
            up: DVec3::Y,
            fov_y: 0.7,
        },
        mirrors: vec![
            mirror("bowl", 80, Similarity::IDENTITY),
            mirror("sphere", 200, at(0.4, 0.7, 0.9, 0.25)),
        ],
        objects: vec![
            object("knot", at(0.0, 0.8, 0.5, 0.2)),
            object("sphere", at(-0.6, 0.9, 0.7, 0.3)),
            object("ground", at(0.0, -1.0, 0.0, 3.0)),
        ],
        environment: Environment::Constant(Vec3::ONE),
        light: Light { to_sun: Vec3::Y, sun: Vec3::ONE, ambient: Vec3::ONE },
        notes: vec![],
    };
    let options = PrepareOptions { surfels, ..PrepareOptions::default() };
    PreparedScene::new(&scene, &options, &Context::default()).unwrap()
}

fn seen(scene: &PreparedScene, size: [u32; 2]) -> (Eye, Visibility) {
    let eye = scene.eye_for(ImageSize { width: size[0], height: size[1] }).unwrap();
    let mut visibility = Visibility::default();
    let (mirrors, objects) = (finish::mirror_surfaces(scene), finish::object_surfaces(scene));
    visibility.update(&eye, &mirrors, &objects, &mut Scratch::default());
    (eye, visibility)
}

/// Column and row.
fn pixel(visibility: &Visibility, index: usize) -> [u32; 2] {
    let index = u32::try_from(index).unwrap();
    [index % visibility.size.width, index / visibility.size.width]
}

fn params(words: &[(&str, &str)]) -> Params {
    let info = C3rc.info();
    let mut params = Params::defaults(info.params);
    for (id, value) in words {
        params.set(info.param(id), value).unwrap();
    }
    params
}

/// The kinds of cameras, tests and details; the last row is the paper's preset.
const SETTINGS: [&[(&str, &str)]; 10] = [
    &[],
    &[("detail", "0")],
    &[("test", "sweep"), ("splat", "square2")],
    &[("test", "interval"), ("detail", "0"), ("roots", "first")],
    &[("test", "none"), ("mirror-occlusion", "off")],
    &[("cameras", "triangles")],
    &[("cameras", "triangles"), ("detail", "0"), ("mirror-occlusion", "off")],
    &[("cameras", "triangles"), ("test", "sweep"), ("splat", "square1")],
    &[("cameras", "triangles"), ("test", "interval"), ("ray-scale", "unit")],
    &[
        ("cameras", "triangles"),
        ("test", "paper"),
        ("splat", "square1"),
        ("detail", "0"),
        ("depth", "push-back"),
        ("ray-scale", "unit"),
        ("roots", "first"),
        ("mirror-occlusion", "off"),
    ],
];

fn surfels_of(batches: &[Batch]) -> Vec<u32> {
    batches.iter().flat_map(|b| (0..b.count).map(|i| b.first + i * b.stride)).collect()
}

#[test]
fn a_replay_visits_what_the_frame_visits() {
    let scene = scene(6_000);
    let (eye, visibility) = seen(&scene, [128, 72]);
    for words in SETTINGS {
        let params = params(words);
        let pass = splat_pass(&scene, &eye, &visibility, &params).unwrap();
        let culler = c3rc::culler(&scene, &params);
        let (mut projections, mut valid, mut several, mut hiders) = (0, 0, 0, 0);
        let mut outcomes = [0_usize; 6];
        for camera in &pass.cameras {
            let replay = Replay { scene: &scene, pass: &pass, culler: &culler, camera };
            let (trace, batches) = replay.run();
            let mut fast = Vec::new();
            pass.batches.cull(camera, &mut fast);
            let listed: Vec<u32> = trace.surfels.iter().map(|s| s.surfel).collect();
            assert!(!trace.truncated);
            assert_eq!(listed, surfels_of(&fast), "{words:?}");
            assert_eq!((trace.cloud, trace.lambda), (camera.object as usize, camera.lambda));
            if culler.tests() {
                let plain = |list: &[Batch]| -> Vec<Batch> {
                    list.iter().map(|b| Batch { roots: 0, ..*b }).collect()
                };
                assert_eq!(plain(&batches), plain(&fast), "{words:?}");
            }
            projections += trace.surfels.len() as u64;
            valid += trace.surfels.iter().filter(|s| s.valid).count() as u64;
            several += trace.surfels.iter().filter(|s| s.images > 1).count();
            hiders += usize::from(trace.cloud >= scene.objects.len());
            check_boxes(&scene, &trace);
            for visited in &trace.boxes {
                outcomes[visited.outcome as usize] += 1;
            }
        }
        let mut out = Reflection::default();
        let plan = Plan { passes: vec![Pass::Splat(pass), Pass::Resolve], ..Plan::default() };
        let report = Cpu::default().execute(&plan, &scene, &visibility, false, &mut out).unwrap();
        assert_eq!(Some(projections), report.projections, "{words:?}");
        assert_eq!(Some(valid), report.valid, "{words:?}");
        assert!(valid > 1000, "{words:?}: only {valid}");
        let is = |word: (&str, &str)| words.contains(&word);
        assert_eq!(hiders > 0, !is(("mirror-occlusion", "off")), "{words:?}");
        assert!(several > 0 || is(("roots", "first")), "{words:?}: no point is seen twice");
        let [opened, refused, away, leaves, inside, representatives] = outcomes;
        if culler.tests() {
            assert!(opened.min(refused).min(leaves) > 100, "{words:?}: {outcomes:?}");
            let detailed = !is(("detail", "0"));
            assert_eq!(representatives > 0, detailed, "{words:?}: {outcomes:?}");
            assert!(away == 0 || detailed, "{words:?}: {outcomes:?}");
            assert!(inside == 0 || !detailed, "{words:?}: {outcomes:?}");
        } else {
            assert_eq!(outcomes, [0; 6]);
        }
    }
}

/// Children lie in their parents, and surfels in the boxes that were kept for them.
fn check_boxes(scene: &PreparedScene, trace: &CloudTrace) {
    let cloud = &scene.clouds[trace.cloud];
    let slack = 1e-4 * cloud.bounds.diagonal();
    let local = |p: Vec3| cloud.to_scene.inverse_point(p.as_dvec3()).as_vec3();
    let mut kept = Vec::new();
    for visited in &trace.boxes {
        assert!(visited.depth > 0);
        let corners = visited.corners.map(local);
        let inner = crate::geometry::Aabb::of(corners);
        let whole = cloud.tree.bounds();
        assert!((inner.min - whole.min).min_element() > -slack, "{inner:?} is not in {whole:?}");
        assert!((whole.max - inner.max).min_element() > -slack);
        // By the index's bits.
        assert!((corners[0] - inner.min).abs().max_element() < slack);
        assert!((corners[7] - inner.max).abs().max_element() < slack);
        let ends = Vec3::new(corners[1].x, corners[2].y, corners[4].z);
        assert!((ends - inner.max).abs().max_element() < slack, "{corners:?}");
        if matches!(visited.outcome, Outcome::Leaf | Outcome::Inside) {
            kept.push(inner);
        }
    }
    if trace.boxes.is_empty() {
        return;
    }
    for surfel in trace.surfels.iter().filter(|s| s.surfel < cloud.representatives.start).take(50) {
        let p = local(surfel.position);
        let exact = scene.surfels.position(surfel.surfel as usize);
        assert!((p - exact).length() < slack);
        let inside = |b: &crate::geometry::Aabb| {
            (p - b.min).min_element() > -slack && (b.max - p).min_element() > -slack
        };
        let some = kept.iter().any(inside);
        let sampled = trace.boxes.iter().any(|b| b.outcome == Outcome::Representatives);
        assert!(some || sampled, "surfel {} is in no box that was kept", surfel.surfel);
    }
}

#[test]
fn a_traced_camera_sees_along_its_pixels_rays() {
    let scene = scene(6_000);
    let (eye, visibility) = seen(&scene, [128, 72]);
    for (cameras, scale) in [
        ("cells", RayScale::EyeDistance),
        ("triangles", RayScale::EyeDistance),
        ("triangles", RayScale::Unit),
    ] {
        let word = if scale == RayScale::Unit { "unit" } else { "eye-distance" };
        let params = params(&[("cameras", cameras), ("ray-scale", word)]);
        let (mut traced, mut bare, mut none, mut second) = (0, 0, 0, 0);
        for (i, &id) in visibility.mirror_ids.iter().enumerate().step_by(23) {
            let pixel = pixel(&visibility, i);
            let trace = trace_camera(&scene, &eye, &visibility, &params, pixel).unwrap();
            let Some(trace) = trace else {
                assert_eq!(id, NONE_ID);
                none += 1;
                continue;
            };
            assert_eq!(scene.mirror_of(id), (trace.mirror, trace.triangle));
            second += usize::from(trace.mirror == 1);
            assert!((trace.weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
            assert!(trace.weights.iter().all(|w| *w > -1e-3), "{:?}", trace.weights);
            assert_eq!(trace.clouds.is_empty(), trace.pixels == 0);
            if trace.pixels == 0 {
                bare += 1;
            } else {
                traced += 1;
            }
            let clouds: Vec<usize> = trace.clouds.iter().map(|c| c.cloud).collect();
            assert!(clouds.is_sorted_by(|a, b| a < b), "{clouds:?}");
            // Its ray at the pixel's centre.
            let px = Vec2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5);
            let (origin, view) = (eye.position.as_dvec3(), eye.ray_through_px(px).as_dvec3());
            let weights = weights_on_line(origin, view, trace.corners).unwrap();
            let own: DVec3 = (0..3).map(|k| trace.directions[k].as_dvec3() * weights[k]).sum();
            let mirror = scene.mirror_triangle(id);
            if trace.pixels == 0 || cameras == "triangles" {
                let weights = trace.weights.map(f64::from);
                let exact = mirror.camera_direction(eye.position, weights, scale);
                let error = (own - exact).length() / exact.length();
                assert!(error < 1e-4, "{cameras} {pixel:?}: {own} for {exact}");
            } else {
                // Half a pixel off at most, which is compared with a whole one.
                let exact = |px| reflected_ray(&eye, px, &mirror, RaySource::Surface, scale);
                let exact = |px| exact(px).unwrap().1.as_dvec3();
                let steps = [Vec2::X, Vec2::Y, Vec2::NEG_X, Vec2::NEG_Y];
                let turns = steps.map(|step| exact(px + step).angle_between(exact(px)));
                let allowed = turns.into_iter().fold(0.0, f64::max);
                let angle = own.angle_between(exact(px));
                assert!(angle < allowed, "{pixel:?}: {angle} rad off, a pixel is {allowed}");
            }
            let start: DVec3 = (0..3).map(|k| trace.corners[k].as_dvec3() * weights[k]).sum();
            let depth = (start - origin).dot(eye.forward.as_dvec3());
            let expected = f64::from(visibility.mirror_depth[i]);
            assert!((depth - expected).abs() < 0.03 * expected, "{depth} for {expected}");
        }
        assert!(
            traced > 20 && none > 20 && second > 0,
            "{cameras}: {traced} {bare} {none} {second}"
        );
    }
    let params = params(&[]);
    let beyond = trace_camera(&scene, &eye, &visibility, &params, [128, 3]).unwrap();
    assert_eq!(beyond, None);
}

#[test]
fn pixels_that_see_no_object_have_a_ray_but_no_camera() {
    let mut scene = scene(500);
    for object in 0..3 {
        // Under the bowl.
        let transform = Similarity {
            translation: DVec3::new(0.0, -50.0, -300.0),
            scale: 0.01,
            ..Similarity::IDENTITY
        };
        scene.place(object, &transform);
    }
    let (eye, visibility) = seen(&scene, [64, 36]);
    let shown = visibility.mirror_ids.iter().position(|id| *id != NONE_ID).unwrap();
    let (pixel, id) = (pixel(&visibility, shown), visibility.mirror_ids[shown]);
    for cameras in ["cells", "triangles"] {
        let params = params(&[("cameras", cameras)]);
        let trace = trace_camera(&scene, &eye, &visibility, &params, pixel).unwrap().unwrap();
        assert_eq!((trace.pixels, trace.clouds.len()), (0, 0));
        assert_eq!(trace.corners, scene.mirror_triangle(id).corners);
    }
}

#[test]
fn a_trace_does_not_grow_without_end() {
    let scene = scene(150_000);
    let (eye, visibility) = seen(&scene, [64, 36]);
    let params = params(&[("test", "none")]);
    let pass = splat_pass(&scene, &eye, &visibility, &params).unwrap();
    let [x, y] = pass.patches[0].rect.min;
    let row = (x..).find(|x| pass.patches[0].owns(&visibility, &pass.pixels.rows, *x, y));
    let trace = trace_camera(&scene, &eye, &visibility, &params, [row.unwrap(), y]).unwrap();
    let clouds = trace.unwrap().clouds;
    let cut: Vec<_> = clouds.iter().filter(|c| c.truncated).collect();
    assert!(!cut.is_empty());
    assert!(cut.iter().all(|c| c.surfels.len() == MOST_TRACED));
}

/// By triangle, what its pixels cost by their share in their cameras, and how many cameras draw it.
fn shared(pass: &SplatPass<'_>, visibility: &Visibility, count: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut costs, mut patches) = (vec![0.0; count], vec![0.0; count]);
    for (i, patch) in pass.patches.iter().enumerate() {
        let mut batches = Vec::new();
        for camera in trace_camera::cameras_of(pass, i) {
            pass.batches.cull(camera, &mut batches);
        }
        let cost = surfels_of(&batches).len() as f64 / f64::from(patch.pixels);
        let mut ids = Vec::new();
        for y in patch.rect.min[1]..patch.rect.max[1] {
            for x in patch.rect.min[0]..patch.rect.max[0] {
                if patch.owns(visibility, &pass.pixels.rows, x, y) {
                    let id = visibility.mirror_ids[(y * visibility.size.width + x) as usize];
                    costs[id as usize] += cost;
                    ids.push(id);
                }
            }
        }
        // Shares are rounded, each time that the triangle changes.
        ids.dedup();
        ids.into_iter().for_each(|id| patches[id as usize] += 1.0);
    }
    (costs, patches)
}

#[test]
fn costs_are_the_frames_projections() {
    let scene = scene(6_000);
    let (eye, visibility) = seen(&scene, [128, 72]);
    for words in [SETTINGS[0], SETTINGS[4], SETTINGS[5]] {
        let params = params(words);
        let costs = triangle_costs(&scene, &eye, &visibility, &params).unwrap();
        assert_eq!(costs.len(), scene.mirror_triangle_count());
        let pass = splat_pass(&scene, &eye, &visibility, &params).unwrap();
        let (expected, patches) = shared(&pass, &visibility, costs.len());
        for (id, cost) in costs.iter().enumerate() {
            let apart = (f64::from(*cost) - expected[id]).abs();
            assert!(apart <= patches[id], "{words:?} {id}: {cost} for {}", expected[id]);
        }
        let plan = Plan { passes: vec![Pass::Splat(pass), Pass::Resolve], ..Plan::default() };
        let mut out = Reflection::default();
        let report = Cpu::default().execute(&plan, &scene, &visibility, false, &mut out).unwrap();
        let sum: u64 = costs.iter().map(|c| u64::from(*c)).sum();
        assert_eq!(Some(sum), report.projections, "{words:?}");
        let costly = costs.iter().filter(|cost| **cost > 0).count();
        assert!(costly > 20, "only {costly} triangles cost anything");
    }
}

#[test]
fn bad_parameters_are_refused() {
    let scene = scene(500);
    let (eye, visibility) = seen(&scene, [32, 18]);
    let params = params(&[("test", "paper")]);
    assert!(triangle_costs(&scene, &eye, &visibility, &params).is_err());
    let shown = visibility.mirror_ids.iter().position(|id| *id != NONE_ID).unwrap();
    let pixel = pixel(&visibility, shown);
    assert!(trace_camera(&scene, &eye, &visibility, &params, pixel).is_err());
}
