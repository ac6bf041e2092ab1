//! Triangles between images, drawn by the device and by the CPU.

use std::collections::BTreeMap;

use glam::Vec3;

use super::super::reflected::{Rasteriser, View};
use super::super::shaders;
use super::pictures::scene;
use super::{Device, device};
use crate::backend::cpu::finish::{mirror_surfaces, object_surfaces};
use crate::backend::cpu::search::raster::{Drawing, Drawn, Hit};
use crate::backend::cpu::search::{OnCpu, SearchBackend};
use crate::camera::Eye;
use crate::camera::eye::ImageSize;
use crate::camera::reflector::exact::Surface;
use crate::camera::reflector::tests::map;
use crate::camera::three_ray::tests::Numbers;
use crate::context::Context;
use crate::plan::search::{Bend, ReflectorPart};
use crate::scene::PreparedScene;
use crate::visibility::{Scratch, Visibility};

const LARGE: ImageSize = ImageSize { width: 640, height: 360 };

/// A mirror, and triangles in its front, in it and behind it.
struct Trial {
    scene: PreparedScene,
    eye: Eye,
    visibility: Visibility,
    part: ReflectorPart,
    objects: Vec<Drawn>,
}

fn trial() -> Trial {
    let scene = scene("sphere");
    let eye = scene.eye_for(LARGE).expect("it has one");
    let mut visibility = Visibility::default();
    let mirrors = mirror_surfaces(&scene);
    visibility.update(&eye, &mirrors, &object_surfaces(&scene), &mut Scratch::default());
    let count = scene.mirrors[0].mesh.triangles().len();
    let part = ReflectorPart {
        name: "test".into(),
        mirror: 0,
        triangles: 0..u32::try_from(count).expect("few"),
        center: Vec3::ZERO,
        map: map(Surface::Sphere { inside: false }, false),
        bend: Bend::Convex,
    };
    let mut numbers = Numbers(77);
    let middle =
        scene.mirrors[0].positions.iter().sum::<Vec3>() / scene.mirrors[0].positions.len() as f32;
    let mut object = |count: u32| {
        let mut drawn = Drawn { places: Vec::new(), distances: Vec::new(), triangles: Vec::new() };
        for k in 0..count {
            let at = middle + numbers.point().as_vec3() * 1.3;
            let mut distance = numbers.between(0.2, 4.0);
            for _ in 0..3 {
                drawn.places.push(at + numbers.point().as_vec3() * 0.6);
                distance += numbers.between(0.0, 0.5);
                #[expect(clippy::cast_possible_truncation)]
                drawn.distances.push(distance as f32);
            }
            drawn.triangles.push([3 * k, 3 * k + 1, 3 * k + 2]);
        }
        // A corner whose search did not end.
        drawn.places[4] = Vec3::NAN;
        drawn
    };
    let objects = vec![object(120), object(80)];
    Trial { scene, eye, visibility, part, objects }
}

/// Whether the device shows what the CPU shows, but for a few pixels at edges.
fn agrees(gpu: &Device, trial: &Trial, on_mirror: bool) -> Result<(), String> {
    let Trial { scene, eye, visibility, part, objects } = trial;
    let drawing = Drawing { eye, scene, visibility, part, objects, on_mirror };
    let exact = OnCpu(&Context::default()).rasterise(&drawing).expect("the CPU does not fail");
    let drawn = Rasteriser::new(gpu).and_then(|mut r| r.draw(gpu, &drawing));
    let found = drawn.map_err(|e| e.to_string())?.ok_or("too large")?;
    assert!(exact.len() > 4_000, "{} pixels", exact.len());
    let by_pixel: BTreeMap<usize, &Hit> = found.iter().map(|hit| (hit.pixel, hit)).collect();
    let alike = |hit: &&Hit| {
        by_pixel.get(&hit.pixel).is_some_and(|other| {
            let close = (0..3).all(|k| (hit.weights[k] - other.weights[k]).abs() < 2e-3);
            close && (hit.object, hit.triangle) == (other.object, other.triangle)
        })
    };
    let same = exact.iter().filter(alike).count();
    let (lost, extra) = (exact.len() - same, found.len().abs_diff(exact.len()));
    let few = exact.len() / 100;
    let verdict = format!("{lost} of {} other, {extra} more or less", exact.len());
    if lost <= few && extra <= few { Ok(()) } else { Err(verdict) }
}

#[test]
fn the_device_draws_what_the_cpu_draws() {
    let Some(gpu) = device() else { return };
    let trial = trial();
    for on_mirror in [false, true] {
        assert_eq!(agrees(&gpu, &trial, on_mirror), Ok(()), "on the mirror: {on_mirror}");
    }
}

/// Also where rows of the copied picture do not fill their places, and with another picture after it.
#[test]
fn odd_sizes_are_copied_whole() {
    let Some(gpu) = device() else { return };
    let mut trial = trial();
    let mut rasteriser = Rasteriser::new(&gpu).expect("it is made");
    for (width, height) in [(333, 201), (320, 180), (17, 300)] {
        let size = ImageSize { width, height };
        trial.eye = trial.scene.eye_for(size).expect("it has one");
        let mirrors = mirror_surfaces(&trial.scene);
        trial.visibility.update(&trial.eye, &mirrors, &[], &mut Scratch::default());
        let Trial { scene, eye, visibility, part, objects } = &trial;
        let drawing = Drawing { eye, scene, visibility, part, objects, on_mirror: true };
        let found = rasteriser.draw(&gpu, &drawing).expect("it draws").expect("it fits");
        let exact = OnCpu(&Context::default()).rasterise(&drawing).expect("the CPU does not fail");
        let pixels = |hits: &[Hit]| hits.iter().map(|h| h.pixel).collect::<Vec<_>>();
        let shared =
            pixels(&exact).iter().filter(|p| pixels(&found).binary_search(p).is_ok()).count();
        assert!(
            shared * 100 >= exact.len() * 97,
            "{width} x {height}: {shared} of {}",
            exact.len()
        );
    }
}

/// What is replaced, and by what.
const MUTANTS: [(&str, &str); 12] = [
    ("corner - view.position", "corner + view.position"),
    ("2.0 * view.focal_px", "1.9 * view.focal_px"),
    ("p.z - view.near", "view.near - p.z"),
    ("corners[indices[i]].xyz", "corners[i].xyz"),
    ("position.xy / p.z, corner.w", "position.xy, corner.w"),
    ("corner.w / view.farthest", "1.0 - corner.w / view.farthest"),
    ("f32(k == 1u), f32(k == 2u)", "f32(k == 2u), f32(k == 1u)"),
    ("in.depth > back", "in.depth < back"),
    ("max(1.0 - read, 1e-30)", "max(read, 1e-30)"),
    ("in.triangle + 1u", "in.triangle + 2u"),
    ("id < view.first || id >= view.end", "id >= view.first && id < view.end"),
    ("pixel.y * u32(view.size.x)", "pixel.y * u32(view.size.y)"),
];

#[test]
fn every_mutant_of_drawing_is_noticed() {
    let Some(mut gpu) = device() else { return };
    let trial = trial();
    let mut unnoticed = String::new();
    for (from, to) in MUTANTS {
        assert!(shaders::reflected().contains(from), "{from} is in no shader");
        gpu.mutant = Some([from, to]);
        if [false, true].into_iter().all(|on_mirror| agrees(&gpu, &trial, on_mirror).is_ok()) {
            unnoticed += &format!("{from} -> {to}\n");
        }
    }
    assert_eq!(unnoticed, "");
}

#[test]
fn the_view_is_the_shaders() {
    let module = naga::front::wgsl::parse_str(&shaders::reflected()).expect("it is valid");
    let view = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("View"));
    let naga::TypeInner::Struct { members, span } = &view.expect("it is there").1.inner else {
        panic!("View is a structure")
    };
    macro_rules! fields {
        ($($name:ident),*) => { [$((stringify!($name), std::mem::offset_of!(View, $name))),*] };
    }
    let own = fields!(
        position, focal_px, right, near, up, farthest, forward, on_mirror, size, first, end
    );
    assert_eq!((*span as usize, members.len()), (size_of::<View>(), own.len()));
    for (member, (name, offset)) in members.iter().zip(own) {
        assert_eq!((member.name.as_deref(), member.offset as usize), (Some(name), offset));
    }
}
