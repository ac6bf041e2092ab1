//! Error against time.

use catoptric::analysis::methods::{Entry, Measured};
use plotters::prelude::*;

use super::own_ms;
use crate::commands::plots::{FONT, SIZE, failed};

/// Room for the legend, right of the plot, pixels.
const LEGEND: u32 = 240;
/// Of the knobs' values.
const SMALL: (&str, i32) = ("sans-serif", 12);
/// Between its lines, pixels.
const LINE: i32 = 21;

/// A named line through points (milliseconds, FLIP), each with what it stands for.
struct Line {
    name: String,
    points: Vec<(f64, f64, String)>,
}

fn lines(entries: &[Entry]) -> Vec<Line> {
    let mut lines = Vec::new();
    let place = |m: &Measured, value: &str| {
        own_ms(m).map(|ms| (ms.max(1e-2), m.errors.flip, value.to_owned()))
    };
    for entry in entries {
        let Ok(drawn) = &entry.result else { continue };
        let label = &entry.candidate.label;
        let mut knobs: Vec<&str> = drawn.settings.iter().map(|s| s.knob).collect();
        knobs.dedup();
        for &knob in &knobs {
            let own = drawn.settings.iter().filter(|s| s.knob == knob);
            let points = own.filter_map(|s| place(&s.measured, &s.value)).collect();
            lines.push(Line { name: format!("{label}, {knob}"), points });
        }
        if knobs.is_empty() {
            let points = place(&drawn.measured, "").into_iter().collect();
            lines.push(Line { name: label.clone(), points });
        }
    }
    lines
}

/// FLIP over the time of a frame's reflections: a line for each knob of each method.
pub(super) fn errors(entries: &[Entry]) -> anyhow::Result<String> {
    let lines = lines(entries);
    let all = || lines.iter().flat_map(|line| &line.points);
    let (low, high) =
        all().fold((f64::INFINITY, 0.1_f64), |(a, b), (ms, ..)| (a.min(*ms), b.max(*ms)));
    let top = all().map(|(_, flip, _)| *flip).fold(1e-3, f64::max);
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, (SIZE.0 + LEGEND, SIZE.1));
        let area = area.into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        let (plot, legend) = area.split_horizontally(SIZE.0);
        let mut chart = ChartBuilder::on(&plot)
            .margin(12)
            .x_label_area_size(42)
            .y_label_area_size(62)
            .build_cartesian_2d((low.min(high) * 0.8..high * 1.25).log_scale(), 0.0..top * 1.08)
            .map_err(failed)?;
        chart
            .configure_mesh()
            .x_desc("reflections of a frame, ms")
            .y_desc("FLIP")
            .label_style(FONT)
            .draw()
            .map_err(failed)?;
        for (k, line) in lines.iter().enumerate() {
            let style = Palette99::pick(k).stroke_width(2);
            let points = || line.points.iter().map(|(ms, flip, _)| (*ms, *flip));
            chart.draw_series(LineSeries::new(points(), style).point_size(4)).map_err(failed)?;
            // Where the knob stands, beside the first and the last point of a line.
            let ends = [line.points.first(), line.points.last()];
            for (ms, flip, value) in ends.into_iter().flatten().filter(|p| !p.2.is_empty()) {
                let text = Text::new(value.clone(), (*ms, *flip), SMALL);
                chart.draw_series([text]).map_err(failed)?;
            }
            let y = 24 + LINE * i32::try_from(k)?;
            legend.draw(&PathElement::new([(0, y), (18, y)], style)).map_err(failed)?;
            legend.draw(&Text::new(line.name.clone(), (24, y - 8), FONT)).map_err(failed)?;
        }
        area.present().map_err(failed)?;
    }
    Ok(text)
}
