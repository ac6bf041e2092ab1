//! The vertex-search methods and environment mapping, held against ray tracing.

use catoptric::Context;
use catoptric::analysis::methods::{Candidate, Effort, compare_methods};
use catoptric::backend::{Backend, cpu::Cpu};
use catoptric::frame::Renderer;
use catoptric::geometry::Similarity;
use catoptric::image::{Picture, Planes};
use catoptric::methods::{Method, Params, method};
use catoptric::scene::PreparedScene;
use catoptric::scene::description::Scene;
use glam::DVec3;

use super::{BLUE, GREY, RED, eye, looks, moved, object, prepared, rendered_with, scene, shape};

/// A ball between a ground, a torus and a cube, all finely tessellated.
fn around_a_ball() -> Scene {
    let ground = Similarity { scale: 4.0, ..Similarity::IDENTITY };
    let small = |at: DVec3| Similarity { scale: 0.35, ..moved(at) };
    let objects = vec![
        object("ground", shape("ground", 20_000), ground, GREY),
        object("torus", shape("torus", 20_000), small(DVec3::new(0.95, 0.5, 0.9)), RED),
        object("ball", shape("sphere", 20_000), small(DVec3::new(-0.8, 0.4, 0.9)), BLUE),
    ];
    let mirror = (shape("sphere", 20_000), Similarity { scale: 0.6, ..moved(DVec3::Y * 0.65) });
    scene(mirror, objects, looks(DVec3::new(0.1, 1.0, 3.2), DVec3::new(0.0, 0.6, 0.0)))
}

/// Share of the mirror's pixels that show another object than ray tracing does, or nothing instead of one.
fn wrong(found: &Planes, truth: &Planes) -> f64 {
    let mirrors = (0..truth.mirror.len()).filter(|&i| truth.mirror[i] == 0);
    let (mut all, mut wrong) = (0.0, 0.0);
    for i in mirrors {
        all += 1.0;
        wrong += f64::from(found.object[i] != truth.object[i]);
    }
    wrong / all
}

/// The median distance, where both see the same object, of what is seen from what is to be seen.
fn apart(found: &Planes, truth: &Planes) -> f32 {
    let same = (0..truth.object.len())
        .filter(|&i| truth.object[i] != u32::MAX && found.object[i] == truth.object[i]);
    let mut list: Vec<f32> = same
        .map(|i| {
            let [a, b] = [found.position[i], truth.position[i]].map(glam::Vec3::from);
            a.distance(b)
        })
        .collect();
    list.sort_by(f32::total_cmp);
    list[list.len() / 2]
}

fn shown(scene: &PreparedScene, id: &str, settings: &[(&str, &str)]) -> (Picture, Planes) {
    rendered_with(scene, id, settings, 320, 240)
}

#[test]
fn reflected_meshes_are_where_rays_see_them() {
    let scene = prepared(&around_a_ball(), 100_000);
    let truth = shown(&scene, "raytrace", &[("mirror-occlusion", "off")]).1;
    // Points are as far apart as they were sampled, and leave holes.
    for (id, settings, [most, far]) in [
        ("estalella", &[][..], [0.01, 0.01]),
        ("estalella", &[("grid", "0.1")][..], [0.01, 0.01]),
        ("estalella", &[("tessellate", "4")][..], [0.01, 0.01]),
        ("estalella", &[("primitive", "points")][..], [0.08, 0.06]),
        ("roger-holzschuch", &[][..], [0.01, 0.01]),
        ("roger-holzschuch", &[("early-exit", "off")][..], [0.01, 0.01]),
        ("roger-holzschuch", &[("tessellate", "4")][..], [0.01, 0.01]),
        ("roger-holzschuch", &[("primitive", "points"), ("point", "square1")][..], [0.3, 0.06]),
    ] {
        let found = shown(&scene, id, settings).1;
        let (wrong, apart) = (wrong(&found, &truth), apart(&found, &truth));
        eprintln!("{id} {settings:?}: {:.2} % wrong, {apart:.4} apart", 100.0 * wrong);
        assert!(
            wrong < most && f64::from(apart) < far,
            "{id} {settings:?}: {wrong} wrong, {apart} apart"
        );
    }
    // A map from the centre shows things near the mirror elsewhere.
    let found = shown(&scene, "environment", &[]).1;
    let (wrong, apart) = (wrong(&found, &truth), apart(&found, &truth));
    assert!(wrong > 0.05 && apart > 0.1, "environment: {wrong} wrong, {apart} apart");
}

/// What touches a mirror is far from where a map from the middle shows it, and close to where the cameras do.
#[test]
fn environment_mapping_displaces_what_touches() {
    let ball = object(
        "ball",
        shape("sphere", 3_000),
        Similarity { scale: 0.3, ..moved(DVec3::new(1.18, 0.0, 0.546)) },
        RED,
    );
    let mirror = (shape("sphere", 8_000), Similarity::IDENTITY);
    let described = scene(mirror, vec![ball], looks(DVec3::new(0.0, 0.6, 5.0), DVec3::ZERO));
    let scene = prepared(&described, 100_000);
    let candidates = Candidate::all(false).into_iter();
    let candidates: Vec<Candidate> =
        candidates.filter(|c| ["c3rc", "environment"].contains(&c.label.as_str())).collect();
    let effort = Effort { spp: 4, repeat: 1, frames: 0, orbit: 0.0 };
    let eye = eye(&scene, 640, 480);
    let cpu = |_: usize, _: &dyn Method| Ok(Box::new(Cpu::default()) as Box<dyn Backend>);
    let cx = Context::default();
    let (_, entries) =
        compare_methods(&described, &scene, &eye, candidates, effort, &cpu, &cx).unwrap();
    let px = |i: usize| {
        let drawn = entries[i].result.as_ref().unwrap();
        drawn.displacement_px.unwrap()
    };
    let (cameras, map) = (px(0), px(1));
    eprintln!("c3rc {cameras:?}, environment {map:?}");
    assert!(map.median >= 10.0 * cameras.median && cameras.median < 0.5, "{cameras:?} {map:?}");
    assert!(map.p95 >= 10.0 * cameras.p95, "{cameras:?} {map:?}");
}

#[test]
fn a_plane_is_seen_exactly() {
    let objects = vec![object("ball", shape("sphere", 5_000), moved(DVec3::Z * 2.5), RED)];
    let upright = super::turned(DVec3::X, 0.0, DVec3::ZERO);
    let plane = (shape("plane", 200), Similarity { scale: 2.0, ..upright });
    let scene =
        prepared(&scene(plane, objects, looks(DVec3::new(1.5, 0.5, 4.0), DVec3::ZERO)), 10_000);
    let truth = shown(&scene, "raytrace", &[]).1;
    let seen = truth.object.iter().filter(|&&o| o == 0).count();
    assert!(seen > 500, "the ball is seen in {seen} pixels");
    for id in ["estalella", "roger-holzschuch"] {
        let found = shown(&scene, id, &[]).1;
        assert!(wrong(&found, &truth) < 0.01, "{id}: {}", wrong(&found, &truth));
    }
}

#[test]
fn what_moves_is_seen_where_it_is() {
    let mut scene = prepared(&around_a_ball(), 20_000);
    let mut renderer = Renderer::new();
    let cx = Context::default();
    for id in ["estalella", "roger-holzschuch", "environment"] {
        let method = method(id).unwrap();
        let params = Params::defaults(method.info().params);
        let view = eye(&scene, 160, 120);
        let mut draw = |scene: &PreparedScene| {
            renderer.render(scene, &view, method, &params, false, &cx).unwrap();
            renderer.picture().clone()
        };
        let before = draw(&scene);
        let mirror = Similarity { scale: 0.5, ..moved(DVec3::new(0.1, 0.75, 0.1)) };
        scene.place_mirror(0, &mirror);
        scene.place(1, &Similarity { scale: 0.3, ..moved(DVec3::new(0.8, 0.7, 0.8)) });
        scene.shade(&cx).unwrap();
        let moved_there = draw(&scene);
        assert_ne!(before, moved_there);
        let mut fresh = Renderer::new();
        fresh.render(&scene, &view, method, &params, false, &cx).unwrap();
        assert_eq!(fresh.picture(), &moved_there, "{id} remembers nothing wrong");
        let back = around_a_ball();
        scene.place_mirror(0, &back.mirrors[0].transform);
        scene.place(1, &back.objects[1].transform);
        scene.shade(&cx).unwrap();
        assert_eq!(draw(&scene), before, "{id}");
    }
}

#[test]
fn what_cannot_be_searched_on_is_refused() {
    let objects = vec![object("ball", shape("sphere", 500), moved(DVec3::Z * 2.0), RED)];
    let torus = (shape("torus", 2_000), Similarity::IDENTITY);
    let mut described = scene(torus, objects, looks(DVec3::new(0.0, 1.0, 4.0), DVec3::ZERO));
    let refused = prepared(&described, 1_000);
    for id in ["estalella", "roger-holzschuch"] {
        let method = method(id).unwrap();
        let params = Params::defaults(method.info().params);
        let error = method.qualify(&refused, &params).unwrap_err().to_string();
        assert!(error.contains("mirror mirror: is not star-shaped"), "{error}");
        assert!(error.contains("--proxy"), "{error}");
        assert!(method.qualify(&refused, &params).is_err());
    }
    described.mirrors[0].proxy = Some(catoptric::scene::description::Proxy {
        mesh: shape("ellipsoid", 2_000),
        source: None,
        transform: Similarity { scale: 1.4, ..Similarity::IDENTITY },
    });
    let stands_in = prepared(&described, 1_000);
    let params = Params::defaults(method("estalella").unwrap().info().params);
    assert!(method("estalella").unwrap().qualify(&stands_in, &params).is_ok(), "with a stand-in");
}
