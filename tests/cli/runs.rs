//! Runs that must succeed, and what they write and say.

use serde_json::Value;

use super::{Folder, OCTAHEDRON, SMALL, png_size};

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

/// The keys of a frame's figures, in order.
const FIGURES: [&str; 19] = [
    "scene",
    "method",
    "backend",
    "device",
    "size",
    "surfels",
    "mirror_triangles",
    "cameras",
    "batches",
    "projections",
    "valid",
    "valid_share",
    "mean_steps",
    "mirror_pixels",
    "covered_pixels",
    "notes",
    "threads",
    "simd",
    "ms",
];

const STAGES: [&str; 13] = [
    "load",
    "sample",
    "tree",
    "shade",
    "ids",
    "cameras",
    "cull",
    "project",
    "splat",
    "layer",
    "rays",
    "composite",
    "frame",
];

#[test]
fn nothing_said_gives_the_built_in_scene() {
    let folder = Folder::new();
    // Where there is no display: else a window opens.
    let mut command = folder.command([""; 0]);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    if cfg!(all(feature = "viewer", not(target_os = "linux"))) {
        return;
    }
    let run = folder.finish(command);
    assert_eq!(run.code, Some(0), "{}", run.err);
    if cfg!(feature = "viewer") {
        let told = run.err.contains("there is no display") && run.err.contains("ssh -X");
        assert!(told && run.err.lines().count() == 1, "{}", run.err);
    }
    assert_eq!(png_size(&folder.read("catoptric.png")), [1280, 720]);
    assert_eq!(folder.listing().len(), 1);
    let place = folder.path("catoptric.png").canonicalize().unwrap();
    assert!(run.out.contains(place.to_str().unwrap()), "{}", run.out);
    assert!(run.out.contains("built-in scene") && run.out.contains("render --help"), "{}", run.out);
}

#[test]
fn models_stand_beside_the_teapot() {
    let folder = Folder::new();
    folder.write("gem.obj", OCTAHEDRON);
    let run = folder.good(&format!("render gem.obj {SMALL} -o gem.png --json gem.json"));
    assert_eq!(png_size(&folder.read("gem.png")), [160, 90]);
    assert!(run.out.contains("gem.png: 160 x 90"), "{}", run.out);
    let figures = folder.json("gem.json");
    assert_eq!(figures["scene"], "gem");
    assert!(figures["covered_pixels"].as_u64() > Some(100), "{figures}");
    folder.good(&format!("info gem.obj gem.obj {SMALL} --json info.json"));
    let info = folder.json("info.json");
    let names: Vec<&Value> =
        info["objects"].as_array().unwrap().iter().map(|o| &o["name"]).collect();
    assert_eq!(names, ["gem", "gem-2", "ground"]);
    assert_eq!(info["mirrors"][0]["name"], "teapot");
}

#[test]
fn mirrors_and_objects_by_name_and_by_file() {
    let folder = Folder::new();
    folder.write("gem.obj", OCTAHEDRON);
    let line = "info --mirror sphere --mirror gem.obj --object gem.obj --object cube --json a.json";
    folder.good(&format!("{line} {SMALL}"));
    let info = folder.json("a.json");
    let names = |what: &str| -> Vec<String> {
        info[what].as_array().unwrap().iter().map(|o| o["name"].as_str().unwrap().into()).collect()
    };
    assert_eq!(names("mirrors"), ["sphere", "gem"]);
    assert_eq!(names("objects"), ["gem-2", "cube"], "no ground and nothing else");
    // Files stay as placed.
    let gem = &info["objects"][0];
    assert_eq!(gem["triangles"], 8);
    for (corner, wanted) in [("min", -1.0), ("max", 1.0)] {
        for found in gem["box"][corner].as_array().unwrap() {
            // The box is that of the surfels.
            assert!((found.as_f64().unwrap() - wanted).abs() < 0.05, "{gem}");
        }
    }
    assert_eq!(info["surfels"], 20_000);
}

#[test]
fn every_shape_is_a_mirror_and_an_object() {
    let folder = Folder::new();
    let shapes = [
        "teapot",
        "sphere",
        "ellipsoid",
        "torus",
        "goblet",
        "bowl",
        "wave",
        "plane",
        "ground",
        "cube",
        "cylinder",
        "cone",
        "knot",
    ];
    for shape in shapes {
        for method in ["c3rc", "raytrace"] {
            let line = format!("--mirror {shape} --object {shape} --method {method}");
            folder.good(&format!("render {line} --size 64x36 --surfels 2000 -o {shape}.png"));
        }
    }
    assert_eq!(folder.listing().len(), shapes.len());
}

#[test]
fn odd_views_give_pictures() {
    let folder = Folder::new();
    folder.write("behind.obj", "v 0.1 0.6 -3\nv -0.1 0.6 -3\nv 0 0.7 -3\nf 1 2 3\n");
    folder.write(
        "alone.toml",
        "[eye]\nposition = [0, 1, 3]\ntarget = [0, 0, 0]\n[[mirror]]\nshape = \"cone\"\n",
    );
    for (scene, sees_mirror, nothing_to_reflect) in [
        // Looking away: no mirror triangle is visible.
        ("default --eye 0,1,3 --target 0,1,9", false, true),
        // Inside the mirror, and behind a flat one.
        ("--mirror sphere --object cube --eye 0,0.6,0 --target 1,0.6,0", true, false),
        ("--mirror plane --object cube --eye 0.2,0.5,-2 --target 0,0.5,0", true, false),
        // Nothing to reflect but the sky.
        ("--mirror sphere", true, true),
        ("alone.toml", true, true),
        // All that there is lies behind the mirror.
        ("--mirror sphere --object behind.obj --eye 0,0.6,4 --target 0,0.6,0", true, true),
        // Far off, through a keyhole, and with the widest lens.
        ("default --eye 1e12,0,0", false, true),
        ("default --fov 1e-9", true, false),
        ("default --fov 179.999", false, true),
    ] {
        for method in ["c3rc", "c3rc --preset paper", "raytrace"] {
            let line = format!("render {scene} --method {method} {SMALL} -o a.png --json a.json");
            folder.good(&line);
            assert_eq!(png_size(&folder.read("a.png")), [160, 90]);
            let figures = folder.json("a.json");
            let pixels = |key: &str| figures[key].as_u64().unwrap();
            assert_eq!(pixels("mirror_pixels") > 0, sees_mirror, "{line}: {figures}");
            assert!(pixels("covered_pixels") == 0 || !nothing_to_reflect, "{line}: {figures}");
        }
    }
}

#[test]
fn figures_of_a_frame() {
    let folder = Folder::new();
    for (method, flags, unmeasured) in [
        ("c3rc", "", vec!["project", "rays"]),
        ("c3rc", "--cameras cells", vec!["rays"]),
        ("raytrace", "", vec!["cameras", "cull", "project", "splat", "layer"]),
    ] {
        let line =
            format!("render default --method {method} {flags} {SMALL} -o a.png --json a.json");
        for repeat in ["", "--repeat 3"] {
            let run = folder.good(&format!("{line} {repeat}"));
            let figures = folder.json("a.json");
            assert_eq!(keys(&figures), FIGURES, "{method}");
            assert_eq!(keys(&figures["ms"]), STAGES, "{method}");
            for (stage, ms) in figures["ms"].as_object().unwrap() {
                assert_eq!(ms.is_null(), unmeasured.contains(&stage.as_str()), "{method} {stage}");
                assert!(ms.is_null() || ms.as_f64() >= Some(0.0), "{method} {stage} {ms}");
            }
            assert_eq!(figures["method"], method);
            assert_eq!(
                (&figures["scene"], &figures["backend"]),
                (&"default".into(), &"cpu".into())
            );
            assert_eq!(figures["size"], serde_json::json!([160, 90]));
            assert_eq!(
                (&figures["surfels"], &figures["mirror_triangles"]),
                (&20_000.into(), &4_000.into())
            );
            let counts =
                ["cameras", "batches", "projections", "valid"].map(|key| figures[key].as_u64());
            if method == "c3rc" {
                let [cameras, batches, projections, valid] = counts.map(Option::unwrap);
                assert!(
                    0 < cameras && 0 < batches && batches <= projections && valid <= projections
                );
                let share = figures["valid_share"].as_f64().unwrap();
                assert!((share - valid as f64 / projections as f64).abs() < 1e-12);
                assert!(run.out.contains(&format!("{projections} projections")), "{}", run.out);
            } else {
                assert_eq!(counts, [None; 4], "{figures}");
                assert!(figures["cameras"].is_null() && figures["valid_share"].is_null());
            }
            let [mirror, covered] =
                ["mirror_pixels", "covered_pixels"].map(|key| figures[key].as_u64().unwrap());
            assert!(0 < covered && covered <= mirror && mirror < 160 * 90);
        }
    }
}

/// One object near a curved mirror.
const KNOT: &str = "--mirror teapot --object knot --eye -0.35,0.55,1.22 --target 0.05,0.37,0";

#[test]
fn reflections_are_compared_with_rays() {
    let folder = Folder::new();
    let size = "--size 320x180 --surfels 150000";
    let rays = "--method raytrace --rays camera --mirror-occlusion off";
    folder.good(&format!("render {KNOT} {size} -o a.png --aov a.exr"));
    folder.good(&format!("render {KNOT} {size} {rays} -o b.png --aov b.exr"));
    let compared = |line: &str| {
        let run = folder.good(&format!("compare {line} --json c.json"));
        (folder.json("c.json"), run.out)
    };
    let (found, out) = compared("a.exr b.exr --where object --heatmap map.png");
    assert_eq!(
        keys(&found),
        ["where", "pixels", "rmse", "psnr", "flip", "missing", "extra", "position", "objects"]
    );
    assert_eq!(keys(&found["position"]), ["median", "p95", "p99"]);
    assert_eq!(png_size(&folder.read("map.png")), [320, 180]);
    for key in ["rmse", "psnr", "flip", "missing", "extra"] {
        assert!(found[key].as_f64() >= Some(0.0) && out.contains(key), "{key}: {found} {out}");
    }
    // A splat lands nearly everywhere where a ray meets the object, and where the ray does.
    assert!(found["missing"].as_f64() < Some(0.01), "{found}");
    // Squares of two pixels are fat at this size.
    assert!(found["extra"].as_f64() < Some(0.3), "{found}");
    assert!(found["position"]["median"].as_f64() < Some(0.02), "{found}");
    let (named, _) = compared("a.exr b.exr --where object=knot");
    assert_eq!(named["objects"], found["objects"]);
    assert_eq!(named["objects"][0]["name"], "knot");
    // The control: without the object all of it is missing.
    folder
        .good(&format!("render {} {size} -o d.png --aov d.exr", KNOT.replace("--object knot", "")));
    let (without, _) = compared("d.exr b.exr --where object");
    assert_eq!((&without["missing"], &without["position"]), (&1.0.into(), &Value::Null));
    assert!(without["rmse"].as_f64() > Some(2.0 * found["rmse"].as_f64().unwrap()), "{without}");

    let (same, _) = compared("b.exr b.exr --where mirror");
    for key in ["rmse", "flip", "missing", "extra"] {
        assert_eq!(same[key], 0.0, "{key}");
    }
    assert!(same["psnr"].is_null(), "infinite");
    let (bare, _) = compared("a.png b.png");
    assert!(bare["rmse"].as_f64() > Some(0.0));
    assert!(bare["position"].is_null() && bare["missing"].is_null(), "{bare}");
}

#[test]
fn the_layer_is_timed_against_rays() {
    let folder = Folder::new();
    let run = folder.good(&format!("bench layer {KNOT} {SMALL} --repeat 5 --json a.json"));
    let found = folder.json("a.json");
    let mut wanted = FIGURES.to_vec();
    wanted.extend(["layer_ms", "rays_ms", "ratio", "pairs"]);
    assert_eq!(keys(&found), wanted);
    assert_eq!(keys(&found["ratio"]), ["median", "q1", "q3", "n", "noisy"]);
    let [q1, median, q3] = ["q1", "median", "q3"].map(|key| found["ratio"][key].as_f64().unwrap());
    assert!(0.0 < q1 && q1 <= median && median <= q3, "{found}");
    assert!(found["layer_ms"].as_f64() > Some(0.0) && found["rays_ms"].as_f64() > Some(0.0));
    assert_eq!(found["pairs"], 5);
    assert!(run.out.contains("ratio") && run.out.contains("quartiles"), "{}", run.out);
    let away =
        format!("bench layer --mirror sphere {SMALL} --eye 0,1,3 --target 0,1,9 --json b.json");
    folder.refused(&away, &["the eye sees no mirror; choose another --eye"]);
}

#[test]
fn info_says_what_a_scene_holds() {
    let folder = Folder::new();
    let run = folder.good(&format!("info default {SMALL} --json a.json"));
    let found = folder.json("a.json");
    assert_eq!(keys(&found), ["scene", "notes", "surfels", "mirrors", "objects", "methods", "ms"]);
    let objects = found["objects"].as_array().unwrap();
    let surfels: u64 = objects.iter().map(|o| o["surfels"].as_u64().unwrap()).sum();
    assert_eq!((Some(surfels), surfels), (found["surfels"].as_u64(), 20_000));
    for object in objects {
        assert_eq!(keys(object), ["name", "triangles", "is_cloud", "surfels", "box", "tree"]);
        assert!(run.out.contains(object["name"].as_str().unwrap()), "{}", run.out);
    }
    let methods = found["methods"].as_array().unwrap();
    assert!(methods.len() >= 2 && methods.iter().all(|m| m["refusal"].is_null()), "{found}");
}

#[test]
fn every_format_is_written() {
    let folder = Folder::new();
    for name in ["a.png", "a.PNG", "a.exr", "a.hdr"] {
        folder.good(&format!("render {SMALL} -o {name}"));
    }
    assert_eq!(folder.read("a.png"), folder.read("a.PNG"));
    assert!(folder.read("a.exr").starts_with(&[0x76, 0x2f, 0x31, 0x01]));
    assert!(folder.read("a.hdr").starts_with(b"#?RADIANCE"));
}

#[test]
fn help_names_every_option() {
    let folder = Folder::new();
    let scene = "--mirror --object --surfels --leaf --leaf-size --seed --eye --target --fov --size --threads";
    let how = "--method --backend --preset --repeat --test --splat --depth --ray-scale --roots --rays --spp \
               --mirror-occlusion --quality --cameras --detail";
    for (command, options) in [
        ("", "render compare info bench --version".to_owned()),
        ("render", format!("{scene} {how} --output --aov --json --frames --orbit")),
        ("info", format!("{scene} --json")),
        ("bench", "layer".into()),
        ("bench layer", format!("{scene} {how} --json")),
        ("compare", "--where --aov-a --aov-b --json --heatmap <A> <B>".into()),
    ] {
        for help in ["--help", "-h"] {
            let out = folder.good(&format!("{command} {help}")).out;
            for option in options.split_whitespace() {
                assert!(out.contains(option), "{command} {help}: no {option} in {out}");
            }
        }
    }
    let version = folder.good("--version").out;
    assert_eq!(version, format!("catoptric {}\n", env!("CARGO_PKG_VERSION")));
    assert!(folder.listing().is_empty());
}

#[test]
fn nobody_needs_to_listen() {
    let folder = Folder::new();
    for line in [&format!("render {SMALL} -o a.png"), "info --surfels 9", "render --leaf 0"] {
        let mut child = folder.command(line.split_whitespace()).spawn().unwrap();
        // Closes the pipes' other ends.
        drop((child.stdout.take(), child.stderr.take()));
        let wanted = if line.contains("--leaf 0") { 2 } else { 0 };
        assert_eq!(child.wait().unwrap().code(), Some(wanted), "{line}");
    }
    assert_eq!(png_size(&folder.read("a.png")), [160, 90]);
}

#[test]
fn several_rays_a_pixel_come_nearer_to_many() {
    let folder = Folder::new();
    let line = "render default --size 320x180 --surfels 1000 --method raytrace";
    folder.good(&format!("{line} --spp 64 -o many.exr --aov many.aov.exr"));
    let error = |spp: u32| {
        folder.good(&format!("{line} --spp {spp} -o few.exr"));
        folder.good("compare few.exr many.exr --aov-b many.aov.exr --where object --json e.json");
        folder.json("e.json")["rmse"].as_f64().unwrap()
    };
    let (one, four) = (error(1), error(4));
    assert!(four < 0.7 * one, "{four} is not much less than {one}");
}

#[test]
fn the_scene_of_the_readme_runs() {
    let folder = Folder::new();
    let readme = include_str!("../../README.md");
    let scene = readme.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    std::fs::write(folder.path("readme.toml"), scene).unwrap();
    let run = folder.good("render readme.toml --size 160x90 --surfels 20000");
    assert!(run.out.contains("pot and knot"), "{}", run.out);
}

#[test]
fn an_orbit_is_a_picture_a_frame_and_its_restlessness() {
    let folder = Folder::new();
    folder.good(&format!("render {KNOT} {SMALL} -o still.png"));
    let line = format!("render {KNOT} {SMALL} --frames 4 --orbit 8 -o a.png --json a.json");
    let out = folder.good(&line).out;
    let frames: Vec<_> = (0..4).map(|i| folder.read(&format!("a-000{i}.png"))).collect();
    assert_eq!(folder.listing().len(), 6, "{:?}", folder.listing());
    assert!(frames[0] == folder.read("still.png"), "it begins where the scene's eye is");
    assert!(frames.windows(2).all(|pair| pair[0] != pair[1]));
    let figures = folder.json("a.json");
    let orbit = &figures["orbit"];
    assert_eq!((&orbit["frames"], &orbit["degrees"]), (&4.into(), &8.0.into()));
    for key in ["second_difference", "rms_median", "rms_max"] {
        assert!(orbit[key].as_f64() > Some(0.0), "{key}: {figures}");
    }
    assert!(orbit["rms_max"].as_f64() >= orbit["rms_median"].as_f64());
    assert!(out.contains("4 frames over 8 degrees"), "{out}");
    // A whole turn does not show its first frame twice; an eye that does not move sees no change.
    folder.good(&format!("render {KNOT} {SMALL} --frames 2 -o b.png --json b.json"));
    assert!(folder.read("b-0000.png") != folder.read("b-0001.png"));
    folder.good(&format!("render {KNOT} {SMALL} --frames 3 --orbit 0 -o c.png --json c.json"));
    let still = &folder.json("c.json")["orbit"];
    assert_eq!((&still["second_difference"], &still["rms_max"]), (&0.0.into(), &0.0.into()));
}

#[test]
fn qualities_are_names_for_parameters() {
    let folder = Folder::new();
    let picture = |options: &str| {
        folder.good(&format!("render {KNOT} {SMALL} {options} -o a.png"));
        folder.read("a.png")
    };
    assert!(picture("--quality draft") == picture("--detail 1"));
    assert!(picture("--quality draft --detail 0") == picture("--detail 0"));
    assert!(picture("--quality best") == picture("--detail 4"));
    assert!(picture("--quality default") == picture(""));
    assert!(picture("--quality best") != picture(""));
    assert!(picture("--method raytrace --quality best") == picture("--method raytrace --spp 16"));
}
