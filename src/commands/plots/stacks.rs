//! Stacked bars, several plots on one sheet, with a share on an axis of its own.

use plotters::prelude::*;

use super::{Area, COLORS, LEGEND, TITLE, failed, legend, short, svg};

/// One bar.
pub(crate) struct Stack {
    /// Under it.
    pub(crate) label: String,
    /// From the bottom up.
    pub(crate) parts: Vec<f64>,
    /// What all of it is, where that is more than its parts: they overlap, or some were not timed apart.
    pub(crate) total: f64,
    /// 0 to 1, on the right axis.
    pub(crate) share: Option<f64>,
}

/// One plot of the sheet.
pub(crate) struct StackPlot {
    pub(crate) title: String,
    pub(crate) stacks: Vec<Stack>,
    /// The bar that is marked as the least.
    pub(crate) least: Option<usize>,
}

/// What the bars of all plots on a sheet show.
pub(crate) struct StackLabels<'a> {
    pub(crate) x: &'a str,
    pub(crate) y: &'a str,
    /// Of the parts, from the bottom up.
    pub(crate) parts: &'a [&'a str],
    pub(crate) total: &'a str,
    pub(crate) share: &'a str,
}

/// Of one plot, pixels.
const SIZE: (u32, u32) = (470, 300);

/// Plots in two columns, all over one range of y.
pub(crate) fn stacks(plots: &[StackPlot], labels: &StackLabels<'_>) -> anyhow::Result<String> {
    let columns = plots.len().clamp(1, 2);
    let rows = plots.len().div_ceil(columns).max(1);
    let [width, height] = [SIZE.0 as usize * columns, SIZE.1 as usize * rows];
    let size = (u32::try_from(width)?, u32::try_from(height)?);
    let all = plots.iter().flat_map(|p| &p.stacks);
    let top = all.map(|s| s.total.max(s.parts.iter().sum())).fold(1e-3, f64::max) * 1.15;
    svg((size.0 + LEGEND, size.1), |area| {
        let (left, right) = area.split_horizontally(size.0);
        let mut entries: Vec<(String, RGBColor)> =
            labels.parts.iter().map(|n| (*n).to_owned()).zip(PARTS).collect();
        entries.push((labels.total.to_owned(), BLACK));
        entries.push((labels.share.to_owned(), SHARE));
        entries.push(("least".to_owned(), LEAST));
        legend(&right, &entries)?;
        for (plot, area) in plots.iter().zip(left.split_evenly((rows, columns))) {
            draw(&area, plot, labels, top)?;
        }
        Ok(())
    })
}

/// Of the parts.
const PARTS: [RGBColor; 4] = [COLORS[0], COLORS[1], COLORS[2], COLORS[4]];
/// Of the share's line.
const SHARE: RGBColor = COLORS[5];
/// Of the mark at the least bar.
const LEAST: RGBColor = COLORS[3];

fn draw(
    area: &Area<'_>,
    plot: &StackPlot,
    labels: &StackLabels<'_>,
    top: f64,
) -> anyhow::Result<()> {
    let count = plot.stacks.len();
    let range = -0.6..count as f64 - 0.4;
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .caption(&plot.title, TITLE)
        .x_label_area_size(40)
        .y_label_area_size(54)
        .right_y_label_area_size(48)
        .build_cartesian_2d(range.clone(), 0.0..top)
        .map_err(failed)?
        .set_secondary_coord(range, 0.0..100.0);
    let label = |x: &f64| {
        let near = (x - x.round()).abs() < 1e-6 && *x > -0.5;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a bar's place"
        )]
        let stack = near.then(|| plot.stacks.get(x.round() as usize)).flatten();
        stack.map_or(String::new(), |s| s.label.clone())
    };
    chart
        .configure_mesh()
        .disable_x_mesh()
        .max_light_lines(1)
        .x_desc(labels.x)
        .y_desc(labels.y)
        .x_labels(count + 1)
        .x_label_formatter(&label)
        .y_label_formatter(&|y| short(*y))
        .label_style(("sans-serif", 13))
        .draw()
        .map_err(failed)?;
    chart
        .configure_secondary_axes()
        .y_desc(labels.share)
        .y_labels(6)
        .y_label_formatter(&|y| format!("{y:.0}"))
        .label_style(("sans-serif", 13))
        .draw()
        .map_err(failed)?;
    for (i, stack) in plot.stacks.iter().enumerate() {
        let (left, right) = (i as f64 - 0.36, i as f64 + 0.36);
        let mut bottom = 0.0;
        for (part, color) in stack.parts.iter().zip(PARTS) {
            let bar = Rectangle::new([(left, bottom), (right, bottom + part)], color.filled());
            chart.draw_series([bar]).map_err(failed)?;
            bottom += part;
        }
        let total = [(left, stack.total), (right, stack.total)];
        chart.draw_series([PathElement::new(total, BLACK.stroke_width(2))]).map_err(failed)?;
        if plot.least == Some(i) {
            let mark = TriangleMarker::new((i as f64, stack.total + 0.05 * top), 8, LEAST.filled());
            chart.draw_series([mark]).map_err(failed)?;
        }
    }
    let shares: Vec<(f64, f64)> = plot
        .stacks
        .iter()
        .enumerate()
        .filter_map(|(i, s)| Some((i as f64, 100.0 * s.share?)))
        .collect();
    chart
        .draw_secondary_series(LineSeries::new(shares.iter().copied(), SHARE.stroke_width(2)))
        .map_err(failed)?;
    let dots = shares.iter().map(|&at| Circle::new(at, 3, SHARE.filled()));
    chart.draw_secondary_series(dots).map_err(failed)?;
    Ok(())
}
