//! Plans: every pass finds what it reads.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use catoptric::backend::{Backend, cpu::Cpu, cpu::finish};
use catoptric::geometry::Similarity;
use catoptric::methods::{FrameInput, METHODS, Params};
use catoptric::plan::{Batch, BatchSource, CameraInstance, Pass, Plan, Reflection, Resource};
use catoptric::visibility::{Scratch, Visibility};
use catoptric::{Context, Error};
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

/// Culls for another, and cancels everything at the third camera.
struct Cancelling<'a> {
    inner: Box<dyn BatchSource + 'a>,
    cancel: Arc<AtomicBool>,
    asked: Arc<AtomicUsize>,
}

impl BatchSource for Cancelling<'_> {
    fn cull(&self, camera: &CameraInstance, out: &mut Vec<Batch>) {
        if self.asked.fetch_add(1, Ordering::Relaxed) == 2 {
            self.cancel.store(true, Ordering::Relaxed);
        }
        self.inner.cull(camera, out);
    }
}

#[test]
fn execution_stops_where_it_is_cancelled() {
    let mut splats = 0;
    with_plans(|id, mut plan, scene, visibility| {
        let out = &mut Reflection::default();
        let cancel = plan.cx.cancel_flag();
        if let Some(Pass::Splat(pass)) = plan.passes.first_mut() {
            let asked = Arc::<AtomicUsize>::default();
            let cameras = pass.cameras.len();
            let none: Box<dyn BatchSource> = Box::new(Nothing);
            let inner = std::mem::replace(&mut pass.batches, none);
            let cancel = Arc::clone(&cancel);
            pass.batches = Box::new(Cancelling { inner, cancel, asked: Arc::clone(&asked) });
            let done = Cpu::default().execute(&plan, scene, visibility, false, out);
            assert!(matches!(done, Err(Error::Cancelled)), "{id} went on");
            let asked = asked.load(Ordering::Relaxed);
            // Each thread ends the camera that it is at.
            assert!(asked <= 3 + rayon::current_num_threads(), "{asked} of {cameras} cameras");
            assert!(cameras > 20 + rayon::current_num_threads(), "{cameras} are too few to tell");
            splats += 1;
            return;
        }
        cancel.store(true, Ordering::Relaxed);
        let done = Cpu::default().execute(&plan, scene, visibility, false, out);
        assert!(matches!(done, Err(Error::Cancelled)) || id == "environment", "{id} went on");
    });
    assert_eq!(splats, 1);
}

/// Culls everything.
struct Nothing;

impl BatchSource for Nothing {
    fn cull(&self, _: &CameraInstance, _: &mut Vec<Batch>) {}
}
