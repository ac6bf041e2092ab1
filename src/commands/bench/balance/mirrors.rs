//! The balance by what the mirror is: its number of triangles, and its parts.

use catoptric::analysis::balance::exponent;
use catoptric::analysis::measure::{Quantity, Ratio, Side, Stage, Timed, interleave};
use catoptric::analysis::part_costs;
use catoptric::scene::PreparedScene;
use catoptric::scene::description::Scene;
use serde_json::{Value, json};

use super::super::report::{Block, Image, Plot, Table, median, number, quantity, ratio, times};
use super::super::run::{Bench, c3rc, paper_leaf, params, with_mirror_triangles};
use super::super::tables::frame_figures;
use crate::commands::plots::{Axis, Dot, LinePlot, Series, lines};

/// What each part of the mirrors projects.
pub(super) fn parts(
    bench: Bench<'_>,
    scene: &PreparedScene,
    blocks: &mut Vec<Block>,
) -> anyhow::Result<Value> {
    let eye = bench.args.place.eye(scene)?;
    let mut stage = Stage::new(scene, &eye, Box::new(catoptric::backend::cpu::Cpu::default()));
    let settings = params(c3rc(), "paper", &[("test", "slab")]);
    let found = part_costs(scene, &eye, stage.renderer().visibility(), &settings)?;
    let all: u64 = found.iter().map(|p| p.projections).sum();
    let pixels: usize = found.iter().map(|p| p.pixels).sum();
    let surfels = scene.surfel_count() as f64;
    let percent = |part: f64, whole: f64| format!("{:.1}", 100.0 * part / whole.max(1.0));
    let mut table = Table::new(
        "Parts of the mirror (conservative test, leaves of 122, no detail): how wide their cameras open",
        &[
            "part",
            "triangles",
            "visible",
            "pixels a triangle",
            "% of the mirror's pixels",
            "% of all projections",
            "of all surfels, a camera projects %",
            "the widest one %",
        ],
    );
    for p in &found {
        let mean = p.projections as f64 / p.projecting.max(1) as f64;
        table.row(vec![
            p.name.clone(),
            p.triangles.to_string(),
            p.visible.to_string(),
            format!("{:.0}", p.pixels as f64 / p.visible.max(1) as f64),
            percent(p.pixels as f64, pixels as f64),
            percent(p.projections as f64, all as f64),
            percent(mean, surfels),
            percent(f64::from(p.most), surfels),
        ]);
    }
    blocks.push(Block::Table(table));
    let figures = found.iter().map(|p| {
        json!({
            "part": p.name,
            "triangles": p.triangles,
            "visible": p.visible,
            "pixels": p.pixels,
            "projecting": p.projecting,
            "projections": p.projections,
            "most": p.most,
        })
    });
    Ok(figures.collect())
}

/// Which the tests are that are compared over the mirror's triangles.
const SIDES: [(&str, &str); 2] = [("as published", "paper"), ("conservative test", "slab")];

struct Row {
    triangles: usize,
    timed: Vec<Timed>,
    /// To as published before the first mirror, by side.
    ratios: Vec<Option<Ratio>>,
}

/// Time over the number of mirror triangles.
pub(super) fn triangles(
    bench: Bench<'_>,
    described: &Scene,
    surfels: usize,
    blocks: &mut Vec<Block>,
) -> anyhow::Result<Value> {
    let wanted = bench.pick(&[2_000, 4_000, 8_000, 16_000, 32_000][..], &[2_000, 8_000, 32_000]);
    let mut rows: Vec<Row> = Vec::new();
    let Some(first) = with_mirror_triangles(described, wanted[0]) else {
        blocks.push(Block::Text(
            "The mirror is no built-in shape: it cannot be made of other numbers of triangles."
                .to_owned(),
        ));
        return Ok(json!([]));
    };
    let base = bench.prepared(&first, surfels, paper_leaf())?;
    for (i, &count) in wanted.iter().enumerate() {
        let part = bench.turn(i, wanted.len());
        part.step(0.0)?;
        let Some(scene) = with_mirror_triangles(described, count) else { continue };
        let scene = part.prepared(&scene, surfels, paper_leaf())?;
        let eye = part.args.place.eye(&scene)?;
        let mut stages =
            [Stage::new(&base, &eye, part.backend()?), Stage::new(&scene, &eye, part.backend()?)];
        let own = |test: &str| params(c3rc(), "paper", &[("test", test)]);
        let mut sides = vec![Side::new(&stages, 0, c3rc(), own("paper"), &part.silent())?];
        for (_, test) in SIDES {
            sides.push(Side::new(&stages, 1, c3rc(), own(test), &part.silent())?);
        }
        let mut timed = interleave(&mut stages, &sides, part.rounds(), |done| part.step(done))?;
        let reference = timed.remove(0).reflection_ms();
        let ratios = timed.iter().map(|t| Ratio::of(&t.reflection_ms(), &reference)).collect();
        rows.push(Row { triangles: scene.mirror_triangle_count(), timed, ratios });
    }
    show(&rows, blocks)?;
    let settings = |row: &Row| {
        let one = |((name, _), (timed, own)): (&(&str, &str), (&Timed, &Option<Ratio>))| {
            let mut value = frame_figures(timed);
            value["setting"] = json!(name);
            value["ratio_to_first"] = ratio(*own);
            value
        };
        SIDES.iter().zip(row.timed.iter().zip(&row.ratios)).map(one).collect::<Vec<_>>()
    };
    let list: Vec<Value> = rows
        .iter()
        .map(|row| json!({ "triangles": row.triangles, "settings": settings(row) }))
        .collect();
    Ok(json!(list))
}

fn show(rows: &[Row], blocks: &mut Vec<Block>) -> anyhow::Result<()> {
    let mut table = Table::new(
        "Mirror triangles",
        &[
            "triangles",
            "setting",
            "cameras",
            "total ms",
            "culling ms",
            "projection ms",
            "projections",
            "to the first row",
        ],
    );
    let (mut series, mut growth) = (Vec::new(), Vec::new());
    for (k, (name, _)) in SIDES.iter().enumerate() {
        let stages: [(&str, fn(&catoptric::frame::FrameReport) -> Option<f64>); 3] = [
            ("total", |r| Some(r.reflection_ms())),
            ("culling", |r| r.cull_ms),
            ("projection", |r| r.project_ms),
        ];
        for (stage, pick) in stages {
            let of = |row: &Row| Some((row.triangles as f64, row.timed[k].quantity(pick)?));
            let points: Vec<(f64, Quantity)> = rows.iter().filter_map(of).collect();
            let law: Vec<[f64; 2]> = points.iter().map(|(x, q)| [*x, q.median]).collect();
            if let Some(power) = exponent(&law) {
                growth.push(format!("{name}, {stage}: {}", number(power)));
            }
            let dots = points.iter().map(|&(x, q)| Dot { x, y: q.median, quartiles: [q.q1, q.q3] });
            series.push(Series {
                name: format!("{name}: {stage}"),
                dots: dots.collect(),
                joined: true,
            });
        }
        for row in rows {
            let report = row.timed[k].report();
            table.row(vec![
                row.triangles.to_string(),
                (*name).to_owned(),
                report.cameras.map_or("–".into(), |n| n.to_string()),
                median(Quantity::of(row.timed[k].reflection_ms())),
                median(row.timed[k].quantity(|r| r.cull_ms)),
                median(row.timed[k].quantity(|r| r.project_ms)),
                report.projections.map_or("–".into(), |n| n.to_string()),
                times(row.ratios[k]),
            ]);
        }
    }
    let _ = quantity;
    blocks.push(Block::Table(table));
    if !growth.is_empty() {
        blocks.push(Block::Text(format!(
            "Time as a power of the number of mirror triangles (the paper says linear, which is 1): {}.",
            growth.join("; ")
        )));
    }
    let plot = LinePlot {
        title: "Mirror triangles",
        x: Axis { label: "mirror triangles", log: true },
        y: Axis { label: "ms", log: true },
        series: &series,
        level: None,
    };
    blocks.push(Block::Plot(Plot {
        name: "balance-triangles".into(),
        caption: "Culling, projection and the whole layer over the mirror's triangles; bars span the quartiles.".into(),
        image: Image::Svg(lines(&plot)?),
    }));
    Ok(())
}
