//! `catoptric analyze`: the folder that it writes, and what it refuses.

use serde_json::json;

use super::{Folder, OCTAHEDRON, SMALL, png_size};

const FILES: [&str; 9] = [
    "caustic.ply",
    "classes.png",
    "histogram.svg",
    "images.png",
    "plane.png",
    "report.json",
    "report.md",
    "slice.png",
    "slice.svg",
];

#[test]
fn a_bowl_has_a_folder_full_of_findings() {
    let folder = Folder::new();
    let line = format!("analyze --mirror bowl --object knot {SMALL} --points 500");
    let run = folder.good(&format!("{line} -o out --json figures.json"));
    assert!(run.out.contains("The report is out/report.md"), "{}", run.out);
    for name in FILES {
        assert!(!folder.read(&format!("out/{name}")).is_empty(), "{name}");
    }
    let figures = folder.json("figures.json");
    assert_eq!(figures, folder.json("out/report.json"));
    let count = |pointer: &str| {
        let value = figures.pointer(pointer).unwrap_or_else(|| panic!("{pointer} in {figures}"));
        value.as_u64().unwrap_or_else(|| panic!("{pointer}: {value}"))
    };
    let sum = |pointer: &str| -> u64 {
        figures
            .pointer(pointer)
            .unwrap()
            .as_array()
            .unwrap()
            .iter()
            .map(|n| n.as_u64().unwrap())
            .sum()
    };
    let classes = ["divergent", "convergent_then_divergent", "mixed", "turned_away"];
    let total: u64 = classes.iter().map(|name| count(&format!("/classes/{name}"))).sum();
    assert_eq!(total, count("/mirror_triangles"));
    assert_eq!(count("/cameras") + count("/classes/turned_away"), total);
    assert!(count("/classes/mixed") > 100);
    assert_eq!(sum("/objects/images"), count("/objects/points"));
    assert_eq!(sum("/objects/most_in_one_camera"), count("/objects/points"));
    assert_eq!(sum("/rays/images"), count("/rays/points"));
    assert_eq!(sum("/one_camera/images"), count("/one_camera/points"));
    assert!(count("/caustic/rulings") > count("/caustic/strips"));
    // Every figure that is printed is in the JSON.
    for number in [count("/classes/mixed"), count("/caustic/rulings"), count("/slice/triangle")] {
        assert!(run.out.contains(&number.to_string()), "{number}: {}", run.out);
    }
    assert_eq!(png_size(&folder.read("out/classes.png")), [160, 90]);
    assert_eq!(png_size(&folder.read("out/images.png")), [160, 90]);
    for name in ["slice.svg", "histogram.svg"] {
        let text = String::from_utf8(folder.read(&format!("out/{name}"))).unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"), "{name}");
    }
    let report = String::from_utf8(folder.read("out/report.md")).unwrap();
    for name in FILES.iter().filter(|name| !name.starts_with("report")) {
        assert!(report.contains(&format!("({name})")), "{name} is not in the report");
    }
    // The caustic is a mesh that can be read again.
    let info =
        folder.good(&format!("info --mirror bowl --object out/caustic.ply {SMALL} --json i.json"));
    assert!(info.out.contains("caustic"), "{}", info.out);
    let triangles = folder.json("i.json")["objects"][0]["triangles"].as_u64().unwrap();
    assert!(triangles > count("/caustic/rulings"), "{triangles}");

    // Again, into the folder that is there, with one thread: the same figures and bytes.
    let before: Vec<_> = FILES.map(|name| folder.read(&format!("out/{name}"))).into();
    folder.good(&format!("{line} -o out --threads 1"));
    for (name, before) in FILES.iter().zip(before) {
        // These two say how long the caustic took.
        if !name.starts_with("report") {
            assert!(folder.read(&format!("out/{name}")) == before, "{name} differs");
        }
    }
}

#[test]
fn a_plane_has_no_caustic_and_any_triangle_can_be_sliced() {
    let folder = Folder::new();
    let run =
        folder.good(&format!("analyze --mirror plane --object knot {SMALL} --points 200 -o flat"));
    assert!(run.out.contains("every camera sees every point once"), "{}", run.out);
    let figures = folder.json("flat/report.json");
    assert_eq!((&figures["slice"], &figures["caustic"]["strips"]), (&json!(null), &json!(0)));
    assert_eq!(figures["classes"]["mixed"], 0);
    assert!(!folder.path("flat/slice.png").exists());

    let line = format!("analyze --mirror bowl --object knot {SMALL} --points 200");
    folder.good(&format!("{line} -o a"));
    let first = folder.json("a/report.json");
    let triangle = first["slice"]["triangle"].as_u64().unwrap();
    folder.good(&format!("{line} -o b --triangle {triangle} --ray-scale unit"));
    let second = folder.json("b/report.json");
    assert_eq!(second["slice"]["triangle"], triangle);
    assert_eq!(
        (&first["ray_scale"], &second["ray_scale"]),
        (&json!("eye-distance"), &json!("unit"))
    );
    assert_ne!(first["slice"]["mixed_lambda"], second["slice"]["mixed_lambda"]);
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = Folder::new();
    folder.write("file", "").write("m.obj", OCTAHEDRON).write("bad.obj", "v 1 2\n");
    for (options, expected) in [
        ("--points 0", "--points"),
        ("--points -4", "--points"),
        ("--points 99999999999", "--points"),
        ("--points many", "--points"),
        ("--triangle -1", "--triangle"),
        (
            "--triangle 99999999",
            "--triangle: there is no mirror triangle 99999999; choose one from 0 to",
        ),
        (
            "--mirror plane --triangle 0",
            "--triangle: the camera of mirror triangle 0 sees every point once; ",
        ),
        ("--ray-scale long", "--ray-scale"),
        ("-o file", "file: is a file, and a folder is written; "),
        ("-o no/where", "no/where: cannot be written: its folder does not exist; "),
        ("--json no/f.json", "no/f.json: cannot be written: its folder does not exist; "),
        ("--surfels 0", "--surfels: 0 is not between 1 and"),
        ("--eye 1,2", "--eye"),
        ("--mirror bad.obj", "bad.obj: "),
        ("nothing.toml", "nothing.toml: does not exist; "),
    ] {
        let few = if options.contains("--surfels") { "" } else { "--surfels 5000" };
        folder.refused(&format!("analyze {few} {options}"), &[expected]);
    }
    // A cube's faces are flat, and half of them look away.
    let away = |k: &u32| {
        let line = format!("analyze --mirror cube --object knot --surfels 2000 --triangle {k}");
        folder.refused(&line, &[&format!("--triangle: the camera of mirror triangle {k} ")]);
        folder.run(&line).err.contains("looks away from the eye")
    };
    assert!((4..=8).contains(&(0..12).filter(away).count()));
}
