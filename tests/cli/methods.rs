//! The methods beside c3rc, and the bench of all of them.

use super::{Folder, SMALL, png_size};

const BALL: &str = "--mirror sphere --object knot";

#[test]
fn searches_and_maps_draw_what_they_can() {
    let folder = Folder::new();
    for method in ["estalella", "roger-holzschuch", "environment"] {
        let run = folder.good(&format!("render {BALL} {SMALL} --method {method} --json f.json"));
        assert!(run.out.contains(method), "{}", run.out);
        let figures = folder.json("f.json");
        assert_eq!(figures["method"], method);
        assert!(figures["covered_pixels"].as_u64().unwrap() > 50, "{method}");
        assert!(figures["ms"]["layer"].as_f64().unwrap() > 0.0);
        assert_eq!(png_size(&folder.read("catoptric.png")), [160, 90]);
    }
    let run = folder.good(&format!("render {SMALL} --method estalella --json f.json"));
    let notes = folder.json("f.json")["notes"].clone();
    let has = |note: &str| notes.as_array().unwrap().iter().any(|own| own == note);
    assert!(has("teapot rim is not star-shaped: it shows the environment only"), "{notes}");
    assert!(run.out.contains("note: teapot handle is not star-shaped"), "{}", run.out);
    folder.good(&format!(
        "render {BALL} {SMALL} --method roger-holzschuch --primitive points --point square1 \
         --iterations 6 --early-exit off --map-side 64 --map-triangles 9000"
    ));
    folder.good(&format!(
        "render {BALL} {SMALL} --method estalella --grid 0.1 --epsilon 1e-6 --tessellate 4"
    ));
}

#[test]
fn what_they_cannot_is_refused_with_its_reason() {
    let folder = Folder::new();
    for method in ["estalella", "roger-holzschuch"] {
        folder.refused(
            &format!("render --mirror torus --object knot {SMALL} --method {method}"),
            &["mirror torus: is not star-shaped", "--proxy", "--method c3rc"],
        );
    }
    folder.good(&format!(
        "render --mirror torus --object knot {SMALL} --method estalella --proxy ellipsoid"
    ));
    let small = |rest: &str| format!("render {BALL} {SMALL} {rest}");
    for (line, expected) in [
        (small("--proxy pot"), "--proxy: there is no built-in shape \"pot\""),
        (small("--proxy none.obj"), "none.obj"),
        (small("--proxy sphere --proxy cube"), "--proxy: there are more of them than mirrors (1)"),
        (small("--method estalella --grid 2"), "--grid: \"2\" is not a number from 0 to 1"),
        (small("--method estalella --grid nan"), "--grid: \"nan\" is not a number"),
        (small("--method estalella --iterations 0"), "--iterations: \"0\" is not a whole number"),
        (small("--method roger-holzschuch --map-side 4"), "--map-side: \"4\" is not"),
        (small("--method environment --cube-side 1000000"), "--cube-side: \"1000000\" is not"),
        (small("--method environment --grid 0.5"), "--grid"),
    ] {
        folder.refused(&line, &[expected]);
    }
}

#[test]
fn scene_files_name_stand_ins() {
    let folder = Folder::new();
    let scene = |proxy: &str| {
        format!(
            "[eye]\nposition = [0, 1, 4]\ntarget = [0, 0, 0]\n[[mirror]]\nshape = \"torus\"\n{proxy}\n\
             [[object]]\nshape = \"cube\"\ntranslate = [0, 0, 2]\nscale = 0.5\n"
        )
    };
    folder.write("with.toml", scene("proxy = \"sphere\"")).write("without.toml", scene(""));
    folder.write("wrong.toml", scene("proxy = \"pot\""));
    folder.good(&format!("render with.toml {SMALL} --method roger-holzschuch"));
    let line = |name: &str| format!("render {name} {SMALL} --method roger-holzschuch");
    folder.refused(&line("without.toml"), &["mirror torus: is not star-shaped"]);
    folder.refused(&line("wrong.toml"), &["wrong.toml: line 4: ", "there is no built-in shape"]);
}

#[test]
fn what_is_known_of_a_mirror_is_said() {
    let folder = Folder::new();
    for (mirror, expected) in [
        ("sphere", "sphere is star-shaped and convex"),
        ("bowl", "bowl is star-shaped and concave: "),
        ("wave", "wave is star-shaped and curved both ways: "),
    ] {
        let line = format!("info --mirror {mirror} --object knot --surfels 1000 --json f.json");
        assert!(folder.good(&line).out.contains(expected));
        let methods = folder.json("f.json")["methods"].clone();
        let roger = methods.as_array().unwrap().iter().find(|m| m["id"] == "roger-holzschuch");
        assert!(roger.unwrap()["facts"][0].as_str().unwrap().starts_with(expected));
    }
    let draw = |rest: &str| {
        folder.good(&format!("render --object knot {SMALL} --method estalella {rest}"))
    };
    let out = draw("--mirror wave").out;
    assert!(out.contains("note: wave is curved both ways: of several images"), "{out}");
    let out = draw("--mirror torus --proxy sphere").out;
    assert!(out.contains("note: the proxy of torus is up to "), "{out}");
    let out = draw("--mirror sphere --proxy sphere").out;
    assert!(!out.contains("proxy"), "{out}");
    let out = draw("--mirror sphere --primitive points --grid 0.1").out;
    assert!(out.contains("note: --grid and --tessellate are for triangles"), "{out}");
    let two = "--mirror sphere --mirror torus --proxy none --proxy ellipsoid";
    assert!(draw(two).out.contains("the proxy of torus"));
    let out = folder.good("render --size 640x360 --surfels 20000 --method estalella").out;
    assert!(out.contains(" pixels, drawn straight (") && out.contains("--tessellate 8"), "{out}");
    let line = format!("render --object knot {SMALL} --method estalella");
    folder.refused(
        &format!("{line} --mirror sphere --proxy torus"),
        &["the proxy of mirror sphere: is not star-shaped", "give another"],
    );
    folder.refused(
        &format!("{line} --mirror sphere --point square1"),
        &["--point: says how surfels are drawn, not triangles; add --primitive points"],
    );
}

/// The scenes of benches/COMPARISON.md.
#[test]
fn the_papers_scenes_are_drawn() {
    let folder = Folder::new();
    let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/comparison");
    let mut drawn = 0;
    for entry in std::fs::read_dir(scenes).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            let line = |method| format!("render '{}' {SMALL} --method {method}", path.display());
            for method in ["c3rc", "estalella", "roger-holzschuch", "environment"] {
                folder.good(&line(method));
            }
            drawn += 1;
        }
    }
    assert_eq!(drawn, 5);
}

/// Steps of searches: in the figures, and by pixel.
#[test]
fn steps_are_counted() {
    let folder = Folder::new();
    let line = |rest: &str| {
        format!("render {BALL} {SMALL} --method roger-holzschuch {rest} --json f.json --aov a.exr")
    };
    let mean = |rest: &str| {
        folder.good(&line(rest));
        folder.json("f.json")["mean_steps"].as_f64().unwrap()
    };
    assert!((3.0..15.0).contains(&mean("")), "{}", mean(""));
    assert!((mean("--early-exit off --iterations 7") - 7.0).abs() < 1e-9);
    let (planes, _) = catoptric::image::aov::read_aov(&folder.path("a.exr")).unwrap();
    let shown = planes.steps.iter().zip(&planes.object).filter(|(_, o)| **o != u32::MAX);
    assert!(shown.clone().count() > 50 && shown.clone().all(|(&steps, _)| steps == 7));
    folder.good(&format!("render {BALL} {SMALL} --json f.json"));
    assert!(folder.json("f.json")["mean_steps"].is_null());
}

#[test]
fn chosen_settings_are_compared() {
    let folder = Folder::new();
    let line = |with: &[&str]| {
        let with: Vec<String> = with.iter().map(|with| format!("--with '{with}'")).collect();
        let with = with.join(" ");
        format!(
            "bench methods {BALL} {SMALL} --spp 2 --repeat 1 --frames 0 -o found --steps --backend cpu {with}"
        )
    };
    let settings = ["c3rc --detail 1", "estalella --grid 0.2"];
    let out = folder.good(&line(&settings)).out;
    assert!(out.contains("| estalella --grid 0.2 | cpu |"), "{out}");
    let methods = folder.json("found/methods.json")["methods"].clone();
    assert_eq!(methods[1]["label"], "estalella --grid 0.2");
    assert_eq!(methods[1]["picture"], "estalella-grid-0.2.png");
    assert!(methods[1]["mean_steps"].as_f64().is_some_and(|n| n > 0.5));
    assert_eq!(methods[0]["settings"], serde_json::json!([]));
    folder.write("found/own.png", "mine");
    // Another run leaves no picture of this one, and what is not its own.
    folder.good(&line(&["raytrace"]));
    assert!(!folder.path("found/estalella-grid-0.2.png").exists());
    assert!(folder.path("found/own.png").exists() && folder.path("found/raytrace.png").exists());
    for (with, expected) in [
        ("estalella --grid", "--with \"estalella --grid\": a value is required"),
        ("pinhole", "--method: there is no method \"pinhole\""),
        ("", "--with \"\": is empty; give a method"),
        ("c3rc --grid 1", "--grid: c3rc has no such parameter"),
        ("c3rc --frames 1", "unexpected argument '--frames'"),
    ] {
        folder.refused(&line(&[with]), &[expected]);
    }
}

#[test]
fn all_methods_are_compared() {
    let folder = Folder::new();
    let run = folder.good(&format!(
        "bench methods {BALL} {SMALL} --spp 4 --repeat 1 --frames 3 --backend cpu -o found --json all.json"
    ));
    assert!(run.out.contains("| roger-holzschuch | cpu |"), "{}", run.out);
    let all = folder.json("all.json");
    let methods = all["methods"].as_array().unwrap();
    let ids: Vec<&str> = methods.iter().map(|m| m["method"].as_str().unwrap()).collect();
    assert_eq!(ids, ["c3rc", "raytrace", "estalella", "roger-holzschuch", "environment"]);
    for method in methods {
        for key in ["rmse", "flip", "missing", "flicker"] {
            assert!(method[key].as_f64().is_some(), "{key} of {method}");
        }
        assert!(method["ms"]["reflection"].as_f64().unwrap() > 0.0);
        assert!(method["displacement_px"]["median"].as_f64().is_some(), "{method}");
        assert!(!method["settings"].as_array().unwrap().is_empty(), "{method}");
    }
    // Rays show what is there; a map from the centre does not.
    let px = |i: usize| methods[i]["displacement_px"]["median"].as_f64().unwrap();
    assert!(px(1) < 0.1 && px(4) > 10.0 * px(0), "{} {} {}", px(0), px(1), px(4));
    for name in ["sheet.png", "reference.png", "c3rc.png", "environment.png"] {
        assert!(png_size(&folder.read(&format!("found/{name}"))).iter().all(|&side| side > 50));
    }
    let table = String::from_utf8(folder.read("found/methods.md")).unwrap();
    assert!(table.contains("| c3rc | cpu |") && table.contains("displacement px"));
    let plot = String::from_utf8(folder.read("found/error-against-time.svg")).unwrap();
    assert!(plot.contains("estalella, iterations") && plot.trim_end().ends_with("</svg>"));
    assert_eq!(folder.json("found/methods.json"), all);
    folder.write("taken", "a file");
    folder.refused(
        &format!("bench methods {BALL} {SMALL} -o taken"),
        &["taken: is a file, and a folder is written; "],
    );
    folder.refused(
        &format!("bench methods --mirror sphere --object cube {SMALL} --eye 0,50,0 --target 0,100,1 -o new"),
        &["the view: shows no mirror that reflects an object; "],
    );
}
