//! Raw points, without normals, look in a mirror as the mesh does that they were taken from.

use std::fmt::Write as _;

use catoptric::Context;
use catoptric::geometry::Similarity;
use catoptric::image::compare::{Set, Side, compare};
use catoptric::scene::arrange::{self, Request};
use catoptric::scene::sample::sample;
use glam::DVec3;

use super::{RED, looks, moved, object, prepared, rendered, rendered_with, scene, shape};

const SIZE: [u32; 2] = [960, 540];

#[test]
fn raw_points_look_as_their_mesh() {
    let cx = Context::default();
    let mesh = shape("knot", 20_000);
    let points = sample(&mesh, &RED, 100_000, 7, &cx).unwrap();
    let mut text = String::new();
    for i in 0..points.len() {
        let p = points.position(i);
        writeln!(text, "{} {} {}", p.x, p.y, p.z).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("knot.xyz");
    std::fs::write(&path, text).unwrap();
    let request = Request { objects: vec![path.to_str().unwrap().into()], ..Request::default() };
    let read = arrange::scene(&request, &cx).unwrap();
    assert!(read.notes[0].ends_with("a cloud of 100000 points; normals estimated"));

    let at = Similarity { scale: 0.25, ..moved(DVec3::new(0.9, 0.1, 1.1)) };
    let of_mesh = object("knot", mesh, at, RED);
    let mut of_points = read.objects[0].clone();
    (of_points.name, of_points.transform, of_points.paint) = ("knot".into(), at, RED);
    let ball = || (shape("sphere", 8000), moved(DVec3::ZERO));
    let eye = looks(DVec3::new(-0.8, 0.9, 3.0), DVec3::new(0.3, 0.0, 0.0));
    let with = |objects| prepared(&scene(ball(), objects, eye), 400_000);
    let [width, height] = SIZE;
    let many = [("spp", "64")];
    let truth = rendered_with(&with(vec![of_mesh]), "raytrace", &many, width, height);
    let cloud = rendered(&with(vec![of_points.clone()]), "c3rc", width, height);
    // Far below, it is as if it were not there.
    of_points.transform.translation.y = -1e4;
    let without = rendered(&with(vec![of_points]), "c3rc", width, height);
    let [cloud, without] = [cloud, without].map(|(picture, planes)| {
        let side = Side { picture: &picture, planes: Some(&planes) };
        let reference = Side { picture: &truth.0, planes: Some(&truth.1) };
        let found = compare(side, reference, &Set::Objects).unwrap();
        (found.flip, 1.0 - found.objects.unwrap().total.missing_share())
    });
    assert!(cloud.0 <= 0.10 && cloud.1 >= 0.995, "FLIP {}, coverage {}", cloud.0, cloud.1);
    assert!(without.0 > 0.3 && without.1 < 0.5, "FLIP {}, coverage {}", without.0, without.1);
}
