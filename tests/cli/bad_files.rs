//! Files that are no meshes or scenes: each is refused in a clear message, quickly, and nothing is written.

use super::{Folder, OCTAHEDRON, SMALL};

/// Everything that is asked of a line that names a bad file: as input, as object, as mirror, for each command.
fn refused_everywhere(folder: &Folder, file: &str, expected: &[&str]) {
    for line in [
        format!("render {file} {SMALL} -o out.png --aov out.exr --json out.json"),
        format!("render --object {file} {SMALL} -o out.png"),
        format!("render --mirror {file} --object cube {SMALL} -o out.png"),
        format!("info {file} {SMALL} --json out.json"),
        format!("bench layer --object {file} {SMALL} --json out.json"),
    ] {
        folder.refused(&line, expected);
    }
}

fn bad_mesh(name: &str, bytes: impl AsRef<[u8]>, expected: &[&str]) {
    let folder = Folder::new();
    folder.write(name, bytes);
    let mut all = vec![name];
    all.extend(expected);
    refused_everywhere(&folder, name, &all);
}

#[test]
fn missing_and_empty_files() {
    for name in ["none.obj", "none.ply"] {
        refused_everywhere(&Folder::new(), name, &[name, "does not exist", "check the name"]);
        bad_mesh(name, "", &["is empty", "get or export it again"]);
    }
    let folder = Folder::new();
    folder.refused("render none.toml", &["none.toml: does not exist; check the name"]);
    folder.write("void.toml", "").refused("render void.toml", &["void.toml: is empty; "]);
    std::fs::create_dir(folder.path("folder.ply")).unwrap();
    folder.refused("render folder.ply", &["folder.ply: is a folder; name a file in it"]);
    folder.refused("render none", &["none: is neither a built-in scene", "default, room, knot"]);
    folder.refused("render knot room", &["knot: is given together", "give a single scene"]);
    folder.refused("render none.3ds", &["none.3ds: is neither", "(.obj, .ply, .stl, "]);
    folder.write("a.3ds", "solid").refused("render --object a.3ds", &["a.3ds: ", ".obj, .ply"]);
}

#[test]
fn bad_obj() {
    let with = |from: &str, to: &str| OCTAHEDRON.replacen(from, to, 1);
    for (text, expected) in [
        (OCTAHEDRON[..OCTAHEDRON.len() - 3].to_owned(), "line 14: has a face of 2 vertices"),
        ("o nothing\n".to_owned(), "has no faces; "),
        (with("v 0 1 0", "v 0 one 0"), "line 3: \"one\" is not a number"),
        (with("v 0 1 0", "v 0 nan 0"), "line 3: \"nan\" is not a finite number"),
        (with("v 0 1 0", "v 0 inf 0"), "line 3: \"inf\" is not a finite number"),
        (with("v 0 1 0", "v 0 -1e99 0"), "line 3: \"-1e99\" is not a finite number"),
        (with("v 0 1 0", "v 0 1e38 0"), "line 3: 1e38 is larger than 1e15"),
        (with("f 3 2 5", "f 3 2 7"), "line 8: names vertex 7, but there are 6"),
        (with("f 3 2 5", "f 3 2 4000000000"), "line 8: names vertex 4000000000, but there are 6"),
        (with("f 3 2 5", "f 3 2 0"), "line 8: names vertex 0, but there are 6"),
        ("v 0 0 0\nv 1 0 0\nv 3 0 0\nf 1 2 3\n".into(), "has zero area; "),
        ("\0\u{1}\u{2}\u{3}".repeat(999), "has no faces; "),
    ] {
        bad_mesh("bad.obj", text, &[expected]);
    }
}

/// PLY of a triangle in one of the three encodings.
struct Ply {
    encoding: &'static str,
    vertices: [[f32; 3]; 3],
    vertex_count: u64,
    face_count: u64,
    list_count: u32,
    corners: [u32; 3],
}

impl Ply {
    fn good(encoding: &'static str) -> Self {
        let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]];
        let (vertex_count, face_count, list_count) = (3, 1, 3);
        Self { encoding, vertices, vertex_count, face_count, list_count, corners: [0, 1, 2] }
    }

    fn bytes(&self) -> Vec<u8> {
        let Self { encoding, vertex_count, face_count, .. } = self;
        let mut bytes = format!(
            "ply\nformat {encoding} 1.0\nelement vertex {vertex_count}\nproperty float x\nproperty float y\n\
             property float z\nelement face {face_count}\nproperty list uint uint vertex_indices\nend_header\n"
        )
        .into_bytes();
        let face = [self.list_count, self.corners[0], self.corners[1], self.corners[2]];
        match *encoding {
            "ascii" => {
                for [x, y, z] in self.vertices {
                    bytes.extend(format!("{x} {y} {z}\n").bytes());
                }
                bytes.extend(face.map(|i| i.to_string()).join(" ").bytes());
                bytes.push(b'\n');
            }
            "binary_little_endian" => {
                bytes.extend(self.vertices.iter().flatten().flat_map(|v| v.to_le_bytes()));
                bytes.extend(face.iter().flat_map(|v| v.to_le_bytes()));
            }
            _ => {
                bytes.extend(self.vertices.iter().flatten().flat_map(|v| v.to_be_bytes()));
                bytes.extend(face.iter().flat_map(|v| v.to_be_bytes()));
            }
        }
        bytes
    }
}

fn bad_ply(encoding: &'static str) {
    let good = || Ply::good(encoding);
    // The control: it is the defects that are refused.
    let folder = Folder::new();
    folder.write("good.ply", good().bytes()).good(&format!("info good.ply {SMALL}"));
    let with_x = |x: f32| Ply { vertices: [[0.0; 3], [x, 0.0, 0.0], [0.0, 1.0, 0.5]], ..good() };
    let flat = [[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]];
    let text = encoding == "ascii";
    let whole = good().bytes();
    let cut = |bytes: usize| whole[..whole.len() - bytes].to_vec();
    let header_ends = whole.windows(11).position(|w| w == b"end_header\n").unwrap();
    for (bytes, expected) in [
        (cut(3), if text { "line 13: " } else { "face 0: the file ends here" }),
        // The whole face and the last vertex are missing.
        (cut(if text { 16 } else { 28 }), if text { "" } else { "only 24 bytes follow" }),
        (whole[..header_ends].to_vec(), "has a header without \"end_header\""),
        (b"ply\n".to_vec(), "has a header without \"end_header\""),
        (with_x(f32::NAN).bytes(), "vertex 1: is not a finite number"),
        (with_x(f32::INFINITY).bytes(), "vertex 1: is not a finite number"),
        (with_x(f32::NEG_INFINITY).bytes(), "vertex 1: is not a finite number"),
        (with_x(1e30).bytes(), "vertex 1: is not a finite number, or larger than 1e15"),
        (Ply { corners: [0, 1, 3], ..good() }.bytes(), "face 0: names vertex 3, but there are 3"),
        (Ply { corners: [0, u32::MAX, 2], ..good() }.bytes(), "face 0: names vertex 4294967295"),
        (Ply { vertices: flat, ..good() }.bytes(), "has zero area"),
        (
            Ply { vertex_count: 4_000_000_000, ..good() }.bytes(),
            "promises 4000000000 elements \"vertex\"",
        ),
        (
            Ply { face_count: 4_000_000_000, ..good() }.bytes(),
            "promises 4000000000 elements \"face\"",
        ),
        (
            Ply { list_count: 4_000_000_000, ..good() }.bytes(),
            if text { "line 13: has fewer numbers" } else { "face 0: the file ends here" },
        ),
        (Ply { vertex_count: u64::MAX, ..good() }.bytes(), "element"),
    ] {
        bad_mesh("bad.ply", bytes, &[expected]);
    }
}

#[test]
fn bad_ply_as_text() {
    bad_ply("ascii");
    let words = String::from_utf8(Ply::good("ascii").bytes()).unwrap().replace("1 0 0", "1 zero 0");
    bad_mesh("bad.ply", words, &["line 11: \"zero\" is not a number"]);
}

#[test]
fn bad_ply_of_little_endian_bytes() {
    bad_ply("binary_little_endian");
}

#[test]
fn bad_ply_of_big_endian_bytes() {
    bad_ply("binary_big_endian");
}

const SCENE: &str = "[eye]\nposition = [0, 1, 3]\ntarget = [0, 0, 0]\n\
    [[mirror]]\nshape = \"sphere\"\n[[object]]\nshape = \"cube\"\ntranslate = [1, 0, 1]\n";

#[test]
fn bad_scenes() {
    let folder = Folder::new();
    folder.write("good.toml", SCENE).good(&format!("info good.toml {SMALL}"));
    let with = |from: &str, to: &str| {
        assert!(SCENE.contains(from));
        SCENE.replacen(from, to, 1)
    };
    let cube = "shape = \"cube\"";
    for (text, expected) in [
        (SCENE[..70].to_owned(), "line 5: "),
        (SCENE[..SCENE.find("[[").unwrap()].to_owned(), "has no mirror; add one"),
        (with("translate", "translates"), "line 8: unknown field `translates`, expected one of"),
        (with("[[object]]", "[[objects]]"), "line 6: unknown field `objects`"),
        (with("cube", "cub"), "there is no built-in shape \"cub\"; the shapes are teapot"),
        (with(cube, "file = \"none.ply\""), "none.ply does not exist"),
        (with(cube, "file = \"nan.ply\""), "nan.ply: vertex 1: is not a finite number"),
        (with("3]", "nan]"), "line 2: "),
        (with("3]", "-inf]"), "line 2: "),
        (with("3]", "\"three\"]"), "line 2: "),
        (with("3]", "1e99]"), "line 2: "),
        (with("0, 1, 3", "0, 1"), "line 2: "),
        (with("0, 1, 3", "0, 0, 0"), "the eye's position and target coincide"),
        (with(cube, "shape = \"cube\"\nscale = 0"), "line 8: 0 is not a positive number"),
        (with(cube, "shape = \"cube\"\nscale = inf"), "line 8: inf is not a positive number"),
        (with(cube, "shape = \"cube\"\ndensity = nan"), "line 8: NaN is not a positive number"),
        (with(cube, "shape = \"cube\"\ntriangles = 4000000000"), "line 8: 4000000000 triangles"),
        (with(cube, "shape = \"cube\"\nfile = \"a.ply\""), "has both shape and file; remove one"),
        (with("[[mirror]]", "up = [0, -1, -3]\n[[mirror]]"), "up is parallel to its view"),
        (with("[[mirror]]", "fov_y_deg = 180\n[[mirror]]"), "line 4: "),
        (with("[[mirror]]", "[[mirror]]\nname = 3"), "line 5: "),
        (
            with("[[mirror]]", "[environment]\nkind = \"image\"\n[[mirror]]"),
            "line 4: an image has file, rotate_deg and exposure, and no colours; ",
        ),
        (
            with("[[mirror]]", "[environment]\nkind = \"image\"\nfile = \"no.hdr\"\n[[mirror]]"),
            "no.hdr does not exist; ",
        ),
        (
            with("[[mirror]]", "[environment]\nkind = \"sky\"\nexposure = 1\n[[mirror]]"),
            "line 4: only kind = \"image\" has file, rotate_deg and exposure; ",
        ),
        (
            with(
                cube,
                "shape = \"cube\"\nname = \"x\"\n[[object]]\nshape = \"cube\"\nname = \"x\"",
            ),
            "the name \"x\" is used twice",
        ),
    ] {
        let mut nan = Ply::good("ascii");
        nan.vertices[1][0] = f32::NAN;
        folder.write("bad.toml", text).write("nan.ply", nan.bytes());
        let name = if expected.contains(".ply") { ".ply" } else { "bad.toml: " };
        for line in [
            format!("render bad.toml {SMALL} -o out.png --aov out.exr --json out.json"),
            format!("info bad.toml {SMALL}"),
            format!("bench layer bad.toml {SMALL}"),
        ] {
            folder.refused(&line, &[name, expected]);
        }
    }
    folder.write("bad.toml", [0xff, 0xfe, 0]);
    folder.refused("render bad.toml", &["bad.toml: is not a text file in UTF-8; "]);
}
