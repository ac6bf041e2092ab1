//! Normals and colours.

use super::super::*;
use super::{npy, ply};

fn read(name: &str, bytes: &[u8]) -> Result<(PointLayout, Vec<FilePoint>)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let mut reader = PointReader::open(&path)?;
    let mut all = Vec::new();
    loop {
        let part = reader.read_whole(2)?;
        if part.is_empty() {
            return Ok((reader.layout(), all));
        }
        all.extend(part);
    }
}

const POSITION: DVec3 = DVec3::new(1.5, -2.0, 3.0);
const NORMAL: Vec3 = Vec3::new(0.0, 0.6, -0.8);
const COLOR: Vec3 = Vec3::new(255.0, 128.0, 7.0);

#[test]
fn columns_of_text_are_told_by_their_number_and_by_their_names() {
    let by_largest = Some(Colors::ByLargest);
    for (text, normals, colors) in [
        ("1.5 -2 3", false, None),
        ("1.5 -2 3 255", false, Some(Colors::Intensity)),
        ("1.5 -2 3 0 0.6 -0.8", true, None),
        ("1.5;-2;3;255;128;7", false, by_largest),
        ("1.5,-2,3,0.1,255,128,7", false, by_largest),
        ("1.5 -2 3 0 0.6 -0.8 255 128 7", true, by_largest),
        ("1.5 -2 3 255 128 7 0 0.6 -0.8", true, by_largest),
        ("1.5 -2 3 9 9", false, None),
        ("1.5 -2 3 tree", false, None),
        ("// a scan\nR,G,B,id,z,y,x\n255,128,7,q,3,-2,1.5", false, by_largest),
        (
            "Normal_X nx ny nz x y z Intensity\n9 0 .6 -.8 1.5 -2 3 255",
            true,
            Some(Colors::Intensity),
        ),
    ] {
        let (layout, points) = read("a.txt", text.as_bytes()).unwrap();
        assert_eq!(layout, PointLayout { normals, colors }, "{text}");
        let color = match colors {
            Some(Colors::Intensity) => Vec3::splat(255.0),
            Some(_) => COLOR,
            None => Vec3::ZERO,
        };
        let normal = if normals { NORMAL } else { Vec3::ZERO };
        assert_eq!(points, [FilePoint { position: POSITION, normal, color }], "{text}");
    }
    // A later row that is no normal: all are colours.
    let mixed = "0 0 0 0 1 0\n".repeat(500) + "0 0 0 10 20 30\n";
    assert_eq!(read("a.xyz", mixed.as_bytes()).unwrap().0.colors, by_largest);
    let (layout, points) = read("a.obj", b"v 1.5 -2 3 1 0.5 0\nv 1 2 3 0 0 1\n").unwrap();
    assert_eq!(layout.colors, Some(Colors::Srgb(1.0)));
    assert_eq!(points[0].color, Vec3::new(1.0, 0.5, 0.0));
}

#[test]
fn ply_has_names_and_types() {
    for (number, names, colors) in [
        ("uchar", ["red", "green", "blue"], Colors::Srgb(255.0)),
        ("ushort", ["diffuse_red", "diffuse_green", "diffuse_blue"], Colors::Srgb(65535.0)),
        ("float", ["r", "g", "b"], Colors::Linear),
    ] {
        let mut text = "ply\nformat ascii 1.0\nelement vertex 1\n".to_owned();
        for (number, name) in ["x", "y", "z", "normal_x", "normal_y", "normal_z"]
            .map(|name| ("double", name))
            .into_iter()
            .chain(names.map(|name| (number, name)))
        {
            text += &format!("property {number} {name}\n");
        }
        text += "end_header\n1.5 -2 3 0 0.6 -0.8 255 128 7\n";
        let (layout, points) = read("a.ply", text.as_bytes()).unwrap();
        assert_eq!(layout, PointLayout { normals: true, colors: Some(colors) });
        assert_eq!(points, [FilePoint { position: POSITION, normal: NORMAL, color: COLOR }]);
    }
    let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\nproperty float scalar_Intensity\nend_header\n1.5 -2 3 9\n";
    let (layout, points) = read("a.ply", text.as_bytes()).unwrap();
    assert_eq!((layout.colors, points[0].color), (Some(Colors::Intensity), Vec3::splat(9.0)));
}

/// Vertices without lists are read another way.
#[test]
fn binary_ply_is_the_same_with_and_without_lists() {
    for little in [true, false] {
        let number = |v: f64| if little { v.to_le_bytes() } else { v.to_be_bytes() };
        let order = if little { "little" } else { "big" };
        let mut found = Vec::new();
        for list in ["", "property list uchar uchar tags\n"] {
            let mut bytes = format!(
                "ply\nformat binary_{order}_endian 1.0\nelement vertex 2\nproperty uchar red\n\
                 property double x\nproperty double z\nproperty uchar green\nproperty char c\n\
                 property double y\nproperty uchar blue\n{list}end_header\n"
            )
            .into_bytes();
            for _ in 0..2 {
                bytes.push(255);
                bytes.extend([1.5, 3.0].map(number).concat());
                bytes.extend([128, 0xff]);
                bytes.extend(number(-2.0));
                bytes.push(7);
                bytes.extend((!list.is_empty()).then_some(0));
            }
            let (layout, points) = read("a.ply", &bytes).unwrap();
            assert_eq!(layout.colors, Some(Colors::Srgb(255.0)));
            let point = FilePoint { position: POSITION, normal: Vec3::ZERO, color: COLOR };
            assert_eq!(points, [point; 2]);
            let cut = read("a.ply", &bytes[..bytes.len() - 1]).unwrap_err().to_string();
            assert!(cut.contains("vertex 1: the file ends here"), "{cut}");
            found.push(points);
        }
        assert_eq!(found[0], found[1]);
    }
}

/// Cut off anywhere: points, or an error in one line; never a panic.
#[test]
fn files_that_are_cut_off_anywhere() {
    let body: Vec<u8> = (0..75).collect();
    let numbers: Vec<u8> = (0..9).flat_map(|i| f64::from(i).to_le_bytes()).collect();
    let names = ["x,y,z,nx,ny,nz,r,g,b\n", "1,2,3,0,1,0,255,7,9\n", "-1e3,2,3,0,1,0,255,7,9"];
    for (name, bytes) in [
        ("a.ply", ply("ascii", 2, b"1 1 5\n2 1 0\n1 9 2 3\n4 9 5 6\n")),
        ("a.ply", ply("binary_little_endian", 3, &[&[1, 1, 0, 0, 0, 5, 0][..], &body].concat())),
        ("a.npy", npy("<f8", "(3, 3)", "False", &numbers)),
        ("a.csv", names.concat().into_bytes()),
        ("a.obj", b"v 1 2 3 0.5 0.5 0.5\nv 1 2 3 0 0 1\n".to_vec()),
    ] {
        for length in 0..bytes.len() {
            if let Err(e) = read(name, &bytes[..length]) {
                let e = e.to_string();
                assert!(e.contains(name) && !e.contains('\n'), "{name} {length}: {e}");
            }
        }
    }
}
