//! Error against time.

use catoptric::analysis::methods::{Entry, Measured};
use plotters::prelude::*;

use super::own_ms;
use crate::commands::plots::{FONT, SIZE, failed};

/// FLIP over the time of a frame's reflections: a line for each knob of each method.
pub(super) fn errors(entries: &[Entry]) -> anyhow::Result<String> {
    let mut lines: Vec<(String, Vec<(f64, f64)>)> = Vec::new();
    let place = |m: &Measured| own_ms(m).map(|ms| (ms.max(1e-2), m.errors.flip));
    for entry in entries {
        let Ok(drawn) = &entry.result else { continue };
        let id = entry.method.info().id;
        let mut knobs: Vec<&str> = drawn.settings.iter().map(|s| s.knob).collect();
        knobs.dedup();
        for &knob in &knobs {
            let own = drawn.settings.iter().filter(|s| s.knob == knob);
            lines.push((format!("{id}, {knob}"), own.filter_map(|s| place(&s.measured)).collect()));
        }
        if knobs.is_empty() {
            lines.push((id.to_owned(), place(&drawn.measured).into_iter().collect()));
        }
    }
    let all = || lines.iter().flat_map(|(_, points)| points.iter().copied());
    let (low, high) =
        all().fold((f64::INFINITY, 0.1_f64), |(a, b), (ms, _)| (a.min(ms), b.max(ms)));
    let top = all().map(|(_, flip)| flip).fold(1e-3, f64::max);
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        let mut chart = ChartBuilder::on(&area)
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
        for (k, (name, points)) in lines.iter().enumerate() {
            let style = Palette99::pick(k).stroke_width(2);
            chart
                .draw_series(LineSeries::new(points.iter().copied(), style).point_size(4))
                .map_err(failed)?
                .label(name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
        }
        chart
            .configure_series_labels()
            .label_font(FONT)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK)
            .draw()
            .map_err(failed)?;
        area.present().map_err(failed)?;
    }
    Ok(text)
}
