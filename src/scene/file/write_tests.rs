use std::fs;

use super::*;
use crate::context::Context;
use crate::scene::arrange::{self, Request};
use crate::scene::builtin;
use crate::scene::description::{EyeDescription, Light};
use crate::scene::environment::image::EnvironmentImage;
use crate::scene::file::parse;
use crate::scene::load::ReadOptions;

/// Of transforms and directions.
const CLOSE: f64 = 1e-12;

fn read_back(scene: &Scene) -> Scene {
    let text = to_toml(scene).unwrap();
    parse(
        &text,
        "written.toml",
        Path::new("elsewhere"),
        &ReadOptions { outside: true, ..ReadOptions::default() },
        &Context::default(),
    )
    .unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn apart(a: &Similarity, b: &Similarity) -> f64 {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let turned = axes.map(|v| (a.rotation * v - b.rotation * v).length());
    let moved = (a.translation - b.translation).length();
    let scaled = (a.scale - b.scale).abs() / a.scale;
    turned.into_iter().fold(moved.max(scaled), f64::max)
}

/// What differs first, if anything does.
fn difference(a: &Scene, b: &Scene) -> Option<String> {
    let (e, f) = (a.eye, b.eye);
    let eye = (e.position, e.target) == (f.position, f.target)
        && (e.up - f.up).length() < CLOSE
        && (e.fov_y - f.fov_y).abs() < CLOSE;
    let light = (a.light.sun, a.light.ambient) == (b.light.sun, b.light.ambient)
        && (a.light.to_sun - b.light.to_sun).length() < 2.0 * f32::EPSILON;
    let whole = [
        ("name", a.name == b.name),
        ("eye", eye),
        ("light", light),
        ("environment", a.environment == b.environment),
        ("mirrors", a.mirrors.len() == b.mirrors.len()),
        ("objects", a.objects.len() == b.objects.len()),
    ];
    let mirrors = a.mirrors.iter().zip(&b.mirrors).flat_map(|(a, b)| {
        [
            ("a mirror's name", a.name == b.name),
            ("a mirror's source", a.source == b.source && a.source.is_some()),
            ("a mirror's mesh", a.mesh == b.mesh),
            ("a mirror's tint", a.tint == b.tint),
            ("a mirror's transform", apart(&a.transform, &b.transform) < CLOSE),
        ]
    });
    let objects = a.objects.iter().zip(&b.objects).flat_map(|(a, b)| {
        [
            ("an object's name", a.name == b.name),
            ("an object's source", a.source == b.source && a.source.is_some()),
            ("an object's mesh", a.mesh == b.mesh),
            ("an object's paint", a.paint == b.paint),
            ("an object's density", a.density == b.density),
            ("an object's transform", apart(&a.transform, &b.transform) < CLOSE),
        ]
    });
    let mut all = whole.into_iter().chain(mirrors).chain(objects);
    all.find(|(_, same)| !same).map(|(what, _)| what.to_owned())
}

#[test]
fn built_in_scenes_come_back() {
    for name in builtin::SCENES {
        let text = builtin::scene_text(name).unwrap();
        let scene =
            parse(text, name, Path::new(""), &ReadOptions::default(), &Context::default()).unwrap();
        assert_eq!(difference(&scene, &read_back(&scene)), None, "{name}");
    }
}

/// Everything by its name and value, so that what is compared is also what was meant.
fn all_kinds() -> Scene {
    let text = r##"
        name = "all \"kinds\" # of\nthings"
        [eye]
        position = [1.1, 2.5, 3]
        target = [0, 0.3, -1]
        up = [0.1, 0.2, 5]
        fov_y_deg = 61.7
        [light]
        to_sun = [0.3, 3, 4]
        sun = [2, 1.5, 1]
        ambient = "#ff8000"
        [environment]
        kind = "constant"
        color = [0.1, 7, 0.3]
        [[mirror]]
        name = "ball"
        shape = "sphere"
        triangles = 64
        tint = [1, 0.9, 0.8]
        scale = 2.7
        translate = [1, 0, -1e9]
        rotate_deg = { axis = [-0.3, 0.1, -2], angle = 217.3 }
        [[object]]
        name = "floor"
        shape = "plane"
        density = 0.25
        pattern = { kind = "rings", colors = ["#ffffff", [0, 0, 1.7]], period = 0.3 }
        fit = { diagonal = 3, base = [1, 2, 3] }
        [[object]]
        shape = "sphere"
        triangles = 80
        color = [0.1, 0.2, 0.3]
        rotate_deg = { axis = [0, 1, 0], angle = 180 }
        [[object]]
        shape = "cube"
        rotate_deg = { axis = [1, 0, 0], angle = 1e-7 }
    "##;
    parse(text, "all.toml", Path::new(""), &ReadOptions::default(), &Context::default()).unwrap()
}

#[test]
fn every_kind_of_value_comes_back() {
    let scene = all_kinds();
    assert_eq!(scene.name, "all \"kinds\" # of\nthings");
    assert_eq!(difference(&scene, &read_back(&scene)), None);
    let mut other = scene.clone();
    other.eye.up = DVec3::new(0.1, 0.2, -1.0).try_normalize().unwrap();
    assert_eq!(difference(&other, &read_back(&scene)).as_deref(), Some("eye"));
    assert_eq!(difference(&other, &read_back(&other)), None);
    let turn = &mut other.objects[2].transform.rotation;
    *turn = DQuat::from_axis_angle(DVec3::X, 3e-7);
    assert_eq!(difference(&other, &read_back(&other)), None);
    for angle in [-3.1, -1.0, 1e-12, 0.5, 3.1, 4.0, 6.2] {
        let axis = DVec3::new(angle, 0.7, -1.3).try_normalize().unwrap();
        other.mirrors[0].transform.rotation = DQuat::from_axis_angle(axis, angle);
        assert_eq!(difference(&other, &read_back(&other)), None, "{angle}");
    }
}

#[test]
fn arranged_models_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["plain one.obj", "colored.ply"].map(|name| folder.path().join(name));
    fs::write(&paths[0], "v 0 0 0\nv 9 0 0\nv 9 1 0\nv 5 0 2\nf 1 2 3\nf 1 4 2\n").unwrap();
    let colored = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float r\nproperty float g\nproperty float b\nelement face 1\n\
        property list uchar int vertex_index\nend_header\n0 3 0 1 0 0\n8 3 0 1 0 0\n8 3 8 1 0 0\n3 0 1 2\n";
    fs::write(&paths[1], colored).unwrap();
    let names = paths.clone().map(|p| p.display().to_string());
    let beside = Request { inputs: names.to_vec(), ..Request::default() };
    let placed = Request {
        mirrors: vec!["sphere".into(), names[0].clone()],
        objects: vec!["cube".into(), names[1].clone()],
        ..Request::default()
    };
    for request in [beside, placed] {
        let scene = arrange::scene(&request, &Context::default()).unwrap();
        let file = Source::File {
            path: paths[1].canonicalize().unwrap(),
            part: None,
            own: Similarity::IDENTITY,
        };
        assert!(scene.objects.iter().any(|o| o.source.as_ref() == Some(&file)));
        assert!(scene.objects.iter().any(|o| o.paint == Paint::Vertex));
        assert_eq!(difference(&scene, &read_back(&scene)), None);
        let saved = folder.path().join("saved.toml");
        write(&scene, &saved).unwrap();
        let read = super::super::read(
            &saved,
            &ReadOptions { outside: true, ..ReadOptions::default() },
            &Context::default(),
        )
        .unwrap();
        assert_eq!(difference(&scene, &read), None);
    }
}

#[test]
fn panoramas_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut picture = crate::image::Picture::black(64, 32);
    for (i, color) in picture.rgb.iter_mut().enumerate() {
        *color = [i as f32, 0.5, 7.0];
    }
    let path = folder.path().join("my sky.exr");
    crate::image::io::write_picture(&path, &picture).unwrap();
    let text = "[eye]\nposition = [0, 1, 3]\ntarget = [0, 0, 0]\n[[mirror]]\nshape = \"sphere\"\n\
        [environment]\nkind = \"image\"\nfile = \"my sky.exr\"\nrotate_deg = 30\nexposure = -0.5\n";
    let scene =
        parse(text, "sky.toml", folder.path(), &ReadOptions::default(), &Context::default())
            .unwrap();
    let Environment::Image(image) = &scene.environment else { panic!() };
    let mounting = Mounting { rotate_deg: 30.0, exposure: -0.5 };
    assert_eq!(image.mounting(), mounting);
    let written = to_toml(&scene).unwrap();
    let path = path.canonicalize().unwrap();
    let part = format!(
        "[environment]\nkind = \"image\"\nfile = \"{}\"\nrotate_deg = 30.0\nexposure = -0.5\n",
        path.display()
    );
    assert!(written.contains(&part), "{written}");
    assert_eq!(difference(&scene, &read_back(&scene)), None);
    let mut other = scene.clone();
    let turned = Mounting { rotate_deg: 31.0, ..mounting };
    other.environment =
        crate::scene::load::environment(&path, turned, &Context::default()).unwrap();
    assert_eq!(difference(&scene, &read_back(&other)).as_deref(), Some("environment"));
    let made = EnvironmentImage::new(&picture, mounting, &Context::default()).unwrap();
    other.environment = Environment::Image(made.into());
    let refused = to_toml(&other).unwrap_err().to_string();
    assert!(refused.starts_with("the environment: its picture comes from no file"), "{refused}");
    // On the command line it replaces the scene's, mounted plainly.
    let request = Request { environment: Some(path.clone()), ..Request::default() };
    let scene = arrange::scene(&request, &Context::default()).unwrap();
    let Environment::Image(image) = &scene.environment else { panic!() };
    assert_eq!((image.mounting(), image.source.as_ref()), (Mounting::default(), Some(&path)));
}

#[test]
fn what_is_usual_is_left_out() {
    let text = "[eye]\nposition = [0, 1, 3]\ntarget = [0, 0.5, 0]\n[[mirror]]\nshape = \"sphere\"\n\
        rotate_deg = { axis = [0, 0, -1], angle = 30 }\n[[object]]\nshape = \"plane\"\ncolor = \"#d4213d\"\n";
    let scene =
        parse(text, "a scene.toml", Path::new(""), &ReadOptions::default(), &Context::default())
            .unwrap();
    let written = "name = \"a scene\"\n\n[eye]\nposition = [0.0, 1.0, 3.0]\ntarget = [0.0, 0.5, 0.0]\n\n\
        [[mirror]]\nname = \"sphere\"\nshape = \"sphere\"\n\
        rotate_deg = { axis = [0.0, 0.0, 1.0], angle = -30.0 }\n\n\
        [[object]]\nname = \"plane\"\nshape = \"plane\"\ncolor = \"#d4213d\"\n";
    assert_eq!(to_toml(&scene).unwrap(), written);
}

#[test]
fn what_no_file_could_say_is_refused() {
    let complaint = |change: &dyn Fn(&mut Scene)| {
        let mut scene = all_kinds();
        change(&mut scene);
        let error = to_toml(&scene).unwrap_err();
        assert!(matches!(error, Error::Input { .. }));
        error.to_string()
    };
    let found = complaint(&|s| s.objects[0].source = None);
    assert!(found.starts_with("floor: its mesh comes from no file"), "{found}");
    let found = complaint(&|s| s.objects[0].name = "ball".into());
    assert!(found.contains("used twice"), "{found}");
    assert!(complaint(&|s| s.mirrors.clear()).contains("no mirror"));
    assert!(complaint(&|s| s.mirrors[0].name.clear()).contains("empty"));
    assert!(complaint(&|s| s.objects[1].density = 0.0).contains("positive"));
    assert!(complaint(&|s| s.objects[1].transform.translation.x = f64::NAN).contains("finite"));
    assert!(complaint(&|s| s.eye.target = s.eye.position).contains("coincide"));
    let many = Source::Shape { name: "cube".into(), triangles: Some(usize::MAX) };
    assert!(complaint(&|s| s.objects[1].source = Some(many.clone())).contains("triangles"));
}

#[test]
fn what_was_made_in_code_comes_back_as_it_looks() {
    let mut scene = all_kinds();
    scene.eye = EyeDescription { up: DVec3::NEG_Z, fov_y: 1.0, ..scene.eye };
    scene.light = Light { to_sun: Vec3::X, sun: Vec3::splat(0.1), ambient: Vec3::splat(1e-9) };
    scene.objects[1].paint = Paint::Vertex;
    let back = read_back(&scene);
    assert_eq!(back.objects[1].paint, Paint::Constant(Vec3::ONE));
    scene.objects[1].paint = Paint::Constant(Vec3::ONE);
    assert_eq!(difference(&scene, &back), None);
    let mesh = &scene.objects[1].mesh;
    let color = |paint: &Paint| paint.color(mesh, 0, [1.0, 0.0, 0.0], 0.0);
    assert_eq!(color(&Paint::Vertex), color(&back.objects[1].paint));
}
