//! Level of detail: representatives stand for their surfels, each once, and what they draw stays near the truth.

use catoptric::Context;
use catoptric::accel::kd_tree::representatives;
use catoptric::frame::Renderer;
use catoptric::geometry::Similarity;
use catoptric::image::Planes;
use catoptric::methods::{FrameInput, Params, method};
use catoptric::plan::{Pass, Plan};
use catoptric::scene::PreparedScene;
use catoptric::scene::prepared::Cloud;
use catoptric::visibility::{Scratch, Visibility};
use glam::{DVec3, Vec3};

use super::{BLUE, RED, eye, looks, moved, object, prepared, scene, shape};

const REPRESENTATIVES: usize = representatives::REPRESENTATIVES as usize;

/// A wave (open: nothing of it is skipped) and a knot (closed) before a sphere.
fn setting() -> PreparedScene {
    let wave = object("wave", shape("wave", 4000), moved(DVec3::new(1.4, 0.6, 0.8)), RED);
    let place = Similarity { scale: 0.4, ..moved(DVec3::new(-1.5, 0.9, 1.2)) };
    let knot = object("knot", shape("knot", 4000), place, BLUE);
    let mirror = (shape("sphere", 2000), Similarity::IDENTITY);
    prepared(
        &scene(mirror, vec![wave, knot], looks(DVec3::new(0.0, 1.0, 3.4), DVec3::ZERO)),
        200_000,
    )
}

fn params(settings: &[(&str, &str)]) -> Params {
    let info = method("c3rc").unwrap().info();
    let mut params = Params::defaults(info.params);
    for (id, value) in settings {
        params.set(info.param(id), value).unwrap();
    }
    params
}

/// The surfels of a batch as a range of the object's own.
fn surfels(object: &Cloud, first: u32, count: u32, stride: u32) -> Vec<[u32; 2]> {
    let node_range = |w: usize, slots: std::ops::Range<usize>| {
        let node = &object.tree.wide()[w];
        let used: Vec<usize> = slots.filter(|s| node.used >> s & 1 != 0).collect();
        let (a, b) = (used[0], used[used.len() - 1]);
        [node.first[a], node.first[b] + node.count[b]]
    };
    if first < object.representatives.start {
        let from = first - object.surfels.start;
        return vec![[
            from,
            (from + count * stride).min(object.surfels.end - object.surfels.start),
        ]];
    }
    (first - object.representatives.start..first - object.representatives.start + count)
        .map(|i| {
            let (w, slot) = (i as usize / REPRESENTATIVES, i as usize % REPRESENTATIVES);
            match slot {
                0..8 => node_range(w, slot..slot + 1),
                8..12 => node_range(w, (slot - 8) * 2..(slot - 8) * 2 + 2),
                _ => node_range(w, (slot - 12) * 4..(slot - 12) * 4 + 4),
            }
        })
        .collect()
}

#[test]
fn a_representative_is_the_mean_of_its_surfels_and_reaches_them() {
    let scene = setting();
    let (mut checked, mut reached, mut all) = (0, 0, 0);
    for object in &scene.clouds[..scene.objects.len()] {
        let from = object.surfels.start as usize;
        for i in object.representatives.clone() {
            let slot = (i - object.representatives.start) as usize % REPRESENTATIVES;
            let w = (i - object.representatives.start) as usize / REPRESENTATIVES;
            let node = &object.tree.wide()[w];
            let members = match slot {
                0..8 => slot..slot + 1,
                8..12 => (slot - 8) * 2..(slot - 8) * 2 + 2,
                _ => (slot - 12) * 4..(slot - 12) * 4 + 4,
            };
            if members.clone().all(|s| node.used >> s & 1 == 0) {
                continue;
            }
            let [[a, b]] = surfels(object, i, 1, 1)[..] else { panic!() };
            let own = from + a as usize..from + b as usize;
            let mean = |list: &dyn Fn(usize) -> Vec3| {
                own.clone().map(|k| list(k).as_dvec3()).sum::<DVec3>() / own.len() as f64
            };
            let i = i as usize;
            let middle = mean(&|k| scene.surfels.position(k));
            assert!(middle.distance(scene.surfels.position(i).as_dvec3()) < 1e-5);
            let radiance = mean(&|k| scene.surfels.radiance[k]);
            assert!(radiance.distance(scene.surfels.radiance[i].as_dvec3()) < 1e-5);
            checked += 1;
            let reach = 1.5 * f64::from(scene.surfels.extent[i]);
            let near = |k: &usize| scene.surfels.position(*k).as_dvec3().distance(middle) <= reach;
            reached += own.clone().filter(near).count();
            all += own.len();
        }
    }
    assert!(checked > 30_000, "{checked}");
    assert!(reached * 100 > all * 97, "{reached} of {all} lie within reach");
}

#[test]
fn every_surfel_is_stood_for_once() {
    let scene = setting();
    let eye = eye(&scene, 320, 180);
    let mut visibility = Visibility::default();
    let (mirrors, objects) = (
        catoptric::backend::cpu::finish::mirror_surfaces(&scene),
        catoptric::backend::cpu::finish::object_surfaces(&scene),
    );
    visibility.update(&eye, &mirrors, &objects, &mut Scratch::default());
    let c3rc = method("c3rc").unwrap();
    // For each camera: the ranges that it projects, and how many surfels and representatives that is.
    let ranges = |detail: &str| {
        let params = params(&[
            ("cameras", "triangles"),
            ("splat", "square2"),
            ("detail", detail),
            ("mirror-occlusion", "off"),
        ]);
        let made = c3rc.prepare(&scene, &params, &Context::default()).unwrap();
        let mut plan = Plan::default();
        let input = FrameInput { scene: &scene, eye: &eye, visibility: &visibility };
        c3rc.plan(input, &made, &params, &mut plan).unwrap();
        let Some(Pass::Splat(pass)) = plan.passes.first() else { panic!("no splats") };
        let mut lists = Vec::new();
        let mut origins = Vec::new();
        let mut projected = 0;
        for camera in &pass.cameras {
            let object = &scene.clouds[camera.object as usize];
            let mut batches = Vec::new();
            pass.batches.cull(camera, &mut batches);
            projected += batches.iter().map(|b| b.count as usize).sum::<usize>();
            let mut list: Vec<[u32; 2]> =
                batches.iter().flat_map(|b| surfels(object, b.first, b.count, b.stride)).collect();
            list.sort_unstable();
            lists.push(((camera.patch, camera.object), list));
            origins.push(Vec3::from_array(camera.camera.v1));
        }
        (lists, origins, projected)
    };
    let (every, origins, all) = ranges("0");
    let (some, _, few) = ranges("2");
    let (mut skipped, mut knots) = (0, 0);
    assert!(few * 3 < all, "{few} of {all}");
    for (((camera, every), (other, some)), origin) in every.iter().zip(&some).zip(origins) {
        assert_eq!(camera, other);
        for pair in some.windows(2) {
            // The last of a stride may reach into the next leaf.
            assert!(pair[0][1] <= pair[1][0] + 3, "{pair:?} overlap");
        }
        if camera.1 == 0 {
            // Of the open wave nothing is lost.
            for [a, b] in every {
                let held = some.iter().filter(|[c, d]| c < b && a < d).count();
                assert!(held > 0, "surfels {a}..{b} are lost");
            }
        } else {
            // Of the closed knot only what faces away.
            let held = |k: u32| some.iter().any(|&[a, b]| a <= k && k < b);
            for k in every.iter().flat_map(|&[a, b]| a..b) {
                knots += 1;
                if !held(k) {
                    skipped += 1;
                    let i = (scene.clouds[1].surfels.start + k) as usize;
                    let away = scene.surfels.normals[i].dot(scene.surfels.position(i) - origin);
                    assert!(away > 0.0, "surfel {k} faces the mirror");
                }
            }
        }
    }
    assert!(skipped * 5 > knots, "only {skipped} of {knots} are skipped");
}

#[test]
fn ellipses_and_representatives_keep_to_the_truth() {
    let scene = setting();
    let size = eye(&scene, 640, 360);
    let render = |id: &str, settings: &[(&str, &str)]| {
        let chosen = method(id).unwrap();
        let mut params = Params::defaults(chosen.info().params);
        for (name, value) in settings {
            params.set(chosen.info().param(name), value).unwrap();
        }
        let mut renderer = Renderer::new();
        renderer.keep_bright();
        renderer.render(&scene, &size, chosen, &params, true, &Context::default()).unwrap();
        renderer.planes().unwrap().clone()
    };
    let traced = |rays: &str, spp: &str| {
        render("raytrace", &[("rays", rays), ("mirror-occlusion", "off"), ("spp", spp)])
    };
    // Of the pixels that objects cover: the share that is (at least half) covered, and how much. Of all: the error.
    let error = |planes: &Planes, truth: &Planes| {
        let whole: Vec<usize> =
            (0..truth.coverage.len()).filter(|&i| truth.coverage[i] == 1.0).collect();
        assert!(whole.len() > 500, "{}", whole.len());
        let part = |i: &&usize| planes.coverage[**i] >= 0.5;
        let covered = whole.iter().filter(part).count() as f64 / whole.len() as f64;
        let mean: f32 = whole.iter().map(|&i| planes.coverage[i]).sum();
        let squares: f64 = truth
            .radiance
            .iter()
            .zip(&planes.radiance)
            .map(|(a, b)| f64::from(Vec3::from_array(*a).distance_squared(Vec3::from_array(*b))))
            .sum();
        (covered, f64::from(mean) / whole.len() as f64, squares)
    };
    let ellipses = |cameras: &'static str, detail: &'static str| {
        let settings = [("splat", "ellipse"), ("detail", detail), ("mirror-occlusion", "off")];
        render("c3rc", &[&[("cameras", cameras)], &settings[..]].concat())
    };
    let squares = [("cameras", "triangles"), ("splat", "square2"), ("detail", "0")];
    let squares = render("c3rc", &[&squares[..], &[("mirror-occlusion", "off")]].concat());
    for (cameras, truth) in
        [("triangles", traced("camera", "64")), ("cells", traced("surface", "64"))]
    {
        let (_, _, of_squares) = error(&squares, &truth);
        for detail in ["0", "1", "2", "4"] {
            let found = ellipses(cameras, detail);
            let (covered, mean, of_ellipses) = error(&found, &truth);
            assert!(covered > 0.999, "{cameras} {detail} cover {covered}");
            assert!(mean > 0.99, "{cameras} {detail} cover {mean} on average");
            let most = if cameras == "cells" { 0.25 } else { 0.5 };
            assert!(
                of_ellipses < most * of_squares,
                "{cameras} {detail}: {of_ellipses} is not less than {most} of {of_squares}"
            );
        }
    }
    let truth = traced("surface", "64");
    // Without half of the pixels the check fails.
    let mut cut = ellipses("cells", "2");
    cut.coverage.iter_mut().step_by(2).for_each(|c| *c = 0.0);
    assert!(error(&cut, &truth).0 < 0.999);
}
