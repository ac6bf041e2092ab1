use std::io::Write as _;

use super::super::obj;
use super::*;

/// The tent as OBJ.
pub(super) fn written(faces: &str, with_colors: bool) -> Vec<u8> {
    let mut text = Vec::from(b"# caf\xe9\nmtllib none.mtl\no tent\n".as_slice());
    for (p, c) in POSITIONS.iter().zip(COLORS) {
        write!(text, "v {} {} {}", p[0], p[1], p[2]).unwrap();
        if with_colors {
            c.iter().for_each(|&c| write!(text, " {}", f32::from(c) / 255.0).unwrap());
        }
        writeln!(text).unwrap();
    }
    (0..7).for_each(|i| writeln!(text, "vt 0.{i} 0.5").unwrap());
    for n in normals() {
        writeln!(text, "  vn {} {} {}\r", n[0], n[1], n[2]).unwrap();
    }
    text.extend(faces.as_bytes());
    text
}

#[test]
fn obj_in_all_variants_is_the_same_mesh() {
    // Groups, materials, texture seams, relative indices, points and lines change nothing.
    for faces in [
        "f 1//1 2//2 3//3 4//4\nf 3//3 2//2 4//4\n",
        "f 1/1/1 2/2/2 3/3/3 4/4/4 # quad\ng other\nusemtl red\nf 3/5/3 2/6/2 4/7/4",
        "f -4//-4 -3//-3 -2//-2 -1//-1\nl 1 2\np 1\nf -2/-1/-2 -3/-1/-3 -1/-1/-1\n",
    ] {
        for with_colors in [false, true] {
            let mesh = load("a.obj", &written(faces, with_colors)).unwrap();
            assert_same(&mesh, &tent(true, with_colors), faces);
        }
    }
    // Without normals they are averaged over groups and texture seams alike.
    for faces in ["f 1 2 3 4\nf 3 2 4\n", "f 1/1 2/2 3/3 4/4\ng other\nf 3/5 2/6 4/7\n"] {
        assert_same(&load("a.OBJ", &written(faces, true)).unwrap(), &tent(false, true), faces);
    }
}

#[test]
fn obj_drops_what_only_some_vertices_have() {
    let text =
        "v 0 0 0\nv 1 0 0 1 0 0\nv 0 1 0 0 1 0\nv 0 0 2 2\nvn 0 0 9\nf 1//1 2//1 3//1\nf 1 2 4\n";
    let mesh = load("a.obj", text.as_bytes()).unwrap();
    assert!(mesh.colors().is_empty());
    // A weight divides.
    assert!(mesh.positions().contains(&Vec3::new(0.0, 0.0, 1.0)));
    let plain = text.replace("//1", "");
    let plain = load("a.obj", plain.as_bytes()).unwrap();
    assert!(plain.normals().iter().all(|n| n.is_normalized()));
}

#[test]
fn bad_obj() {
    for (text, wanted) in [
        ("v 0 0 0\nv 1 0 0\nv 0 x 0\nf 1 2 3\n", "line 3: \"x\" is not a number"),
        ("v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", "line 2: \"nan\" is not a finite number"),
        ("v 0 0 -inf\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "line 1: \"-inf\" is not a finite number"),
        ("v 0 0 1e39\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "line 1: \"1e39\" is not a finite number"),
        ("v 0 0 0\nv 2e15 0 0\nv 0 1 0\nf 1 3 2\n", "line 2: 2e15 is larger than 1e15"),
        ("v 0 0 0 r 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "line 1: \"r\" is not a number"),
        ("v 0 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "line 1: scaling (w) by zero"),
        ("v 0 0 0\nv 1 0 0\nv 0 1\nf 1 2 3\n", "line 3: has 2 numbers after \"v\""),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 4\n", "line 5: names vertex 4, but there are 3"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "line 4: names vertex 0, but there are 3"),
        ("v 0 0 0\nv 1 0 0\nf -1 -2 -3\nv 0 1 0\n", "line 3: names vertex -3, but there are 3"),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -9223372036854775808\n",
            "line 4: names vertex -9223372036854775808, but there are 3",
        ),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//1 2 3\n", "line 4: names normal 1, but there are 0"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3/a/b\n", "line 4: \"3/a/b\" is not a corner of a face"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3e\n", "line 4: \"3e\" is not a corner of a face"),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n",
            "line 4: has a face of 2 vertices, which needs at least 3",
        ),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "has zero area"),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\n", "has no faces"),
        ("hello\n", "has no faces"),
        ("f 1 2 3\n", "line 1: names vertex 1, but there are 0"),
    ] {
        assert_eq!(complaint("a.obj", text.as_bytes()), wanted);
    }
    assert_eq!(complaint("a.obj", b"v 0 0 \xff\nf 1 1 1\n"), "line 1: is not text");
    assert_eq!(complaint("a.obj", &[0; 4096]), "has no faces");
    let points = load("a.obj", b"v 0 0 0\n").unwrap_err().to_string();
    assert!(points.contains("point clouds are not supported yet"));
}

#[test]
fn any_byte_may_be_wrong() {
    // No single wrong byte in a good file makes the reader panic or take memory that the file cannot back.
    let (path, cx) = (Path::new("any"), Context::default());
    let good = written("f 1/1/1 2/2/2 3/3/3 4/4/4\nf 3/5/3 2/6/2 4/7/4\n", true);
    for at in 0..good.len() {
        for byte in [0, b'-', b'9', b'/', b'\n', 0xff] {
            let mut bad = good.clone();
            bad[at] = byte;
            let _ = obj::read(path, &bad, &cx);
        }
    }
}
