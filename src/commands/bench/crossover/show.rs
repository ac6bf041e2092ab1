//! Maps, tables and figures of the crossover.

use catoptric::analysis::break_even::BreakEven;
use serde_json::{Value, json};

use super::super::report::{Block, Image, Plot, Table, median, number, ratio, times};
use super::super::tables::frame_figures;
use super::{Cell, EQUAL, Entry, Map, SETTINGS, SPP};
use crate::commands::plots::{Axis, Dot, HeatMap, LinePlot, Series, heat_maps, lines, short};

pub(super) const NOTE: &str = "Cameras (c3rc: a camera a triangle with squares, draft, default, best) and rays (1, 4, 16 a pixel) draw the same reflections; each is \
    timed in turn with one ray a pixel. The error is the RMSE (linear, values above white as white) against many rays a pixel where objects are reflected. At equal error \
    counts the fastest setting of cameras whose error is at most 5 % above that of the rays; where there is none, cameras do not \
    reach that error, at whatever time. Below 1 cameras win. The paper conjectures a break-even in pixels per mirror triangle and \
    measured none.";

/// What is shown of a cell: a name, and the ratio if there is one.
type View = (String, fn(&Cell, usize) -> Option<f64>, usize);

fn views() -> Vec<View> {
    let triangles: View =
        ("a camera a triangle, any error, to 1 ray".into(), |c, _| Some(c.triangles()), 0);
    let equal = (0..SPP.len()).map(|k| -> View {
        let rays = if SPP[k] == 1 { "1 ray".to_owned() } else { format!("{} rays", SPP[k]) };
        (format!("equal error, to {rays}"), |c, k| c.at_equal_error(k).map(|e| e.1), k)
    });
    std::iter::once(triangles).chain(equal).collect()
}

/// Adds all maps.
pub(super) fn maps(maps: &[Map], blocks: &mut Vec<Block>) -> anyhow::Result<()> {
    let heat = |map: &Map, (name, of, k): &View| {
        let column = map.sizes.iter().map(|s| format!("{} x {}", s.width, s.height)).collect();
        let cell = |i: usize, j: usize| map.cells.get(i * map.sizes.len() + j);
        let row = |i: usize| (0..map.sizes.len()).map(|j| of(cell(i, j)?, *k)).collect();
        HeatMap {
            title: format!("{}: {name}", map.scene),
            columns: column,
            rows: map.triangles.iter().map(|&n| short(n as f64)).collect(),
            ratios: (0..map.triangles.len()).map(row).collect(),
        }
    };
    let views = views();
    let sheets: Vec<HeatMap> =
        maps.iter().flat_map(|map| views.iter().map(move |view| heat(map, view))).collect();
    // Where an error is never reached there is nothing to be seen; the words below say so.
    let reached = |sheet: &HeatMap| sheet.ratios.iter().flatten().any(Option::is_some);
    let sheets: Vec<HeatMap> = sheets.into_iter().filter(reached).collect();
    if !sheets.is_empty() {
        blocks.push(Block::Plot(Plot {
            name: "crossover-maps".into(),
            caption: "Time of cameras by time of rays over mirror triangles and pixels; blue: cameras win, orange: rays win, grey: \
                      cameras do not reach that error."
                .into(),
            image: Image::Svg(heat_maps(&sheets, 2, ["picture, pixels", "mirror triangles"])?),
        }));
        blocks.push(Block::Plot(curve(maps)?));
    }
    for map in maps {
        blocks.push(Block::Text(verdict(map)));
        blocks.push(Block::Table(table(map)));
    }
    Ok(())
}

/// Ratios over pixels a triangle.
fn curve(maps: &[Map]) -> anyhow::Result<Plot> {
    let mut series = Vec::new();
    for map in maps {
        for (name, of, k) in views().into_iter().take(2) {
            let dot = |c: &Cell| Some(Dot::exact(c.pixels_a_triangle, of(c, k)?));
            let short = if name.starts_with("equal") { "equal error" } else { "triangles" };
            series.push(Series {
                name: format!("{}: {short}", map.scene),
                dots: map.cells.iter().filter_map(dot).collect(),
                joined: false,
            });
        }
    }
    let plot = LinePlot {
        title: "Cameras by one ray a pixel",
        x: Axis { label: "pixels a visible mirror triangle", log: true },
        y: Axis { label: "time of cameras / time of rays", log: true },
        series: &series,
        level: Some(1.0),
    };
    Ok(Plot {
        name: "crossover-pixels".into(),
        caption: "The same over the pixels that a visible mirror triangle covers; below the line cameras win.".into(),
        image: Image::Svg(lines(&plot)?),
    })
}

/// Who wins where, in words.
fn verdict(map: &Map) -> String {
    let mut text = format!("{}: ", map.scene);
    let reach = map.cells.iter().map(|c| c.pixels_a_triangle);
    let (from, to) = reach.fold((f64::INFINITY, 0.0_f64), |(a, b), x| (a.min(x), b.max(x)));
    for (name, of, k) in views() {
        let ratios: Vec<f64> = map.cells.iter().filter_map(|c| of(c, k)).collect();
        let wins = ratios.iter().filter(|&&r| r < 1.0).count();
        let (count, all) = (ratios.len(), map.cells.len());
        if count == 0 {
            text.push_str(&format!("{name}: never reached. "));
            continue;
        }
        text.push_str(&format!(
            "{name}: reached in {count} of {all} places, cameras win in {wins}"
        ));
        let found = (count > 2).then(|| map.break_even(|c| of(c, k))).flatten();
        text.push_str(&match found {
            Some(BreakEven { x, exponent, measured: true }) => {
                let side = if exponent < 0.0 { "above" } else { "below" };
                format!(", by the trend {side} {} pixels a triangle. ", number(x))
            }
            Some(BreakEven { .. }) => {
                format!(
                    "; no break-even between {} and {} pixels a triangle. ",
                    number(from),
                    number(to)
                )
            }
            None => ". ".to_owned(),
        });
    }
    text.trim_end().to_owned()
}

fn entries(cell: &Cell) -> impl Iterator<Item = (String, &Entry)> {
    let rays = SPP.iter().map(|spp| format!("{spp} ray{}", if *spp == 1 { "" } else { "s" }));
    let cameras = SETTINGS.iter().map(|s| s.name.to_owned());
    rays.zip(&cell.rays).chain(cameras.zip(&cell.cameras))
}

fn table(map: &Map) -> Table {
    let mut table = Table::new(
        format!("{}, {} surfels", map.scene, map.surfels),
        &["mirror triangles", "size", "pixels a triangle", "side", "ms", "RMSE", "to 1 ray"],
    );
    for cell in &map.cells {
        for (name, entry) in entries(cell) {
            table.row(vec![
                cell.triangles.to_string(),
                format!("{} x {}", cell.size.width, cell.size.height),
                number(cell.pixels_a_triangle),
                name,
                median(entry.timed.total()),
                format!("{:.4}", entry.rmse),
                times(entry.timed.ratio()),
            ]);
        }
    }
    table
}

/// For JSON.
pub(super) fn figures(map: &Map) -> Value {
    let cell = |cell: &Cell| {
        let side = |(name, entry): (String, &Entry)| {
            let mut value = frame_figures(&entry.timed);
            value["side"] = json!(name);
            value["rmse"] = json!(entry.rmse);
            value["ratio_to_1_ray"] = ratio(entry.timed.ratio());
            value
        };
        let equal = (0..SPP.len()).map(|k| {
            let found = cell.at_equal_error(k);
            json!({ "spp": SPP[k], "setting": found.map(|f| f.0), "time_by_rays": found.map(|f| f.1) })
        });
        json!({
            "triangles": cell.triangles,
            "size": [cell.size.width, cell.size.height],
            "pixels_per_triangle": cell.pixels_a_triangle,
            "sides": entries(cell).map(side).collect::<Vec<_>>(),
            "equal_error": equal.collect::<Vec<_>>(),
        })
    };
    let crossings = views().into_iter().map(|(name, of, k)| {
        let found = map.break_even(|c| of(c, k));
        json!({
            "of": name,
            "pixels_per_triangle": found.map(|f| f.x),
            "exponent": found.map(|f| f.exponent),
            "measured": found.map(|f| f.measured),
        })
    });
    json!({
        "scene": map.scene,
        "surfels": map.surfels,
        "error_tolerance": EQUAL,
        "cells": map.cells.iter().map(cell).collect::<Vec<_>>(),
        "break_even": crossings.collect::<Vec<_>>(),
    })
}
