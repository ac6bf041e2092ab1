//! One shading for everything: an object has the same colour seen directly and in a mirror.

use catoptric::geometry::Similarity;
use catoptric::image::Reason;
use catoptric::scene::description::Scene;
use glam::DVec3;

use super::{
    BLUE, GREY, RED, looks, moved, near, object, prepared, rendered, rendered_with, scene, shape,
    turned,
};

const SIZE: [u32; 2] = [960, 540];

/// A torus and a cube that throw shadows on a floor before an upright flat mirror in z = `mirror_z`.
fn before_a_mirror(mirror_z: f64, eye: DVec3) -> Scene {
    let mirror = Similarity { scale: 4.0, ..moved(DVec3::new(0.0, -1.0, mirror_z)) };
    let torus = turned(DVec3::X, 60.0, DVec3::new(-0.5, 0.5, 1.0));
    let floor = Similarity { scale: 2.0, ..moved(DVec3::new(0.0, 0.0, 1.2)) };
    let objects = vec![
        object("torus", shape("torus", 4000), torus, RED),
        object("cube", shape("cube", 12), turned(DVec3::Y, 30.0, DVec3::new(0.7, 0.0, 1.3)), BLUE),
        object("floor", shape("ground", 2), floor, GREY),
    ];
    scene((shape("plane", 2), mirror), objects, looks(eye, DVec3::new(0.0, 0.5, 0.0)))
}

#[test]
fn a_flat_mirror_shows_the_colours_of_the_direct_view() {
    let (eye, mirrored) = (DVec3::new(0.4, 1.3, 3.5), DVec3::new(0.4, 1.3, -3.5));
    // The same things without the mirror in between: it is behind the eye.
    let direct = prepared(&before_a_mirror(-20.0, mirrored), 9);
    let (direct, _) = rendered(&direct, "raytrace", SIZE[0], SIZE[1]);
    let scene = prepared(&before_a_mirror(0.0, eye), 400_000);
    let width = SIZE[0] as usize;
    for method in ["raytrace", "c3rc"] {
        // Every point a square: what is averaged has other colours at the rims of shadows and patterns.
        let squares = [("splat", "square2"), ("detail", "0")];
        let settings = if method == "c3rc" { &squares[..] } else { &[] };
        let (picture, planes) = rendered_with(&scene, method, settings, SIZE[0], SIZE[1]);
        for (object, name) in ["torus", "cube", "floor"].into_iter().enumerate() {
            // A splat may lie a pixel beside its surfel, which on the torus is another normal.
            let splats = method == "c3rc";
            let tolerance = if splats && name == "torus" { 0.08 } else { 0.01 };
            // Outlines and the rims of shadows differ: the direct view is antialiased, and splats are fat.
            let wanted = if splats { 0.86 } else { 0.95 };
            let (mut pixels, mut alike) = (0, 0);
            for (i, color) in picture.rgb.iter().enumerate() {
                if planes.object[i] as usize == object {
                    // A mirror swaps left and right.
                    let twin = &direct.rgb[i / width * width + width - 1 - i % width];
                    pixels += 1;
                    alike += u32::from(near(color, twin, tolerance));
                }
            }
            let share = f64::from(alike) / f64::from(pixels);
            assert!(pixels > 1000, "{method}, {name}: {pixels}");
            assert!(share > wanted, "{method}, {name}: {share} of {pixels} pixels are alike");
        }
    }
}

#[test]
fn planes_hold_what_the_picture_shows() {
    let scene = prepared(&before_a_mirror(0.0, DVec3::new(0.4, 1.3, 3.5)), 100_000);
    for method in ["raytrace", "c3rc"] {
        let (picture, planes) = rendered(&scene, method, SIZE[0], SIZE[1]);
        let width = SIZE[0] as usize;
        let mirror = |i: usize| planes.reason[i] != Reason::NotMirror as u32;
        let (mut inside, mut lit) = (0, 0);
        for i in width + 1..picture.rgb.len() - width - 1 {
            if !mirror(i) {
                assert_eq!(planes.radiance[i], [0.0; 3], "{method} pixel {i}");
                continue;
            }
            // Away from the mirror's outline, where the picture mixes it with what lies around.
            let around = [
                i - width - 1,
                i - width,
                i - width + 1,
                i - 1,
                i + 1,
                i + width - 1,
                i + width,
                i + width + 1,
            ];
            if around.into_iter().all(mirror) {
                inside += 1;
                assert!(near(&planes.radiance[i], &picture.rgb[i], 1e-6), "{method} pixel {i}");
                lit += u32::from(planes.radiance[i] != [0.0; 3]);
            }
        }
        assert!(inside > 5000 && lit == inside, "{method}: {lit} of {inside}");
    }
}
