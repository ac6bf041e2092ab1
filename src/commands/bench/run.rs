//! What the benches of whole scenes share: their flags, how far they are, and how scenes are prepared for them.

use std::path::PathBuf;
use std::time::Instant;

use catoptric::accel::KdTreeLimits;
use catoptric::analysis::measure::{Rounds, Timed};
use catoptric::backend::Backend;
use catoptric::camera::Eye;
use catoptric::frame::Renderer;
use catoptric::methods::{Method, Params, method};
use catoptric::scene::arrange;
use catoptric::scene::description::{Scene, Source};
use catoptric::scene::prepared::DEFAULT_SURFELS;
use catoptric::scene::prepared::{self, PrepareOptions, PreparedScene};
use catoptric::scene::{builtin, load};
use catoptric::{Context, Error};
use clap::Args;
use serde_json::{Value, json};

use super::super::machine::{BUSY, Load, machine, today};
use super::super::render::HowArgs;
use super::super::{PlaceArgs, check_folder, check_json, memory, say, write_json};
use super::report::{self, Block, Head, Section};

/// What all benches of whole scenes can be told.
#[derive(Args, Clone, Debug)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub(crate) place: PlaceArgs,
    /// Turns of each side that count (default 9, or 5 with --quick)
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..=1_000))]
    pub(crate) repeat: Option<u32>,
    /// No scene gets more surfels than this
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u64).range(100..=100_000_000))]
    pub(crate) max: Option<u64>,
    /// Fewer and smaller settings, fewer turns
    #[arg(long)]
    pub(crate) quick: bool,
    /// Where c3rc runs: auto (whatever is fastest here; `balance` takes the CPU and then an adapter, if there is one), cpu or gpu
    #[arg(long, value_name = "ID", default_value = "auto", value_parser = ["auto", "cpu", "gpu"])]
    pub(crate) backend: String,
    /// Graphics adapter, also a software one: a part of its name, or its number in `info --adapters`; means --backend gpu
    #[arg(long, value_name = "NAME|INDEX")]
    pub(crate) adapter: Option<String>,
    /// Folder for a report with plots (report.html, .md, .json); made if it is not there
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
}

/// A bench under way.
#[derive(Clone, Copy)]
pub(super) struct Bench<'a> {
    pub(super) args: &'a RunArgs,
    pub(super) cx: &'a Context,
    /// Which part of the whole it is, 0 to 1.
    part: [f64; 2],
}

impl<'a> Bench<'a> {
    pub(super) fn new(args: &'a RunArgs, cx: &'a Context) -> Self {
        Self { args, cx, part: [0.0, 1.0] }
    }

    /// A part of it, as shares.
    pub(super) fn part(self, from: f64, to: f64) -> Self {
        let at = |share: f64| self.part[0] + share * (self.part[1] - self.part[0]);
        Self { part: [at(from), at(to)], ..self }
    }

    /// Part `i` of `n` equal ones.
    pub(super) fn turn(self, i: usize, n: usize) -> Self {
        self.part(i as f64 / n as f64, (i + 1) as f64 / n as f64)
    }

    /// Says how far it is, 0 to 1: one bar from the beginning to the end, so that the time left is that of the whole.
    pub(super) fn step(self, done: f64) -> catoptric::Result<()> {
        self.cx.step("measuring", self.part[0] + done * (self.part[1] - self.part[0]))
    }

    /// For work that has bars of its own: it is cancelled likewise, and silent.
    pub(super) fn silent(self) -> Context {
        self.cx.silent()
    }

    pub(super) fn rounds(self) -> Rounds {
        let quick = self.args.quick;
        Rounds {
            repeat: self.args.repeat.unwrap_or(if quick { 5 } else { 9 }),
            warm_up: 1,
            least_ms: if quick { 15.0 } else { 50.0 },
            least_frames: if quick { 2 } else { 3 },
            most_ms: if quick { 1000.0 } else { 4000.0 },
        }
    }

    /// One of two, by `--quick`.
    pub(super) fn pick<T>(self, full: T, quick: T) -> T {
        if self.args.quick { quick } else { full }
    }

    /// Not more surfels than `--max`.
    pub(super) fn surfels(self, wanted: usize) -> usize {
        self.args.max.map_or(wanted, |max| wanted.min(usize::try_from(max).unwrap_or(wanted)))
    }

    /// The scene that is asked for, by default `knot`; given models stand before the teapot alone, without ground, as those
    /// of the paper.
    pub(super) fn described(self) -> catoptric::Result<Scene> {
        let mut request = self.args.place.request(DEFAULT_SURFELS);
        if request.inputs.is_empty() && request.mirrors.is_empty() && request.objects.is_empty() {
            request.inputs.push("knot".into());
        }
        let mut scene = arrange::scene(&request, &self.silent())?;
        if !request.inputs.is_empty()
            && request.inputs.iter().all(|i| load::is_model(std::path::Path::new(i)))
        {
            scene.objects.pop();
        }
        Ok(scene)
    }

    /// Samples and shades a scene.
    pub(super) fn prepared(
        self,
        scene: &Scene,
        surfels: usize,
        leaf: u32,
    ) -> catoptric::Result<PreparedScene> {
        if !self.fits(surfels) {
            let problem = format!("{surfels} surfels do not go into the free memory");
            return Err(Error::input("--max", "", problem, "give a smaller number"));
        }
        let options = PrepareOptions { surfels, tree: leaves(leaf), seed: self.args.place.seed };
        PreparedScene::new(scene, &options, &self.silent())
    }

    /// Whether so many surfels go into the free memory.
    pub(super) fn fits(self, surfels: usize) -> bool {
        prepared::check_room(surfels, self.cx).is_ok()
            && memory::check(self.args.place.size, self.cx).is_ok()
    }

    /// Where c3rc is to run.
    pub(super) fn backend(self) -> catoptric::Result<Box<dyn Backend>> {
        let how = HowArgs {
            backend: self.args.backend.clone(),
            adapter: self.args.adapter.clone(),
            ..HowArgs::standard()
        };
        how.backend(c3rc())
    }
}

/// Trees with leaves of so many surfels.
pub(super) fn leaves(leaf_points: u32) -> KdTreeLimits {
    KdTreeLimits { leaf_points, leaf_size: 0.0 }
}

pub(super) fn c3rc() -> &'static dyn Method {
    method("c3rc").expect("it is in the registry")
}

/// A method's defaults with a preset or quality of that name, if it is not empty, and then these values.
pub(super) fn params(method: &dyn Method, preset: &str, values: &[(&str, &str)]) -> Params {
    let info = method.info();
    let mut params = Params::defaults(info.params);
    let known = info.presets.iter().chain(info.qualities).filter(|p| p.id == preset);
    for (id, value) in known.flat_map(|p| p.params).chain(values) {
        params.set(info.param(id), value).expect("the registry's values are in range");
    }
    params
}

/// Leaves of the preset `paper`.
pub(super) fn paper_leaf() -> u32 {
    c3rc().info().presets.iter().find_map(|p| p.leaf_points).expect("the preset says so")
}

/// The scene with its first mirror made of about so many triangles; `None` if that is not a built-in shape.
pub(super) fn with_mirror_triangles(scene: &Scene, triangles: usize) -> Option<Scene> {
    let mut scene = scene.clone();
    let mirror = scene.mirrors.first_mut()?;
    let Some(Source::Shape { name, .. }) = &mirror.source else { return None };
    mirror.mesh = std::sync::Arc::new(builtin::shape(name, Some(triangles))?);
    mirror.source = Some(Source::Shape { name: name.clone(), triangles: Some(triangles) });
    Some(scene)
}

/// The share of valid projections of a frame that was measured, counted on the CPU where its device did not.
pub(super) fn valid_share(
    timed: &Timed,
    scene: &PreparedScene,
    eye: &Eye,
    params: &Params,
) -> catoptric::Result<Option<f64>> {
    let measured = timed.report();
    if measured.valid.is_some() {
        return Ok(measured.valid_share());
    }
    let made = c3rc().prepare(scene, params, &Context::default())?;
    let mut renderer = Renderer::new();
    renderer.see(scene, eye);
    let (counted, _) =
        renderer.reflect(scene, eye, c3rc(), &made, params, false, &Context::default())?;
    Ok(counted.valid_share())
}

/// Where that is so.
pub(super) const NOT_BUILT_IN: &str =
    "The mirror is no built-in shape: it cannot be made of other numbers of triangles.";

/// A bench of one section, by itself.
pub(super) fn single(
    args: &RunArgs,
    cx: &Context,
    bench: impl FnOnce(Bench<'_>) -> anyhow::Result<Section>,
) -> anyhow::Result<()> {
    let bench_of = Bench::new(args, cx);
    begin(args, cx)?;
    let section = watched(|| bench(bench_of))?;
    let head = head(args, &format!("catoptric bench {}", section.id));
    let sections = [section];
    if let Some(folder) = &args.output {
        report::write(folder, &head, &sections)?;
    }
    write_json(args.json.as_ref(), &report::figures(&head, &sections))?;
    say!("{}", report::to_markdown(&sections[0], false).trim_end());
    if let Some(folder) = &args.output {
        say!("\nThe report is {}", folder.join("report.html").display());
    }
    Ok(())
}

/// Refuses what can be refused before anything is measured.
pub(super) fn begin(args: &RunArgs, cx: &Context) -> anyhow::Result<()> {
    check_json(args.json.as_ref())?;
    if let Some(folder) = &args.output {
        check_folder(folder)?;
    }
    if args.adapter.is_some() && args.backend == "cpu" {
        let problem = "is for --backend gpu";
        return Err(Error::input("--adapter", "", problem, "leave one of the two out").into());
    }
    args.place.begin(1, cx)
}

/// Runs a bench, and notes in its section what else the machine did meanwhile.
pub(super) fn watched(bench: impl FnOnce() -> anyhow::Result<Section>) -> anyhow::Result<Section> {
    let (start, before) = (Instant::now(), Load::now());
    let mut section = bench()?;
    let others = before.zip(Load::now()).and_then(|(before, now)| before.others_until(now));
    let busy = others.is_some_and(|share| share > BUSY);
    section.figures["load"] = json!({ "others": others, "busy": others.map(|_| busy) });
    section.figures["seconds"] = json!(start.elapsed().as_secs_f64().round());
    if let (true, Some(share)) = (busy, others) {
        let said = format!(
            "Busy machine: other programs took {:.0} % of it while this was measured. Ratios suffer less than times; repeat \
             it on a quiet machine before you quote either.",
            100.0 * share
        );
        section.blocks.insert(0, Block::Text(said));
    }
    Ok(section)
}

/// What is known before anything is measured.
pub(super) fn head(args: &RunArgs, title: &str) -> Head {
    let adapters = adapters();
    let machine = machine(&adapters);
    let text = |key: &str| match &machine[key] {
        Value::Null => "unknown".to_owned(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    let rounds = Bench::new(args, &Context::default()).rounds();
    let memory = machine["memory_bytes"].as_f64();
    let memory = memory.map_or(String::new(), |b| format!(", {:.0} GB of memory", b * 1e-9));
    let names: Vec<String> = adapters.as_array().into_iter().flatten().map(adapter_name).collect();
    let names = if names.is_empty() { "none".to_owned() } else { names.join("; ") };
    let inputs = inputs(&args.place);
    let mut facts = vec![
        ("Date", today()),
        (
            "Machine",
            format!(
                "{}, {} threads, {}{memory}, {}",
                text("cpu"),
                text("threads"),
                text("simd"),
                text("system")
            ),
        ),
        ("Graphics adapters", names),
        ("Program", format!("catoptric {}", env!("CARGO_PKG_VERSION"))),
        (
            "Method",
            format!(
                "frames of each side alternate with those of a reference (A B A B), {} turns after {} to warm up, each the fastest of at \
                 least {} frames and {:.0} ms of both; medians; ratios are turn by turn; ~ marks ratios whose quartiles are more than \
                 10 % apart",
                rounds.repeat, rounds.warm_up, rounds.least_frames, rounds.least_ms
            ),
        ),
        ("Seed", args.place.seed.to_string()),
    ];
    for input in &inputs {
        let text = |key: &str| input[key].as_str().unwrap_or_default().to_owned();
        let said = format!("{}, {} bytes, CRC-32 {}", text("file"), input["bytes"], text("crc32"));
        facts.push(("File", said));
    }
    let figures = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "date": today(),
        "machine": machine,
        "quick": args.quick,
        "repeat": rounds.repeat,
        "seed": args.place.seed,
        "inputs": inputs,
    });
    Head { title: title.to_owned(), facts, figures }
}

/// The files among what was given: name, size and checksum.
fn inputs(place: &PlaceArgs) -> Vec<Value> {
    let given = [&place.inputs, &place.mirror, &place.object, &place.proxy];
    let file = |name: &String| {
        let bytes = std::fs::read(name).ok()?;
        let sum = format!("{:08x}", crc32fast::hash(&bytes));
        Some(json!({ "file": name, "bytes": bytes.len(), "crc32": sum }))
    };
    let panorama = place.environment.as_ref().map(|path| path.display().to_string());
    given.into_iter().flatten().chain(&panorama).filter_map(file).collect()
}

/// With what must be said of it.
pub(super) fn adapter_name(adapter: &Value) -> String {
    let name = adapter["name"].as_str().unwrap_or_default();
    let software = adapter["software"] == true;
    if software {
        format!("{name} (software: its shaders run on the CPU)")
    } else {
        name.to_owned()
    }
}

#[cfg(feature = "gpu")]
pub(super) fn adapters() -> Value {
    super::super::info::adapter_figures(&catoptric::backend::gpu::adapters())
}

#[cfg(not(feature = "gpu"))]
pub(super) fn adapters() -> Value {
    json!([])
}
