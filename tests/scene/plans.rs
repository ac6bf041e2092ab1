//! Plans: every pass finds what it reads.

use catoptric::Context;
use catoptric::backend::{Backend, cpu::Cpu, cpu::finish};
use catoptric::geometry::Similarity;
use catoptric::methods::{FrameInput, METHODS, Params, method};
use catoptric::plan::{Pass, Plan, Reflection, Resource};
use catoptric::visibility::{Scratch, Visibility};
use glam::DVec3;

use super::{RED, eye, looks, moved, object, prepared, scene, shape};

/// Does something with each method's plan for a small scene.
fn with_plans(mut see: impl FnMut(&str, Plan, &catoptric::scene::PreparedScene, &Visibility)) {
    let cube = object("cube", shape("cube", 12), moved(DVec3::new(0.8, 0.0, 0.8)), RED);
    let mirror = (shape("sphere", 500), Similarity::IDENTITY);
    let looks = looks(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO);
    let scene = prepared(&scene(mirror, vec![cube], looks), 2000);
    let eye = eye(&scene, 64, 36);
    let mut visibility = Visibility::default();
    let (mirrors, objects) = (finish::mirror_surfaces(&scene), finish::object_surfaces(&scene));
    visibility.update(&eye, &mirrors, &objects, &mut Scratch::default());
    for method in METHODS {
        let params = Params::defaults(method.info().params);
        let made = method.prepare(&scene, &params, &Context::default()).unwrap();
        let mut plan = Plan::default();
        let input = FrameInput { scene: &scene, eye: &eye, visibility: &visibility };
        method.plan(input, &made, &params, &mut plan).unwrap();
        see(method.info().id, plan, &scene, &visibility);
    }
}

#[test]
fn every_pass_finds_what_it_reads() {
    let mut seen = 0;
    with_plans(|id, plan, _, _| {
        assert_eq!(plan.missing_resource(), None, "{id}");
        let last = plan.passes.last().unwrap();
        assert!(last.writes().contains(&Resource::Reflection), "{id} ends without a reflection");
        seen += 1;
    });
    assert_eq!(seen, METHODS.len());
}

#[test]
fn swapped_and_lost_passes_are_found_out() {
    let mut swapped = 0;
    with_plans(|id, mut plan, scene, visibility| {
        if plan.passes.len() < 2 {
            return;
        }
        plan.passes.swap(0, 1);
        assert_eq!(plan.missing_resource(), Some(Resource::Keys), "{id}");
        let execute = || {
            let out = &mut Reflection::default();
            Cpu::default().execute(&plan, scene, visibility, false, out).map(|_| ())
        };
        let refused = std::panic::catch_unwind(std::panic::AssertUnwindSafe(execute)).unwrap_err();
        let message = refused.downcast_ref::<String>().unwrap();
        assert!(message.contains("out of order"), "{id}: {message}");
        plan.passes.swap(0, 1);
        plan.passes.remove(0);
        assert_eq!(plan.missing_resource(), Some(Resource::Keys), "{id}");
        swapped += 1;
    });
    assert!(swapped > 0, "no method has two passes");
}

#[test]
fn backs_of_closed_things_are_left_out_unless_the_eye_is_among_them() {
    // A ball that touches the mirror: the mirror's points there lie in its box. And a box around all, seen from inside.
    let ball = object("ball", shape("sphere", 2000), moved(DVec3::new(0.9, 0.2, 0.3)), RED);
    let mut room = object("room", shape("cube", 12), moved(DVec3::new(0.0, -6.0, 0.0)), RED);
    room.transform.scale = 12.0;
    let mirror = (shape("sphere", 500), Similarity::IDENTITY);
    let looks = looks(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO);
    let scene = prepared(&scene(mirror, vec![ball, room], looks), 20_000);
    let eye = eye(&scene, 320, 180);
    let mut visibility = Visibility::default();
    let (mirrors, objects) = (finish::mirror_surfaces(&scene), finish::object_surfaces(&scene));
    visibility.update(&eye, &mirrors, &objects, &mut Scratch::default());
    let c3rc = method("c3rc").unwrap();
    let params = Params::defaults(c3rc.info().params);
    let made = c3rc.prepare(&scene, &params, &Context::default()).unwrap();
    let mut plan = Plan::default();
    let input = FrameInput { scene: &scene, eye: &eye, visibility: &visibility };
    c3rc.plan(input, &made, &params, &mut plan).unwrap();
    let Some(Pass::Splat(pass)) = plan.passes.first() else { panic!("c3rc splats first") };
    // Those whose rays start in the thing's box, without and with backs left out.
    let mut counts = [[0; 2]; 2];
    for camera in pass.cameras.iter().filter(|c| c.object < 2) {
        let object = camera.object as usize;
        let bounds = scene.clouds[object].tree.bounds();
        if bounds.contains(glam::Vec3::from(camera.camera.v1)) {
            counts[object][usize::from(camera.gaze.is_some())] += 1;
        }
    }
    let [[_, front], [both, none]] = counts;
    assert!(front > 10, "the ball: {counts:?}");
    assert!(both > 10 && none == 0, "the room: {counts:?}");
}
