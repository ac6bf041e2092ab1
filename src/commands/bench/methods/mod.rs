//! `catoptric bench methods`: every method on one scene, held against many rays a pixel.

mod plot;
mod section;
mod sheet;
mod with;

pub(super) use section::section;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use catoptric::analysis::methods::{Candidate, Drawn, Effort, Entry, Measured, compare_methods};
use catoptric::image::compare::Percentiles;
use catoptric::image::io::{write_bytes, write_picture};
use catoptric::methods::Method;
use catoptric::{Context, Error};
use clap::Args;
use serde_json::{Value, json};

use super::super::render::{HowArgs, where_it_ran};
use super::super::{Ready, SceneArgs, check_folder, check_json, ms, say, write_json};
use super::report::{ratio, times};

/// See [`super::What::Methods`].
#[derive(Args, Debug)]
pub(crate) struct MethodsArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Folder for the results; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "catoptric-methods")]
    output: PathBuf,
    /// Where the methods run: auto (whatever is fastest here), cpu or gpu
    #[arg(long, value_name = "ID", default_value = "auto", value_parser = ["auto", "cpu", "gpu"])]
    backend: String,
    /// Graphics adapter, also a software one: a part of its name, or its number in `info --adapters`; means --backend gpu
    #[arg(long, value_name = "NAME|INDEX")]
    adapter: Option<String>,
    /// Rays a pixel of the reference
    #[arg(long, value_name = "N", default_value_t = 256, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..=65_536))]
    spp: u32,
    /// Turns that are timed, each the fastest of three frames that alternate with one ray a pixel; medians count
    #[arg(long, value_name = "N", default_value_t = 5, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..=1_000))]
    repeat: u32,
    /// Frames of the orbit on which flicker is measured; 0: it is not
    #[arg(long, value_name = "N", default_value_t = 12, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(0..=1_000))]
    frames: u32,
    /// The orbit, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 3.0, allow_negative_numbers = true)]
    orbit: f64,
    /// Compare this instead of all methods: a method and its flags in quotes, as in --with "estalella --grid 0.1";
    /// repeatable
    #[arg(long, value_name = "METHOD FLAGS")]
    with: Vec<String>,
    /// Add a row to the sheet: how many steps searches took
    #[arg(long)]
    steps: bool,
    /// Leave the methods' quality knobs alone: one setting of each
    #[arg(long)]
    defaults: bool,
    /// Write the figures here, too
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

pub(crate) fn run(args: &MethodsArgs, cx: &Context) -> anyhow::Result<()> {
    check_json(args.json.as_ref())?;
    if (1..3).contains(&args.frames) {
        let problem = "flicker is measured over three frames";
        return Err(Error::input("--frames", "", problem, "give 3 or more, or 0 for none").into());
    }
    if !args.orbit.is_finite() {
        return Err(Error::input("--orbit", "", "is not a number", "give degrees").into());
    }
    check_folder(&args.output)?;
    let (candidates, hows): (Vec<_>, Vec<_>) =
        args.with.iter().map(|text| with::candidate(text)).collect::<anyhow::Result<_>>()?;
    let candidates =
        if candidates.is_empty() { Candidate::all(!args.defaults) } else { candidates };
    let ready = args.scene.ready(None, cx)?;
    let effort = Effort {
        spp: args.spp,
        repeat: args.repeat,
        frames: args.frames,
        orbit: args.orbit.to_radians(),
    };
    let backend = |i: usize, method: &dyn Method| {
        // Rays are the CPU's: what has no shaders is not asked of a device.
        let backend = if method.info().has_shaders { args.backend.clone() } else { "cpu".into() };
        let adapter = args.adapter.clone().filter(|_| method.info().has_shaders);
        match hows.get(i) {
            Some(how) if how.backend != "auto" || how.adapter.is_some() => how.backend(method),
            _ => HowArgs { backend, adapter, ..HowArgs::standard() }.backend(method),
        }
    };
    let (scene, eye) = (&ready.scene, &ready.eye);
    let (reference, entries) =
        compare_methods(&ready.described, scene, eye, candidates, effort, &backend, cx)?;
    cx.step("writing", 1.0)?;
    let figures = figures(&ready, args, &entries);
    let table = table(&ready, args, &entries);
    std::fs::create_dir_all(&args.output).map_err(|e| Error::Output {
        name: args.output.display().to_string(),
        problem: e.to_string(),
    })?;
    let file = |name: &str| args.output.join(name);
    remove_pictures(&args.output);
    write_picture(&file("sheet.png"), &sheet::sheet(&reference, &entries, args.steps))?;
    for entry in &entries {
        if let Ok(drawn) = &entry.result {
            write_picture(&file(&with::file_name(&entry.candidate.label)), &drawn.picture)?;
        }
    }
    write_picture(&file("reference.png"), &reference.picture)?;
    write_bytes(
        &file("error-against-time.svg"),
        plot::errors(&ready.scene.name, &entries)?.as_bytes(),
    )?;
    write_bytes(&file("methods.md"), table.as_bytes())?;
    write_json(Some(&file("methods.json")), &figures)?;
    write_json(args.json.as_ref(), &figures)?;
    say!("{}", table.trim_end());
    say!("Written to {}: sheet.png, methods.md, methods.json and more", args.output.display());
    Ok(())
}

/// Removes the pictures that an earlier run left in the folder, by its own list of them.
fn remove_pictures(folder: &Path) {
    let Ok(text) = std::fs::read(folder.join("methods.json")) else { return };
    let Ok(figures) = serde_json::from_slice::<Value>(&text) else { return };
    let methods = figures["methods"].as_array().into_iter().flatten();
    for name in methods.filter_map(|method| method["picture"].as_str()) {
        if Path::new(name).file_name().is_some_and(|own| own == name) {
            // What cannot be removed is overwritten, or stays.
            let _ = std::fs::remove_file(folder.join(name));
        }
    }
}

/// What a method's reflections took, milliseconds: cameras, searches or rays, and drawing; without the direct view.
fn own_ms(measured: &Measured) -> Option<f64> {
    measured.report.layer_ms.or(measured.report.rays_ms)
}

fn table(ready: &Ready, args: &MethodsArgs, entries: &[Entry]) -> String {
    let mut text = format!(
        "# Methods on {} ({} x {}), against {} rays a pixel\n\n\
         Errors are over the pixels that reflect objects. Times are medians of {} turns, each the fastest of \
         three frames that alternate with one ray a pixel; `reflection` is everything but visibility and the direct view. Displacement: how far what a pixel shows is from where it belongs.\n\n\
         | method | runs on | reflection ms | to 1 ray | projection ms | steps | RMSE | PSNR dB | FLIP | missing % | displacement px, median / 95 % / 99 % | flicker |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|\n",
        ready.scene.name, ready.eye.size.width, ready.eye.size.height, args.spp, args.repeat
    );
    let number = |value: Option<f64>, digits: usize| {
        value.map_or("–".to_owned(), |value| format!("{value:.digits$}"))
    };
    for entry in entries {
        let id = &entry.candidate.label;
        let row = match &entry.result {
            Err(_) => format!("| {id} | refused | – | – | – | – | – | – | – | – | – | – |"),
            Ok(drawn) => {
                let Measured { report, to_one_ray, errors } = &drawn.measured;
                let missing = errors.objects.as_ref().map(|o| 100.0 * o.total.missing_share());
                let px = drawn
                    .displacement_px
                    .map_or("–".into(), |Percentiles { median, p95, p99 }| {
                        format!("{median:.2} / {p95:.2} / {p99:.2}")
                    });
                format!(
                    "| {id} | {} | {} | {} | {} | {} | {:.4} | {} | {:.4} | {} | {px} | {} |",
                    where_it_ran(report),
                    number(own_ms(&drawn.measured), 1),
                    times(Some(*to_one_ray)),
                    number(report.project_ms, 1),
                    number(report.mean_steps(), 1),
                    errors.rmse,
                    number(errors.psnr, 1),
                    errors.flip,
                    number(missing, 2),
                    number(drawn.restlessness.second_difference, 4),
                )
            }
        };
        writeln!(text, "{row}").expect("strings grow");
    }
    for entry in entries {
        if let Err(error) = &entry.result {
            writeln!(text, "\n{}: {error}.", entry.candidate.label).expect("strings grow");
        }
    }
    for (note, labels) in notes(entries) {
        let drawn = entries.iter().filter(|entry| entry.result.is_ok()).count();
        let whose = if labels.len() == drawn { "all".into() } else { labels.join(", ") };
        writeln!(text, "\n{whose}: {note}.").expect("strings grow");
    }
    text
}

/// Each note once, with what it is about.
fn notes(entries: &[Entry]) -> Vec<(&str, Vec<&str>)> {
    let mut list: Vec<(&str, Vec<&str>)> = Vec::new();
    for entry in entries {
        let Ok(drawn) = &entry.result else { continue };
        for note in &drawn.measured.report.notes {
            let label = entry.candidate.label.as_str();
            match list.iter_mut().find(|(known, _)| known == note) {
                Some((_, labels)) => labels.push(label),
                None => list.push((note, vec![label])),
            }
        }
    }
    list
}

fn measured_figures(measured: &Measured) -> Value {
    let report = &measured.report;
    let errors = &measured.errors;
    json!({
        "backend": report.backend,
        "device": report.device,
        "ms": {
            "reflection": ms(own_ms(measured)),
            "cameras": ms(report.cameras_ms),
            "cull": ms(report.cull_ms),
            "project": ms(report.project_ms),
            "splat": ms(report.splat_ms),
            "rays": ms(report.rays_ms),
            "ids": ms(report.ids_ms),
            "composite": ms(report.composite_ms),
            "frame": ms(report.frame_ms),
        },
        "ratio_to_1_ray": ratio(Some(measured.to_one_ray)),
        "projections": report.projections,
        "valid": report.valid,
        "mean_steps": report.mean_steps(),
        "notes": report.notes,
        "pixels": errors.pixels,
        "rmse": errors.rmse,
        "psnr": errors.psnr,
        "flip": errors.flip,
        "missing": errors.objects.as_ref().map(|o| o.total.missing_share()),
    })
}

fn drawn_figures(drawn: &Drawn) -> Value {
    let mut value = measured_figures(&drawn.measured);
    value["displacement_px"] =
        json!(drawn.displacement_px.map(|Percentiles { median, p95, p99 }| {
            json!({ "median": median, "p95": p95, "p99": p99 })
        }));
    value["flicker"] = json!(drawn.restlessness.second_difference);
    let settings = drawn.settings.iter().map(|setting| {
        let mut value = measured_figures(&setting.measured);
        value["knob"] = json!(setting.knob);
        value["value"] = json!(setting.value);
        value
    });
    value["settings"] = settings.collect();
    value
}

fn figures(ready: &Ready, args: &MethodsArgs, entries: &[Entry]) -> Value {
    let methods: Vec<Value> = entries
        .iter()
        .map(|entry| {
            let mut value = match &entry.result {
                Ok(drawn) => drawn_figures(drawn),
                Err(error) => json!({ "refused": error.to_string() }),
            };
            value["method"] = json!(entry.candidate.method.info().id);
            value["label"] = json!(entry.candidate.label);
            value["picture"] =
                json!(entry.result.is_ok().then(|| with::file_name(&entry.candidate.label)));
            value
        })
        .collect();
    json!({
        "scene": ready.scene.name,
        "size": [ready.eye.size.width, ready.eye.size.height],
        "surfels": ready.scene.surfel_count(),
        "mirror_triangles": ready.scene.mirror_triangle_count(),
        "threads": rayon::current_num_threads(),
        "spp": args.spp,
        "repeat": args.repeat,
        "frames": args.frames,
        "orbit_degrees": args.orbit,
        "methods": methods,
    })
}
