//! Plots with axes, as SVG: what all share, and the kinds that benches draw. Legends stand beside the axes, never over curves.

mod heat;
mod lines;
mod stacks;

use plotters::coord::Shift;
use plotters::prelude::*;

pub(super) use heat::{HeatMap, heat_maps};
pub(super) use lines::{Axis, Dot, LinePlot, Series, lines};
pub(super) use stacks::{Stack, StackLabels, StackPlot, stacks};

/// Of a plot, pixels.
pub(super) const SIZE: (u32, u32) = (760, 460);
/// Of its labels.
pub(super) const FONT: (&str, i32) = ("sans-serif", 15);
/// Of what stands over a plot.
const TITLE: (&str, i32) = ("sans-serif", 17);
/// Width of a legend, pixels.
const LEGEND: u32 = 240;

/// Told apart by most eyes, on white and on black (after Okabe and Ito 2008).
const COLORS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(213, 94, 0),
    RGBColor(86, 180, 233),
    RGBColor(204, 121, 167),
    RGBColor(140, 140, 140),
    RGBColor(170, 110, 40),
];

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

pub(super) fn failed(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow::anyhow!("a plot could not be drawn: {error}")
}

/// Draws on a white area and gives the SVG.
fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<String> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        draw(&area)?;
        area.present().map_err(failed)?;
    }
    Ok(text)
}

/// Names beside their colours, from the top left of an area on.
fn legend(area: &Area<'_>, entries: &[(String, RGBColor)]) -> anyhow::Result<()> {
    for ((name, color), y) in entries.iter().zip((20..).step_by(22)) {
        let swatch = Rectangle::new([(6, y - 5), (22, y + 5)], color.filled());
        area.draw(&swatch).map_err(failed)?;
        area.draw(&Text::new(name.clone(), (28, y - 7), FONT)).map_err(failed)?;
    }
    Ok(())
}

/// A number on an axis: 1200 as 1.2k.
pub(super) fn short(x: f64) -> String {
    let (x, unit) = match x.abs() {
        a if a >= 0.9995e6 => (x * 1e-6, "M"),
        a if a >= 999.5 => (x * 1e-3, "k"),
        _ => (x, ""),
    };
    let digits = match x.abs() {
        a if a >= 99.95 || a == 0.0 => 0,
        a if a >= 9.995 => 1,
        a if a >= 0.0995 => 2,
        _ => 4,
    };
    let text = format!("{x:.digits$}");
    let text = if digits > 0 { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text}{unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_on_axes_are_short() {
        for (x, text) in [
            (0.0, "0"),
            (0.05, "0.05"),
            (0.25, "0.25"),
            (7.0, "7"),
            (12.5, "12.5"),
            (122.4, "122"),
            (999.9, "1k"),
            (1200.0, "1.2k"),
            (147_000.0, "147k"),
            (1e7, "10M"),
            (-2.0, "-2"),
        ] {
            assert_eq!(short(x), text);
        }
    }
}
