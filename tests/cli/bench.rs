//! The benches as a user types them, on scenes so small that they take seconds.

use serde_json::Value;

use super::{Folder, Run};

/// Two shapes, few surfels, one turn.
const TINY: &str =
    "--mirror teapot --object torus --size 160x90 --max 4000 --repeat 1 --quick --backend cpu";

/// Every number of a list by its key.
fn numbers(list: &Value, key: &str) -> Vec<f64> {
    list.as_array().unwrap().iter().map(|row| row[key].as_f64().unwrap()).collect()
}

/// A page that loads nothing: all that it shows is in it.
fn is_self_contained(page: &str) {
    assert!(page.starts_with("<!DOCTYPE html>") && page.trim_end().ends_with("</html>"));
    for load in ["http:", "https:", "<script", "<link", "@import", "url("] {
        assert!(!page.contains(load), "{load}");
    }
    for source in page.split("src=\"").skip(1) {
        assert!(source.starts_with("data:image/png;base64,"), "{}", &source[..40]);
    }
    assert!(page.contains("prefers-color-scheme: dark"));
}

#[test]
fn the_papers_tables() {
    let folder = Folder::new();
    let line = TINY.replace("--max 4000", "--max 20000");
    let run = folder.good(&format!("bench tables {line} -o found --json f.json"));
    assert!(run.out.contains("| 10000 | the paper's (Dinosaur) | 48.0 | 25.0 | 23.0 | 19.0 |"));
    let figures = folder.json("f.json");
    assert_eq!(folder.json("found/report.json"), figures);
    for key in ["version", "date", "machine", "repeat", "seed", "quick", "ratios"] {
        assert!(!figures[key].is_null(), "{key}");
    }
    assert!(figures["machine"]["threads"].as_u64().unwrap() > 0);
    let rows = &figures["tables"]["rows"];
    assert_eq!(numbers(rows, "surfels"), [10_000.0, 20_000.0]);
    for row in rows.as_array().unwrap() {
        // Leaves of the paper's size are nearly full, ours are smaller and deeper.
        let [paper, own] = ["tree", "tree_default"].map(|key| &row[key]);
        let leaf = paper["points_per_leaf"].as_f64().unwrap();
        assert!((100.0..=122.0).contains(&leaf), "{leaf}");
        assert!(own["mean_depth"].as_f64().unwrap() > paper["mean_depth"].as_f64().unwrap() + 3.0);
        assert!(paper["build_ms"]["median"].as_f64().unwrap() > 0.0);
        let settings = row["settings"].as_array().unwrap();
        let names: Vec<&str> = settings.iter().map(|s| s["setting"].as_str().unwrap()).collect();
        assert_eq!(names, ["as published", "conservative tests", "our default"]);
        // The published test misses boxes: never more points than the conservative one.
        let tried = |i: usize| settings[i]["projections"].as_u64().unwrap();
        assert!(tried(0) > 0 && tried(0) <= tried(1), "{} {}", tried(0), tried(1));
        assert!(settings[0]["ratio_to_published"].is_null());
        assert!(settings[1]["ratio_to_published"]["noisy"].is_boolean());
    }
    is_self_contained(&String::from_utf8(folder.read("found/report.html")).unwrap());
    let agree = folder.good("bench agree f.json found/report.json --json agree.json");
    assert!(agree.out.contains("4 ratios in both: 100.0 % within 10 %"), "{}", agree.out);
    assert_eq!(folder.json("agree.json")["within_25_percent"], 1.0);
}

#[test]
fn the_balance_over_leaves() {
    let folder = Folder::new();
    let run = folder.good(&format!("bench balance {TINY} -o found"));
    assert!(
        run.out.contains("On this machine (cpu) the total is least with the test "),
        "{}",
        run.out
    );
    assert!(run.out.contains("Nearest to the paper's 20 % of valid projections are leaves of "));
    let figures = folder.json("found/report.json");
    let sweep = &figures["balance"]["sweeps"][0];
    let points = sweep["points"].as_array().unwrap();
    for test in ["interval", "paper", "sweep", "slab"] {
        let own: Vec<&Value> =
            points.iter().filter(|p| p["test"] == test && p["detail"] == 0).collect();
        let leaves: Vec<u64> = own.iter().map(|p| p["leaf"].as_u64().unwrap()).collect();
        assert_eq!(leaves, [2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096]);
        let shares: Vec<f64> = own.iter().map(|p| p["valid_share"].as_f64().unwrap()).collect();
        assert!(shares.windows(2).all(|pair| pair[1] <= pair[0] + 0.01), "{test}: {shares:?}");
        assert!(shares[2] > 2.0 * shares[11], "{test}: {shares:?}");
        let most = sweep["none"]["projections"].as_u64().unwrap();
        assert!(own.iter().all(|p| p["projections"].as_u64().unwrap() <= most), "{test}");
    }
    for verdict in sweep["verdicts"].as_array().unwrap() {
        assert_eq!(verdict["valid_share_falls"], true, "{verdict}");
        assert!(
            verdict["least_leaf"].as_u64().is_some() && verdict["least_is_interior"].is_boolean()
        );
    }
    let parts = figures["balance"]["parts"].as_array().unwrap();
    assert!(parts.iter().any(|p| p["part"] == "teapot knob"), "{parts:?}");
    let triangles = numbers(&figures["balance"]["triangles"]["rows"], "triangles");
    assert!(triangles.len() == 3 && triangles[2] > 15.0 * triangles[0], "{triangles:?}");
    let plot = String::from_utf8(folder.read("found/balance-cpu-detail-0.svg")).unwrap();
    assert!(plot.contains("test slab, detail 0") && plot.trim_end().ends_with("</svg>"));
}

#[test]
fn everything_in_one_report() {
    let folder = Folder::new();
    let run = folder.good(&format!("bench all {TINY} -o found --json f.json"));
    assert!(run.out.contains("The report is found/report.html"), "{}", run.out);
    let figures = folder.json("f.json");
    let sections = ["layer", "tables", "balance", "growth", "crossover", "methods"];
    assert_eq!(figures["sections"], serde_json::json!(sections));
    let page = String::from_utf8(folder.read("found/report.html")).unwrap();
    is_self_contained(&page);
    for id in sections {
        assert!(page.contains(&format!("<section id=\"{id}\">")), "{id}");
        assert!(!figures[id]["load"].is_null(), "{id}");
    }
    let count = figures["ratios"]["count"].as_u64().unwrap();
    assert!(count > 100 && figures["ratios"]["noisy_count"].as_u64().unwrap() <= count);
    let growth = &figures["growth"];
    assert_eq!(numbers(&growth["by_surfels"]["rows"], "surfels"), [4000.0]);
    assert!(growth["by_surfels"]["rows"][0]["surfel_MB"].as_f64().unwrap() > 0.1);
    assert_eq!(numbers(&growth["by_pixels"]["rows"], "pixels"), [920.0, 3600.0, 14_400.0]);
    assert_eq!(numbers(&growth["by_curvature"]["rows"], "curvature"), [-1.0, 0.0, 2.0]);
    let cells = figures["crossover"]["scenes"][0]["cells"].as_array().unwrap();
    assert_eq!(cells.len(), 4);
    for cell in cells {
        let error = |side: usize| cell["sides"][side]["rmse"].as_f64().unwrap();
        assert!(error(2) < error(0), "16 rays are nearer to 32 than one: {cell}");
    }
    let methods = figures["methods"]["methods"].as_array().unwrap();
    assert_eq!(methods.len(), 5);
    let text = String::from_utf8(folder.read("found/report.md")).unwrap();
    assert!(
        text.contains("![") && text.contains("crossover-maps.svg"),
        "plots are files beside it"
    );
    assert!(folder.read("found/methods-sheet.png").starts_with(b"\x89PNG"));
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_the_sections_that_are_done() {
    let folder = Folder::new();
    let line = format!("bench all {} -o found", TINY.replace("--repeat 1", "--repeat 200"));
    let child = folder.command(line.split_whitespace()).spawn().unwrap();
    let report = folder.path("found/report.json");
    let start = std::time::Instant::now();
    while !report.exists() {
        assert!(start.elapsed() < super::LIMIT, "no section is ever done");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let id = child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let run = Run::of(line, child);
    assert_eq!(run.code, Some(130), "{}", run.err);
    let figures = folder.json("found/report.json");
    let done = figures["sections"].as_array().unwrap().len();
    let said = format!("cancelled: found/report.html has {done} of 6 sections\n");
    assert_eq!((run.err.as_str(), run.out.as_str()), (said.as_str(), ""));
    assert!((1..6).contains(&done));
    is_self_contained(&String::from_utf8(folder.read("found/report.html")).unwrap());
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = Folder::new();
    folder.write("taken", "a file").write("text.json", "no figures").write("empty.json", "{}");
    for command in ["tables", "balance", "growth", "crossover", "all"] {
        for (options, expected) in [
            ("--max 5", "--max"),
            ("--max many", "--max"),
            ("--repeat 0", "--repeat"),
            ("--backend magic", "--backend"),
            (
                "--backend cpu --adapter 0",
                "--adapter: is for --backend gpu; leave one of the two out",
            ),
            ("-o taken", "taken: is a file, and a folder is written; "),
            ("-o none/found", "none/found: cannot be written: "),
            ("--json none/a.json", "none/a.json: cannot be written"),
            ("--size 0x10", "--size"),
            ("--surfels 10", "--surfels"),
            ("pot", "pot: is neither a built-in scene"),
            ("--mirror pot", "--mirror: there is no built-in shape \"pot\""),
        ] {
            folder.refused(&format!("bench {command} {options}"), &[expected]);
        }
    }
    for (options, expected) in [
        ("none.json empty.json", "none.json: cannot be read: "),
        ("text.json empty.json", "text.json: is not JSON: "),
        ("empty.json empty.json", "empty.json: shares no ratio with the other file; "),
        ("empty.json", "<B>"),
    ] {
        folder.refused(&format!("bench agree {options}"), &[expected]);
    }
}
