//! Reflectors from meshes: which qualify, and whether vertices are found on them.

use glam::{DVec3, Vec3};

use super::bend::bend;
use super::center::center;
use super::grid::grid;
use super::maps::surface;
use super::parts::Shape;
use crate::camera::reflector::exact::Surface;
use crate::camera::reflector::tests::{ELLIPSOID, SPHERE, apart_px, cases};
use crate::camera::reflector::{ReflectorMap, estalella, roger};
use crate::geometry::Mesh;
use crate::plan::search::Bend;
use crate::scene::builtin;

fn corners(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    (0..mesh.triangles().len()).map(|t| mesh.corners(t)).collect()
}

#[test]
fn star_shapes_have_a_centre() {
    for (name, inward) in [
        ("sphere", false),
        ("ellipsoid", false),
        ("cube", false),
        ("cylinder", false),
        ("cone", false),
        ("plane", false),
        ("wave", false),
        ("bowl", true),
    ] {
        let mesh = builtin::shape(name, None).unwrap();
        let found = center(&corners(&mesh)).unwrap_or_else(|| panic!("{name} is star-shaped"));
        assert_eq!(found.inward, inward, "{name}");
        for triangle in corners(&mesh) {
            let [a, b, c] = triangle.map(|p| p.as_dvec3());
            let normal = (b - a).cross(c - a);
            let side = normal.dot(a - found.point);
            assert!(if inward { side < 0.0 } else { side > 0.0 }, "{name}: {triangle:?}");
        }
    }
    for name in ["torus", "knot", "goblet", "teapot"] {
        let mesh = builtin::shape(name, None).unwrap();
        assert_eq!(center(&corners(&mesh)), None, "{name}");
    }
    assert_eq!(center(&[]), None);
}

#[test]
fn surfaces_are_convex_concave_or_both() {
    for (name, expected) in [
        ("sphere", Bend::Convex),
        ("ellipsoid", Bend::Convex),
        ("cube", Bend::Faceted),
        ("plane", Bend::Flat),
        ("bowl", Bend::Concave),
        ("wave", Bend::Mixed),
        ("torus", Bend::Mixed),
        ("goblet", Bend::Mixed),
    ] {
        let mesh = builtin::shape(name, None).unwrap();
        let normals: Vec<[Vec3; 3]> =
            mesh.triangles().iter().map(|t| t.map(|i| mesh.normals()[i as usize])).collect();
        assert_eq!(bend(&corners(&mesh), &normals), expected, "{name}");
    }
}

#[test]
fn the_teapot_comes_in_parts() {
    for wanted in [None, Some(2_000), Some(50_000)] {
        let mesh = builtin::shape("teapot", wanted).unwrap();
        let parts = builtin::parts("teapot", wanted);
        let names: Vec<&str> = parts.iter().map(|p| p.0).collect();
        assert_eq!(names, ["rim", "body", "lid", "handle", "spout"]);
        assert_eq!(parts[0].1.start, 0);
        assert!(parts.windows(2).all(|p| p[0].1.end == p[1].1.start));
        assert_eq!(parts[4].1.end, mesh.triangles().len(), "nothing is left over");
        let all = corners(&mesh);
        // The spout is on the one side, the handle on the other; the lid is on top.
        let mean = |k: usize| {
            let own = &all[parts[k].1.clone()];
            own.iter().flatten().sum::<Vec3>() / (3 * own.len()) as f32
        };
        assert!(mean(4).x < -2.0 && mean(3).x > 2.0 && mean(2).y > 2.4, "{wanted:?}");
        assert!(center(&all[parts[1].1.clone()]).is_some(), "the body is star-shaped");
        assert_eq!(center(&all[parts[3].1.clone()]), None, "the handle is not");
    }
}

/// A sphere's grid on another star-shaped surface, with that one's normals.
fn mesh_of(exact: Surface, triangles: usize) -> Mesh {
    let sphere = builtin::shape("sphere", Some(triangles)).unwrap();
    let place = |p: &Vec3| {
        let u = p.as_dvec3().normalize_or(DVec3::Z);
        u * exact.radius(u)
    };
    let points: Vec<DVec3> = sphere.positions().iter().map(place).collect();
    Mesh::new(
        points.iter().map(|p| p.as_vec3()).collect(),
        points.iter().map(|&p| exact.normal(p).as_vec3()).collect(),
        Vec::new(),
        sphere.triangles().to_vec(),
    )
    .unwrap()
}

/// The bars of the exact maps hold for maps from meshes, too.
#[test]
fn vertices_are_found_on_maps_of_meshes() {
    const SIDE: u32 = 256;
    for (exact, bars) in
        [(SPHERE, [2.0, 0.05]), (ELLIPSOID, [3.0, 0.2]), (Surface::Bumpy(0.02), [3.0, 0.2])]
    {
        let mesh = mesh_of(exact, 250_000);
        let corners = corners(&mesh);
        let normal = |i: u32| mesh.normals()[i as usize];
        let found = center(&corners).expect("it is star-shaped");
        assert!(found.point.length() < 0.5 && !found.inward, "{found:?}");
        let shape = Shape {
            name: "test".into(),
            triangles: 0..0,
            center: found,
            bend: Bend::Convex,
            normals: mesh.triangles().iter().map(|t| t.map(normal)).collect(),
            corners,
        };
        let middle = found.point.as_vec3();
        let map = ReflectorMap::new(SIDE, &surface(&shape, middle, SIDE), false);
        let cases = cases(exact, 5_000);
        let mut errors = [Vec::new(), Vec::new()];
        for case in &cases {
            let (eye, vertex) = (case.eye.as_vec3() - middle, case.vertex.as_vec3() - middle);
            let ends = estalella::Ends { iterations: 9, epsilon: 0.0 };
            let a = estalella::search(&map, eye, vertex, false, ends);
            let b = roger::search(&map, eye, vertex, roger::Ends { iterations: 20, angle: 1e-5 });
            for (errors, found) in errors.iter_mut().zip([a, b]) {
                errors.push(apart_px(case.eye, case.exact, (found.point + middle).as_dvec3()));
            }
        }
        for (errors, bar) in errors.iter_mut().zip(bars) {
            errors.sort_by(f64::total_cmp);
            let p99 = errors[errors.len() * 99 / 100];
            eprintln!("{exact:?} as a mesh: p99 {p99:.4} px, bar {bar}");
            assert!(p99 <= bar, "{exact:?}: {p99} px, not {bar}");
        }
    }
}

#[test]
fn a_grid_gives_its_vertices_back() {
    let mesh = builtin::shape("knot", Some(20_000)).unwrap();
    for share in [0.041, 0.096, 0.5] {
        let grid = grid(mesh.positions(), share);
        assert_eq!(grid.vertices.len(), mesh.positions().len());
        let mut cells: Vec<[u32; 8]> = grid.vertices.iter().map(|v| v.0).collect();
        cells.sort_unstable();
        cells.dedup();
        // Only cells with a vertex: fewer than the whole box has.
        let all = mesh.positions().len() as f64 * share;
        assert!((cells.len() as f64) < all && cells.len() > 20, "{} of {all}", cells.len());
        for (vertex, (corners, [x, y, z])) in mesh.positions().iter().zip(&grid.vertices) {
            let at = (0..8).map(|k: usize| {
                let along = |bit: usize, t: f32| if k >> bit & 1 == 1 { t } else { 1.0 - t };
                grid.corners[corners[k] as usize] * along(0, *x) * along(1, *y) * along(2, *z)
            });
            assert!(at.sum::<Vec3>().distance(*vertex) < 1e-4);
        }
    }
    assert!(grid(&[], 0.1).corners.is_empty());
    assert_eq!(grid(&[Vec3::ONE; 5], 0.1).vertices.len(), 5, "all in one point");
}
