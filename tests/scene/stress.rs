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

use super::{BLUE, GREY, RED, eye, looks, moved, object, prepared, scene, shape};

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

const WAYS: [Way; 12] = [
    way("c3rc", &[], Splat::Disk, false),
    way("c3rc", &[("detail", "4")], Splat::Disk, false),
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
            assert!(
                { mirrors }.all(|i| super::near(&picture.rgb[i], &SKY, 1e-6)),
                "{name}, {way:?}"
            );
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
            let inside = x >= 0.0 && y >= 0.0 && x < SIZE[0].into() && y < SIZE[1].into();
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

#[test]
fn surfels_at_one_point() {
    for point in [Vec3::new(1.2, 0.3, 1.5), Vec3::new(-0.4, 2.0, 0.3)] {
        let points = vec![point; 2000];
        let world = surfels(&ball(), &points, looks(EYE, DVec3::ZERO));
        assert_paths("one point", &world, &points, 40);
    }
    // One surfel is as many.
    let points = [Vec3::new(1.2, 0.3, 1.5)];
    let world = surfels(&ball(), &points, looks(EYE, DVec3::ZERO));
    assert_paths("one surfel", &world, &points, 40);
}

#[test]
fn surfels_on_a_line() {
    for (name, points) in [
        ("across", line(Vec3::new(-1.5, 0.2, 1.2), Vec3::new(1.5, 0.4, 1.4))),
        ("along an axis", line(Vec3::new(0.7, -2.0, 1.0), Vec3::new(0.7, 2.0, 1.0))),
        ("out of the mirror", line(Vec3::new(0.1, 0.1, 0.2), Vec3::new(0.5, 0.8, 2.5))),
    ] {
        let world = surfels(&ball(), &points, looks(EYE, DVec3::ZERO));
        assert_paths(name, &world, &points, 2500);
    }
}

#[test]
fn surfels_in_the_mirror() {
    let mesh = ball();
    let middles = mesh.triangles().iter().map(|t| {
        let [a, b, c] = t.map(|i| mesh.positions()[i as usize]);
        (a + b + c) / 3.0
    });
    let points: Vec<Vec3> = mesh.positions().iter().copied().chain(middles).collect();
    let eye = looks(EYE, DVec3::ZERO);
    let (prepared, _) = surfels(&mesh, &points, eye);
    for (way, _, planes) in drawn(&prepared) {
        let covered = covered(&planes);
        let off = covered.iter().map(|&i| {
            let at = Vec3::from(planes.position[i]).as_dvec3();
            (project(&eye, at) - centre(i)).abs().max_element()
        });
        let disks = way.splat == Splat::Disk;
        let far = off.filter(|off| *off > if disks { 6.0 } else { 2.0 }).count();
        // Along the outline disks reach in that lie beyond it.
        assert!(
            far <= if disks { covered.len() / 15 } else { 0 },
            "{way:?}: {far} of {} pixels show another place",
            covered.len()
        );
    }
}

#[test]
fn surfels_behind_the_eye() {
    for point in [Vec3::new(0.9, 0.6, 6.0), Vec3::new(-2.0, 1.0, 40.0)] {
        let points = vec![point; 500];
        let world = surfels(&ball(), &points, looks(EYE, DVec3::ZERO));
        assert_paths("behind the eye", &world, &points, 40);
    }
}

#[test]
fn what_no_ray_reaches() {
    let eye = looks(DVec3::new(0.3, 0.2, 3.0), DVec3::ZERO);
    let behind = line(Vec3::new(-0.5, 0.1, -0.3), Vec3::new(0.5, -0.2, -2.0));
    let inside = line(Vec3::new(-0.4, 0.0, 0.1), Vec3::new(0.4, 0.2, 0.3));
    let away = looks(DVec3::new(0.3, 0.2, 3.0), DVec3::new(0.3, 0.2, 9.0));
    let front = line(Vec3::new(-0.5, 0.1, 1.0), Vec3::new(0.5, -0.2, 2.0));
    let plane = (*shape("plane", 200)).clone();
    for (name, mirror, points, eye) in [
        ("behind a plane", &plane, &behind, eye),
        ("within a ball", &ball(), &inside, eye),
        ("a mirror behind the eye", &ball(), &front, away),
    ] {
        for (way, picture, planes) in drawn(&surfels(mirror, points, eye).0) {
            assert_eq!(covered(&planes), [], "{name}, {way:?}");
            assert!(picture.rgb.iter().all(|c| super::near(c, &SKY, 1e-6)), "{name}, {way:?}");
            let seen = planes.mirror.iter().filter(|&&m| m == 0).count();
            assert_eq!(seen > 0, name != "a mirror behind the eye", "{name}");
        }
    }
}

/// A mesh with every triangle twice, every third once more the other way round, and triangles without area: points,
/// sides there and back, and one of no width.
fn degenerate(mesh: &Mesh) -> Mesh {
    let mut triangles = mesh.triangles().to_vec();
    triangles.extend_from_slice(mesh.triangles());
    let sides = mesh.triangles().iter().step_by(3);
    triangles.extend(sides.clone().map(|&[a, b, _]| [a, b, a]));
    triangles.extend(sides.clone().map(|&[a, _, _]| [a; 3]));
    let (mut positions, mut normals) = (mesh.positions().to_vec(), mesh.normals().to_vec());
    for &[a, b, _] in sides {
        // The middle of a side, up to a rounding.
        let at = u32::try_from(positions.len()).unwrap();
        positions.push((positions[a as usize] + positions[b as usize]) * 0.5);
        normals.push((normals[a as usize] + normals[b as usize]).normalize_or(Vec3::Y));
        triangles.push([a, b, at]);
    }
    Mesh::new(positions, normals, Vec::new(), triangles).unwrap()
}

/// A ball beside a mirror.
fn pair(mirror: Mesh, ball: Mesh) -> Scene {
    let place = |at: DVec3, scale: f64| catoptric::geometry::Similarity { scale, ..moved(at) };
    let objects = vec![
        object("ball", ball.into(), place(DVec3::new(1.4, 0.2, 1.2), 0.6), RED),
        object("cube", shape("cube", 12), place(DVec3::new(-1.5, -0.2, 1.0), 0.5), BLUE),
        object("ground", shape("ground", 200), place(DVec3::Y * -1.05, 1.0), GREY),
    ];
    scene((mirror.into(), moved(DVec3::ZERO)), objects, looks(EYE, DVec3::ZERO))
}

/// Share of the mirror's pixels that objects cover half of, and not the same ones.
fn other_objects(a: &Planes, b: &Planes) -> f64 {
    let mirrors: Vec<usize> = (0..a.mirror.len()).filter(|&i| a.mirror[i] == 0).collect();
    let shown = |p: &Planes, i: usize| if p.coverage[i] >= 0.5 { p.object[i] } else { u32::MAX };
    let other = mirrors.iter().filter(|&&i| shown(a, i) != shown(b, i)).count();
    other as f64 / mirrors.len().max(1) as f64
}

fn flipped(mesh: &Mesh, winding: bool) -> Mesh {
    let normals = mesh.normals().iter().map(|n| -*n).collect();
    let turned = |&[a, b, c]: &[u32; 3]| if winding { [a, c, b] } else { [a, b, c] };
    let triangles = mesh.triangles().iter().map(turned).collect();
    Mesh::new(mesh.positions().to_vec(), normals, Vec::new(), triangles).unwrap()
}

/// By all ways but the vertex searches, if those are another matter.
fn assert_alike(name: &str, clean: &Scene, other: &Scene, searches: bool) {
    let (clean, other) = (prepared(clean, 60_000), prepared(other, 60_000));
    let other = drawn(&other);
    for (way, _, planes) in drawn(&clean) {
        let Some((_, _, found)) = other.iter().find(|o| std::ptr::eq(o.0, way)) else {
            assert!(searched(way), "{name}, {way:?} is refused");
            continue;
        };
        let share = other_objects(&planes, found);
        assert!(share <= 0.02 || searched(way) && !searches, "{name}, {way:?}: {share}");
    }
}

fn searched(way: &Way) -> bool {
    ["estalella", "roger-holzschuch"].contains(&way.method)
}

#[test]
fn triangles_twice_and_without_area() {
    let (mirror, object) = (ball(), (*shape("sphere", 1000)).clone());
    let clean = pair(mirror.clone(), object.clone());
    assert_alike("object", &clean, &pair(mirror.clone(), degenerate(&object)), true);
    assert_alike("mirror", &clean, &pair(degenerate(&mirror), object.clone()), true);
}

#[test]
fn normals_that_point_inwards() {
    let (mirror, object) = (ball(), (*shape("sphere", 1000)).clone());
    let clean = pair(mirror.clone(), object.clone());
    for winding in [false, true] {
        assert_alike("object", &clean, &pair(mirror.clone(), flipped(&object, winding)), true);
        assert_alike("mirror", &clean, &pair(flipped(&mirror, winding), object.clone()), false);
    }
}

#[test]
fn mirrors_of_one_triangle_and_of_a_million() {
    let corners = [Vec3::new(-1.2, -0.9, 0.0), Vec3::new(1.3, -0.8, 0.0), Vec3::new(0.1, 1.2, 0.1)];
    let one = Mesh::new(corners.to_vec(), Vec::new(), Vec::new(), vec![[0, 1, 2]]).unwrap();
    let million = (*shape("sphere", 1_000_000)).clone();
    assert!(million.triangles().len() > 900_000);
    // Searches make their maps for seconds.
    for (name, mirror, ways) in [("one", one, &WAYS[..]), ("a million", million, &WAYS[2..8])] {
        let scene = prepared(&pair(mirror, (*shape("sphere", 1000)).clone()), 60_000);
        let all = drawn_by(&scene, ways);
        let truth = &all.iter().find(|(way, ..)| way.method == "raytrace").unwrap().2;
        for (way, _, planes) in &all {
            let share = other_objects(truth, planes);
            // Its box test misses some.
            let paper = way.settings.contains(&("test", "paper"));
            assert!(share < if paper { 0.1 } else { 0.03 }, "{name}, {way:?}: {share}");
        }
    }
}

#[test]
fn the_eye_on_a_vertex() {
    let mesh = ball();
    let top = mesh.positions().iter().copied().max_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
    let mut wrong = String::new();
    for (name, mirror, at, towards, mirror_pixels) in [
        ("of a ball, outwards", mesh.clone(), top, top * 3.0, false),
        ("of a ball, inwards", mesh.clone(), top, Vec3::ZERO, true),
        ("of a ball, along it", mesh.clone(), top, top + Vec3::X, true),
        ("of a plane, outwards", (*shape("plane", 200)).clone(), Vec3::ZERO, Vec3::Z, false),
        ("of a plane, along it", (*shape("plane", 200)).clone(), Vec3::ZERO, Vec3::X, false),
        ("of a bowl", (*shape("bowl", 2000)).clone(), Vec3::ZERO, Vec3::new(1.0, 0.6, 0.1), true),
    ] {
        let nearer = |a: &Vec3, b: &Vec3| a.distance(at).total_cmp(&b.distance(at));
        let at = mirror.positions().iter().copied().min_by(nearer).unwrap();
        let mut world = pair(mirror, (*shape("sphere", 1000)).clone());
        world.eye = looks(at.as_dvec3(), towards.as_dvec3());
        let all = drawn(&prepared(&world, 60_000));
        let truth = &all.iter().find(|(way, ..)| way.method == "raytrace").unwrap().2;
        let seen = truth.mirror.iter().filter(|&&m| m == 0).count();
        assert_eq!(seen > 0, mirror_pixels, "{name}: {seen} pixels");
        for (way, _, planes) in &all {
            let share = other_objects(truth, planes);
            assert_eq!(planes.mirror, truth.mirror, "{name}, {way:?}");
            // Squares of the mirror's surfels leave some pixels open: they are few.
            let most = if way.splat == Splat::Disk { 0.02 } else { 0.06 };
            let hides = !way.settings.contains(&("mirror-occlusion", "off"));
            if way.method == "c3rc" && hides && share >= most {
                wrong += &format!("{name}, {way:?}: {share}\n");
            }
        }
    }
    assert_eq!(wrong, "", "share of what rays do not see");
    // Of an object: seen directly, and reflected.
    let mut world = pair(mesh, (*shape("sphere", 1000)).clone());
    let corner = world.objects[1].mesh.positions()[0].as_dvec3();
    world.eye = looks(world.objects[1].transform.point(corner), DVec3::ZERO);
    let all = drawn(&prepared(&world, 60_000));
    assert!(all[0].2.mirror.contains(&0), "the mirror is seen");
}

/// The device draws degenerate worlds as the CPU does.
#[cfg(feature = "gpu")]
#[test]
fn on_the_gpu() {
    use catoptric::backend::gpu::{Gpu, Options};
    let one = vec![Vec3::new(1.2, 0.3, 1.5); 500];
    let thin = line(Vec3::new(-1.5, 0.2, 1.2), Vec3::new(1.5, 0.4, 1.4));
    for points in [one, thin] {
        let (scene, _) = surfels(&ball(), &points, looks(EYE, DVec3::ZERO));
        let ways = &WAYS[..4];
        for (way, _, cpu) in drawn_by(&scene, ways) {
            let gpu = match Gpu::new(Options::default()) {
                Ok(gpu) => gpu,
                Err(error) => {
                    let required = std::env::var("CATOPTRIC_REQUIRE_GPU").is_ok_and(|v| v == "1");
                    assert!(!required, "{error}");
                    return;
                }
            };
            let c3rc = method(way.method).unwrap();
            let mut params = Params::defaults(c3rc.info().params);
            for (name, value) in way.settings {
                params.set(c3rc.info().param(name), value).unwrap();
            }
            let mut renderer = Renderer::on(Box::new(gpu));
            let eye = eye(&scene, SIZE[0], SIZE[1]);
            renderer.render(&scene, &eye, c3rc, &params, true, &Context::default()).unwrap();
            let planes = renderer.planes().unwrap();
            sound(way, renderer.picture(), planes);
            let all = cpu.coverage.iter().zip(&planes.coverage);
            let apart = all.filter(|(a, b)| (*a - *b).abs() > 0.02).count();
            assert!(apart <= covered(&cpu).len() / 20, "{way:?}: {apart} pixels differ");
        }
    }
}
