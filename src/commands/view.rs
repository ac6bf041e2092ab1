//! `catoptric view`: the window.

use std::path::PathBuf;
use std::time::Instant;

use catoptric::Context;
use catoptric::camera::eye::ImageSize;
use catoptric::image::io::check_place;
use catoptric::methods::METHODS;
use catoptric::viewer::{BackendChoice, Opening, Outcome, Side, run as open};
use clap::parser::ValueSource;
use clap::{ArgMatches, Args};
use serde_json::{Value, json};

use super::render::{HowArgs, Subject};
use super::{SceneArgs, check_apart, check_json, chosen_method, ms, say, write_json};

/// Open a scene in a window: orbit, move things, compare methods, look inside them
#[derive(Args, Debug)]
pub(crate) struct ViewArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Reflection method shown first: c3rc or raytrace [default: as last time]
    #[arg(long, value_name = "ID", default_value = "c3rc", hide_default_value = true)]
    method: String,
    /// Where it runs: auto (whatever is fastest here), cpu or gpu [default: as last time]
    #[arg(long, value_name = "ID", default_value = "auto", hide_default_value = true,
        value_parser = ["auto", "cpu", "gpu"])]
    backend: String,
    /// Named set of parameters (paper: everything as Mei et al. had it)
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// Time against error: sets the method's parameters for that together
    #[arg(long, value_name = "WORD", default_value = "default", conflicts_with = "preset",
        hide_default_value = true, value_parser = ["draft", "default", "best"])]
    quality: String,
    /// Draw so many frames of an orbit in the window, at full resolution, report their times and close
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: Option<u32>,
    /// Write a picture (.png) of the window once it shows the scene, and close
    #[arg(long, value_name = "FILE")]
    screenshot: Option<PathBuf>,
    /// Write the figures as JSON (with --frames or --screenshot)
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl ViewArgs {
    /// Without a command line: the built-in scene.
    pub(crate) fn standard() -> Self {
        Self {
            scene: SceneArgs::default_scene(),
            method: "c3rc".into(),
            backend: "auto".into(),
            preset: None,
            quality: "default".into(),
            frames: None,
            screenshot: None,
            json: None,
        }
    }

    fn how(&self) -> HowArgs {
        HowArgs {
            method: self.method.clone(),
            backend: self.backend.clone(),
            preset: self.preset.clone(),
            quality: self.quality.clone(),
            ..HowArgs::standard()
        }
    }
}

/// Opens the window; an error where there is no display to open it on.
pub(crate) fn run(
    args: &ViewArgs,
    matches: &ArgMatches,
    started: Instant,
    cx: &Context,
) -> anyhow::Result<()> {
    check_json(args.json.as_ref())?;
    if let Some(path) = &args.screenshot {
        check_place(path)?;
    }
    check_apart(&[("--screenshot", args.screenshot.as_deref()), ("--json", args.json.as_deref())])?;
    let (method, params, leaf) = chosen_method(&args.how(), matches)?;
    args.scene.begin(cx)?;
    let said = |id: &str| {
        matches.try_contains_id(id).is_ok_and(|known| known)
            && matches.value_source(id) == Some(ValueSource::CommandLine)
    };
    let flags = METHODS.iter().flat_map(|m| m.info().params).map(|p| p.id);
    let chosen = ["method", "backend", "preset", "quality"].into_iter().chain(flags).any(said);
    let backend = BackendChoice::ALL.into_iter().find(|(_, word)| *word == args.backend);
    let side = Side {
        method: method.info().id,
        backend: backend.map_or_else(Default::default, |b| b.0),
        params,
    };
    let measured = args.frames.is_some() || args.screenshot.is_some();
    let opening = Opening {
        request: args.scene.place.request(args.scene.surfels),
        prepare: args.scene.prepare_options(leaf),
        side: (chosen || measured).then_some(side),
        size: (said("size") || measured).then_some(args.scene.place.size),
        frames: args.frames,
        screenshot: args.screenshot.clone(),
        started,
        memory: cx.memory(),
        on_failure: Some(|what| eprintln!("error: {what}")),
    };
    let Some(outcome) = open(&opening, cx)? else { return Ok(()) };
    write_json(args.json.as_ref(), &figures(&outcome))?;
    print(args, &outcome);
    Ok(())
}

/// Those of `render`, and the window's.
fn figures(outcome: &Outcome) -> Value {
    let prepared = &outcome.prepared;
    let subject = Subject {
        scene: &prepared.name,
        surfels: prepared.surfels,
        mirror_triangles: prepared.mirror_triangles,
        size: outcome.size,
        load_ms: prepared.load_ms,
        times: prepared.times,
    };
    let mut value = subject.figures(&outcome.report);
    let counted = !outcome.frame_ms.is_empty();
    let [median, p99] = [50, 99].map(|p| counted.then(|| outcome.percentile(p)));
    let ImageSize { width, height } = outcome.window;
    value["window"] = json!([width, height]);
    value["canvas"] = json!(outcome.canvas);
    value["mirror_share"] = json!(mirror_share(outcome));
    value["frames_rendered"] = json!(outcome.frames_rendered);
    value["fps_median"] = median.map_or(Value::Null, |ms| json!(1e3 / ms));
    value["frame_ms"] = json!({ "median": ms(median), "p99": ms(p99) });
    value["ui_blocked_ms_max"] = ms(Some(outcome.ui_blocked_ms_max));
    value["first_picture_ms"] = ms(Some(outcome.first_picture_ms));
    value
}

/// The mirrors' part of the window, in the last frame.
fn mirror_share(outcome: &Outcome) -> f64 {
    outcome.report.mirror_pixels as f64 / outcome.window.pixels().max(1) as f64
}

fn print(args: &ViewArgs, outcome: &Outcome) {
    if let Some(path) = &args.screenshot {
        say!(
            "{}: the window, {} x {}",
            path.display(),
            outcome.window.width,
            outcome.window.height
        );
    }
    let (size, report) = (outcome.size, &outcome.report);
    say!(
        "{} frames of {} x {} in the window, {} by {} on {}, mirrors on {:.0} % of it",
        outcome.frames_rendered,
        size.width,
        size.height,
        outcome.prepared.name,
        report.method,
        super::render::where_it_ran(report),
        100.0 * mirror_share(outcome)
    );
    if !outcome.frame_ms.is_empty() {
        let [median, p99] = [50, 99].map(|p| outcome.percentile(p));
        say!("  {:.1} frames/s; a frame {median:.1} ms (99 %: {p99:.1})", 1e3 / median);
    }
    say!(
        "  first picture after {:.0} ms; the window did not answer for {:.0} ms at most",
        outcome.first_picture_ms,
        outcome.ui_blocked_ms_max
    );
}
