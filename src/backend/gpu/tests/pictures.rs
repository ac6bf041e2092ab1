//! The GPU's pictures against the CPU's, and what a device goes through over several frames.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::super::buffers::PictureBuffers;
use super::super::device::Gpu as Device;
use super::super::{Gpu, Limits, Options, Path};
use super::device;
use crate::backend::{Backend, cpu::Cpu};
use crate::camera::Eye;
use crate::camera::eye::ImageSize;
use crate::context::Context;
use crate::frame::Renderer;
use crate::geometry::Similarity;
use crate::image::{NONE, Planes};
use crate::methods::{Params, method};
use crate::scene::description::{Environment, EyeDescription, Light, Mirror, Object, Paint, Scene};
use crate::scene::{PrepareOptions, PreparedScene, builtin};

pub(super) const SIZE: ImageSize = ImageSize { width: 320, height: 180 };

/// A mirror of that shape and two objects, one of which is near it; a second mirror stands beside them. The bowl is
/// coarse and one object lies at its focus: a camera sees its points several times.
pub(super) fn scene(shape: &str) -> PreparedScene {
    let mesh = |name: &str, triangles| {
        Arc::new(builtin::shape(name, Some(triangles)).expect("it is built in"))
    };
    let at = |x: f64, y: f64, z: f64, scale: f64| Similarity {
        translation: DVec3::new(x, y, z),
        scale,
        ..Similarity::IDENTITY
    };
    let object = |name: &str, transform, color| Object {
        name: name.into(),
        mesh: mesh(name, 2000),
        source: None,
        points: None,
        transform,
        paint: Paint::Constant(color),
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
    let bowl = shape == "bowl";
    let scene = Scene {
        name: "test".into(),
        eye: EyeDescription {
            position: if bowl { DVec3::new(0.3, 2.2, 3.4) } else { DVec3::new(0.3, 1.2, 3.6) },
            target: if bowl { DVec3::new(0.0, 0.7, 0.2) } else { DVec3::new(0.2, 0.7, 0.0) },
            up: DVec3::Y,
            fov_y: 0.7,
        },
        mirrors: vec![
            mirror(shape, if bowl { 80 } else { 1200 }, Similarity::IDENTITY),
            mirror("sphere", 300, at(1.6, -0.2, 0.9, 0.35)),
        ],
        objects: vec![
            if bowl {
                object("knot", at(0.0, 0.8, 0.5, 0.2), Vec3::new(0.8, 0.3, 0.1))
            } else {
                object("knot", at(-0.9, 0.6, 1.5, 0.9), Vec3::new(0.8, 0.3, 0.1))
            },
            object("sphere", at(0.7, 1.1, 1.2, 0.4), Vec3::new(0.1, 0.3, 0.8)),
        ],
        environment: Environment::Constant(Vec3::splat(0.5)),
        light: Light {
            to_sun: Vec3::new(0.4, 0.8, 0.45).normalize_or(Vec3::Y),
            sun: Vec3::splat(0.8),
            ambient: Vec3::splat(0.3),
        },
        notes: vec![],
    };
    let options = PrepareOptions { surfels: 20_000, ..PrepareOptions::default() };
    PreparedScene::new(&scene, &options, &Context::default()).expect("it is a scene")
}

/// What a mirror's pixels show.
pub(super) struct Shown {
    radiance: Vec<Vec3>,
    coverage: Vec<f32>,
    planes: Planes,
}

pub(super) fn eye(scene: &PreparedScene) -> Eye {
    scene.eye_for(SIZE).expect("a view")
}

pub(super) fn shown(
    backend: Box<dyn Backend>,
    scene: &PreparedScene,
    words: &[(&str, &str)],
) -> Shown {
    let mut renderer = Renderer::on(backend);
    draw(&mut renderer, scene, words);
    Shown {
        radiance: renderer.reflection().to_vec(),
        coverage: renderer.coverage().to_vec(),
        planes: renderer.planes().expect("they were asked for").clone(),
    }
}

fn draw(renderer: &mut Renderer, scene: &PreparedScene, words: &[(&str, &str)]) {
    let c3rc = method("c3rc").expect("it is there");
    let mut params = Params::defaults(c3rc.info().params);
    for (id, value) in words {
        params.set(c3rc.info().param(id), value).expect("it has this value");
    }
    renderer
        .render(scene, &eye(scene), c3rc, &params, true, &Context::default())
        .unwrap_or_else(|e| panic!("{e}"));
}

/// Share of the pixels that see objects whose surfel may be another one: ties and edges.
const OTHER_SURFELS: f64 = 5e-4;
/// Share of those whose blended colour or coverage may be off by more than [`BLEND`].
const OTHER_BLENDS: f64 = 2e-3;
const BLEND: f32 = 0.02;
/// Halves have eleven bits.
const COLOR: f32 = 1e-3;

/// What is wrong with the GPU's picture, if anything.
pub(super) fn verdict(cpu: &Shown, gpu: &Shown, ellipses: bool) -> Result<(), String> {
    let seen = cpu.planes.surfel.iter().filter(|s| **s != NONE).count();
    let mut other = 0;
    for i in 0..cpu.coverage.len() {
        let (a, b) = (cpu.coverage[i], gpu.coverage[i]);
        let apart = if a.max(b) > 0.0 {
            let of = |s: &Shown| if s.coverage[i] > 0.0 { s.radiance[i] } else { Vec3::ZERO };
            (of(cpu) - of(gpu)).abs().max_element().max((a - b).abs())
        } else {
            0.0
        };
        let same = cpu.planes.surfel[i] == gpu.planes.surfel[i];
        if ellipses {
            other += usize::from(apart.is_nan() || apart > BLEND);
        } else if !same {
            other += 1;
        } else if apart.is_nan() || apart > COLOR {
            return Err(format!("pixel {i}: the same surfel, and {apart} apart"));
        }
    }
    let share = if ellipses { OTHER_BLENDS } else { OTHER_SURFELS };
    let allowed = (share * seen as f64).max(1.0);
    if other as f64 > allowed {
        return Err(format!("{other} of {seen} pixels differ"));
    }
    if seen < 150 { Err(format!("only {seen} pixels see objects")) } else { Ok(()) }
}

pub(super) fn gpu(path: Path, limits: Limits) -> Box<Gpu> {
    let options = Options { path, limits, ..Options::default() };
    Box::new(Gpu::new(options).unwrap_or_else(|e| panic!("{e}")))
}

#[test]
fn pictures_are_the_cpus() {
    if device().is_none() {
        return;
    }
    let mut wrong = String::new();
    for shape in ["sphere", "bowl", "goblet"] {
        let scene = scene(shape);
        for cameras in ["triangles", "cells"] {
            for splat in ["square1", "square2", "ellipse"] {
                let words = [("cameras", cameras), ("splat", splat), ("detail", "1")];
                let cpu = shown(Box::new(Cpu::default()), &scene, &words);
                for path in [Path::Vertex, Path::Compute] {
                    let found = shown(gpu(path, Limits::Adapter), &scene, &words);
                    if let Err(problem) = verdict(&cpu, &found, splat == "ellipse") {
                        wrong += &format!("{shape} {cameras} {splat} {path:?}: {problem}\n");
                    }
                }
            }
        }
    }
    assert_eq!(wrong, "");
}

#[test]
fn settings_reach_the_shaders() {
    if device().is_none() {
        return;
    }
    let scene = scene("bowl");
    let plain = [("splat", "square2"), ("cameras", "triangles")];
    let first = shown(Box::new(Cpu::default()), &scene, &plain);
    for more in
        [("roots", "first"), ("depth", "push-back"), ("mirror-occlusion", "off"), ("detail", "0")]
    {
        let words = [plain[0], plain[1], more];
        let cpu = shown(Box::new(Cpu::default()), &scene, &words);
        assert!(verdict(&cpu, &first, false).is_err(), "{more:?} changes nothing");
        for path in [Path::Vertex, Path::Compute] {
            let found = shown(gpu(path, Limits::Adapter), &scene, &words);
            verdict(&cpu, &found, false).unwrap_or_else(|e| panic!("{more:?} {path:?}: {e}"));
        }
    }
}

#[test]
fn what_every_webgpu_has_is_enough() {
    if device().is_none() {
        return;
    }
    let scene = scene("sphere");
    for splat in ["square1", "square2", "ellipse"] {
        let words = [("splat", splat), ("cameras", "cells")];
        let cpu = shown(Box::new(Cpu::default()), &scene, &words);
        for path in [Path::Vertex, Path::Compute] {
            let found = shown(gpu(path, Limits::Core), &scene, &words);
            verdict(&cpu, &found, splat == "ellipse")
                .unwrap_or_else(|e| panic!("{splat} {path:?}: {e}"));
        }
    }
}

#[test]
fn frames_make_no_buffers_and_a_lost_device_is_replaced() {
    if device().is_none() {
        return;
    }
    let scene = scene("sphere");
    let mut backend = gpu(Path::Compute, Limits::Adapter);
    // Lists begin too small: they must grow, and then stay.
    backend.ready.as_mut().expect("it is open").capacity = 1000;
    let c3rc = method("c3rc").expect("it is there");
    let params = Params::defaults(c3rc.info().params);
    let visibility = seen(&scene);
    let frame =
        crate::methods::FrameInput { scene: &scene, eye: &eye(&scene), visibility: &visibility };
    let made = c3rc.prepare(&scene, &params, &Context::default()).expect("nothing to do");
    let mut plan = crate::plan::Plan::default();
    c3rc.plan(frame, &made, &params, &mut plan).expect("it can draw it");
    let mut out = crate::plan::Reflection::default();
    let mut run = |backend: &mut Gpu| {
        let report = backend.execute(&plan, &scene, &visibility, false, &mut out);
        let report = report.unwrap_or_else(|e| panic!("{e}"));
        assert!(report.projections > Some(1000));
        out.coverage.iter().map(|c| f64::from(*c)).sum::<f64>()
    };
    let first = run(&mut backend);
    assert!(first > 500.0);
    let after_one = backend.allocations();
    for _ in 0..3 {
        assert!((run(&mut backend) - first).abs() < 1e-2);
    }
    assert_eq!(backend.allocations(), after_one, "a frame made a buffer");
    backend.lose();
    assert!((run(&mut backend) - first).abs() < 1e-2, "after the device was lost");
}

pub(super) fn seen(scene: &PreparedScene) -> crate::visibility::Visibility {
    use crate::backend::cpu::finish;
    let mut visibility = crate::visibility::Visibility::default();
    let (mirrors, objects) = (finish::mirror_surfaces(scene), finish::object_surfaces(scene));
    visibility.update(&eye(scene), &mirrors, &objects, &mut crate::visibility::Scratch::default());
    visibility
}

#[test]
fn bad_wishes_are_refused() {
    let named = |name: &str| Options { adapter: Some(name.into()), ..Options::default() };
    let error = Gpu::new(named("no such card")).err().expect("there is none").to_string();
    assert!(error.starts_with("--adapter: ") && error.contains("; "), "{error}");
    if device().is_none() {
        return;
    }
    let core = Device::open(None, Limits::Core).expect("it was opened before");
    let large = ImageSize { width: 16384, height: 16384 };
    let error = PictureBuffers::new(&core, large, 16, true).err().expect("too large").to_string();
    assert!(error.contains("MiB in one piece") && error.contains("--backend cpu"), "{error}");
    assert!(Gpu::new(named("99")).is_err());
    assert!(Gpu::new(named("0")).is_ok());
    let mut backend = gpu(Path::Compute, Limits::Adapter);
    let scene = scene("sphere");
    let raytrace = method("raytrace").expect("it is there");
    let params = Params::defaults(raytrace.info().params);
    let visibility = seen(&scene);
    let frame =
        crate::methods::FrameInput { scene: &scene, eye: &eye(&scene), visibility: &visibility };
    let made = raytrace.prepare(&scene, &params, &Context::default()).expect("no one cancels");
    let mut plan = crate::plan::Plan::default();
    raytrace.plan(frame, &made, &params, &mut plan).expect("it can draw it");
    let done = backend.execute(&plan, &scene, &visibility, false, &mut Default::default());
    assert!(done.is_err_and(|e| e.to_string().contains("shaders")));
}
