use super::*;

mod las;
mod whole;

const POINTS: [DVec3; 3] =
    [DVec3::new(0.1, -2.0, 3.0), DVec3::new(1e-7, 0.5, -1e6), DVec3::new(4.0, 5.25, 0.0)];

fn read(name: &str, bytes: &[u8]) -> Result<Vec<DVec3>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let mut reader = PointReader::open(&path)?;
    let mut all = Vec::new();
    loop {
        // Two at a time: parts join.
        let part = reader.read(2)?;
        assert!(part.len() <= 2);
        if part.is_empty() {
            assert!(reader.done() > 0.8 && reader.read(2)?.is_empty());
            return Ok(all);
        }
        all.extend(part);
    }
}

fn rows(between: &str) -> String {
    POINTS.map(|p| format!("{}{between}{}{between}{}", p.x, p.y, p.z)).join("\n")
}

fn ply(encoding: &str, count: usize, body: &[u8]) -> Vec<u8> {
    let header = format!(
        "ply\nformat {encoding} 1.0\nelement camera 2\nproperty uchar id\nproperty list uchar int list\n\
         element vertex {count}\nproperty double x\nproperty uchar red\nproperty double y\n\
         property double z\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n"
    );
    [header.as_bytes(), body].concat()
}

fn npy(dtype: &str, shape: &str, order: &str, body: &[u8]) -> Vec<u8> {
    let text = format!("{{'descr': '{dtype}', 'fortran_order': {order}, 'shape': {shape}, }}");
    let text = format!("{text:<117}\n");
    let length = u16::try_from(text.len()).unwrap().to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], text.as_bytes(), body].concat()
}

#[test]
fn texts_are_read_however_their_numbers_are_separated() {
    for between in [" ", "\t", "  ", ",", ", ", ";"] {
        assert_eq!(read("a.xyz", rows(between).as_bytes()).unwrap(), POINTS, "{between:?}");
    }
    let named = format!("# a scan\n\n{}\n", rows(",").replace('\n', "\r\n\r\n"));
    assert_eq!(read("a.CSV", named.as_bytes()).unwrap(), POINTS);
    let columns = "\u{feff}id,\"Z\",y,X\n1,3,-2,0.1\n2,-1e6,0.5,1e-7\n3,0,5.25,4";
    assert_eq!(read("a.csv", columns.as_bytes()).unwrap(), POINTS);
    let header = format!("east north up\n{}", rows(" "));
    assert_eq!(read("a.txt", header.as_bytes()).unwrap(), POINTS);
}

#[test]
fn vertices_of_meshes_are_points() {
    let obj = "o pile\nv 0.1 -2 3 1 0 0\nvn 0 1 0\nv 1e-7 0.5 -1e6\nvt 0 0\nv 4 5.25 0\nf 1 2 3\n";
    assert_eq!(read("a.obj", obj.as_bytes()).unwrap(), POINTS);
    let text = POINTS.map(|p| format!("{} 9 {} {}\n", p.x, p.y, p.z)).concat();
    let text = format!("1 2 5 6\n2 0\n{text}");
    assert_eq!(read("a.ply", &ply("ascii", 3, text.as_bytes())).unwrap(), POINTS);
    for little in [true, false] {
        let number = |v: f64| if little { v.to_le_bytes() } else { v.to_be_bytes() };
        let mut body = vec![1, 1, 0, 0, 0, 5, 2, 0];
        for p in POINTS {
            body.extend(number(p.x));
            body.push(9);
            body.extend([p.y, p.z].map(number).concat());
        }
        let encoding = if little { "binary_little_endian" } else { "binary_big_endian" };
        assert_eq!(read("a.ply", &ply(encoding, 3, &body)).unwrap(), POINTS, "{encoding}");
        let cut = read("a.ply", &ply(encoding, 3, &body[..body.len() - 1])).unwrap_err();
        assert!(cut.to_string().contains("vertex 2: the file ends here"), "{cut}");
    }
}

#[test]
fn arrays_of_either_precision_and_order_of_bytes() {
    let bytes = |f: fn(f64) -> Vec<u8>| -> Vec<u8> {
        POINTS.iter().flat_map(|p| p.to_array()).flat_map(f).collect()
    };
    let double = bytes(|v| v.to_le_bytes().to_vec());
    assert_eq!(read("a.npy", &npy("<f8", "(3, 3)", "False", &double)).unwrap(), POINTS);
    let big = bytes(|v| v.to_be_bytes().to_vec());
    assert_eq!(read("a.npy", &npy(">f8", "(3, 3)", "False", &big)).unwrap(), POINTS);
    #[expect(clippy::cast_possible_truncation, reason = "meant")]
    let single = bytes(|v| (v as f32).to_le_bytes().to_vec());
    let rounded = POINTS.map(|p| p.as_vec3().as_dvec3());
    assert_eq!(read("a.npy", &npy("<f4", "(3, 3)", "False", &single)).unwrap(), rounded);
    // Columns behind the third are passed over.
    let wide: Vec<u8> = double.chunks(24).flat_map(|row| [row, &[7; 8]].concat()).collect();
    assert_eq!(read("a.npy", &npy("<f8", "(3, 4)", "False", &wide)).unwrap(), POINTS);
}

#[test]
fn what_is_no_file_of_points_is_refused() {
    let long = "1 ".repeat(LONGEST);
    for (name, bytes, expected) in [
        ("a.xyz", &b"1 2 3\n1 2\n"[..], "line 2: has fewer than three numbers"),
        ("a.xyz", b"1 2 3\n1 two 3\n", "line 2: \"two\" is not a number"),
        ("a.xyz", b"1 2 3\n\n1 nan 3\n", "line 3: \"nan\" is not a finite number"),
        ("a.xyz", b"1 2 -1e16\n", "line 1: \"-1e16\" is not a finite number, or larger than 1e15"),
        ("a.csv", b"id,px,py,pz\n7,1,2,3\n", "line 1: names columns, but not x, y and z"),
        ("a.xyz", b"# nothing\n\n", "has no points"),
        ("a.xyz", b"1 2 \xff\n", "line 1: is not text"),
        ("a.xyz", long.as_bytes(), "line 1: is longer than 65536 bytes"),
        ("a.obj", b"f 1 2 3\n", "has no points"),
        ("a.obj", b"v 1 2\n", "line 1: has fewer than three numbers"),
        (
            "a.stl",
            b"solid",
            "convert it: .ply, .obj, .xyz, .csv, .txt, .npy, .las, .laz are supported",
        ),
        ("a.ply", b"1 2 3\n", "does not say \"ply\""),
        ("a.ply", &ply("ascii", 3, b"1 0\n2 0\n1 2 3\n"), "line 16: has fewer numbers"),
        ("a.ply", &ply("ascii", 9_999, b""), "promises 9999 elements \"vertex\""),
        ("a.npy", b"no array at all", "is no array of NumPy"),
        ("a.npy", b"\x93NUMPY\x02\x00\xff\xff\xff\xff", "has a header of 4294967295 bytes"),
        ("a.npy", b"\x93NUMPY\x01\x00\x40\x00{", "ends within its header"),
        (
            "a.npy",
            &npy("<f8", "((((((9, 3))))))", "False", &[0; 72]),
            "has a header with too many brackets",
        ),
        ("a.npy", &npy("<f8", "(9,)", "False", &[0; 72]), "has shape [9]; save an array"),
        ("a.npy", &npy("<f8", "(3, 3)", "True", &[0; 72]), "is in Fortran order"),
        ("a.npy", &npy("<i8", "(3, 3)", "False", &[0; 72]), "has elements '<i8'"),
        ("a.npy", &npy("<f8", "(4, 3)", "False", &[0; 72]), "promises 96 bytes of numbers"),
        ("a.npy", &npy("<f8", "(0, 3)", "False", &[]), "has no points"),
    ] {
        let error = read(name, bytes).unwrap_err().to_string();
        let shown = String::from_utf8_lossy(&bytes[..bytes.len().min(60)]);
        assert!(error.contains(expected), "{name} {shown:?}: {error}");
    }
}
