//! Panoramas as environments.

use catoptric::image::Picture;
use catoptric::image::io::{read_picture, write_picture};

use super::{Folder, SMALL};

/// Red ahead (towards -z), green at the right, blue behind, white at the left.
fn panorama(folder: &Folder, name: &str) {
    let mut picture = Picture::black(128, 64);
    for (i, pixel) in picture.rgb.iter_mut().enumerate() {
        let quarter = (i % 128 + 16) / 32 % 4;
        *pixel = [[0.0, 0.0, 1.0], [1.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]][quarter];
    }
    write_picture(&folder.path(name), &picture).unwrap();
}

/// A flat mirror across the view and nothing else.
const SCENE: &str = "[eye]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\n\
    [environment]\nkind = \"image\"\nfile = \"sky.png\"\nrotate_deg = -90\nexposure = -1\n\
    [[mirror]]\nshape = \"sphere\"\nscale = 0.5\n\
    [[object]]\nshape = \"cube\"\nscale = 0.01\ntranslate = [0, 90, 0]\n";

#[test]
fn as_they_are_typed() {
    let folder = Folder::new();
    panorama(&folder, "sky.png");
    panorama(&folder, "sky.exr");
    folder.write("scene.toml", SCENE);
    // The middle of the ball shows what is behind the eye, beside it is what lies ahead.
    let seen = |name: &str| {
        let picture = read_picture(&folder.path(name)).unwrap();
        [picture.rgb[45 * 160 + 80], picture.rgb[45 * 160 + 40]]
    };
    for method in ["c3rc", "raytrace", "environment"] {
        let how = format!("{SMALL} --method {method}");
        folder.good(&format!("render scene.toml --environment sky.exr {how} -o plain.exr"));
        let [ball, beside] = seen("plain.exr");
        let near = |a: [f32; 3], b: [f32; 3]| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-4);
        assert!(near(ball, [0.0, 0.0, 1.0]) && near(beside, [1.0, 0.0, 0.0]), "{method}: {ball:?}");
        // Turned clockwise, half as bright: the left is ahead, the right behind.
        folder.good(&format!("render scene.toml {how} -o turned.exr"));
        let [ball, beside] = seen("turned.exr");
        assert!(near(ball, [0.0, 0.5, 0.0]) && near(beside, [0.5; 3]), "{method}: {ball:?}");
    }
    for command in ["info", "bench layer"] {
        folder.good(&format!("{command} scene.toml --environment sky.png {SMALL}"));
    }
}

#[test]
fn files_that_are_none() {
    let folder = Folder::new();
    panorama(&folder, "sky.png");
    let whole = folder.read("sky.png");
    folder.write("cut.png", &whole[..whole.len() - 30]).write("text.hdr", "no picture");
    write_picture(&folder.path("square.exr"), &Picture::black(32, 32)).unwrap();
    for (name, expected) in [
        ("none.hdr", "none.hdr: does not exist; check the name and the folder"),
        ("cut.png", "cut.png: damaged or truncated"),
        ("text.hdr", "text.hdr: not a picture in a format that can be read; give a PNG"),
        (
            "square.exr",
            "square.exr: 32x32 pixels are no panorama, which is twice as wide as high; ",
        ),
        (".", ".: is a folder; name a file in it"),
    ] {
        for command in ["render", "info", "bench layer"] {
            folder.refused(&format!("{command} {SMALL} --environment {name}"), &[expected]);
        }
    }
}
