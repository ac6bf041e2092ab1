//! What mirrors hide from each other and from themselves, against traced rays.

use catoptric::scene::PreparedScene;
use catoptric::scene::description::Mirror;
use glam::{DVec3, Vec3};

use super::{RED, looks, moved, object, prepared, rendered_with, scene, shape};

const SIZE: [u32; 2] = [320, 180];

/// Which pixels objects cover at least half of.
fn covered(scene: &PreparedScene, id: &str, settings: &[(&str, &str)]) -> Vec<bool> {
    let (_, planes) = rendered_with(scene, id, settings, SIZE[0], SIZE[1]);
    planes.coverage.iter().map(|&c| c >= 0.5).collect()
}

fn differ(a: &[bool], b: &[bool]) -> usize {
    a.iter().zip(b).filter(|(a, b)| a != b).count()
}

/// A ball before a plane mirror, and between them, as the mirror sees it, a smaller mirror.
fn two_mirrors() -> PreparedScene {
    let plane = (shape("plane", 200), moved(DVec3::ZERO));
    let eye = looks(DVec3::new(1.4, 0.4, 3.4), DVec3::new(0.0, 0.0, 0.0));
    let ball = object("ball", shape("sphere", 2000), moved(DVec3::new(-1.1, -0.2, 2.6)), RED);
    let mut scene = scene(plane, vec![ball], eye);
    scene.mirrors.push(Mirror {
        name: "small".into(),
        mesh: shape("torus", 2000),
        source: None,
        transform: moved(DVec3::new(-0.6, -0.1, 1.2)),
        tint: Vec3::ONE,
        proxy: None,
    });
    prepared(&scene, 200_000)
}

/// A knot in a bowl, whose wall hides it from parts of itself.
fn bowl() -> PreparedScene {
    let eye = looks(DVec3::new(0.0, 2.2, 0.6), DVec3::new(0.0, 0.2, 0.0));
    let mut knot = object("knot", shape("knot", 20_000), moved(DVec3::new(0.1, 0.5, 0.1)), RED);
    knot.transform.scale = 0.12;
    prepared(&scene((shape("bowl", 8000), moved(DVec3::ZERO)), vec![knot], eye), 200_000)
}

#[test]
fn mirrors_hide_what_rays_do_not_reach() {
    for (name, scene) in [("two mirrors", two_mirrors()), ("bowl", bowl())] {
        let truth = covered(&scene, "raytrace", &[("mirror-occlusion", "on")]);
        let through = covered(&scene, "raytrace", &[("mirror-occlusion", "off")]);
        let hidden = differ(&truth, &through);
        assert!(hidden > 50, "{name}: only {hidden} pixels differ");
        let cells = [("cameras", "cells"), ("splat", "ellipse"), ("detail", "1")];
        let squares = [("cameras", "triangles"), ("splat", "square2"), ("detail", "0")];
        for settings in [cells, squares] {
            let off = [&settings[..], &[("mirror-occlusion", "off")]].concat();
            let without = covered(&scene, "c3rc", &off);
            // Outlines differ by some pixels anyway.
            let outlines = differ(&without, &through);
            let wrong = differ(&covered(&scene, "c3rc", &settings), &truth);
            println!("{name}: {hidden} hidden, {outlines} and {wrong} differ, {settings:?}");
            assert!(wrong < outlines + hidden / 4, "{name}, {settings:?}: {wrong}, {outlines}");
            let shown = differ(&without, &truth);
            assert!(shown > outlines + hidden / 2, "{name}, {settings:?}: only {shown} shown");
        }
    }
}
