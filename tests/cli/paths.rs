//! `catoptric paths` as a user types it.

use serde_json::Value;

use super::{Folder, OCTAHEDRON};

/// Points before the plane mirror at z = 0, and one behind it.
const POINTS: &str = "x,y,z\n0.1,0.6,1\n-0.2,0.4,0.5\n0,0.5,-1\n";
const PLANE: &str = "paths plane.toml --eye 0,0.5,2 --points points.csv";

fn plane() -> Folder {
    let folder = Folder::new();
    folder.write("points.csv", POINTS).write(
        "plane.toml",
        "[eye]\nposition = [0, 0.5, 2]\ntarget = [0, 0.5, 0]\n[[mirror]]\nshape = \"plane\"\n",
    );
    folder
}

/// Rows of numbers of a CSV file, and its names.
fn table(folder: &Folder, name: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = String::from_utf8(folder.read(name)).unwrap();
    let mut lines = text.lines().map(|line| line.split(','));
    let names = lines.next().unwrap().map(String::from).collect();
    let rows = lines.map(|line| line.map(|word| word.parse().unwrap()).collect()).collect();
    (names, rows)
}

#[test]
fn ghosts_of_a_plane_mirror_are_mirrored_points() {
    let folder = plane();
    let run = folder.good(&format!("{PLANE} -o out.csv --json out.json"));
    assert!(run.out.contains("0: 33.33 %, 1: 66.67 %"), "{}", run.out);
    let (names, rows) = table(&folder, "out.csv");
    assert_eq!((names.len(), rows.len()), (29, 2));
    let get = |row: usize, name: &str| rows[row][names.iter().position(|n| n == name).unwrap()];
    for (row, point) in [[0.1, 0.6, 1.0], [-0.2, 0.4, 0.5]].into_iter().enumerate() {
        assert_eq!(get(row, "point"), row as f64);
        for (axis, mirrored) in [("x", point[0]), ("y", point[1]), ("z", -point[2])] {
            assert!((get(row, &format!("ghost_{axis}")) - mirrored).abs() < 1e-12);
        }
        assert!((get(row, "lambda") - point[2] / 2.0).abs() < 1e-12);
        for (name, value) in
            [("parity", 1.0), ("near_caustic", 0.0), ("occluded", 0.0), ("mirror_z", 0.0)]
        {
            assert_eq!(get(row, name), value, "{name}");
        }
    }
    let figures = folder.json("out.json");
    assert_eq!(figures["points_by_images"], serde_json::json!([1, 2, 0, 0]));
    assert_eq!((&figures["points"], &figures["images"]), (&Value::from(3), &Value::from(2)));
    assert_eq!((&figures["cameras"], &figures["refined"]), (&Value::from(2), &Value::Null));
    // The scene's own eye is the same one.
    folder.good("paths plane.toml --points points.csv -o same.csv");
    assert_eq!(folder.read("same.csv"), folder.read("out.csv"));
}

/// The elements of a packed NumPy or PLY table behind its header, and how many its header promises.
fn packed(folder: &Folder, name: &str, row_bytes: usize) -> (usize, Vec<u8>) {
    let bytes = folder.read(name);
    let (end, mark): (usize, &[u8]) = if bytes.starts_with(b"ply") {
        (bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11, b"element vertex ")
    } else {
        assert!(bytes.starts_with(b"\x93NUMPY\x01\x00"));
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]])) + 10;
        assert!(length.is_multiple_of(64) && bytes[length - 1] == b'\n');
        (length, b"'shape': (")
    };
    let at = bytes.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len();
    let digits: Vec<u8> = bytes[at..].iter().copied().take_while(u8::is_ascii_digit).collect();
    let count = String::from_utf8(digits).unwrap().parse().unwrap();
    let body = bytes[end..].to_vec();
    assert_eq!(body.len(), count * row_bytes, "{name}");
    (count, body)
}

#[test]
fn all_formats_hold_the_same_and_so_does_any_number_of_threads() {
    let folder = Folder::new();
    let row = |i: u32| {
        format!(
            "{} {} {}\n",
            (i % 40) as f64 * 0.1 - 2.0,
            (i / 40 % 40) as f64 * 0.05,
            (i / 1600) as f64 * 0.2
        )
    };
    folder.write("points.xyz", (0..80_000).map(row).collect::<String>());
    let line = "paths --mirror bowl --object cube --eye 0.3,1,3 --points points.xyz";
    folder.good(&format!("{line} -o out.csv --json a.json"));
    let (_, rows) = table(&folder, "out.csv");
    let bytes = 20 * 8 + 3 * 4 + 6;
    folder.good(&format!("{line} -o out.npy"));
    folder.good(&format!("{line} -o out.ply"));
    let (count, npy) = packed(&folder, "out.npy", bytes);
    let (vertices, ply) = packed(&folder, "out.ply", bytes);
    assert!(count > 40_000 && count == rows.len() && count == vertices);
    assert_eq!(npy, ply);
    let double = |at: usize| f64::from_le_bytes(npy[at..at + 8].try_into().unwrap());
    for i in [0, 1, count / 2, count - 1] {
        assert_eq!(double(i * bytes), rows[i][0]);
        assert_eq!(double(i * bytes + 16), rows[i][2]);
        let point = u32::from_le_bytes(npy[i * bytes + 24..i * bytes + 28].try_into().unwrap());
        assert_eq!(f64::from(point), rows[i][3]);
        assert_eq!(f64::from(npy[(i + 1) * bytes - 1]), rows[i][28]);
    }
    assert!(rows.is_sorted_by(|a, b| a[3] <= b[3]), "in the order of the points");
    folder.good(&format!("{line} -o one.npy --threads 1"));
    assert_eq!(folder.read("one.npy"), folder.read("out.npy"));
    let mut narrow = folder.command(format!("{line} -o sse.npy").split_whitespace());
    narrow.env("CATOPTRIC_SIMD", "sse2");
    assert_eq!(folder.finish(narrow).code, Some(0));
    assert_eq!(folder.read("sse.npy"), folder.read("out.npy"));
    // Counts are those of the paths.
    folder.good(&format!("{line} --count -o counts.csv --json b.json"));
    let (names, counts) = table(&folder, "counts.csv");
    assert_eq!(names, ["point_x", "point_y", "point_z", "images", "near_caustic"]);
    let mut of_paths = rows.iter().map(|row| row[3]).peekable();
    for (i, row) in (0_u32..).zip(&counts) {
        let own = std::iter::from_fn(|| of_paths.next_if_eq(&f64::from(i))).count();
        assert_eq!(row[3], own as f64, "point {i}");
    }
    assert_eq!((counts.len(), of_paths.next()), (80_000, None));
    let [a, b] = ["a.json", "b.json"].map(|name| folder.json(name));
    assert_eq!(a["points_by_images"], b["points_by_images"]);
    assert_eq!((&b["hidden_by_mirror"], &b["miss_max"]), (&Value::Null, &Value::Null));
    // Ghosts are points again; of a table it is not clear which of its points are meant.
    folder.good("paths --mirror plane --points out.ply --count --json c.json");
    assert_eq!(folder.json("c.json")["points"], a["images"]);
    let line = "paths --mirror plane --points out.csv --count";
    folder.refused(line, &["out.csv: line 1: names columns, but not x, y and z; "]);
    assert!(a["hidden_by_object"].as_u64() > Some(0), "{a}");
}

#[test]
fn a_refinement_makes_paths_exact() {
    let folder = Folder::new();
    folder.write("points.txt", "2 1 1\n-1 2 2\n0 -1 3\n1.5 0 1\n");
    let line = "paths --mirror sphere --eye 0,1,5 --points points.txt";
    folder.good(&format!("{line} -o a.csv --json a.json"));
    let run = folder.good(&format!("{line} -o b.csv --json b.json --refine"));
    assert!(run.out.contains("refined       100.00 %"), "{}", run.out);
    let [a, b] = ["a.json", "b.json"].map(|name| folder.json(name)["miss_max"].as_f64().unwrap());
    assert!(a > 1e-5 && b < 1e-12, "{a} {b}");
    assert_eq!(folder.json("b.json")["refined"], folder.json("b.json")["images"]);
}

#[test]
fn bad_requests() {
    let folder = plane();
    folder.write("bad.xyz", "1 2 3\n1 x 3\n").write("mesh.obj", OCTAHEDRON).write("void.xyz", "");
    std::fs::create_dir(folder.path("folder.csv")).unwrap();
    for (options, expected) in [
        ("--points none.xyz", "none.xyz: does not exist; check the name"),
        ("--points bad.xyz -o out.csv", "bad.xyz: line 2: \"x\" is not a number"),
        ("--points void.xyz", "void.xyz: is empty"),
        ("--points folder.csv", "folder.csv: is a folder"),
        ("--points plane.toml", "plane.toml: is not of a kind that points are read from"),
        ("--points points.csv -o out.txt", "out.txt: not a table format that can be written"),
        ("--points points.csv -o none/out.csv", "none/out.csv: cannot be written"),
        ("--points points.csv -o folder.csv", "folder.csv: cannot be written: it names a folder"),
        ("--points points.csv -o a.csv --json a.csv", "--json: names the same file as --output"),
        ("--points points.csv --json none/a", "none/a: cannot be written"),
        ("--points points.csv --eye nan,0,0", "--eye"),
        ("--points points.csv --eye 1e16,0,0", "--eye: is not finite, or beyond 1e15"),
        ("--points points.csv --mirror pot", "--mirror: there is no built-in shape \"pot\""),
        ("--points points.csv --ray-scale long", "--ray-scale"),
        ("--points points.csv --count --refine", "--refine"),
        ("--points points.csv --threads 0", "--threads"),
        ("", "--points"),
    ] {
        folder.refused(&format!("paths {options}"), &[expected]);
    }
    // The control.
    folder.good("paths --mirror mesh.obj --points mesh.obj -o out.ply");
}

#[test]
fn an_output_that_fails_keeps_the_old_file() {
    let folder = Folder::new();
    let row = |i: u32| format!("{} 1 2\n", f64::from(i) * 1e-5);
    let rows: String = (0..200_000).map(row).collect();
    folder.write("late.xyz", rows + "1 2 three\n").write("out.npy", "precious");
    let line = "paths --mirror sphere --points late.xyz -o out.npy --json out.json";
    folder.refused(line, &["late.xyz: line 200001: \"three\" is not a number"]);
    assert_eq!(folder.read("out.npy"), b"precious");
}

#[test]
fn points_are_not_overwritten_nor_guessed() {
    let folder = Folder::new();
    let text = "x,y,z\n0,0.6,2\n";
    folder.write("p.csv", text).write("odd.csv", "id,px,py,pz\n7,1,2,3\n");
    for output in ["p.csv", "./p.csv"] {
        folder.refused(
            &format!("paths --mirror sphere --points p.csv -o {output}"),
            &["--output: names the same file as --points; "],
        );
    }
    assert_eq!(folder.read("p.csv"), text.as_bytes());
    folder.refused(
        "paths --mirror sphere --points odd.csv -o out.csv",
        &["odd.csv: line 1: names columns, but not x, y and z; "],
    );
}
