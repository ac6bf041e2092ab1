//! Triangles and normals as no mesh should have them, and eyes where none should be.

use super::super::{BLUE, GREY, RED, object, prepared};
use super::*;

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
    for (name, mirror, ways) in [("one", one, &WAYS[..]), ("a million", million, &WAYS[3..9])] {
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
