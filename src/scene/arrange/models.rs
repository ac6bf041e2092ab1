//! Models on the command line: a scene of their own if there are mirrors in them, or else beside the teapot.

use std::f64::consts::TAU;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::{
    BESIDE, EYE, MODEL_COLORS, OBJECT_DIAGONAL, Request, bare, mirror, new_name, object, teapot,
};
use crate::error::{Error, Result};
use crate::geometry::{Mesh, Similarity};
use crate::scene::description::{EyeDescription, Object, Paint, PatternKind, Scene};
use crate::scene::fit::{fit, world_bounds};
use crate::scene::library::{Found, Library, stem};
use crate::scene::load::Part;

/// The scene of the given models.
pub(super) fn scene(request: &Request, library: &mut Library) -> Result<Scene> {
    if let [model] = &request.inputs[..] {
        let path = Path::new(model);
        let things = library.model(path)?;
        if things.iter().any(|(part, _)| part.mirror.is_some()) && request.mirrors.is_empty() {
            return Ok(as_it_is(path, &things, request, library));
        }
    }
    beside_teapot(request, library)
}

/// A file that has mirrors of its own, seen by its own camera if it has one.
fn as_it_is(path: &Path, things: &[(Part, Found)], request: &Request, library: &Library) -> Scene {
    let mut scene = bare(&stem(path));
    let turn = Similarity { rotation: request.read.turn(path), ..Similarity::IDENTITY };
    add(&mut scene, path, things, &turn, Vec3::splat(0.7));
    scene.eye = match library.eye(path) {
        Some(eye) => EyeDescription {
            position: turn.point(eye.position),
            target: turn.point(eye.target),
            up: turn.direction(eye.up),
            ..eye
        },
        None => before_mirrors(scene.eye, &scene),
    };
    scene
}

/// Adds a file's things under a common transform. `color`: of those that bring none.
fn add(
    scene: &mut Scene,
    path: &Path,
    things: &[(Part, Found)],
    transform: &Similarity,
    color: Vec3,
) {
    for (part, found) in things {
        let plain = if things.len() == 1 { stem(path) } else { part.name.clone() };
        let name = new_name(scene, &plain);
        let transform = part.own.then(transform);
        match part.mirror {
            Some(tint) => scene.mirrors.push(mirror(name, found.clone(), transform, tint)),
            None => {
                let paint = part.paint.clone().unwrap_or(Paint::Constant(color));
                scene.objects.push(object(name, found.clone(), transform, paint));
            }
        }
    }
}

/// Things this many times as large as the mirrors are ground or walls: framing leaves them out.
const LARGE: f64 = 4.0;

/// The eye turned to the middle of the mirrors, far enough away to see them and what stands about them.
fn before_mirrors(eye: EyeDescription, scene: &Scene) -> EyeDescription {
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let union = |a: (DVec3, DVec3), b: &(DVec3, DVec3)| (a.0.min(b.0), a.1.max(b.1));
    let mirrors = scene.mirrors.iter().map(|m| world_bounds(&m.mesh, &m.transform));
    let core = mirrors.fold(none, |all, own| union(all, &own));
    let size = (core.1 - core.0).length();
    let objects = scene.objects.iter().map(|o| world_bounds(&o.mesh, &o.transform));
    let near: Vec<_> = objects.filter(|(min, max)| (*max - *min).length() < LARGE * size).collect();
    let target = 0.5 * (core.0 + core.1);
    let from = (eye.position - eye.target).normalize_or(DVec3::Z);
    let eye = EyeDescription { position: target + from * size, target, ..eye };
    stepped_back(eye, &[near.as_slice(), &[core]].concat())
}

/// The teapot on a checkered ground, with models around it.
fn beside_teapot(request: &Request, library: &mut Library) -> Result<Scene> {
    let models = &request.inputs;
    let mut scene = bare(&stem(Path::new(&models[0])));
    let teapot = teapot(library)?;
    let mut discs = vec![Disc::around(&[(&*teapot.mesh, teapot.transform)])];
    scene.mirrors.push(teapot);

    let mut boxes = Vec::new();
    for (i, model) in models.iter().enumerate() {
        let path = Path::new(model);
        let things = library.model(path)?;
        let meshes: Vec<(&Mesh, Similarity)> =
            things.iter().map(|(part, _)| (&*part.mesh, part.own)).collect();
        let mut transform = fit(&meshes, request.read.turn(path), OBJECT_DIAGONAL, BESIDE);
        if things.iter().all(|(part, _)| part.points.is_none()) && has_floor(&meshes, &transform) {
            transform.translation.y += MAT;
        }
        let placed = |transform: &Similarity| -> Vec<(&Mesh, Similarity)> {
            meshes.iter().map(|(mesh, own)| (*mesh, own.then(transform))).collect()
        };
        let mut disc = Disc::around(&placed(&transform));
        if i > 0 {
            disc.center = free_spot(disc.radius, &discs);
            transform.translation += disc.center - BESIDE;
        }
        discs.push(disc);
        boxes.extend(placed(&transform).iter().map(|(mesh, own)| world_bounds(mesh, own)));
        add(&mut scene, path, &things, &transform, MODEL_COLORS[i % MODEL_COLORS.len()]);
    }
    scene.eye = stepped_back(scene.eye, &boxes);

    let far = discs.iter().map(|d| d.center.length() + d.radius).fold(0.0, f64::max);
    let ground = ground(GROUND_SHARE * far, library)?;
    scene.objects.push(Object { name: new_name(&scene, "ground"), ..ground });
    Ok(scene)
}

/// A model's own floor lies so far above the ground, world units: in one plane, each would show through the other.
const MAT: f64 = 0.004;
/// A floor covers at least this part of what the model covers.
const FLOOR_SHARE: f64 = 0.1;

/// Whether a model that stands on the ground has triangles in the ground's plane that face up.
fn has_floor(meshes: &[(&Mesh, Similarity)], transform: &Similarity) -> bool {
    let mut floor = 0.0;
    for (mesh, own) in meshes {
        let all = own.then(transform);
        for corners in mesh.triangles() {
            let [a, b, c] = corners.map(|i| all.point(mesh.positions()[i as usize].as_dvec3()));
            if a.y.max(b.y).max(c.y) < MAT {
                floor += (0.5 * (b - a).cross(c - a).y).max(0.0);
            }
        }
    }
    let boxes: Vec<_> =
        meshes.iter().map(|(m, own)| world_bounds(m, &own.then(transform))).collect();
    let min = boxes.iter().fold(DVec3::INFINITY, |low, b| low.min(b.0));
    let max = boxes.iter().fold(DVec3::NEG_INFINITY, |high, b| high.max(b.1));
    floor > FLOOR_SHARE * (max.x - min.x) * (max.z - min.z)
}

/// The ground reaches so much farther than what stands on it.
const GROUND_SHARE: f64 = 2.0;
/// Length of two of its tiles, world units.
const GROUND_PERIOD: f64 = 0.5;

#[expect(clippy::cast_possible_truncation, reason = "a length in a pattern")]
fn narrow(x: f64) -> f32 {
    x as f32
}

/// The checkered ground, grown if it would end less than `radius` from the origin.
fn ground(radius: f64, library: &mut Library) -> Result<Object> {
    let found = library.shape("ground", None, |p, r| Error::input("ground", "", p, r))?;
    let extent = found.mesh.bounds().extent();
    let half = f64::from(extent.x.min(extent.z)) * 0.5;
    let transform = Similarity { scale: (radius / half).max(1.0), ..Similarity::IDENTITY };
    let colors = [Vec3::splat(0.72), Vec3::new(0.16, 0.17, 0.20)];
    let period = narrow(GROUND_PERIOD / transform.scale);
    let paint = Paint::Pattern { kind: PatternKind::Checker, colors, period };
    Ok(object(String::new(), found, transform, paint))
}

/// What a thing stands on: y is 0.
#[derive(Clone, Copy)]
struct Disc {
    center: DVec3,
    radius: f64,
}

impl Disc {
    fn around(things: &[(&Mesh, Similarity)]) -> Self {
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (min, max) = things.iter().fold(none, |(low, high), (mesh, transform)| {
            let (min, max) = world_bounds(mesh, transform);
            (low.min(min), high.max(max))
        });
        let flat = DVec3::new(1.0, 0.0, 1.0);
        Self { center: 0.5 * (min + max) * flat, radius: 0.5 * ((max - min) * flat).length() }
    }
}

/// The first place around the teapot where a disc touches no other: on rings from the inside out, on each
/// from the sides that the eye sees to the back, and not between eye and teapot.
fn free_spot(radius: f64, discs: &[Disc]) -> DVec3 {
    let to_eye = EYE.z.atan2(EYE.x);
    // Rings 0.15 apart, 16 places on each; the quarter towards the eye stays free. Discs of bounded size
    // leave room on some ring.
    (4..)
        .flat_map(|ring| (2..=14).map(move |step| (f64::from(ring) * 0.15, step)))
        .map(|(ring, step)| {
            // 2, 14, 3, 13, …: left and right in turn.
            let turn = if step % 2 == 0 { 1 + step / 2 } else { 15 - step / 2 };
            let angle = to_eye + TAU * f64::from(turn) / 16.0;
            DVec3::new(ring * angle.cos(), 0.0, ring * angle.sin())
        })
        .find(|&p| discs.iter().all(|d| (d.center - p).length() >= d.radius + radius))
        .unwrap_or(BESIDE)
}

/// Moves the eye back along its view until the boxes are in a picture of 4:3 or wider.
fn stepped_back(eye: EyeDescription, boxes: &[(DVec3, DVec3)]) -> EyeDescription {
    let forward = (eye.target - eye.position).normalize_or(DVec3::NEG_Z);
    let right = forward.cross(eye.up).normalize_or(DVec3::X);
    let up = right.cross(forward);
    let tan_y = (0.5 * eye.fov_y).tan();
    let tan_x = tan_y * 4.0 / 3.0;
    let distance = |&(min, max): &(DVec3, DVec3)| {
        let corner = |i: u32| {
            let side = |bit: u32, min: f64, max: f64| if i >> bit & 1 == 0 { min } else { max };
            let p = DVec3::new(side(0, min.x, max.x), side(1, min.y, max.y), side(2, min.z, max.z));
            let p = p - eye.target;
            (p.dot(right).abs() / tan_x).max(p.dot(up).abs() / tan_y) - p.dot(forward)
        };
        (0..8).map(corner).fold(0.0, f64::max)
    };
    let now = (eye.target - eye.position).length();
    let needed = boxes.iter().map(distance).fold(now, f64::max);
    EyeDescription { position: eye.target - forward * needed, ..eye }
}
