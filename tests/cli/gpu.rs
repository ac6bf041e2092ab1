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
    folder.good(&format!("render {SMALL} --backend cpu -o cpu.png --json cpu.json --aov cpu.exr"));
    let cpu = folder.json("cpu.json");
    assert_eq!(cpu["backend"], "cpu");
    for path in ["compute", "vertex"] {
        let how = format!("--backend gpu --adapter 0 --gpu-path {path} --stats --repeat 2");
        let run =
            folder.good(&format!("render {SMALL} {how} -o gpu.png --json gpu.json --aov gpu.exr"));
        assert!(run.out.contains("on gpu"), "{}", run.out);
        let gpu = folder.json("gpu.json");
        assert_eq!(gpu["backend"], "gpu");
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
fn rays_are_for_the_cpu() {
    let line = "render --backend gpu --method raytrace";
    let expected = "--backend gpu: --method raytrace has no shaders; use --backend cpu, or auto";
    Folder::new().refused(line, &[expected]);
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
    assert!(bench["ratio"]["median"].as_f64().unwrap() > 0.0);
}
