//! Curves with their quartiles.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::{Area, COLORS, FONT, LEGEND, SIZE, TITLE, failed, legend, short, svg};

/// What an axis shows.
#[derive(Clone, Copy)]
pub(crate) struct Axis {
    /// With its unit.
    pub(crate) label: &'static str,
    /// Equal factors have equal lengths.
    pub(crate) log: bool,
}

/// A measured point.
#[derive(Clone, Copy)]
pub(crate) struct Dot {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Quartiles of y.
    pub(crate) quartiles: [f64; 2],
}

impl Dot {
    /// A point without quartiles.
    pub(crate) fn exact(x: f64, y: f64) -> Self {
        Self { x, y, quartiles: [y; 2] }
    }
}

/// Points that belong together.
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) dots: Vec<Dot>,
    /// Whether they are joined by a line.
    pub(crate) joined: bool,
}

/// See [`lines`].
pub(crate) struct LinePlot<'a> {
    pub(crate) title: &'a str,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: &'a [Series],
    /// A line across at this y.
    pub(crate) level: Option<f64>,
}

/// Curves over two axes.
pub(crate) fn lines(plot: &LinePlot<'_>) -> anyhow::Result<String> {
    svg((SIZE.0 + LEGEND, SIZE.1), |area| {
        let (left, right) = area.split_horizontally(SIZE.0);
        let names = plot.series.iter().map(|s| s.name.clone());
        legend(&right, &names.zip(COLORS.into_iter().cycle()).collect::<Vec<_>>())?;
        let dots = || plot.series.iter().flat_map(|s| &s.dots);
        let x = reach(plot.x, dots().map(|d| d.x));
        let y = dots().flat_map(|d| [d.y, d.quartiles[0], d.quartiles[1]]).chain(plot.level);
        let y = reach(plot.y, y);
        let [x, y] = [(plot.x, x), (plot.y, y)].map(|(axis, range)| Scale { range, log: axis.log });
        draw(&left, plot, x, y)
    })
}

/// From the least to the largest value, with room.
fn reach(axis: Axis, values: impl Iterator<Item = f64>) -> Range<f64> {
    let usable = values.filter(|v| v.is_finite() && (!axis.log || *v > 0.0));
    let (low, high) =
        usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return if axis.log { 0.1..10.0 } else { 0.0..1.0 };
    }
    if axis.log {
        return low / 1.3..high * 1.3;
    }
    let low = low.min(0.0);
    let room = 0.06 * (high - low).max(1e-9);
    (if low < 0.0 { low - room } else { low })..high + room
}

/// An axis: where equal factors have equal lengths, with ticks at 1, 2 and 5 if there is room for them.
#[derive(Clone)]
struct Scale {
    range: Range<f64>,
    log: bool,
}

impl Scale {
    fn at(&self, value: f64) -> f64 {
        if self.log { value.max(f64::MIN_POSITIVE).ln() } else { value }
    }
}

impl Ranged for Scale {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    #[expect(clippy::cast_possible_truncation, reason = "pixels")]
    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let [start, end] = [self.range.start, self.range.end].map(|end| self.at(end));
        let share = (self.at(*value) - start) / (end - start);
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    #[expect(clippy::cast_possible_truncation, reason = "decades")]
    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let Range { start, end } = self.range;
        if !self.log {
            return RangedCoordf64::from(start..end).key_points(hint);
        }
        let decades = start.log10().floor() as i32..=end.log10().ceil() as i32;
        let ticks = |steps: &[f64]| -> Vec<f64> {
            let all = decades.clone().flat_map(|d| steps.iter().map(move |s| s * 10_f64.powi(d)));
            all.filter(|t| self.range.contains(t)).collect()
        };
        let fine = ticks(&[1.0, 2.0, 5.0]);
        if fine.len() <= hint.max_num_points() { fine } else { ticks(&[1.0]) }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

fn draw(area: &Area<'_>, plot: &LinePlot<'_>, x: Scale, y: Scale) -> anyhow::Result<()> {
    let ends = x.range.clone();
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .caption(plot.title, TITLE)
        .x_label_area_size(42)
        .y_label_area_size(62)
        .build_cartesian_2d(x, y)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .max_light_lines(1)
        .x_labels(10)
        .y_labels(10)
        .x_desc(plot.x.label)
        .y_desc(plot.y.label)
        .x_label_formatter(&|x| short(*x))
        .y_label_formatter(&|y| short(*y))
        .label_style(FONT)
        .draw()
        .map_err(failed)?;
    if let Some(level) = plot.level {
        let across = [(ends.start, level), (ends.end, level)];
        chart.draw_series([PathElement::new(across, BLACK.stroke_width(2))]).map_err(failed)?;
    }
    for (series, color) in plot.series.iter().zip(COLORS.into_iter().cycle()) {
        let dots = || series.dots.iter().filter(|d| d.x.is_finite() && d.y.is_finite());
        let bars = dots().map(|d| {
            let [low, high] = d.quartiles;
            PathElement::new([(d.x, low), (d.x, high)], color.mix(0.6).stroke_width(3))
        });
        chart.draw_series(bars).map_err(failed)?;
        if series.joined {
            let line = LineSeries::new(dots().map(|d| (d.x, d.y)), color.stroke_width(2));
            chart.draw_series(line).map_err(failed)?;
        }
        let points = dots().map(|d| Circle::new((d.x, d.y), 4, color.filled()));
        chart.draw_series(points).map_err(failed)?;
    }
    Ok(())
}
