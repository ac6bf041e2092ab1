//! Degenerate worlds, each with its defined result, by every way to draw it.
//!
//! | world | result |
//! |---|---|
//! | all surfels at one point, or on a line | the pixels where f64 finds their paths, and no others |
//! | surfels in the mirror's surface | seen where they are, or not at all (disks beyond the outline reach a few pixels in) |
//! | surfels behind the eye | reflected as any others |
//! | surfels behind a mirror, or within a closed one | not seen |
//! | a mirror behind the eye | the sky, to the bit |
//! | an object's triangles twice, slivers, points | as without them |
//! | a mirror's triangles twice, slivers, points | as without them; vertex searches refuse it |
//! | normals that point inwards | an object is seen all the same; a mirror reflects with both sides (vertex searches take it for a hollow one) |
//! | the eye within a closed mirror | hidden by it, as rays find |
//! | a mirror of one triangle, of a million | as rays see it |
//! | the eye on a vertex of a mirror, or of an object | what touches it is seen edge-on: not at all |
//!
//! In all of them every number is finite, and coverage is from 0 to 1.

mod meshes;
mod surfels;

use std::time::{Duration, Instant};

use catoptric::Context;
use catoptric::frame::Renderer;
use catoptric::geometry::Mesh;
use catoptric::image::{Picture, Planes, Reason};
use catoptric::methods::{Params, method};
use catoptric::paths::{PathFinder, PathOptions, PathScene};
use catoptric::scene::description::{Environment, EyeDescription, Scene};
use catoptric::scene::{GivenSurfels, PreparedScene};
use glam::{DVec2, DVec3, Vec3};

use super::{eye, looks, moved, near, scene, shape};

const SIZE: [u32; 2] = [320, 240];
const SKY: [f32; 3] = [0.4, 0.5, 0.6];
/// No frame here takes a tenth of it on a free machine.
const LIMIT: Duration = Duration::from_secs(20);

/// What is drawn of surfels.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Splat {
    /// Their triangles instead, if there are any.
    Triangles,
    /// Squares of so many pixels a side.
    Square(f64),
    /// Their disks.
    Disk,
}

/// A method with parameters.
struct Way {
    method: &'static str,
    settings: &'static [(&'static str, &'static str)],
    splat: Splat,
    /// Its rays are those of the triangles' cameras.
    cameras: bool,
}

const fn way(
    method: &'static str,
    settings: &'static [(&'static str, &'static str)],
    splat: Splat,
    cameras: bool,
) -> Way {
    Way { method, settings, splat, cameras }
}

const WAYS: [Way; 13] = [
    way("c3rc", &[], Splat::Disk, false),
    way("c3rc", &[("cameras", "cells")], Splat::Disk, false),
    way("c3rc", &[("cameras", "cells"), ("detail", "4")], Splat::Disk, false),
    way(
        "c3rc",
        &[("cameras", "triangles"), ("splat", "square2"), ("detail", "1")],
        Splat::Square(2.0),
        true,
    ),
    way(
        "c3rc",
        &[("cameras", "triangles"), ("splat", "square1"), ("detail", "0")],
        Splat::Square(1.0),
        true,
    ),
    way("c3rc", &[("splat", "square2"), ("detail", "0")], Splat::Square(2.0), false),
    way(
        "c3rc",
        &[
            ("cameras", "triangles"),
            ("test", "paper"),
            ("splat", "square1"),
            ("detail", "0"),
            ("depth", "push-back"),
            ("ray-scale", "unit"),
            ("roots", "first"),
            ("mirror-occlusion", "off"),
        ],
        Splat::Square(1.0),
        true,
    ),
    way("raytrace", &[("spp", "4")], Splat::Triangles, false),
    way("raytrace", &[("rays", "camera")], Splat::Triangles, true),
    way("estalella", &[("map-side", "128")], Splat::Triangles, false),
    way("estalella", &[("map-side", "128"), ("primitive", "points")], Splat::Square(2.0), false),
    way(
        "roger-holzschuch",
        &[("map-side", "128"), ("primitive", "points")],
        Splat::Square(2.0),
        false,
    ),
    way("environment", &[("cube-side", "64")], Splat::Triangles, false),
];

/// What a way drew.
type Drawn = (&'static Way, Picture, Planes);

/// What all ways drew that take the scene; each is sound.
fn drawn(scene: &PreparedScene) -> Vec<Drawn> {
    let list = drawn_by(scene, &WAYS);
    assert!(list.len() >= 9, "c3rc, rays and environment mapping take any mirror");
    list
}

fn drawn_by(scene: &PreparedScene, ways: &'static [Way]) -> Vec<Drawn> {
    let mut list = Vec::new();
    for way in ways {
        let method = method(way.method).unwrap();
        let mut params = Params::defaults(method.info().params);
        for (name, value) in way.settings {
            params.set(method.info().param(name), value).unwrap();
        }
        if let Err(refusal) = method.qualify(scene, &params) {
            // With what to do instead.
            assert!(refusal.to_string().contains("; "), "{refusal}");
            continue;
        }
        let mut renderer = Renderer::new();
        renderer.keep_bright();
        let start = Instant::now();
        let eye = eye(scene, SIZE[0], SIZE[1]);
        renderer.render(scene, &eye, method, &params, true, &Context::default()).unwrap();
        assert!(start.elapsed() < LIMIT, "{way:?} takes {:?}", start.elapsed());
        let (picture, planes) = (renderer.picture().clone(), renderer.planes().unwrap().clone());
        sound(way, &picture, &planes);
        list.push((way, picture, planes));
    }
    list
}

impl std::fmt::Debug for Way {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {:?}", self.method, self.settings)
    }
}

/// Nothing that is no number, nothing negative, nothing that contradicts itself.
fn sound(way: &Way, picture: &Picture, planes: &Planes) {
    let finite = |what: &str, list: &mut dyn Iterator<Item = f32>| {
        let bad = list.filter(|v| !v.is_finite()).count();
        assert_eq!(bad, 0, "{way:?}: {what}");
    };
    finite("picture", &mut picture.rgb.iter().flatten().copied());
    finite("radiance", &mut planes.radiance.iter().flatten().copied());
    finite("position", &mut planes.position.iter().flatten().copied());
    finite("normal", &mut planes.normal.iter().flatten().copied());
    finite("lambda", &mut planes.lambda.iter().copied());
    finite("splat", &mut planes.splat.iter().flatten().copied());
    finite("coverage", &mut planes.coverage.iter().copied());
    assert!(picture.rgb.iter().flatten().all(|v| *v >= 0.0), "{way:?}: negative light");
    assert!(planes.coverage.iter().all(|c| (0.0..=1.0 + 1e-5).contains(c)), "{way:?}: coverage");
    for i in 0..planes.reason.len() {
        let is_object = planes.reason[i] == Reason::Object as u32;
        let is_mirror = planes.reason[i] != Reason::NotMirror as u32;
        assert_eq!(planes.object[i] != u32::MAX, is_object, "{way:?}: pixel {i}");
        assert_eq!(planes.mirror[i] != u32::MAX, is_mirror, "{way:?}: pixel {i}");
        assert!(planes.coverage[i] == 0.0 || is_mirror, "{way:?}: pixel {i}");
    }
}

/// Surfels before a mirror, and the mirror alone for the finder of paths.
fn surfels(mirror: &Mesh, points: &[Vec3], eye: EyeDescription) -> (PreparedScene, Scene) {
    let normals: Vec<Vec3> = points.iter().map(|p| -p.normalize_or(Vec3::Z)).collect();
    let radiance = vec![Vec3::new(0.9, 0.1, 0.2); points.len()];
    let given = GivenSurfels { positions: points, normals: &normals, radiance: &radiance };
    let sky = Environment::Constant(Vec3::from_array(SKY));
    let prepared = PreparedScene::from_surfels(mirror.clone(), given, eye, sky).unwrap();
    (prepared, scene((mirror.clone().into(), moved(DVec3::ZERO)), Vec::new(), eye))
}

/// Where a point in the world is seen, pixels.
fn project(eye: &EyeDescription, point: DVec3) -> DVec2 {
    let forward = (eye.target - eye.position).try_normalize().unwrap();
    let right = forward.cross(eye.up).try_normalize().unwrap();
    let focal = 0.5 * f64::from(SIZE[1]) / (0.5 * eye.fov_y).tan();
    let p = point - eye.position;
    let px = DVec2::new(p.dot(right), -p.dot(right.cross(forward))) * (focal / p.dot(forward));
    px + 0.5 * DVec2::new(f64::from(SIZE[0]), f64::from(SIZE[1]))
}

/// Where f64 sees the points reflected.
fn found_px(scene: &Scene, points: &[Vec3], way: &Way) -> Vec<DVec2> {
    let paths = PathScene::new(scene);
    let ray_scale = if way.settings.contains(&("ray-scale", "unit")) {
        catoptric::camera::RayScale::Unit
    } else {
        catoptric::camera::RayScale::EyeDistance
    };
    let hides = !way.settings.contains(&("mirror-occlusion", "off"));
    let options = PathOptions { ray_scale, occlusion: hides, refine: !way.cameras };
    let finder = PathFinder::new(&paths, scene.eye.position, options).unwrap();
    let points: Vec<DVec3> = points.iter().map(|p| p.as_dvec3()).collect();
    let set = finder.find(&points, &Context::default()).unwrap();
    let seen = (0..points.len()).flat_map(|i| set.of(i).iter().filter(|p| !p.is_occluded()));
    seen.map(|path| project(&scene.eye, path.mirror_point)).collect()
}

fn centre(pixel: usize) -> DVec2 {
    let width = SIZE[0] as usize;
    DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5)
}

fn covered(planes: &Planes) -> Vec<usize> {
    (0..planes.coverage.len()).filter(|&i| planes.coverage[i] > 0.0).collect()
}

/// How far a disk, a square's corner, a facet instead of the smooth surface, reach beyond the pixel of a path.
fn reach(way: &Way) -> f64 {
    match way.splat {
        // Next to an edge the neighbour's camera draws the pixel.
        Splat::Square(side) => 0.5 * side + 1.0,
        Splat::Disk => 3.0,
        Splat::Triangles => 0.0,
    }
}

/// Every covered pixel shows a path, and every path a covered pixel.
fn assert_paths(name: &str, world: &(PreparedScene, Scene), points: &[Vec3], most: usize) {
    for (way, picture, planes) in drawn(&world.0) {
        let covered = covered(&planes);
        if way.splat == Splat::Triangles {
            assert!(covered.is_empty(), "{name}, {way:?}: there are no triangles");
            let mirrors = (0..planes.mirror.len()).filter(|&i| planes.mirror[i] == 0);
            assert!({ mirrors }.all(|i| near(&picture.rgb[i], &SKY, 1e-6)), "{name}, {way:?}");
            continue;
        }
        let expected = found_px(&world.1, points, way);
        assert!(!expected.is_empty(), "{name}: there is something to be seen");
        let apart = |a: DVec2, b: DVec2| (a - b).abs().max_element();
        let reach = reach(way);
        for &i in &covered {
            let near = expected.iter().map(|px| apart(*px, centre(i))).fold(f64::MAX, f64::min);
            assert!(near <= reach, "{name}, {way:?}: pixel {:?} is {near} off", centre(i));
        }
        let mirror = |px: DVec2| {
            let [x, y] = [px.x.floor(), px.y.floor()];
            let inside = x >= 0.0 && y >= 0.0 && x < f64::from(SIZE[0]) && y < f64::from(SIZE[1]);
            inside && planes.mirror[index(x, y)] == 0
        };
        let missed = { expected.iter() }
            .filter(|px| mirror(**px) && off_edges(**px))
            .filter(|px| !covered.iter().any(|&i| apart(**px, centre(i)) <= 1.5))
            .count();
        assert_eq!(missed, 0, "{name}, {way:?}: of {}", expected.len());
        let off = covered.iter().map(|&i| {
            let at = Vec3::from(planes.position[i]);
            points.iter().map(|p| p.distance(at)).fold(f32::MAX, f32::min)
        });
        assert!({ off }.fold(0.0, f32::max) < 2e-2, "{name}, {way:?}: it shows another place");
        assert!(covered.len() <= most, "{name}, {way:?}: {} pixels", covered.len());
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in the picture")]
fn index(x: f64, y: f64) -> usize {
    y as usize * SIZE[0] as usize + x as usize
}

/// Not where f32 may take it for the next pixel.
fn off_edges(px: DVec2) -> bool {
    (px - px.floor() - 0.5).abs().max_element() < 0.49
}

const EYE: DVec3 = DVec3::new(0.2, 0.5, 4.0);

fn ball() -> Mesh {
    (*shape("sphere", 2000)).clone()
}

fn line(from: Vec3, to: Vec3) -> Vec<Vec3> {
    (0..2000u16).map(|i| from.lerp(to, f32::from(i) / 1999.0)).collect()
}
