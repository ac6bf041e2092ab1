use std::fs;

use std::sync::Arc;

use super::*;
use crate::scene::description::PatternKind;
use crate::scene::fit::world_bounds;

fn arranged(request: &Request) -> Result<Scene> {
    scene(request, &Context::default())
}

fn strings<const N: usize>(list: [&str; N]) -> Vec<String> {
    list.map(str::to_owned).to_vec()
}

/// A folder with a long, a tall and a flat model; "flat.ply" has colours.
fn models() -> (tempfile::TempDir, [String; 3]) {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["long.obj", "tall.OBJ", "flat.ply"].map(|name| folder.path().join(name));
    fs::write(&paths[0], "v 0 0 0\nv 9 0 0\nv 9 1 0\nv 5 0 2\nf 1 2 3\nf 1 4 2\n").unwrap();
    fs::write(&paths[1], "v 0 0 0\nv 1 0 0\nv 1 50 0\nf 1 2 3\n").unwrap();
    let flat = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float r\nproperty float g\nproperty float b\nelement face 1\n\
        property list uchar int vertex_index\nend_header\n0 3 0 1 0 0\n8 3 0 1 0 0\n8 3 8 1 0 0\n3 0 2 1\n";
    fs::write(&paths[2], flat).unwrap();
    let names = paths.map(|p| p.display().to_string());
    (folder, names)
}

fn bounds_of(object: &Object) -> (DVec3, DVec3) {
    world_bounds(&object.mesh, &object.transform)
}

#[test]
fn nothing_asked_is_the_default_scene() {
    let default = arranged(&Request::default()).unwrap();
    let named = arranged(&Request { inputs: strings(["default"]), ..Request::default() }).unwrap();
    assert_eq!(default.name, "default");
    assert_eq!((default.name, default.eye), (named.name, named.eye));
}

#[test]
fn one_model_stands_beside_the_teapot() {
    let (_folder, paths) = models();
    for (path, name) in paths.iter().zip(["long", "tall", "flat"]) {
        let request = Request { inputs: vec![path.clone()], ..Request::default() };
        let scene = arranged(&request).unwrap();
        assert_eq!(scene.name, name);
        let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
        assert_eq!(names, [name, "ground"]);
        let (min, max) = bounds_of(&scene.objects[0]);
        assert!(((max - min).length() - 1.2).abs() < 1e-12);
        let base = DVec3::new(0.5 * (min.x + max.x), min.y, 0.5 * (min.z + max.z));
        // Those that lie flat and face up would lie in the ground's plane.
        let lifted = if name == "tall" { 0.0 } else { 0.004 };
        assert!((base - DVec3::new(0.74, lifted, 0.5)).length() < 1e-12, "{name}: {base}");
        let (min, max) = world_bounds(&scene.mirrors[0].mesh, &scene.mirrors[0].transform);
        assert!(((max - min).length() - 2.0).abs() < 1e-12 && min.y.abs() < 1e-12);
        // The usual eye, whatever the model's shape.
        assert!((scene.eye.position - EYE).length() < 1e-12, "{name}: {}", scene.eye.position);
        assert_eq!(scene.eye.target, TARGET);
        assert_eq!(scene.objects[0].paint == Paint::Vertex, name == "flat");
        assert!(matches!(
            scene.objects[1].paint,
            Paint::Pattern { kind: PatternKind::Checker, .. }
        ));
    }
}

#[test]
fn many_models_stand_apart_and_are_seen() {
    let (_folder, paths) = models();
    for count in [2, 5, 12, 40] {
        let inputs: Vec<String> = paths.iter().cycle().take(count).cloned().collect();
        let scene = arranged(&Request { inputs, ..Request::default() }).unwrap();
        let (ground, objects) = scene.objects.split_last().unwrap();
        assert_eq!(objects.len(), count);
        let mut boxes: Vec<_> = objects.iter().map(bounds_of).collect();
        for (i, a) in boxes.iter().enumerate() {
            for b in &boxes[..i] {
                let apart = a.1.cmple(b.0) | b.1.cmple(a.0);
                assert!(apart.x || apart.z, "{count}: {a:?} meets {b:?}");
            }
        }
        let teapot = world_bounds(&scene.mirrors[0].mesh, &scene.mirrors[0].transform);
        for b in &boxes[1..] {
            let apart = teapot.1.cmple(b.0) | b.1.cmple(teapot.0);
            assert!(apart.x || apart.z, "{count}: {b:?} meets the teapot");
        }
        // Every corner is in a picture of 4:3, and the ground reaches under every model.
        boxes.push(teapot);
        let e = scene.eye;
        let forward = (e.target - e.position).try_normalize().unwrap();
        let right = forward.cross(e.up).try_normalize().unwrap();
        let half_height = (0.5 * e.fov_y).tan();
        let (low, high) = bounds_of(ground);
        for (min, max) in boxes {
            for i in 0..8 {
                let bit = |k: i32| i >> k & 1 == 1;
                let p = DVec3::select(glam::BVec3::new(bit(0), bit(1), bit(2)), max, min);
                let (from_eye, up) = (p - e.position, right.cross(forward));
                let depth = from_eye.dot(forward) * (half_height + 1e-9);
                let (x, y) = (from_eye.dot(right), from_eye.dot(up));
                assert!(x.abs() <= depth * 4.0 / 3.0 && y.abs() <= depth, "{count}: {p}");
                assert!(p.x > low.x && p.x < high.x && p.z > low.z && p.z < high.z);
            }
        }
        let mut names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count + 1);
    }
}

#[test]
fn files_as_placed_and_shapes_where_they_belong() {
    let (_folder, [long, _, flat]) = models();
    let mirrors = vec![long.clone()];
    let scene = arranged(&Request { mirrors, ..Request::default() }).unwrap();
    assert!(scene.objects.is_empty());
    assert_eq!(scene.mirrors.len(), 1);
    assert_eq!(scene.mirrors[0].transform, Similarity::IDENTITY);
    assert_eq!((scene.eye.position, scene.eye.target), (EYE, TARGET));

    let objects = vec![flat.clone(), long.clone(), "sphere".to_owned()];
    let scene = arranged(&Request { objects, ..Request::default() }).unwrap();
    assert_eq!(scene.mirrors[0].name, "teapot");
    let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["flat", "long", "sphere"]);
    assert_eq!(scene.objects[0].paint, Paint::Vertex);
    assert_eq!(scene.objects[1].paint, Paint::Constant(file::LIGHT_GREY));
    assert_eq!(scene.objects[0].transform, Similarity::IDENTITY);
    let (min, max) = bounds_of(&scene.objects[2]);
    assert!(((max - min).length() - 1.2).abs() < 1e-12);
    let base = DVec3::new(0.5 * (min.x + max.x), min.y, 0.5 * (min.z + max.z));
    assert!((base - DVec3::new(0.74, 0.0, 0.5)).length() < 1e-12);

    let request = Request {
        inputs: strings(["default"]),
        mirrors: strings(["plane", "plane"]),
        ..Request::default()
    };
    let scene = arranged(&request).unwrap();
    let names: Vec<&str> = scene.mirrors.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["plane", "plane-2"]);
    assert!(Arc::ptr_eq(&scene.mirrors[0].mesh, &scene.mirrors[1].mesh));
    let (min, max) = world_bounds(&scene.mirrors[0].mesh, &scene.mirrors[0].transform);
    assert!(((max - min).length() - 2.0).abs() < 1e-12 && min.y.abs() < 1e-12);
    assert!(!scene.objects.is_empty());
    let request = Request { objects: vec![long], ..request };
    assert_eq!(arranged(&request).unwrap().objects.len(), 1);

    let request =
        Request { inputs: vec![flat], mirrors: strings(["sphere"]), ..Request::default() };
    let scene = arranged(&request).unwrap();
    assert_eq!((scene.mirrors.len(), scene.objects.len()), (1, 2));
}

#[test]
fn the_eye_can_be_overridden() {
    let (eye, target) = (DVec3::new(5.0, 6.0, 7.0), DVec3::new(1.0, 0.0, 0.0));
    let request = Request {
        eye: Some(eye),
        target: Some(target),
        fov_y_deg: Some(90.0),
        ..Request::default()
    };
    let scene = arranged(&request).unwrap();
    assert_eq!((scene.eye.position, scene.eye.target), (eye, target));
    assert!((scene.eye.fov_y - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    // Straight down, and along every axis: an eye comes out of it.
    for axis in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_Y] {
        let request = Request { eye: Some(target + axis), ..request.clone() };
        let e = arranged(&request).unwrap().eye;
        let view = e.target - e.position;
        assert!(view.cross(e.up).length() > 0.9 * view.length() * e.up.length());
    }
}

#[test]
fn bad_requests() {
    let (_folder, [long, tall, _]) = models();
    let none = Request::default;
    for (request, wanted) in [
        (
            Request { inputs: strings(["defualt"]), ..none() },
            "defualt: is neither a built-in scene nor a scene file (.toml) nor a model (.obj, .ply, .stl, .gltf, .glb, .las, .laz, .xyz, .csv, .txt, .npy); the built-in scenes are default",
        ),
        (
            Request { inputs: strings(["sphere"]), ..none() },
            "sphere: is neither a built-in scene nor a scene file (.toml) nor a model (.obj, .ply, .stl, .gltf, .glb, .las, .laz, .xyz, .csv, .txt, .npy); use the shape with --mirror or --object",
        ),
        (Request { inputs: strings(["no.toml"]), ..none() }, "no.toml: does not exist"),
        (Request { inputs: strings(["no.ply"]), ..none() }, "no.ply: does not exist"),
        (
            Request { inputs: strings(["default", "default"]), ..none() },
            "default: is given together with other inputs",
        ),
        (
            Request { inputs: vec!["default".into(), long.clone()], ..none() },
            "default: is given together with other inputs",
        ),
        (
            Request { inputs: vec![long], objects: vec![tall], ..none() },
            "--object: would replace the given models",
        ),
        (
            Request { mirrors: strings(["blob"]), ..none() },
            "--mirror: there is no built-in shape \"blob\"; the shapes are teapot",
        ),
        (
            Request { objects: strings(["blob"]), ..none() },
            "--object: there is no built-in shape \"blob\"",
        ),
        (Request { objects: strings(["no.obj"]), ..none() }, "no.obj: does not exist"),
        (Request { objects: strings(["/"]), ..none() }, "/: is a folder"),
        (Request { eye: Some(DVec3::NAN), ..none() }, "--eye: is not finite"),
        (Request { target: Some(DVec3::INFINITY), ..none() }, "--target: is not finite"),
        (
            Request { eye: Some(DVec3::ONE), target: Some(DVec3::ONE), ..none() },
            "--eye: the eye and its target coincide",
        ),
        (Request { fov_y_deg: Some(0.0), ..none() }, "--fov: 0 degrees"),
        (Request { fov_y_deg: Some(180.0), ..none() }, "--fov: 180 degrees"),
        (Request { fov_y_deg: Some(f64::NAN), ..none() }, "--fov: NaN degrees"),
    ] {
        let found = arranged(&request).unwrap_err().to_string();
        assert!(found.starts_with(wanted), "{found}\n  instead of {wanted}");
    }
}
