//! The GPU backend as a user calls it; on a machine without an adapter, how it says so.

use std::io::Write as _;

use serde_json::Value;

use super::{Folder, SMALL};

/// This machine's adapters, as the program lists them; says and checks what none means.
fn adapters(folder: &Folder) -> Vec<Value> {
    let run = folder.good("info --adapters --json adapters.json");
    let list = folder.json("adapters.json")["adapters"].as_array().unwrap().clone();
    for adapter in &list {
        assert!(run.out.contains(adapter["name"].as_str().unwrap()), "{}", run.out);
        assert!(adapter["binding_bytes"].as_u64().unwrap() >= 128 << 20);
    }
    if list.is_empty() {
        assert_ne!(std::env::var("CATOPTRIC_REQUIRE_GPU").as_deref(), Ok("1"), "{}", run.out);
        let _ = writeln!(std::io::stderr(), "GPU: not tested (no adapter)");
        folder.refused("render --backend gpu", &["no graphics adapter was found", "--backend cpu"]);
    }
    list
}

#[test]
fn both_paths_draw_what_the_cpu_draws() {
    let folder = Folder::new();
    if adapters(&folder).is_empty() {
        return;
    }
    // What a device draws instead of blocks.
    let cells = format!("render {SMALL} --backend cpu --cameras cells");
    folder.good(&format!("{cells} -o cpu.png --json cpu.json --aov cpu.exr"));
    let cpu = folder.json("cpu.json");
    assert_eq!(cpu["backend"], "cpu");
    for path in ["compute", "vertex"] {
        let how = format!("--backend gpu --adapter 0 --gpu-path {path} --stats --repeat 2");
        let run =
            folder.good(&format!("render {SMALL} {how} -o gpu.png --json gpu.json --aov gpu.exr"));
        assert!(run.out.contains("on gpu (") && run.out.contains(path), "{}", run.out);
        let gpu = folder.json("gpu.json");
        assert_eq!(gpu["backend"], "gpu");
        assert!(gpu["device"].as_str().unwrap().contains(path) && cpu["device"].is_null());
        for key in ["cameras", "batches", "projections"] {
            assert_eq!(gpu[key], cpu[key], "{key}");
        }
        assert_eq!(
            gpu["valid"],
            if path == "compute" { cpu["valid"].clone() } else { Value::Null }
        );
        assert!(gpu["ms"]["layer"].as_f64().unwrap() > 0.0 && gpu["ms"]["cull"].is_number());
        folder.good(
            "compare gpu.png cpu.png --aov-a gpu.exr --aov-b cpu.exr --where object --json c.json",
        );
        let flip = folder.json("c.json")["flip"].as_f64().unwrap();
        assert!(flip <= 0.005, "{path}: {flip}");
    }
    // Without objects it is another picture.
    folder.good(&format!("render --mirror teapot --object knot {SMALL} --backend gpu -o gpu.png"));
    folder.good("compare gpu.png cpu.png --aov-b cpu.exr --where object --json c.json");
    assert!(folder.json("c.json")["flip"].as_f64().unwrap() > 0.05);
}

#[test]
fn adapters_that_are_not_there() {
    let folder = Folder::new();
    let some = !adapters(&folder).is_empty();
    for wanted in ["magic", "99", "''"] {
        let line = format!("render {SMALL} --adapter {wanted}");
        let remedy = if some {
            "choose a number or a part of a name of these: 0 ("
        } else {
            "--backend cpu"
        };
        folder.refused(&line, &["--adapter: ", remedy]);
    }
}

#[test]
fn rays_are_for_the_cpu() {
    let expected = "--adapter: --method raytrace has no shaders; leave it out";
    Folder::new().refused("render --adapter 0 --method raytrace", &[expected]);
    let line = "render --backend gpu --method raytrace";
    let expected = "--backend gpu: --method raytrace has no shaders; use --backend cpu, or auto";
    Folder::new().refused(line, &[expected]);
}

#[test]
fn odd_views_are_drawn() {
    let folder = Folder::new();
    if adapters(&folder).is_empty() {
        return;
    }
    for scene in [
        "default --target 0,50,0",
        "--mirror sphere",
        "--mirror plane --object knot --eye 0.2,0.5,-2 --target 0,0.5,0",
        "default --eye 1e12,0,0",
        "default --fov 1e-9",
        "default --fov 179.999",
        "default --eye 0.1,0.35,0.1",
        "knot --preset paper",
    ] {
        for path in ["compute", "vertex"] {
            let line = format!("render {scene} {SMALL} --gpu-path {path}");
            folder.good(&format!("{line} --backend gpu -o gpu.png"));
            // What a device draws instead of blocks.
            let cameras = if scene.contains("paper") { "triangles" } else { "cells" };
            folder.good(&format!("{line} --backend cpu --cameras {cameras} -o cpu.png"));
            folder.good("compare gpu.png cpu.png --json c.json");
            let flip = folder.json("c.json")["flip"].as_f64().unwrap();
            assert!(flip <= 0.005, "{line}: {flip}");
        }
    }
}

#[test]
fn benches_run_on_it_too() {
    let folder = Folder::new();
    if adapters(&folder).is_empty() {
        return;
    }
    folder.good(&format!("bench layer {SMALL} --backend gpu --repeat 1 --json bench.json"));
    let bench = folder.json("bench.json");
    assert_eq!(bench["backend"], "gpu");
    assert!(bench["device"].is_string());
    assert!(bench["ratio"]["median"].as_f64().unwrap() > 0.0);
}
