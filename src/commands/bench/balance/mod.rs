//! `catoptric bench balance`: culling against projection, over leaves, tests, details and backends; over mirror triangles; and
//! by part of the mirror.

mod mirrors;
mod sentence;
mod show;

use catoptric::analysis::balance::{Balance, BalancePoint};
use catoptric::analysis::measure::{Quantity, Side, Stage, Timed, against};
use catoptric::backend::Backend;
use catoptric::backend::cpu::Cpu;
use catoptric::frame::FrameReport;
use catoptric::scene::PreparedScene;
use serde_json::{Value, json};

use super::super::render::HowArgs;
use super::report::{Block, Section};
use super::run::{Bench, adapter_name, adapters, c3rc, leaves, paper_leaf, params, valid_share};

/// Box tests that walk the tree, in the order of the plots.
const TESTS: [&str; 4] = ["interval", "paper", "sweep", "slab"];
/// Surfels a leaf; so small that the least total is not at an end, where projection is dear.
const LEAVES: [u32; 12] = [2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096];
/// Where each frame takes long.
const FEW_LEAVES: [u32; 7] = [1, 2, 8, 32, 128, 512, 4096];

/// What one side of the sweep took.
struct Point {
    test: &'static str,
    detail: &'static str,
    leaf: u32,
    /// In turn with the paper's setting.
    timed: Timed,
    valid_share: Option<f64>,
}

/// The sweep on one backend.
struct Sweep {
    /// `cpu`, or the adapter with what must be said of it.
    place: String,
    points: Vec<Point>,
    /// Without a test leaves do not matter.
    none: Point,
    /// The paper's setting, milliseconds, over all turns.
    reference: Option<Quantity>,
}

impl Sweep {
    /// The points of one test at one detail, in the order of their leaves.
    fn of<'a>(&'a self, test: &'a str, detail: &'a str) -> impl Iterator<Item = &'a Point> {
        self.points.iter().filter(move |p| p.test == test && p.detail == detail)
    }

    /// A stage's time, milliseconds, as its share of the reference's turns beside it: so it moves with the machine as they do.
    fn stage_ms(&self, point: &Point, pick: fn(&FrameReport) -> Option<f64>) -> Option<f64> {
        Some(point.timed.relative(pick)?.median * self.reference?.median)
    }

    /// The same as numbers.
    fn numbers(&self, test: &str, detail: &str) -> Vec<BalancePoint> {
        let number = |p: &Point| BalancePoint {
            leaf: p.leaf,
            cull_ms: self.stage_ms(p, |r| r.cull_ms).unwrap_or(0.0),
            project_ms: self.stage_ms(p, |r| r.project_ms).unwrap_or(f64::NAN),
            total: self.stage_ms(p, |r| Some(r.reflection_ms())).unwrap_or(f64::NAN),
            valid_share: p.valid_share,
        };
        self.of(test, detail).map(number).collect()
    }
}

pub(super) fn section(bench: Bench<'_>) -> anyhow::Result<Section> {
    let described = bench.described()?;
    let surfels = bench.surfels(bench.pick(147_000, 37_000));
    bench.step(0.0)?;
    let base = bench.prepared(&described, surfels, paper_leaf())?;
    let mut blocks = vec![Block::Text(NOTE.to_owned())];
    let mut sweeps = Vec::new();
    let auto = bench.args.backend == "auto" && bench.args.adapter.is_none();
    if auto || bench.args.backend == "cpu" {
        let details: &[&str] = &["0", "2"];
        let settings = Settings { leaves: &LEAVES, details, place: "cpu".into(), slow: false };
        sweeps.push(sweep(bench.part(0.02, 0.45), &base, &settings, &|| {
            Ok(Box::new(Cpu::default()))
        })?);
    }
    match gpu(bench, auto) {
        Some(Ok((name, software))) => {
            let leaves = if software || bench.args.quick { &FEW_LEAVES[..] } else { &LEAVES };
            let settings = Settings { leaves, details: &["0"], place: name, slow: software };
            let on_gpu = || {
                let adapter = bench.args.adapter.clone();
                HowArgs { backend: "gpu".into(), adapter, ..HowArgs::standard() }.backend(c3rc())
            };
            sweeps.push(sweep(bench.part(0.45, 0.75), &base, &settings, &on_gpu)?);
        }
        // Asked for, and not there.
        Some(Err(error)) => return Err(error.into()),
        None if auto => blocks.push(Block::Text(
            "No graphics adapter was found (or this program was built without the feature gpu): this is the CPU's side only."
                .to_owned(),
        )),
        None => {}
    }
    for sweep in &sweeps {
        show::sweep(sweep, &mut blocks)?;
    }
    let parts = mirrors::parts(bench, &base, &mut blocks)?;
    let triangles = mirrors::triangles(bench.part(0.75, 1.0), &described, surfels, &mut blocks)?;
    let size = bench.args.place.size;
    Ok(Section {
        id: "balance",
        title: format!(
            "Culling against projection: {}, {surfels} surfels, {} x {}",
            described.name, size.width, size.height
        ),
        blocks,
        figures: json!({
            "scene": described.name,
            "surfels": surfels,
            "size": [size.width, size.height],
            "sweeps": sweeps.iter().map(show::figures).collect::<Vec<_>>(),
            "parts": parts,
            "triangles": triangles,
        }),
    })
}

const NOTE: &str = "All settings are those of the preset paper (a camera a triangle, squares of one pixel, unit rays, first root) but \
    for the box test, the level of detail and the leaves. Totals are of the reflected layer; each was measured in turn with the \
    paper's own setting (its test, leaves of 122, no detail), and the ratio to that tells which is least. Detail 0 projects every \
    point, as in the paper.";

/// The adapter, and whether it is in software; `None`: there is none, or it is not to be used.
fn gpu(bench: Bench<'_>, auto: bool) -> Option<catoptric::Result<(String, bool)>> {
    if !auto && bench.args.backend == "cpu" {
        return None;
    }
    let list = adapters();
    let wanted = bench.args.adapter.as_deref().map(str::to_lowercase);
    let fits = |(i, adapter): &(usize, &Value)| {
        let name = adapter["name"].as_str().unwrap_or_default().to_lowercase();
        wanted.as_ref().is_none_or(|w| *w == i.to_string() || name.contains(w.as_str()))
    };
    let found = list.as_array()?.iter().enumerate().find(fits);
    match found {
        Some((_, adapter)) => Some(Ok((adapter_name(adapter), adapter["software"] == true))),
        None if auto => None,
        // The backend's own message names the option and the remedy.
        None => bench.backend().err().map(Err),
    }
}

/// What is swept.
struct Settings<'a> {
    leaves: &'a [u32],
    details: &'a [&'static str],
    place: String,
    /// Frames take so long that few turns have to do.
    slow: bool,
}

fn sweep(
    bench: Bench<'_>,
    base: &PreparedScene,
    settings: &Settings<'_>,
    backend: &dyn Fn() -> catoptric::Result<Box<dyn Backend>>,
) -> anyhow::Result<Sweep> {
    let Settings { leaves: sizes, details, ref place, slow } = *settings;
    let eye = bench.args.place.eye(base)?;
    let mut rounds = bench.rounds();
    if slow {
        rounds.repeat = rounds.repeat.min(bench.pick(7, 3));
    }
    let mut swept = base.clone();
    let (mut points, mut none, mut references) = (Vec::new(), None, Vec::new());
    let mut backends = [backend()?, backend()?];
    for (i, &leaf) in sizes.iter().enumerate() {
        let part = bench.turn(i, sizes.len());
        part.step(0.0)?;
        swept.rebuild_trees(leaves(leaf), &bench.silent())?;
        let [a, b] = backends;
        let mut stages = [Stage::new(base, &eye, a), Stage::new(&swept, &eye, b)];
        let published = params(c3rc(), "paper", &[]);
        let published = Side::new(&stages, 0, c3rc(), published, &bench.silent())?;
        let (mut sides, mut names) = (Vec::new(), Vec::new());
        // Where leaves do not matter, one of them will do.
        let tests =
            TESTS.iter().flat_map(|&test| details.iter().map(move |&detail| (test, detail)));
        let untested = (i == 0).then_some(("none", "0"));
        for (test, detail) in tests.chain(untested) {
            let params = params(c3rc(), "paper", &[("test", test), ("detail", detail)]);
            sides.push(Side::new(&stages, 1, c3rc(), params, &bench.silent())?);
            names.push((test, detail));
        }
        let step = |done| part.step(done);
        let (reference, timed) = against(&mut stages, &published, &sides, rounds, step)?;
        for ((test, detail), timed) in names.into_iter().zip(timed) {
            let own = params(c3rc(), "paper", &[("test", test), ("detail", detail)]);
            // Counted on the CPU it would take long, and is the number of images by that of cameras times surfels.
            let valid_share = match test {
                "none" => timed.report().valid_share(),
                _ => valid_share(&timed, &swept, &eye, &own)?,
            };
            let point = Point { test, detail, leaf, timed, valid_share };
            if test == "none" { none = Some(point) } else { points.push(point) }
        }
        references.extend(reference.reflection_ms());
        backends = stages.map(Stage::into_backend);
    }
    Ok(Sweep {
        place: place.clone(),
        points,
        none: none.expect("there is a first leaf"),
        reference: Quantity::of(references),
    })
}

/// What is least, over all tests at one detail.
fn least(sweep: &Sweep, detail: &str) -> Option<(&'static str, Balance, Vec<BalancePoint>)> {
    let of = |test: &'static str| {
        let points = sweep.numbers(test, detail);
        Balance::of(&points).map(|balance| (test, balance, points))
    };
    TESTS
        .into_iter()
        .filter_map(of)
        .min_by(|a, b| a.2[a.1.least].total.total_cmp(&b.2[b.1.least].total))
}
