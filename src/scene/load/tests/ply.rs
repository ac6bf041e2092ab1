#![expect(clippy::cast_possible_truncation, reason = "numbers are written as narrow ones")]

use std::io::Write as _;

use super::super::ply;
use super::*;

/// Writes numbers of PLY in one of its encodings.
struct Ply {
    format: &'static str,
    bytes: Vec<u8>,
}

impl Ply {
    fn put(&mut self, number_type: &str, value: f64) {
        macro_rules! put {
            ($t:ty) => {
                match self.format {
                    "ascii" => write!(self.bytes, "{} ", value as $t).unwrap(),
                    "binary_little_endian" => self.bytes.extend((value as $t).to_le_bytes()),
                    _ => self.bytes.extend((value as $t).to_be_bytes()),
                }
            };
        }
        match number_type {
            "char" | "int8" => put!(i8),
            "uchar" | "uint8" => put!(u8),
            "short" | "int16" => put!(i16),
            "ushort" | "uint16" => put!(u16),
            "int" | "int32" => put!(i32),
            "uint" | "uint32" => put!(u32),
            "float" | "float32" => put!(f32),
            "double" | "float64" => put!(f64),
            _ => panic!("{number_type}"),
        }
    }

    fn line(&mut self) {
        if self.format == "ascii" {
            self.bytes.push(b'\n');
        }
    }
}

const FORMATS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

/// The tent as PLY, with properties and elements that are of no concern in between.
pub(super) fn written(
    format: &'static str,
    coordinate: &str,
    color: Option<(&str, [&str; 3])>,
    (count, index, list): (&str, &str, &str),
) -> Vec<u8> {
    let mut header = format!("ply\r\nformat {format} 1.0\ncomment na\u{ef}ve\nelement camera 2\n");
    header += "property list uchar double pose\nproperty int id\n";
    header += "element vertex 4\nproperty uchar flags\n";
    for name in ["x", "y", "z", "nx", "ny", "nz"] {
        header += &format!("property {coordinate} {name}\n");
    }
    if let Some((number, names)) = color {
        for name in names {
            header += &format!("property {number} {name}\n");
        }
    }
    header += &format!(
        "element face 2\nproperty list uchar float texcoord\nproperty list {count} {index} {list}\n"
    );
    header += "property uchar material\nelement nothing 4000000000\nend_header\n";
    let mut out = Ply { format, bytes: header.into_bytes() };
    for camera in [3.0, 0.0] {
        out.put("uchar", camera);
        (0..camera as u32).for_each(|i| out.put("double", f64::from(i) + 0.5));
        out.put("int", -7.0);
        out.line();
    }
    for i in 0..4 {
        out.put("uchar", 9.0);
        POSITIONS[i].iter().chain(&normals()[i]).for_each(|&v| out.put(coordinate, f64::from(v)));
        for channel in COLORS[i] {
            match color {
                Some((number @ ("float" | "double"), _)) => {
                    let linear = linear_from_srgb(f32::from(channel) / 255.0);
                    out.put(number, f64::from(linear));
                }
                // 255 · 257 = 65535
                Some(("ushort", _)) => out.put("ushort", f64::from(channel) * 257.0),
                Some((number, _)) => out.put(number, f64::from(channel)),
                None => {}
            }
        }
        out.line();
    }
    for polygon in POLYGONS {
        out.put("uchar", 1.0);
        out.put("float", 0.25);
        out.put(count, polygon.len() as f64);
        polygon.iter().for_each(|&i| out.put(index, f64::from(i)));
        out.put("uchar", 5.0);
        out.line();
    }
    out.bytes
}

const RGB: [&str; 3] = ["red", "green", "blue"];
pub(super) const FACES: (&str, &str, &str) = ("uchar", "int", "vertex_indices");

#[test]
fn ply_in_all_variants_is_the_same_mesh() {
    for format in FORMATS {
        let colors = [
            None,
            Some(("uchar", RGB)),
            Some(("uint8", ["r", "g", "b"])),
            Some(("ushort", ["diffuse_red", "diffuse_green", "diffuse_blue"])),
            Some(("float", RGB)),
            Some(("double", RGB)),
            Some(("int", RGB)),
        ];
        for color in colors {
            for coordinate in ["float", "double", "float32", "float64"] {
                let bytes = written(format, coordinate, color, FACES);
                let what = format!("{format} {coordinate} {color:?}");
                assert_same(&load("a.ply", &bytes).unwrap(), &tent(true, color.is_some()), &what);
            }
        }
        for count in ["char", "uchar", "short", "ushort", "int", "uint"] {
            for index in ["int8", "uint8", "int16", "uint16", "int32", "uint32"] {
                let bytes = written(format, "float", None, (count, index, "vertex_index"));
                let what = format!("{format} {count} {index}");
                assert_same(&load("a.PLY", &bytes).unwrap(), &tent(true, false), &what);
            }
        }
    }
}

#[test]
fn ply_of_integers_and_odd_numbers() {
    let text = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\n\
                element vertex 3\nproperty short x\nproperty float y\nproperty float z\n\
                end_header\n3 2 1 0\n\n 7 .5 1.\r\n-3 +2 0\n0 1e2 -1E-2";
    let mesh = load("a.ply", text.as_bytes()).unwrap();
    let wanted =
        [Vec3::new(7.0, 0.5, 1.0), Vec3::new(-3.0, 2.0, 0.0), Vec3::new(0.0, 100.0, -0.01)];
    assert_eq!(mesh.positions(), wanted);
    assert_eq!(mesh.triangles(), [[2, 1, 0]]);
}

#[test]
fn bad_ply_headers() {
    let fine = "format ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    for (text, wanted) in [
        ("hello".to_owned(), "line 1: does not say \"ply\""),
        ("plymouth\nend_header\n".into(), "line 1: \"plymouth\" is not a line of a PLY header"),
        (format!("ply\n{fine}0 0 0\n"), "has a header without \"end_header\""),
        ("ply".into(), "has a header without \"end_header\""),
        (
            format!("ply\n{fine}gibberish\nend_header\n"),
            "line 7: \"gibberish\" is not a line of a PLY header",
        ),
        ("ply\nelement vertex 1\nend_header\n".into(), "has a bad header: No format line found"),
        (
            "ply\nformat ascii 1.0\nelement vertex -1\nend_header\n".into(),
            "line 3: \"element vertex -1\" is not a line of a PLY header",
        ),
        (
            "ply\nformat ascii 1.0\nelement vertex 99999999999999999999999\nend_header\n".into(),
            "line 3: \"element vertex 99999999999999999999999\" is not a line of a PLY header",
        ),
        (
            "ply\nproperty float x\nend_header\n".into(),
            "line 2: \"property float x\" is not a line of a PLY header",
        ),
        (
            format!("ply\n{fine}property float x\nend_header\n0 0 0 0\n"),
            "has a header that gives two elements or properties the same name",
        ),
        ("ply\nformat ascii 1.0\nend_header\n".into(), "has no vertices with x, y and z"),
        (
            format!("ply\n{fine}end_header\n0 0 0\n").replace("float z", "float w"),
            "has no vertices with x, y and z",
        ),
    ] {
        assert_eq!(complaint("a.ply", text.as_bytes()), wanted);
    }
}

#[test]
fn ply_counts_are_not_believed() {
    for format in FORMATS {
        for (vertices, faces, wanted) in [
            (
                "4000000000",
                "1",
                "promises 4000000000 elements \"vertex\", but only 40 bytes follow the header",
            ),
            (
                "1",
                "4000000000",
                "promises 4000000000 elements \"face\", but only 40 bytes follow the header",
            ),
            (
                "18446744073709551615",
                "1",
                "promises 18446744073709551615 elements \"vertex\", but only 40 bytes follow the header",
            ),
        ] {
            let header = format!(
                "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
                 property float z\nelement face {faces}\nproperty list uint int vertex_indices\nend_header\n"
            );
            let mut bytes = header.into_bytes();
            bytes.extend([b'1'; 40]);
            assert_eq!(complaint("a.ply", &bytes), wanted);
        }
        // A list that promises more than there is.
        let mut out = Ply {
            format,
            bytes: format!(
                "ply\nformat {format} 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                 property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n"
            )
            .into_bytes(),
        };
        for v in [0.0; 3] {
            out.put("float", v);
        }
        out.line();
        for v in [4e9, 0.0, 0.0, 0.0] {
            out.put("uint", v);
        }
        let found = complaint("a.ply", &out.bytes);
        let text = "line 11: has fewer numbers than the header promises";
        let binary = "face 0: the file ends here, but its header promises 1 of them";
        assert_eq!(found, if format == "ascii" { text } else { binary });
    }
}

#[test]
fn ply_cut_off_anywhere() {
    for format in FORMATS {
        let whole = written(format, "float", Some(("uchar", RGB)), FACES);
        // The last text line may lose its newline, and its ignored last number.
        let end = whole.len() - if format == "ascii" { 4 } else { 0 };
        for length in 0..end {
            let found = complaint("a.ply", &whole[..length]);
            assert!(!found.is_empty());
        }
        let found = complaint("a.ply", &whole[..whole.len() - 6]);
        let text = "line 31: has fewer numbers than the header promises";
        let binary = "face 1: the file ends here, but its header promises 2 of them";
        assert_eq!(found, if format == "ascii" { text } else { binary });
    }
}

#[test]
fn bad_ply_data() {
    let text = |vertex: &str, face: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
             property float z\nelement face 2\nproperty list char int vertex_indices\nend_header\n\
             0 0 0\n{vertex}\n1 1 1\n3 0 1 2\n{face}\n"
        )
    };
    for (vertex, face, wanted) in [
        ("0 a 0", "3 0 1 2", "line 11: \"a\" is not a number"),
        ("0 0", "3 0 1 2", "line 11: has fewer numbers than the header promises"),
        ("0 nan 0", "3 0 1 2", "vertex 1: is not a finite number, or larger than 1e15"),
        ("0 0 -inf", "3 0 1 2", "vertex 1: is not a finite number, or larger than 1e15"),
        ("0 1e300 0", "3 0 1 2", "vertex 1: is not a finite number, or larger than 1e15"),
        ("0 1 0", "3 0 1 3", "face 1: names vertex 3, but there are 3 vertices"),
        ("0 1 0", "3 0 -1 2", "face 1: names vertex -1, but there are 3 vertices"),
        ("0 1 0", "3 0 1.5 2", "face 1: names vertex 1.5, but there are 3 vertices"),
        ("0 1 0", "-3 0 1 2", "line 14: has a list of -3 numbers"),
        ("0 1 0", "nan 0 1 2", "line 14: has a list of NaN numbers"),
        ("2 2 2", "3 0 1 2", "has zero area"),
    ] {
        assert_eq!(complaint("a.ply", text(vertex, face).as_bytes()), wanted);
    }
    // Faces of fewer than three corners are passed over.
    assert_eq!(load("a.ply", text("0 1 0", "2 0 1").as_bytes()).unwrap().triangles().len(), 1);

    for format in &FORMATS[1..] {
        let header = format!(
            "ply\nformat {format} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             element face 1\nproperty list char int vertex_indices\nend_header\n"
        );
        let bytes = |z: f32, count: f64, corner: f64| {
            let mut out = Ply { format, bytes: header.clone().into_bytes() };
            for v in [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, z] {
                out.put("float", f64::from(v));
            }
            out.put("char", count);
            for v in [0.0, 1.0, corner] {
                out.put("int", v);
            }
            out.bytes
        };
        assert!(load("a.ply", &bytes(0.0, 3.0, 2.0)).is_ok());
        for (bytes, wanted) in [
            (bytes(f32::NAN, 3.0, 2.0), "vertex 2: is not a finite number, or larger than 1e15"),
            (
                bytes(f32::INFINITY, 3.0, 2.0),
                "vertex 2: is not a finite number, or larger than 1e15",
            ),
            (bytes(0.0, 3.0, 3.0), "face 0: names vertex 3, but there are 3 vertices"),
            (bytes(0.0, 3.0, -1.0), "face 0: names vertex -1, but there are 3 vertices"),
            (bytes(0.0, -3.0, 2.0), "face 0: List length cannot be negative (i8)"),
            (
                bytes(0.0, 127.0, 2.0),
                "face 0: the file ends here, but its header promises 1 of them",
            ),
        ] {
            assert_eq!(complaint("a.ply", &bytes), wanted);
        }
    }
}

#[test]
fn any_byte_may_be_wrong() {
    // No single wrong byte in a good file makes the reader panic or take memory that the file cannot back.
    let (path, cx) = (Path::new("any"), Context::default());
    for format in FORMATS {
        let good = written(format, "float", Some(("uchar", RGB)), FACES);
        for at in 0..good.len() {
            for byte in [0, b'-', b'9', b'\n', 0xff] {
                let mut bad = good.clone();
                bad[at] = byte;
                let _ = ply::read(path, &bad, &cx);
            }
        }
    }
}
