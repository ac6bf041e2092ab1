//! Squares for the direct view, and neighbours whose neighbours go.

use super::*;
use crate::geometry::Mesh;

#[test]
fn each_surfel_has_a_square_that_faces_along_its_normal() {
    let cx = Context::default();
    let mut points = of(noise(3_000));
    points.colors = (0..3_000).map(|i| Vec3::splat(unit32(i))).collect();
    let cloud = surfels(points, &CloudOptions::default(), &cx).unwrap();
    let mesh = disks(&cloud.surfels, usize::MAX, true, &cx).unwrap();
    let count = cloud.surfels.len();
    assert_eq!((mesh.triangles().len(), mesh.positions().len()), (2 * count, 4 * count));
    for t in 0..2 * count {
        let (i, [a, b, c]) = (t / 2, mesh.corners(t));
        assert!((b - a).cross(c - a).dot(cloud.surfels.normals[i]) > 0.0, "{t}");
        let corner = mesh.triangles()[t][0] as usize;
        assert_eq!(mesh.colors()[corner], cloud.surfels.albedo[i]);
        // The disk lies within: the sides are further from the middle than the extent.
        let square = &mesh.positions()[4 * i..4 * i + 4];
        for k in 0..4 {
            let side = (square[k] + square[(k + 1) % 4]) * 0.5 - cloud.surfels.position(i);
            assert!(side.length() > cloud.surfels.extent[i], "{t}");
        }
    }
    assert!(disks(&cloud.surfels, usize::MAX, false, &cx).unwrap().colors().is_empty());
}

#[expect(clippy::cast_possible_truncation, reason = "pixels")]
/// Part of the middle of the unit square that lies under no triangle.
fn bare(mesh: &Mesh) -> f64 {
    let mut side = vec![false; 400 * 400];
    let at = |v: f32| ((v - 0.1) * 500.0 - 0.5).clamp(0.0, 399.0);
    for square in mesh.positions().chunks(4) {
        let (low, high) =
            square.iter().fold((square[0], square[0]), |(l, h), p| (l.min(*p), h.max(*p)));
        for x in at(low.x).ceil() as usize..=at(high.x).floor() as usize {
            for z in at(low.z).ceil() as usize..=at(high.z).floor() as usize {
                let p = Vec3::new(x as f32 + 0.5, 0.0, z as f32 + 0.5) / 500.0
                    + Vec3::new(0.1, 0.0, 0.1);
                let inside = (0..4).all(|k| {
                    let edge = square[(k + 1) % 4] - square[k];
                    edge.cross(p - square[k]).y >= 0.0
                });
                side[x * 400 + z] |= inside;
            }
        }
    }
    side.iter().filter(|covered| !**covered).count() as f64 / side.len() as f64
}

#[test]
fn squares_leave_few_holes_however_many_there_are() {
    let cx = Context::default();
    let clouds = [made(&noise(400_000), 20_000), made(&noise(20_000), 20_000)];
    for (cloud, wanted) in clouds.iter().zip([3e-3, 8e-3]) {
        for most in [usize::MAX, 4_000] {
            let mesh = disks(&cloud.surfels, most, false, &cx).unwrap();
            assert!(mesh.positions().len() <= 4 * most.min(cloud.surfels.len()));
            let bare = bare(&mesh);
            println!("{wanted}, {most}: {bare} bare");
            assert!(bare < wanted, "{most}: {bare}");
        }
    }
    assert!(bare(&disks(&made(&noise(100), 100).surfels, 9, false, &cx).unwrap()) < 0.3);
}

#[test]
fn neighbours_that_go_are_replaced_by_those_that_stay() {
    let line: Vec<Vec3> = (0..10_u8).map(|i| Vec3::X * f32::from(i).powf(1.1)).collect();
    let mut near =
        Neighbors::find(&line, 3, Stage::new(&Context::default(), "x", 0.0, 1.0)).unwrap();
    assert_eq!((near.of(0), near.of(9)), (&[1, 2, 3][..], &[8, 7, 6][..]));
    near.keep(&[0, 3, 4, 5, 9]);
    // Of 1, 2 and 3 only 3 is left, and it is called 1 now; of 8, 7 and 6 nothing is.
    assert_eq!((near.of(0), near.of(4)), (&[1, 1, 1][..], &[4, 4, 4][..]));
    assert_eq!(near.of(2), [1, 3, 3]);
}
