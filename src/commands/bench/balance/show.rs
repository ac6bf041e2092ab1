//! Tables, plots and figures of a sweep.

use catoptric::analysis::balance::{Balance, nearest_to_share};
use serde_json::{Value, json};

use super::super::report::{Block, Image, Plot, Table, median, quantity, ratio, times};
use super::super::tables::frame_figures;
use super::sentence::{self, PAPER_SHARE};
use super::{Point, Sweep, TESTS, least};
use crate::commands::plots::{Stack, StackLabels, StackPlot, stacks};

/// The details of a sweep, in its order.
fn details(sweep: &Sweep) -> Vec<&'static str> {
    let mut details: Vec<&str> = sweep.points.iter().map(|p| p.detail).collect();
    details.sort_unstable();
    details.dedup();
    details
}

/// Adds what a sweep says.
pub(super) fn sweep(sweep: &Sweep, blocks: &mut Vec<Block>) -> anyhow::Result<()> {
    if let Some((test, balance, points)) = least(sweep, "0") {
        blocks.push(Block::Text(sentence::optimum(&sweep.place, test, balance, &points)));
        let least = points[balance.least].total;
        let near = |test: &str| {
            let points = sweep.numbers(test, "0");
            let share = points[nearest_to_share(&points, PAPER_SHARE)?].valid_share?;
            Some(((share - PAPER_SHARE).abs(), sentence::nearest(test, least, &points)?))
        };
        let nearest = TESTS.into_iter().filter_map(near).min_by(|a, b| a.0.total_cmp(&b.0));
        blocks.extend(nearest.map(|(_, text)| Block::Text(text)));
    }
    let kind = if sweep.place == "cpu" { "cpu" } else { "gpu" };
    for detail in details(sweep) {
        blocks.push(Block::Plot(plot(sweep, kind, detail)?));
        blocks.push(Block::Table(table(sweep, detail)));
    }
    blocks.push(Block::Text(untested(sweep)));
    Ok(())
}

/// What is left out of the plots: it would dwarf them.
fn untested(sweep: &Sweep) -> String {
    let timed = &sweep.none.timed;
    let report = timed.report();
    let valid = report
        .valid_share()
        .map_or(String::new(), |v| format!(", {:.2} % of them valid", 100.0 * v));
    format!(
        "Without a test ({}) every object that a camera may see is projected whole: {} ms, {} projections{valid}; {} times the paper's \
         setting.",
        sweep.place,
        median(timed.total()),
        report.projections.unwrap_or(0),
        times(timed.ratio())
    )
}

fn plot(sweep: &Sweep, kind: &str, detail: &str) -> anyhow::Result<Plot> {
    let one = |test: &'static str| {
        let numbers = sweep.numbers(test, detail);
        let stack =
            |(point, number): (&Point, &catoptric::analysis::balance::BalancePoint)| Stack {
                label: match point.leaf {
                    leaf if leaf >= 1024 => format!("{}k", leaf / 1024),
                    leaf => leaf.to_string(),
                },
                parts: vec![
                    number.cull_ms,
                    number.project_ms,
                    sweep.stage_ms(point, |r| r.splat_ms).unwrap_or(0.0),
                    sweep.stage_ms(point, |r| r.cameras_ms).unwrap_or(0.0),
                ],
                total: number.total,
                share: number.valid_share,
            };
        StackPlot {
            title: format!("test {test}, detail {detail}"),
            stacks: sweep.of(test, detail).zip(&numbers).map(stack).collect(),
            least: Balance::of(&numbers).map(|b| b.least),
        }
    };
    let labels = StackLabels {
        x: "surfels a leaf",
        y: "ms",
        parts: &["culling", "projection", "splatting", "cameras"],
        total: "whole layer",
        share: "valid, %",
    };
    Ok(Plot {
        name: format!("balance-{kind}-detail-{detail}"),
        caption: format!(
            "Culling and projection over the leaf, on {}, detail {detail}: time by stage (threads' time by their number), the layer's \
             wall time as a line across each bar, the least marked. Times are by the reference's turns beside them.",
            sweep.place
        ),
        image: Image::Svg(stacks(&TESTS.map(one), &labels)?),
    })
}

fn table(sweep: &Sweep, detail: &str) -> Table {
    let mut table = Table::new(
        format!("On {}, detail {detail}", sweep.place),
        &[
            "test",
            "leaf",
            "total ms",
            "culling ms",
            "projection ms",
            "valid %",
            "projections",
            "to the paper's setting",
        ],
    );
    for test in TESTS {
        let numbers = sweep.numbers(test, detail);
        let least = Balance::of(&numbers).map(|b| b.least);
        for (i, point) in sweep.of(test, detail).enumerate() {
            let report = point.timed.report();
            table.row(vec![
                if least == Some(i) { format!("{test} (least)") } else { test.to_owned() },
                point.leaf.to_string(),
                median(point.timed.total()),
                median(point.timed.quantity(|r| r.cull_ms)),
                median(point.timed.quantity(|r| r.project_ms)),
                point.valid_share.map_or("–".into(), |v| format!("{:.1}", 100.0 * v)),
                report.projections.map_or("–".into(), |n| n.to_string()),
                times(point.timed.ratio()),
            ]);
        }
    }
    table
}

/// For JSON.
pub(super) fn figures(sweep: &Sweep) -> Value {
    let point = |p: &Point| {
        let mut value = frame_figures(&p.timed);
        value["test"] = json!(p.test);
        value["valid_share"] = json!(p.valid_share);
        value["detail"] = json!(p.detail.parse::<u32>().unwrap_or(0));
        value["leaf"] = json!(p.leaf);
        value["ratio_to_paper"] = ratio(p.timed.ratio());
        value
    };
    let verdicts = details(sweep).into_iter().flat_map(|detail| {
        TESTS.into_iter().filter_map(move |test| {
            let points = sweep.numbers(test, detail);
            let balance = Balance::of(&points)?;
            let near = nearest_to_share(&points, PAPER_SHARE);
            Some(json!({
                "test": test,
                "detail": detail.parse::<u32>().unwrap_or(0),
                "least_leaf": points[balance.least].leaf,
                "least_is_interior": balance.interior,
                "valid_share_falls": balance.share_falls,
                "leaf_nearest_to_20_percent_valid": near.map(|i| points[i].leaf),
            }))
        })
    });
    let mut none = point(&sweep.none);
    none["leaf"] = Value::Null;
    json!({
        "place": sweep.place,
        "reference_ms": quantity(sweep.reference),
        "points": sweep.points.iter().map(point).collect::<Vec<_>>(),
        "none": none,
        "verdicts": verdicts.collect::<Vec<_>>(),
    })
}
