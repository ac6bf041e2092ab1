//! The balance by what the mirror is: its number of triangles, and its parts.

use catoptric::analysis::measure::{Side, Stage, against};
use catoptric::analysis::part_costs;
use catoptric::scene::PreparedScene;
use catoptric::scene::description::Scene;
use serde_json::{Value, json};

use super::super::curve::{BALANCE, Curve, Row};
use super::super::report::{Block, Table};
use super::super::run::{Bench, NOT_BUILT_IN, c3rc, paper_leaf, params, with_mirror_triangles};
use crate::commands::plots::Axis;

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

/// Time over the number of mirror triangles.
pub(super) fn triangles(
    bench: Bench<'_>,
    described: &Scene,
    surfels: usize,
    blocks: &mut Vec<Block>,
) -> anyhow::Result<Value> {
    let wanted = bench.pick(&[2_000, 4_000, 8_000, 16_000, 32_000][..], &[2_000, 8_000, 32_000]);
    let Some(first) = with_mirror_triangles(described, wanted[0]) else {
        blocks.push(Block::Text(NOT_BUILT_IN.to_owned()));
        return Ok(Value::Null);
    };
    let base = bench.prepared(&first, surfels, paper_leaf())?;
    let mut rows = Vec::new();
    for (i, &count) in wanted.iter().enumerate() {
        let part = bench.turn(i, wanted.len());
        part.step(0.0)?;
        let Some(scene) = with_mirror_triangles(described, count) else { continue };
        let scene = part.prepared(&scene, surfels, paper_leaf())?;
        let eye = part.args.place.eye(&scene)?;
        let mut stages =
            [Stage::new(&base, &eye, part.backend()?), Stage::new(&scene, &eye, part.backend()?)];
        let own = |test: &str| params(c3rc(), "paper", &[("test", test)]);
        let first = Side::new(&stages, 0, c3rc(), own("paper"), &part.silent())?;
        let mut sides = Vec::new();
        for (_, test) in SIDES {
            sides.push(Side::new(&stages, 1, c3rc(), own(test), &part.silent())?);
        }
        let step = |done| part.step(done);
        let (_, timed) = against(&mut stages, &first, &sides, part.rounds(), step)?;
        rows.push(Row { x: scene.mirror_triangle_count() as f64, timed, more: Vec::new() });
    }
    let curve = Curve {
        id: "balance-triangles",
        title: "Culling and projection over the mirror's triangles (the paper says: linear)".into(),
        x: Axis { label: "mirror triangles", log: true },
        sides: SIDES.map(|side| side.0).to_vec(),
        stages: &BALANCE,
        rows,
        reference: "as published before the first mirror",
    };
    curve.show(blocks)?;
    Ok(curve.figures("triangles"))
}
