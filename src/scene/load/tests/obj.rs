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
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "has no faces"),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "has zero area"),
        ("hello\n", "has no faces"),
        ("f 1 2 3\n", "line 1: names vertex 1, but there are 0"),
    ] {
        assert_eq!(complaint("a.obj", text.as_bytes()), wanted);
    }
    assert_eq!(complaint("a.obj", b"v 0 0 \xff\nf 1 1 1\n"), "line 1: is not text");
    assert_eq!(complaint("a.obj", &[0; 4096]), "has no faces");
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
            let _ = obj::read(path, &bad, false, &cx);
        }
    }
}

/// A red square on the left, a textured one on the right, a mirror behind; a quad each.
const PAINTED: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n\
    v 0 0 -1\nv 2 0 -1\nv 2 1 -1\nv 0 1 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    usemtl red\nf 1 2 3 4\nusemtl wood\nf 2/1 5/2 6/3 3/4\nusemtl glass\nf 7 8 9 10\n";
const MATERIALS: &str = "newmtl red\nKd 1 0 0\nillum 2\nnewmtl wood\nKd 0 0 0\nmap_Kd textures\\w.png\n\
    newmtl glass\nKs 0.5 1 1\nillum 3\nnewmtl other\nKd 1\n";

/// The model in a folder with its materials and a texture: white above, black below.
fn painted(materials: &str) -> Model {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    fs::create_dir(place("textures")).unwrap();
    let texture =
        image::RgbImage::from_fn(2, 2, |_, y| image::Rgb([if y == 0 { 255 } else { 0 }; 3]));
    texture.save(place("textures/w.png")).unwrap();
    fs::write(place("a.mtl"), materials).unwrap();
    fs::write(place("a.obj"), PAINTED).unwrap();
    model(&place("a.obj"), &ReadOptions::default(), &Context::default()).unwrap()
}

#[test]
fn materials_paint_triangles_and_make_mirrors() {
    let model = painted(MATERIALS);
    assert_eq!(model.notes, Vec::<String>::new());
    let names: Vec<&str> = model.parts.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["diffuse", "glass"]);
    let (diffuse, glass) = (&model.parts[0], &model.parts[1]);
    let tint = glass.mirror.unwrap();
    assert!((tint - Vec3::new(0.214, 1.0, 1.0)).length() < 1e-3, "{tint}");
    assert_eq!(glass.mesh.triangles().len(), 2);
    assert_eq!(glass.mesh.positions().len(), 4, "only its own vertices");
    let paint = diffuse.paint.clone().unwrap();
    let color = |t: usize, w: [f32; 3]| paint.color(&diffuse.mesh, t, w, 0.0);
    assert_eq!(color(0, [1.0, 0.0, 0.0]), Vec3::X);
    assert_eq!(color(1, [0.2, 0.3, 0.5]), Vec3::X);
    // The second square: its lower edge is black, its upper one white, where the texture's rows have their middle.
    let [low, high] = [0.25, 0.75].map(|v| {
        // Along the diagonal from the first corner (0, 0) to the third (1, 1).
        color(2, [1.0 - v, 0.0, v])
    });
    assert_eq!((low, high), (Vec3::ZERO, Vec3::ONE));
    let average = paint.color(&diffuse.mesh, 2, [0.75, 0.0, 0.25], 1.0);
    assert!((average.x - 0.5).abs() < 0.01, "a surfel as large as the square: {average}");
    // Edges without a face, as Blender writes them, shift nothing.
    let edges = PAINTED.replace("usemtl wood\n", "usemtl wood\nf 1 2\nf 3\n");
    let read = obj::read(Path::new("b.obj"), edges.as_bytes(), false, &Context::default()).unwrap();
    assert!(read.notes[0].contains("b.obj: 2 faces of fewer than three"), "{:?}", read.notes);
    assert_eq!(read.parts[0].mesh.triangles().len(), 6);
    // As one thing, the mirror is plain.
    let one = model.merged(Path::new("a.obj")).unwrap();
    assert_eq!(one.mesh.triangles().len(), 6);
    assert!(one.mirror.is_none());
    assert_eq!(one.paint.unwrap().color(&one.mesh, 0, [1.0, 0.0, 0.0], 0.0), Vec3::X);
}

#[test]
fn what_materials_lack_is_noted() {
    let model = painted("newmtl wood\nmap_Kd w.png\n");
    assert!(model.notes[0].contains("w.png does not exist"), "{:?}", model.notes);
    assert!(model.notes[1].contains("no material file has red, glass"), "{:?}", model.notes);
    let model = painted("newmtl wood\nKd 1 1 1\nmap_Kd ../w.png\n");
    assert!(model.notes[0].contains("--allow-outside"), "{:?}", model.notes);
    let model = painted("newmtl wood\nmap_Kd a.obj\n");
    assert!(model.notes[0].contains("shown without this texture"), "{:?}", model.notes);
    // Without any material the mesh is as plain as without a library.
    let model = painted("hello");
    assert_eq!((model.parts.len(), model.parts[0].paint.is_none()), (1, true));
    let alone = load("a.obj", PAINTED.as_bytes()).unwrap();
    assert_eq!(alone.triangles().len(), 6);
    // High specular with little diffuse is a mirror, glossy paint is not.
    for (line, mirrors) in [("Kd 0.2 0.2 0.2\nKs 1 1 1", 1), ("Kd 0.8 0.8 0.8\nKs 1 1 1", 0)] {
        let model = painted(&format!("newmtl red\n{line}\nillum 2\n"));
        assert_eq!(model.parts.iter().filter(|p| p.mirror.is_some()).count(), mirrors, "{line}");
    }
}
