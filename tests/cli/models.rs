//! Files with more than a mesh, and clouds of points, as a user names them.

use std::fs;

use super::{Folder, OCTAHEDRON, SMALL};

/// A file that the fuzzing starts from, too.
fn seed(name: &str) -> Vec<u8> {
    fs::read(format!("{}/tests/fuzz/seeds/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

#[test]
fn every_format_becomes_a_picture() {
    for (name, from) in [
        ("a.stl", "stl/binary.stl"),
        ("a.gltf", "gltf/all.gltf"),
        ("A.GLB", "gltf/all.glb"),
        ("a.las", "points/v1.2.las"),
        ("a.laz", "points/v1.4.laz"),
        ("a.xyz", "points/plain.xyz"),
        ("a.csv", "points/colors.xyz"),
        ("a.npy", "points/a.npy"),
        ("a.ply", "points/ascii.ply"),
    ] {
        let folder = Folder::new();
        folder.write(name, seed(from));
        folder.ok(&format!("render {name} {SMALL} -o out.png --json out.json"));
        assert!(folder.path("out.png").exists());
        let scene = folder.json("out.json");
        assert!(scene["mirror_pixels"].as_u64().unwrap() > 0, "{name}");
    }
}

#[test]
fn a_file_with_a_mirror_is_a_scene() {
    let folder = Folder::new();
    folder.write("a.glb", seed("gltf/all.glb"));
    let said = folder.ok(&format!("info a.glb {SMALL}")).0;
    assert!(said.contains("mirror glass") && said.contains("object board"), "{said}");
    assert!(!said.contains("teapot") && !said.contains("ground"), "{said}");
    // Parts by their names, in a scene file.
    let text = "[eye]\nposition = [10, 1, 5]\ntarget = [10, 1, 0]\n[[mirror]]\nfile = \"a.glb\"\npart = \"glass\"\n\
        [[object]]\nfile = \"a.glb\"\npart = \"board\"\n";
    folder.write("a.toml", text);
    folder.ok(&format!("render a.toml {SMALL} -o out.png"));
    folder.write("b.toml", text.replace("\"board\"", "\"bored\""));
    folder.refused("info b.toml", &["b.toml: line 7: ", "no part \"bored\"", "are board, glass"]);
    assert!(folder.ok(&format!("info a.toml {SMALL}")).0.contains("object board"));
    // All of it as one thing, and too far away to be seen.
    let (_, noted) = folder.ok(&format!("info --mirror a.glb {SMALL}"));
    assert!(noted.contains("a.glb: board, glass are taken as one"), "{noted}");
    folder.write("far.obj", "v 900 0 0\nv 901 0 0\nv 900 1 0\nf 1 2 3\n");
    let (_, noted) = folder.ok(&format!("info --mirror far.obj {SMALL}"));
    assert!(noted.contains("no mirror is in view: far, 1.414 across"), "{noted}");
    let (_, noted) = folder.ok(&format!("info --mirror far.obj --eye 901,0,5 {SMALL}"));
    assert_eq!(noted, "", "who says where the eye is knows");
}

#[test]
fn clouds_say_what_was_done() {
    let folder = Folder::new();
    let mut text = String::from_utf8(seed("points/plain.xyz")).unwrap();
    text += "50 50 50\n";
    let first = text.lines().next().unwrap().to_owned();
    text += &first;
    folder.write("a.xyz", text);
    let (said, noted) = folder.ok(&format!("info a.xyz {SMALL}"));
    assert!(
        noted.contains("note: a.xyz: a cloud of 42 points, 1 in places that others have"),
        "{noted}"
    );
    assert!(noted.contains("1 far from all others left out; normals estimated"), "{noted}");
    assert!(said.contains("object a: points, 40 surfels"), "{said}");
    folder.refused("info --mirror a.xyz", &["a.xyz: is a cloud of points", "make it an object"]);
    // Fewer than there are: an even part of them.
    let (_, noted) = folder.ok("info a.xyz --size 16x9 --surfels 20");
    assert!(noted.contains("20 more than wanted (--surfels)"), "{noted}");
}

#[test]
fn up_turns_models() {
    let folder = Folder::new();
    folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 0 3\nf 1 2 3\n");
    let height = |line: &str| {
        folder.ok(&format!("info --object a.obj {line} {SMALL} --json out.json"));
        let b = folder.json("out.json")["objects"][0]["box"].clone();
        let at = |corner: &str, k: usize| b[corner][k].as_f64().unwrap();
        at("max", 1) - at("min", 1)
    };
    assert!(height("") < 0.01);
    assert!((height("--up z") - 3.0).abs() < 0.1);
    folder.refused("info a.obj --up x", &["--up", "y, z"]);
    folder.refused("info default --up z", &["--up: turns models, and no model is given"]);
}

#[test]
fn scenes_stay_in_their_folder() {
    let folder = Folder::new();
    fs::create_dir(folder.path("inner")).unwrap();
    folder.write("secret.obj", OCTAHEDRON);
    let scene = "[eye]\nposition = [0, 1, 5]\ntarget = [0, 0, 0]\n[[mirror]]\nshape = \"sphere\"\n\
        [[object]]\nfile = \"../secret.obj\"\n";
    folder.write("inner/a.toml", scene);
    let expected = ["inner/a.toml: line 6: ", "lies outside of the folder", "--allow-outside"];
    folder.refused("info inner/a.toml", &expected);
    folder.ok(&format!("info inner/a.toml {SMALL} --allow-outside"));
    folder.write("inner/b.toml", scene.replace("../secret.obj", "/etc/passwd"));
    folder.refused("info inner/b.toml", &["lies outside of the folder"]);
    // A material file and a texture elsewhere are left out, with a note.
    folder.write("secret.mtl", "newmtl a\nKd 1 0 0\n");
    folder.write("inner/b.obj", format!("mtllib ../secret.mtl\nusemtl a\n{OCTAHEDRON}"));
    let (_, noted) = folder.ok(&format!("info inner/b.obj {SMALL}"));
    assert!(
        noted.contains("lies outside of the folder") && noted.contains("without its materials")
    );
}

#[test]
fn memory_is_not_taken_beyond_the_limit() {
    let folder = Folder::new();
    folder.refused(
        "render --max-memory 300M -o out.png",
        &["--surfels: 3000000 surfels need about 390 MB", "--max-memory"],
    );
    folder.refused(
        "render --max-memory 1G --size 16384x16384 -o out.png",
        &["--size: 16384 x 16384 pixels"],
    );
    folder.ok(&format!("info --max-memory 300M {SMALL}"));
    folder.refused("info --max-memory lots", &["--max-memory", "such as 8G"]);
    folder.refused("info --max-memory 10", &["--max-memory", "such as 8G"]);
    let scene = "[eye]\nposition = [0, 1, 5]\ntarget = [0, 0, 0]\n[[mirror]]\nshape = \"sphere\"\ntriangles = 50000000\n";
    folder.write("a.toml", scene);
    folder.refused(
        &format!("info a.toml {SMALL} --max-memory 1G"),
        &["sphere: 50000000 triangles need about 7.50 GB"],
    );
    folder.write(
        "b.toml",
        format!(
            "{}[[object]]\nshape = \"sphere\"\ntriangles = 1000000\n",
            scene.replace("50000000", "50")
        ),
    );
    folder.refused(
        &format!("info b.toml {SMALL} --max-memory 250M"),
        &["b: its ", " triangles need about 350 MB"],
    );
    // A picture that would be much larger than its file.
    folder.write("a.mtl", "newmtl a\nmap_Kd a.png\n");
    folder.write("a.obj", format!("mtllib a.mtl\nusemtl a\n{OCTAHEDRON}"));
    folder.write("a.png", bomb());
    folder.refused(
        &format!("info a.obj {SMALL} --max-memory 400M"),
        &["a.png: 12000 x 12000 texels need about", "--max-memory"],
    );
    folder.write("a.png", {
        let mut huge = bomb();
        huge[16..20].copy_from_slice(&100_000u32.to_be_bytes());
        huge
    });
    let (_, noted) = folder.ok(&format!("info a.obj {SMALL}"));
    assert!(noted.contains("shown without this texture"), "{noted}");
}

/// The beginning of a PNG file of 12000 x 12000 pixels.
fn bomb() -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
    bytes.extend(12_000u32.to_be_bytes());
    bytes.extend(12_000u32.to_be_bytes());
    bytes.extend([8, 2, 0, 0, 0]);
    let mut crc = 0xffff_ffffu32;
    for byte in &bytes[12..] {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 };
        }
    }
    bytes.extend((!crc).to_be_bytes());
    bytes.extend([0, 0, 0, 0]);
    bytes.extend(b"IDAT\x35\xaf\x06\x1e");
    bytes
}

#[test]
fn a_decoder_that_panics_is_an_error() {
    let found = format!("{}/tests/fuzz/found/points/decoder.laz", env!("CARGO_MANIFEST_DIR"));
    let folder = Folder::new();
    folder.write("a.laz", fs::read(found).unwrap());
    folder.refused(&format!("info a.laz {SMALL}"), &["a.laz: "]);
}
