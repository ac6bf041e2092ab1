//! What the built-in scenes promise, read from their text.

use glam::{DQuat, DVec3};
use toml::{Table, Value};

use super::*;
use crate::geometry::{Aabb, Similarity};

fn scene(name: &str) -> Table {
    scene_text(name).unwrap().parse().unwrap()
}

fn things<'a>(scene: &'a Table, kind: &str) -> Vec<&'a Table> {
    let list = scene.get(kind).and_then(Value::as_array);
    list.into_iter().flatten().map(|thing| thing.as_table().unwrap()).collect()
}

fn text<'a>(thing: &'a Table, key: &str) -> &'a str {
    thing[key].as_str().unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_float().or(value.as_integer().map(|i| i as f64)).unwrap()
}

fn vector(value: &Value) -> DVec3 {
    let list = value.as_array().unwrap();
    assert_eq!(list.len(), 3);
    DVec3::new(number(&list[0]), number(&list[1]), number(&list[2]))
}

fn named<'a>(scene: &'a Table, kind: &str, name: &str) -> &'a Table {
    things(scene, kind).into_iter().find(|thing| text(thing, "name") == name).unwrap()
}

fn mesh_of(thing: &Table) -> Mesh {
    let triangles =
        thing.get("triangles").map(|n| usize::try_from(n.as_integer().unwrap()).unwrap());
    shape(text(thing, "shape"), triangles).unwrap()
}

fn placement(thing: &Table, mesh: &Mesh) -> Similarity {
    let turn = |r: &Value| {
        let axis = vector(&r["axis"]).try_normalize().unwrap();
        DQuat::from_axis_angle(axis, number(&r["angle"]).to_radians())
    };
    let rotation = thing.get("rotate_deg").map_or(DQuat::IDENTITY, turn);
    let Some(fit) = thing.get("fit") else {
        let scale = thing.get("scale").map_or(1.0, number);
        let translation = thing.get("translate").map_or(DVec3::ZERO, vector);
        return Similarity { rotation, translation, scale };
    };
    assert!(!thing.contains_key("scale") && !thing.contains_key("translate"));
    let turned = mesh.positions().iter().map(|p| (rotation * p.as_dvec3()).as_vec3());
    let bounds = Aabb::of(turned);
    let scale = number(&fit["diagonal"]) / f64::from(bounds.diagonal());
    let (middle, low) = (bounds.center(), bounds.min.y);
    let from = DVec3::new(middle.x.into(), low.into(), middle.z.into());
    Similarity { rotation, translation: vector(&fit["base"]) - from * scale, scale }
}

/// The teapot's triangles in the world.
fn teapot(scene: &Table) -> Vec<[DVec3; 3]> {
    let mirror = named(scene, "mirror", "teapot");
    let mesh = mesh_of(mirror);
    let place = placement(mirror, &mesh);
    (0..mesh.triangles().len())
        .map(|t| mesh.corners(t).map(|p| place.point(p.as_dvec3())))
        .collect()
}

/// Nearest distance of a point to triangles, negative behind them (where the nearest point is in a face).
fn signed_distance(point: DVec3, triangles: &[[DVec3; 3]]) -> f64 {
    let mut best = f64::INFINITY;
    for &[a, b, c] in triangles {
        let normal = (b - a).cross(c - a).try_normalize().unwrap();
        let above = (point - a).dot(normal);
        let foot = point - normal * above;
        let inside = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|&(p, q)| (q - p).cross(foot - p).dot(normal) >= 0.0);
        let edge = |p: DVec3, q: DVec3| {
            let along = ((point - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
            point.distance(p + (q - p) * along)
        };
        let distance =
            if inside { above } else { edge(a, b).min(edge(b, c)).min(edge(c, a)).copysign(above) };
        if distance.abs() < best.abs() {
            best = distance;
        }
    }
    best
}

#[test]
fn scenes_are_sound() {
    for &name in SCENES {
        let scene = scene(name);
        assert_eq!(text(&scene, "name"), name);
        let all = [things(&scene, "mirror"), things(&scene, "object")].concat();
        let mut names: Vec<_> = all.iter().map(|thing| text(thing, "name")).collect();
        names.sort_unstable();
        let count = names.len();
        names.dedup();
        assert_eq!(names.len(), count, "{name}: two things have one name");
        for thing in all {
            let place = placement(thing, &mesh_of(thing));
            assert!(place.scale > 0.0 && place.translation.is_finite(), "{thing}");
        }
    }
}

#[test]
fn the_default_scene_has_a_touching_and_a_piercing_thing() {
    let scene = scene("default");
    let teapot = teapot(&scene);
    let ball = named(&scene, "object", "touching ball");
    let place = placement(ball, &mesh_of(ball));
    let gap = signed_distance(place.translation, &teapot) - place.scale;
    assert!(gap.abs() < 2e-5, "{gap}");

    let ring = named(&scene, "object", "piercing ring");
    let mesh = mesh_of(ring);
    let place = placement(ring, &mesh);
    let points = mesh.positions().iter().step_by(29).map(|p| place.point(p.as_dvec3()));
    let distances: Vec<f64> = points.map(|p| signed_distance(p, &teapot)).collect();
    let share = |test: fn(f64) -> bool| {
        distances.iter().filter(|&&d| test(d)).count() as f64 / distances.len() as f64
    };
    assert!(share(|d| d < -0.01) > 0.03 && share(|d| d > 0.01) > 0.5, "{:?}", distances);
}

#[test]
fn the_default_grounds_tiles_continue_each_other() {
    const TILE: f64 = 0.375;
    let scene = scene("default");
    let ground = things(&scene, "object").into_iter().filter(|o| text(o, "shape") == "ground");
    let mut area = 0.0;
    for square in ground {
        let place = placement(square, &mesh_of(square));
        let period = number(&square["pattern"]["period"]) * place.scale;
        assert!((period / TILE - 1.0).abs() < 1e-7, "{square}");
        let tiles = place.translation / TILE;
        assert!(tiles.y == 0.0 && (tiles.x + tiles.z) % 2.0 == 0.0, "{square}");
        assert!(tiles == tiles.round(), "{square}");
        area += place.scale * place.scale;
    }
    // Rings of three times three squares: what they cover is covered once.
    assert_eq!(area, 81.0 * 81.0);
}

#[test]
fn the_room_is_full_and_its_walls_are_plain() {
    let scene = scene("room");
    let objects = things(&scene, "object");
    let is_wall = |o: &&Table| ["plane", "ground"].contains(&text(o, "shape"));
    let (walls, others): (Vec<_>, Vec<_>) = objects.into_iter().partition(is_wall);
    assert!(others.len() >= 20, "{}", others.len());
    assert!(walls.iter().all(|wall| mesh_of(wall).triangles().len() == 2));
    let eye = vector(&scene["eye"]["position"]);
    let behind = others.iter().filter(|o| {
        let base = vector(&o["fit"]["base"]);
        base.z > 1.0 && base.distance(eye) < 3.0
    });
    assert!(behind.count() >= 5);
    for wall in walls {
        let mesh = mesh_of(wall);
        let place = placement(wall, &mesh);
        let inward = place.direction(mesh.normals()[0].as_dvec3());
        for point in [eye, DVec3::ZERO] {
            let from = place.point(mesh.positions()[0].as_dvec3());
            assert!((point - from).dot(inward) > -1e-5, "{wall} faces outward");
        }
    }
}

#[test]
fn the_knot_is_as_dense_as_a_scan() {
    let scene = scene("knot");
    let count = mesh_of(named(&scene, "object", "knot")).triangles().len();
    assert!(count.abs_diff(871_414) < 100, "{count}");
}
