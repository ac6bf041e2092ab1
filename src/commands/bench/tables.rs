//! `catoptric bench tables`: Tables 1 and 2 of Mei et al. on this machine.

use std::time::Instant;

use catoptric::accel::KdTree;
use catoptric::accel::kd_tree::KdTreeStatistics;
use catoptric::analysis::measure::{Quantity, Side, Stage, Timed, against};
use catoptric::frame::FrameReport;
use catoptric::scene::PreparedScene;
use catoptric::scene::prepared::PrepareOptions;
use serde_json::{Value, json};

use super::super::render::where_it_ran;
use super::report::{Block, Image, Plot, Section, Table, median, number, quantity, ratio, times};
use super::run::{Bench, c3rc, leaves, paper_leaf, params, valid_share};
use crate::commands::plots::{Axis, Dot, LinePlot, Series, lines};

/// A row of the paper's tables.
struct Published {
    scene: &'static str,
    /// Thousands of points.
    points_k: usize,
    build_ms: f64,
    depth: f64,
    leaf: f64,
    total_ms: f64,
    cull_ms: f64,
    project_ms: f64,
    valid_percent: f64,
}

const fn row(scene: &'static str, points_k: usize, tree: [f64; 3], frame: [f64; 4]) -> Published {
    let [build_ms, depth, leaf] = tree;
    let [total_ms, cull_ms, project_ms, valid_percent] = frame;
    Published {
        scene,
        points_k,
        build_ms,
        depth,
        leaf,
        total_ms,
        cull_ms,
        project_ms,
        valid_percent,
    }
}

/// Mei et al., Tables 1 and 2 (3.4 GHz Pentium 4, Quadro FX 3400). The totals leave out the tree.
const PAPER: [Published; 6] = [
    row("Dinosaur", 10, [6.0, 3.4, 123.0], [48.0, 25.0, 23.0, 19.0]),
    row("Bunny1", 37, [25.0, 4.7, 121.0], [121.0, 63.0, 58.0, 19.0]),
    row("Dragon1", 100, [95.0, 5.7, 122.0], [250.0, 134.0, 116.0, 20.0]),
    row("Bunny0", 147, [190.0, 6.1, 121.0], [264.0, 136.0, 128.0, 19.0]),
    row("Dragon0", 437, [533.0, 7.2, 121.0], [588.0, 273.0, 315.0, 20.0]),
    row("Statue0", 543, [577.0, 7.4, 122.0], [650.0, 304.0, 346.0, 21.0]),
];
/// What the paper's machine projects, million points a second.
const PAPER_RATE: f64 = 3.4;

/// A way to draw the frame.
#[derive(Clone, Copy)]
struct Setting {
    name: &'static str,
    preset: &'static str,
    values: &'static [(&'static str, &'static str)],
    /// Of the paper, or our own.
    paper_leaf: bool,
}

const SETTINGS: [Setting; 3] = [
    Setting { name: "as published", preset: "paper", values: &[], paper_leaf: true },
    Setting {
        name: "conservative tests",
        preset: "paper",
        values: &[("test", "slab")],
        paper_leaf: true,
    },
    Setting { name: "our default", preset: "", values: &[], paper_leaf: false },
];

/// What was measured for one row of the paper.
struct Measured {
    paper: &'static Published,
    surfels: usize,
    /// With the paper's leaves, and with ours.
    trees: [Tree; 2],
    /// By [`SETTINGS`].
    frames: Vec<Timed>,
    /// Likewise.
    valid_shares: Vec<Option<f64>>,
}

struct Tree {
    build_ms: Option<Quantity>,
    statistics: KdTreeStatistics,
}

pub(super) fn section(bench: Bench<'_>) -> anyhow::Result<Section> {
    let described = bench.described()?;
    let own_leaf = PrepareOptions::default().tree.leaf_points;
    let mut rows = Vec::new();
    for (i, paper) in PAPER.iter().enumerate() {
        let part = bench.turn(i, PAPER.len());
        part.step(0.0)?;
        let surfels = part.surfels(paper.points_k * 1000);
        if rows.last().is_some_and(|row: &Measured| row.surfels == surfels) {
            break;
        }
        let scene = part.prepared(&described, surfels, paper_leaf())?;
        let mut fine = scene.clone();
        fine.rebuild_trees(leaves(own_leaf), &part.silent())?;
        let trees = build(part.part(0.1, 0.3), [&scene, &fine], [paper_leaf(), own_leaf])?;
        let eye = part.args.place.eye(&scene)?;
        let mut stages =
            [Stage::new(&scene, &eye, part.backend()?), Stage::new(&fine, &eye, part.backend()?)];
        let (mut sides, all) = (Vec::new(), SETTINGS.map(|s| params(c3rc(), s.preset, s.values)));
        for (setting, params) in SETTINGS.iter().zip(&all) {
            let stage = usize::from(!setting.paper_leaf);
            sides.push(Side::new(&stages, stage, c3rc(), params.clone(), &part.silent())?);
        }
        let measuring = part.part(0.3, 1.0);
        let published = sides.remove(0);
        let step = |done| measuring.step(done);
        let (published, others) = against(&mut stages, &published, &sides, part.rounds(), step)?;
        let frames: Vec<Timed> = std::iter::once(published).chain(others).collect();
        let counted =
            frames.iter().zip(SETTINGS.iter().zip(&all)).map(|(timed, (setting, params))| {
                let own = if setting.paper_leaf { &scene } else { &fine };
                valid_share(timed, own, &eye, params)
            });
        let valid_shares = counted.collect::<catoptric::Result<_>>()?;
        rows.push(Measured { paper, surfels, trees, frames, valid_shares });
    }
    let size = bench.args.place.size;
    let place = rows.last().map_or(String::new(), |row| where_it_ran(&row.frames[0].report()));
    let title = format!(
        "Tables 1 and 2 of Mei et al., with {} before the mirror ({} x {}, {place})",
        described.name, size.width, size.height
    );
    Ok(Section {
        id: "tables",
        title,
        blocks: vec![
            Block::Text(NOTE.to_owned()),
            Block::Plot(plot(&rows)?),
            Block::Table(table_1(&rows)),
            Block::Table(table_2(&rows)),
            Block::Text(balance(&rows)),
        ],
        figures: json!({
            "scene": described.name,
            "size": [size.width, size.height],
            "rows": rows.iter().map(figures).collect::<Vec<_>>(),
        }),
    })
}

const NOTE: &str = "The paper's own figures stand beside ours; they are of a 3.4 GHz Pentium 4 with a Quadro FX 3400, and of \
    scans that are not part of this program. What differs: the paper's tree is split eight ways, ours is built in two and walked \
    eight children at a time, so depths of ours are given in binary levels and, divided by three, in eight-way ones; the paper \
    culls on one core and projects on the card, here culling and projection are the time of all threads by their number, and \
    the total is wall time with cameras, splatting and clearing. Valid is the share of projected points that have an image in \
    the camera: it depends on how large the mirror's triangles are against the object, and so on the view.";

/// Builds the trees over all objects in turn, without representatives, as the paper's have none.
fn build(
    bench: Bench<'_>,
    scenes: [&PreparedScene; 2],
    sizes: [u32; 2],
) -> anyhow::Result<[Tree; 2]> {
    let mut taken = [Vec::new(), Vec::new()];
    let repeat = bench.rounds().repeat.min(7);
    for round in 0..=repeat {
        for (times, (scene, leaf)) in taken.iter_mut().zip(scenes.into_iter().zip(sizes)) {
            bench.step(f64::from(round) / f64::from(repeat + 1))?;
            let own = (0..scene.objects.len()).map(|i| scene.surfels_of(i));
            let mut own: Vec<_> = own.collect();
            let start = Instant::now();
            for surfels in &mut own {
                std::hint::black_box(KdTree::build(surfels, leaves(leaf)));
            }
            if round > 0 {
                times.push(start.elapsed().as_secs_f64() * 1e3);
            }
        }
    }
    let [a, b] = taken;
    let tree = |scene: &PreparedScene, times: Vec<f64>| Tree {
        build_ms: Quantity::of(times),
        statistics: over_objects(scene),
    };
    Ok([tree(scenes[0], a), tree(scenes[1], b)])
}

/// Of all objects' trees together.
fn over_objects(scene: &PreparedScene) -> KdTreeStatistics {
    let of = |cloud: &catoptric::scene::prepared::Cloud| cloud.tree.statistics();
    let all: Vec<KdTreeStatistics> = scene.clouds[..scene.objects.len()].iter().map(of).collect();
    let leaves: usize = all.iter().map(|s| s.leaves).sum();
    let depths: f64 = all.iter().map(|s| s.mean_depth * s.leaves as f64).sum();
    KdTreeStatistics {
        leaves,
        mean_depth: depths / leaves as f64,
        points_per_leaf: scene.surfel_count() as f64 / leaves as f64,
    }
}

/// Totals over points, the paper's and ours.
fn plot(rows: &[Measured]) -> anyhow::Result<Plot> {
    let published =
        rows.iter().map(|row| Dot::exact(row.paper.points_k as f64 * 1e3, row.paper.total_ms));
    let name = "the paper's (2007)".to_owned();
    let mut series = vec![Series { name, dots: published.collect(), joined: true }];
    for (k, setting) in SETTINGS.iter().enumerate() {
        let dot = |row: &Measured| {
            let total = row.frames[k].total()?;
            Some(Dot { x: row.surfels as f64, y: total.median, quartiles: [total.q1, total.q3] })
        };
        let dots = rows.iter().filter_map(dot).collect();
        series.push(Series { name: setting.name.to_owned(), dots, joined: true });
    }
    let plot = LinePlot {
        title: "Table 2: the reflection over the points",
        x: Axis { label: "points", log: true },
        y: Axis { label: "ms", log: true },
        series: &series,
        level: None,
    };
    let caption = "The paper's totals (3.4 GHz Pentium 4, Quadro FX 3400, its own scans) and those of this machine; bars span the quartiles.";
    Ok(Plot { name: "tables".into(), caption: caption.into(), image: Image::Svg(lines(&plot)?) })
}

fn table_1(rows: &[Measured]) -> Table {
    let mut table = Table::new(
        "Table 1: the tree over the surfels (paper | ours with its leaves | ours with our leaves)",
        &[
            "points",
            "paper: scene",
            "build ms",
            "depth",
            "a leaf",
            "ours: build ms",
            "depth (by 3)",
            "a leaf",
            "leaves",
            "default: build ms",
            "depth (by 3)",
            "a leaf",
            "leaves",
        ],
    );
    for row in rows {
        let mut cells = vec![
            row.surfels.to_string(),
            row.paper.scene.to_owned(),
            number(row.paper.build_ms),
            row.paper.depth.to_string(),
            row.paper.leaf.to_string(),
        ];
        for Tree { build_ms, statistics: s } in &row.trees {
            cells.push(median(*build_ms));
            cells.push(format!("{:.1} ({:.1})", s.mean_depth, s.mean_depth / 3.0));
            cells.push(format!("{:.1}", s.points_per_leaf));
            cells.push(s.leaves.to_string());
        }
        table.row(cells);
    }
    table
}

fn table_2(rows: &[Measured]) -> Table {
    let mut table = Table::new(
        "Table 2: the reflection",
        &[
            "points",
            "setting",
            "total ms",
            "culling ms",
            "projection ms",
            "valid %",
            "projections",
            "a point",
            "to the published",
        ],
    );
    for row in rows {
        let Published { scene, total_ms, cull_ms, project_ms, valid_percent, .. } = row.paper;
        table.row(vec![
            (row.paper.points_k * 1000).to_string(),
            format!("the paper's ({scene})"),
            number(*total_ms),
            number(*cull_ms),
            number(*project_ms),
            number(*valid_percent),
            "–".into(),
            "–".into(),
            "–".into(),
        ]);
        for ((setting, timed), valid) in SETTINGS.iter().zip(&row.frames).zip(&row.valid_shares) {
            let report = timed.report();
            let projections = report.projections;
            let share = projections.map(|n| n as f64 / row.surfels as f64);
            table.row(vec![
                row.surfels.to_string(),
                setting.name.to_owned(),
                median(timed.total()),
                median(timed.quantity(|r| r.cull_ms)),
                median(timed.quantity(|r| r.project_ms)),
                valid.map_or("–".into(), |v| number(100.0 * v)),
                projections.map_or("–".into(), |n| n.to_string()),
                share.map_or("–".into(), number),
                times(timed.ratio()),
            ]);
        }
    }
    table
}

/// Where the largest scene's time goes, there and here.
fn balance(rows: &[Measured]) -> String {
    let Some(row) = rows.last() else { return String::new() };
    let share = |cull: f64, project: f64| 100.0 * cull / (cull + project);
    let of = |timed: &Timed| {
        let pick = |pick: fn(&FrameReport) -> Option<f64>| timed.quantity(pick).map(|q| q.median);
        Some((pick(|r| r.cull_ms)?, pick(|r| r.project_ms)?, timed.report().projections?))
    };
    let (Some((a, b, n)), Some((c, d, _))) = (of(&row.frames[0]), of(&row.frames[1])) else {
        return String::new();
    };
    format!(
        "Of culling and projection together, culling is {:.0} % in the paper's largest scene ({} of {} ms). Here, of {} surfels, \
         it is {:.0} % with everything as published ({} of {} ms) and {:.0} % with the conservative test, which also refuses \
         boxes sooner. Projection runs at {:.0} million points a second here, at {PAPER_RATE} million there.",
        share(row.paper.cull_ms, row.paper.project_ms),
        row.paper.cull_ms,
        row.paper.cull_ms + row.paper.project_ms,
        row.surfels,
        share(a, b),
        number(a),
        number(a + b),
        share(c, d),
        n as f64 / b * 1e-3,
    )
}

fn figures(row: &Measured) -> Value {
    let tree = |tree: &Tree| {
        let s = tree.statistics;
        json!({
            "build_ms": quantity(tree.build_ms),
            "leaves": s.leaves,
            "points_per_leaf": s.points_per_leaf,
            "mean_depth": s.mean_depth,
        })
    };
    let p = row.paper;
    let frames = row.frames.iter().zip(&row.valid_shares);
    let settings = SETTINGS.iter().zip(frames).map(|(setting, (timed, valid))| {
        let mut value = frame_figures(timed);
        value["valid_share"] = json!(valid);
        value["setting"] = json!(setting.name);
        value["ratio_to_published"] = ratio(timed.ratio());
        value
    });
    json!({
        "surfels": row.surfels,
        "paper": {
            "scene": p.scene,
            "points": p.points_k * 1000,
            "build_ms": p.build_ms,
            "mean_depth": p.depth,
            "points_per_leaf": p.leaf,
            "total_ms": p.total_ms,
            "cull_ms": p.cull_ms,
            "project_ms": p.project_ms,
            "valid_share": p.valid_percent / 100.0,
        },
        "tree": tree(&row.trees[0]),
        "tree_default": tree(&row.trees[1]),
        "settings": settings.collect::<Vec<_>>(),
    })
}

/// What a side's frames took and did.
pub(super) fn frame_figures(timed: &Timed) -> Value {
    let report = timed.report();
    json!({
        "backend": report.backend,
        "device": report.device,
        "total_ms": quantity(timed.total()),
        "cameras_ms": quantity(timed.quantity(|r| r.cameras_ms)),
        "cull_ms": quantity(timed.quantity(|r| r.cull_ms)),
        "project_ms": quantity(timed.quantity(|r| r.project_ms)),
        "splat_ms": quantity(timed.quantity(|r| r.splat_ms)),
        "cameras": report.cameras,
        "batches": report.batches,
        "projections": report.projections,
        "valid": report.valid,
        "valid_share": report.valid_share(),
    })
}
