//! Environment, direct view and composition against the CPU's picture.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::super::adapters::choose;
use super::super::look::Uniform;
use super::super::records::Row;
use super::super::{Gpu, Options, features, shaders};
use super::pictures::SIZE;
use super::{device, run};
use crate::backend::{Backend, cpu::Cpu, cpu::finish};
use crate::camera::three_ray::tests::Numbers;
use crate::context::Context;
use crate::frame::Renderer;
use crate::geometry::{Mesh, Similarity};
use crate::image::Picture;
use crate::methods::{FrameInput, Method, Params, method};
use crate::plan::{Plan, Reflection};
use crate::scene::description::{
    Environment, EyeDescription, Light, Mirror, Object, Paint, PatternKind, Scene,
};
use crate::scene::shade::{Sun, SurfacePoint};
use crate::scene::{GivenSurfels, PrepareOptions, PreparedScene, builtin};
use crate::visibility::{Scratch, Visibility};

const EYE: EyeDescription = EyeDescription {
    position: DVec3::new(0.3, 1.2, 3.6),
    target: DVec3::new(0.1, 0.4, 0.0),
    up: DVec3::Y,
    fov_y: 0.9,
};

/// Every paint, with shadows on each other, before a sky with its sun in view; one mirror hides another.
pub(super) fn scene(environment: Environment) -> PreparedScene {
    let shape = |name: &str| Arc::new(builtin::shape(name, Some(1500)).expect("it is built in"));
    let at = |x: f64, y: f64, z: f64, scale: f64| Similarity {
        translation: DVec3::new(x, y, z),
        rotation: glam::DQuat::from_rotation_y(0.4),
        scale,
    };
    let object = |name: &str, mesh, transform, paint| Object {
        name: name.into(),
        mesh,
        source: None,
        points: None,
        transform,
        paint,
        density: 1.0,
    };
    let pattern = |kind, period| Paint::Pattern {
        kind,
        colors: [Vec3::new(0.8, 0.7, 0.1), Vec3::new(0.1, 0.2, 0.5)],
        period,
    };
    let plain = shape("sphere");
    let colors = plain.positions().iter().map(|p| (*p * 0.5 + 0.5).clamp(Vec3::ZERO, Vec3::ONE));
    let colored = Mesh::new(
        plain.positions().to_vec(),
        plain.normals().to_vec(),
        colors.collect(),
        plain.triangles().to_vec(),
    );
    let mirror = |name: &str, transform, tint| Mirror {
        name: name.into(),
        mesh: shape(name),
        source: None,
        transform,
        tint,
        proxy: None,
    };
    let scene = Scene {
        name: "test".into(),
        eye: EYE,
        mirrors: vec![
            mirror("goblet", at(0.0, 0.0, 0.0, 1.0), Vec3::new(0.9, 0.8, 0.7)),
            mirror("sphere", at(0.9, 0.4, 0.4, 0.4), Vec3::ONE),
        ],
        objects: vec![
            object(
                "ground",
                shape("ground"),
                at(0.0, 0.0, 0.0, 1.0),
                pattern(PatternKind::Checker, 0.4),
            ),
            object(
                "knot",
                shape("knot"),
                at(-0.9, 0.5, 0.8, 0.6),
                pattern(PatternKind::Rings, 0.2),
            ),
            object(
                "cylinder",
                shape("cylinder"),
                at(1.3, 0.4, -0.6, 0.5),
                pattern(PatternKind::Stripes, 0.15),
            ),
            object(
                "ball",
                Arc::new(colored.expect("a mesh")),
                at(-0.2, 0.3, 1.6, 0.25),
                Paint::Vertex,
            ),
            object(
                "cube",
                shape("cube"),
                at(-1.6, 0.3, -0.6, 0.4),
                Paint::Constant(Vec3::splat(0.6)),
            ),
        ],
        environment,
        light: Light {
            to_sun: Vec3::new(-0.35, 0.25, -0.9).normalize_or(Vec3::Y),
            sun: Vec3::new(0.9, 0.85, 0.75),
            ambient: Vec3::new(0.33, 0.36, 0.42),
        },
        notes: vec![],
    };
    let options = PrepareOptions { surfels: 20_000, ..PrepareOptions::default() };
    PreparedScene::new(&scene, &options, &Context::default()).expect("it is a scene")
}

const SKY: Environment = Environment::Sky {
    zenith: Vec3::new(0.1, 0.25, 0.7),
    horizon: Vec3::new(0.7, 0.8, 0.95),
    ground: Vec3::new(0.25, 0.22, 0.2),
};

pub(super) fn picture(
    backend: Box<dyn Backend>,
    scene: &PreparedScene,
    bright: bool,
) -> (Picture, Vec<[f32; 3]>) {
    let mut renderer = Renderer::on(backend);
    if bright {
        renderer.keep_bright();
    }
    let c3rc = method("c3rc").expect("it is there");
    let params = of_cells(c3rc);
    let eye = scene.eye_for(SIZE).expect("a view");
    renderer
        .render(scene, &eye, c3rc, &params, true, &Context::default())
        .unwrap_or_else(|e| panic!("{e}"));
    let planes = renderer.planes().expect("they were asked for");
    (renderer.picture().clone(), planes.radiance.clone())
}

/// The defaults, but for what devices draw instead of blocks.
pub(super) fn of_cells(c3rc: &dyn Method) -> Params {
    let mut params = Params::defaults(c3rc.info().params);
    params.set(c3rc.info().param("cameras"), "cells").expect("it has this value");
    params
}

pub(super) fn gpu() -> Box<Gpu> {
    let options = Options { composes: Some(true), ..Options::default() };
    Box::new(Gpu::new(options).unwrap_or_else(|e| panic!("{e}")))
}

/// Share of pixels that may be off: at the edges of shadows and patterns.
const OTHERS: f64 = 2e-3;
/// By more than this share of a value.
const APART: f32 = 0.01;

pub(super) fn verdict(cpu: &[[f32; 3]], gpu: &[[f32; 3]]) -> Result<(), String> {
    let apart = |a: f32, b: f32| {
        let apart = (a - b).abs();
        apart.is_nan() || apart > APART * a.abs().max(0.2)
    };
    let off = cpu.iter().zip(gpu).filter(|(a, b)| (0..3).any(|k| apart(a[k], b[k]))).count();
    let allowed = (OTHERS * cpu.len() as f64).max(2.0);
    if off as f64 > allowed { Err(format!("{off} of {} pixels", cpu.len())) } else { Ok(()) }
}

#[test]
fn the_picture_is_the_cpus() {
    if device().is_none() {
        return;
    }
    for (environment, bright) in
        [(SKY, false), (SKY, true), (Environment::Constant(Vec3::new(0.4, 0.5, 0.6)), false)]
    {
        let scene = scene(environment);
        let (cpu, cpu_planes) = picture(Box::new(Cpu::default()), &scene, bright);
        let mut backend = gpu();
        backend.options.stats = true;
        let (found, planes) = picture(backend, &scene, bright);
        assert_eq!((found.width, found.height), (SIZE.width, SIZE.height));
        verdict(&cpu.rgb, &found.rgb).unwrap_or_else(|e| panic!("{e}"));
        verdict(&cpu_planes, &planes).unwrap_or_else(|e| panic!("planes: {e}"));
        assert!(!bright || found.rgb.iter().any(|c| c[0] > 1.0), "the sun is brighter than white");
    }
}

#[test]
fn frames_on_a_given_device_make_no_buffers() {
    if device().is_none() {
        return;
    }
    let (adapter, _) = choose(None).expect("there is one");
    let descriptor = wgpu::DeviceDescriptor {
        required_features: features(&adapter),
        required_limits: adapter.limits(),
        ..Default::default()
    };
    let opened = pollster::block_on(adapter.request_device(&descriptor));
    let (device, queue) = opened.expect("it was opened before");
    let options = Options { composes: Some(true), ..Options::default() };
    let mut backend = Gpu::on_device(&adapter, device, queue, options).expect("it is open");
    let scene = scene(SKY);
    let eye = scene.eye_for(SIZE).expect("a view");
    let mut visibility = Visibility::default();
    let (mirrors, objects) = (finish::mirror_surfaces(&scene), finish::object_surfaces(&scene));
    visibility.update(&eye, &mirrors, &objects, &mut Scratch::default());
    let frame = FrameInput { scene: &scene, eye: &eye, visibility: &visibility };
    let (c3rc, mut plan) = (method("c3rc").expect("it is there"), Plan::default());
    let params = of_cells(c3rc);
    let made = c3rc.prepare(&scene, &params, &Context::default()).expect("no one cancels");
    c3rc.plan(frame, &made, &params, &mut plan).expect("it can draw it");
    let (mut out, mut picture) = (Reflection::default(), Picture::black(0, 0));
    let mut counts = Vec::new();
    for _ in 0..4 {
        let done = backend.execute(&plan, &scene, &visibility, false, &mut out);
        done.unwrap_or_else(|e| panic!("{e}"));
        backend.compose(&scene, &eye, &visibility, &mut out, 1.0, &mut picture);
        counts.push(backend.allocations());
    }
    assert_eq!(picture.rgb.len(), SIZE.pixels());
    assert!(counts[0] > 10 && counts[1..].iter().all(|c| *c == counts[0]), "{counts:?}");
}

#[test]
fn moved_things_and_scenes_without_triangles() {
    if device().is_none() {
        return;
    }
    let mut scene = scene(SKY);
    let mut renderer = Renderer::on(gpu());
    let c3rc = method("c3rc").expect("it is there");
    let params = of_cells(c3rc);
    let eye = scene.eye_for(SIZE).expect("a view");
    let to = |x, y, z, scale| Similarity {
        translation: DVec3::new(x, y, z),
        scale,
        ..Similarity::IDENTITY
    };
    let mut last: Option<Picture> = None;
    for moved in ["nothing", "object", "mirror"] {
        match moved {
            "object" => {
                scene.place(1, &to(-0.3, 0.6, 1.2, 0.5));
                scene.shade(&Context::default()).expect("no one cancels");
            }
            "mirror" => scene.place_mirror(1, &to(0.5, 0.9, 1.0, 0.6)),
            _ => {}
        }
        renderer
            .render(&scene, &eye, c3rc, &params, false, &Context::default())
            .unwrap_or_else(|e| panic!("{e}"));
        let (cpu, _) = picture(Box::new(Cpu::default()), &scene, false);
        verdict(&cpu.rgb, &renderer.picture().rgb).unwrap_or_else(|e| panic!("{moved}: {e}"));
        if let Some(last) = last.replace(cpu.clone()) {
            assert!(verdict(&last.rgb, &cpu.rgb).is_err(), "{moved}: the move is not seen");
        }
    }
    let points: Vec<Vec3> = (0u16..10_000)
        .map(|i| Vec3::new(f32::from(i % 100) * 0.02 - 1.0, -0.3, f32::from(i / 100) * 0.02 - 1.0))
        .collect();
    let (normals, radiance) = (vec![Vec3::Y; 10_000], vec![Vec3::X; 10_000]);
    let given = GivenSurfels { positions: &points, normals: &normals, radiance: &radiance };
    let mirror = builtin::shape("sphere", Some(500)).expect("it is built in");
    let bare = PreparedScene::from_surfels(mirror, given, EYE, SKY).expect("it is a scene");
    let (cpu, _) = picture(Box::new(Cpu::default()), &bare, false);
    let (found, _) = picture(gpu(), &bare, false);
    verdict(&cpu.rgb, &found.rgb).unwrap_or_else(|e| panic!("{e}"));
}

const MUTANTS: [[&str; 2]; 14] = [
    ["(id & ~MIXED) * 5u", "(id & ~MIXED) * 4u"],
    ["surfaces[middle * SURFACE_ROWS].x <= id", "surfaces[middle * SURFACE_ROWS].x + 40u <= id"],
    ["abs(folded.x) - abs(folded.y)", "abs(folded.x)"],
    ["look.right * from_middle.x - look.up", "look.right * from_middle.x + look.up"],
    ["let v = dot(ray, q) / det;", "let v = dot(ray, p) / det;"],
    ["0.6 * down4 * down4 * down4", "0.6 * down4"],
    ["let inverse = 1.0 / select", "let inverse = -1.0 / select"],
    ["if facing <= 0.0 {", "if facing <= 0.5 {"],
    ["odd = is_odd(length(p.xz));", "odd = is_odd(length(p.xy));"],
    ["point - v0)", "point)"],
    ["unpack2x16float(color.y).x", "unpack2x16float(color.x).x"],
    ["sky(direction) * (1.0 - own.w)", "sky(direction)"],
    ["near.xyz / near.w", "near.xyz"],
    ["sum / 5.0", "sum / 4.0"],
];

#[test]
fn every_mutant_is_noticed() {
    if device().is_none() {
        return;
    }
    let scene = scene(SKY);
    let (cpu, _) = picture(Box::new(Cpu::default()), &scene, true);
    let all: String = shaders::looks().into_iter().map(|(text, _)| text).collect();
    let mut unnoticed = String::new();
    for mutant in MUTANTS {
        assert!(all.contains(mutant[0]), "{} is in no shader", mutant[0]);
        let mut backend = gpu();
        backend.mutate(mutant);
        let found = catch_unwind(AssertUnwindSafe(|| picture(backend, &scene, true)));
        if found.is_ok_and(|(found, _)| verdict(&cpu.rgb, &found.rgb).is_ok()) {
            unnoticed += &format!("{mutant:?}\n");
        }
    }
    assert_eq!(unnoticed, "");
}

/// Of every surfel: whether the sun lights it, and how far away what is seen along a direction of its own is, or -1.
fn rays_by_shader(
    scene: &PreparedScene,
    points: &[(Vec3, Vec3, Vec3)],
    change: impl Fn(String) -> String,
) -> Option<Vec<[f32; 4]>> {
    const ENTRY: &str = "
        @group(0) @binding(10) var<storage, read> inputs: array<vec4<f32>>;
        @group(0) @binding(20) var<storage, read_write> found: array<vec4<f32>>;
        @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            let i = id.x;
            if i >= arrayLength(&inputs) / 3u { return; }
            let point = inputs[3u * i].xyz;
            let lit = is_lit(point, inputs[3u * i + 1u].xyz);
            let hit = find(point * look.scale, inputs[3u * i + 2u].xyz, 0.01 * look.scale, false);
            found[i] = vec4(select(0.0, 1.0, lit), select(-1.0, hit.t / look.scale, hit.found), 0.0, 0.0);
        }";
    let gpu = device()?;
    let text = change(shaders::looks()[0].0.clone() + ENTRY);
    let (nodes, obstacles, scale) = scene.triangles.parts();
    let sun = Sun::new(&scene.triangles, &scene.light);
    let to_sun = scene.light.to_sun.to_array();
    let uniform = Uniform { to_sun, apart: sun.apart, scale, ..Uniform::default() };
    let row = |v: Vec3| v.extend(0.0).to_array().map(f32::to_bits);
    let inputs: Vec<Row> = points.iter().flat_map(|&(p, n, d)| [row(p), row(n), row(d)]).collect();
    let lists: [(u32, &[Row]); 4] = [
        (0, bytemuck::cast_slice(bytemuck::bytes_of(&uniform))),
        (5, bytemuck::cast_slice(nodes)),
        (6, bytemuck::cast_slice(&obstacles)),
        (10, &inputs),
    ];
    let groups = u32::try_from(points.len().div_ceil(64)).expect("few");
    Some(run(&gpu, &text, &lists, points.len(), groups))
}

/// Share of the points at the edge of a shadow, and of the rays that pass the edge of a triangle.
const EDGES: f64 = 2e-3;

#[test]
fn rays_meet_what_the_cpus_meet() {
    let scene = scene(SKY);
    let mut numbers = Numbers(3);
    let surfels = &scene.surfels;
    let mut points = Vec::new();
    for cloud in &scene.clouds[..scene.objects.len()] {
        for i in cloud.surfels.clone() {
            let i = i as usize;
            let place = cloud.to_scene.point(surfels.position(i).as_dvec3()).as_vec3();
            let normal = cloud.to_scene.direction(surfels.normals[i].as_dvec3()).as_vec3();
            points.push((place, normal, numbers.point().normalize_or(DVec3::Y).as_vec3()));
        }
    }
    let sun = Sun::new(&scene.triangles, &scene.light);
    let verdict = |found: &[[f32; 4]]| {
        let (mut wrong, mut lit) = ([0u32; 2], 0);
        for (&(position, normal, direction), found) in points.iter().zip(found) {
            let visible = sun.visible_from(&SurfacePoint { position, normal, extent: 0.0 });
            lit += usize::from(visible);
            wrong[0] += u32::from(visible != (found[0] > 0.0));
            let hit = scene.triangles.closest(position, direction, 0.01, f32::INFINITY);
            let t = hit.map_or(-1.0, |hit| hit.t);
            wrong[1] += u32::from((t - found[1]).abs() > 1e-3 * t.abs().max(1.0));
        }
        assert!(lit > points.len() / 5 && lit < points.len() * 4 / 5, "{lit} of {}", points.len());
        let most = EDGES * points.len() as f64;
        if wrong.iter().any(|&wrong| f64::from(wrong) > most) { Err(wrong) } else { Ok(()) }
    };
    let Some(found) = rays_by_shader(&scene, &points, |text| text) else { return };
    verdict(&found).unwrap_or_else(|wrong| panic!("{wrong:?} of {}", points.len()));
    for [from, to] in [
        [
            "countOneBits(imask & ~(0xffffffffu << slot))",
            "countOneBits(imask & ~(0xfffffffeu << slot))",
        ],
        ["meta_bits & 0xe0u", "meta_bits & 0x20u"],
        ["let u = dot(across, e2) / volume;", "let u = dot(across, e1) / volume;"],
        ["let far = min(min(max(a.x, b.x)", "let far = min(min(min(a.x, b.x)"],
        ["byte_of(z.z, z.w, child)", "byte_of(z.x, z.y, child)"],
        ["point + normal * look.apart", "point - normal * look.apart * 100.0"],
    ] {
        let found = rays_by_shader(&scene, &points, |text| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        });
        let noticed = found.is_some_and(|found| verdict(&found).is_err());
        assert!(noticed, "{from} -> {to} goes unnoticed");
    }
}

#[test]
fn the_uniform_is_the_shaders() {
    let module = naga::front::wgsl::parse_str(&shaders::looks()[2].0).expect("it is valid");
    let look = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Look"));
    let naga::TypeInner::Struct { members, span } = &look.expect("it is there").1.inner else {
        panic!("Look is a structure")
    };
    macro_rules! fields {
        ($($name:ident),*) => { [$((stringify!($name), std::mem::offset_of!(Uniform, $name))),*] };
    }
    let own = fields!(
        eye,
        white,
        right,
        width,
        up,
        height,
        forward,
        surfaces,
        to_sun,
        mirrors,
        sun,
        mirror_triangles,
        ambient,
        apart,
        zenith,
        environment,
        horizon,
        scale,
        ground,
        padding
    );
    assert_eq!((*span as usize, members.len()), (size_of::<Uniform>(), own.len()));
    for (member, (name, offset)) in members.iter().zip(own) {
        let found = (member.name.as_deref(), member.offset as usize);
        assert_eq!(found, (Some(name), offset));
    }
}
