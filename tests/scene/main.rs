//! The whole pipeline through the library: scenes made in code, prepared, rendered, and held against what must
//! come out.

#![expect(clippy::unwrap_used, reason = "a test fails where it panics")]

mod cells;
#[cfg(feature = "cli")]
mod clouds;
mod detail;
mod hiding;
mod holes;
mod light;
mod moves;
mod plane_mirror;
mod plans;
mod roots;
mod searches;
mod stress;

use std::sync::Arc;

use catoptric::Context;
use catoptric::camera::Eye;
use catoptric::camera::eye::ImageSize;
use catoptric::frame::Renderer;
use catoptric::geometry::{Mesh, Similarity};
use catoptric::image::{Picture, Planes};
use catoptric::methods::{Params, method};
use catoptric::scene::builtin;
use catoptric::scene::description::{
    Environment, EyeDescription, Light, Mirror, Object, Paint, Scene,
};
use catoptric::scene::{PrepareOptions, PreparedScene};
use glam::{DQuat, DVec3, Vec3};

const RED: Paint = Paint::Constant(Vec3::new(0.8, 0.2, 0.1));
const BLUE: Paint = Paint::Constant(Vec3::new(0.1, 0.3, 0.8));
const GREY: Paint = Paint::Constant(Vec3::splat(0.5));

fn shape(name: &str, triangles: usize) -> Arc<Mesh> {
    Arc::new(builtin::shape(name, Some(triangles)).unwrap())
}

fn moved(translation: DVec3) -> Similarity {
    Similarity { translation, ..Similarity::IDENTITY }
}

fn turned(axis: DVec3, degrees: f64, translation: DVec3) -> Similarity {
    let axis = axis.try_normalize().unwrap();
    let rotation = DQuat::from_axis_angle(axis, degrees.to_radians());
    Similarity { rotation, translation, scale: 1.0 }
}

fn object(name: &str, mesh: Arc<Mesh>, transform: Similarity, paint: Paint) -> Object {
    Object { name: name.into(), mesh, source: None, points: None, transform, paint, density: 1.0 }
}

/// A scene under a plain sky, with one mirror without a tint.
fn scene(mirror: (Arc<Mesh>, Similarity), objects: Vec<Object>, eye: EyeDescription) -> Scene {
    let (mesh, transform) = mirror;
    Scene {
        name: "test".into(),
        eye,
        mirrors: vec![Mirror {
            name: "mirror".into(),
            mesh,
            source: None,
            transform,
            tint: Vec3::ONE,
            proxy: None,
        }],
        objects,
        environment: Environment::Constant(Vec3::new(0.4, 0.5, 0.6)),
        light: Light {
            to_sun: Vec3::new(0.4, 0.8, 0.45).try_normalize().unwrap(),
            sun: Vec3::new(0.9, 0.85, 0.75),
            ambient: Vec3::new(0.33, 0.36, 0.42),
        },
        notes: vec![],
    }
}

fn looks(position: DVec3, target: DVec3) -> EyeDescription {
    EyeDescription { position, target, up: DVec3::Y, fov_y: 45_f64.to_radians() }
}

fn prepared(scene: &Scene, surfels: usize) -> PreparedScene {
    let options = PrepareOptions { surfels, ..PrepareOptions::default() };
    PreparedScene::new(scene, &options, &Context::default()).unwrap()
}

/// The scene's own eye.
fn eye(scene: &PreparedScene, width: u32, height: u32) -> Eye {
    let EyeDescription { position, target, up, fov_y } = scene.eye;
    let size = ImageSize { width, height };
    Eye::new(position - scene.origin, target - scene.origin, up, fov_y, size).unwrap()
}

/// A picture and its planes, by a method with its default parameters.
fn rendered(scene: &PreparedScene, id: &str, width: u32, height: u32) -> (Picture, Planes) {
    rendered_with(scene, id, &[], width, height)
}

fn rendered_with(
    scene: &PreparedScene,
    id: &str,
    settings: &[(&str, &str)],
    width: u32,
    height: u32,
) -> (Picture, Planes) {
    let method = method(id).unwrap();
    let mut params = Params::defaults(method.info().params);
    for (name, value) in settings {
        params.set(method.info().param(name), value).unwrap();
    }
    let mut renderer = Renderer::new();
    renderer.keep_bright();
    let eye = eye(scene, width, height);
    renderer.render(scene, &eye, method, &params, true, &Context::default()).unwrap();
    (renderer.picture().clone(), renderer.planes().unwrap().clone())
}

/// Share of the pixels whose channels differ by at most `tolerance`.
fn share_within(a: &Picture, b: &Picture, tolerance: f32) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let close = a.rgb.iter().zip(&b.rgb).filter(|(a, b)| near(a, b, tolerance)).count();
    close as f64 / a.rgb.len() as f64
}

fn near(a: &[f32; 3], b: &[f32; 3], tolerance: f32) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}
