//! Plots with axes, as SVG.

use catoptric::analysis::multiplicity::{COUNT_COLORS, ImageHistogram};
use plotters::prelude::*;

use super::CameraSlice;
use crate::commands::plots::{FONT, SIZE, failed};

fn color(images: u32) -> RGBColor {
    let [r, g, b] = COUNT_COLORS[(images as usize).min(COUNT_COLORS.len() - 1)];
    RGBColor(r, g, b)
}

/// Shares of points by their number of images over all cameras, a group of bars for each set of points.
pub(super) fn histogram(sets: &[(&str, &ImageHistogram)]) -> anyhow::Result<String> {
    let mut text = String::new();
    let columns = sets.iter().map(|(_, set)| set.over_all.len()).max().unwrap_or(0).max(1);
    let shares = |set: &ImageHistogram, n: usize| 100.0 * set.share(n);
    let most = (0..columns).flat_map(|n| sets.iter().map(move |(_, set)| shares(set, n)));
    let most = most.fold(1.0, f64::max);
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .caption("Images of a point over all cameras", ("sans-serif", 18))
            .x_label_area_size(42)
            .y_label_area_size(56)
            .build_cartesian_2d(-0.5..columns as f64 - 0.5, 0.0..most * 1.08)
            .map_err(failed)?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .max_light_lines(1)
            .x_desc("images")
            .y_desc("% of the points")
            .x_labels(columns.min(24))
            .x_label_formatter(&|x| format!("{x:.0}"))
            .label_style(FONT)
            .draw()
            .map_err(failed)?;
        let width = 0.8 / sets.len() as f64;
        for (k, (name, set)) in sets.iter().enumerate() {
            let style = color(1 + 2 * u32::try_from(k)?).filled();
            let bar = |n: usize| {
                let left = n as f64 - 0.4 + k as f64 * width;
                Rectangle::new([(left, 0.0), (left + width, shares(set, n))], style)
            };
            chart
                .draw_series((0..columns).map(bar))
                .map_err(failed)?
                .label(format!("on {name}"))
                .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 14, y + 5)], style));
        }
        chart
            .configure_series_labels()
            .label_font(FONT)
            .background_style(WHITE)
            .draw()
            .map_err(failed)?;
        area.present().map_err(failed)?;
    }
    Ok(text)
}

/// Numbers of images over the plane through one camera's view volume.
pub(super) fn slice(cut: &CameraSlice) -> anyhow::Result<String> {
    let slice = &cut.slice;
    let [along, across] = slice.sides.map(|side| side.length());
    let [columns, rows] = slice.pixels;
    let x = |column: u32| along * f64::from(column) / f64::from(columns);
    let y = |row: u32| across * (0.5 - f64::from(row) / f64::from(rows));
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        let title = format!("Images in the camera of mirror triangle {}", cut.triangle);
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .caption(title, ("sans-serif", 18))
            .x_label_area_size(42)
            .y_label_area_size(72)
            .build_cartesian_2d(0.0..along, -0.5 * across..0.5 * across)
            .map_err(failed)?;
        // Runs of pixels with one number of images.
        for (row, counts) in (0..rows).zip(slice.counts.chunks(columns as usize)) {
            let mut from = 0;
            let runs = counts.chunk_by(|a, b| a == b).map(|run| {
                let to = from + u32::try_from(run.len()).unwrap_or(columns);
                let corners = [(x(from), y(row)), (x(to), y(row + 1))];
                from = to;
                Rectangle::new(corners, color(run[0]).filled())
            });
            chart.draw_series(runs).map_err(failed)?;
        }
        for n in 0..4 {
            let style = color(n).filled();
            chart
                .draw_series(std::iter::once(Rectangle::new([(0.0, 0.0); 2], style)))
                .map_err(failed)?
                .label(format!("{n}"))
                .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 14, y + 5)], style));
        }
        chart
            .configure_mesh()
            .disable_mesh()
            .x_desc("along the ray, away from the mirror")
            .y_desc("across")
            .y_label_formatter(&|y| format!("{y:.1e}"))
            .label_style(FONT)
            .draw()
            .map_err(failed)?;
        chart
            .configure_series_labels()
            .label_font(FONT)
            .background_style(WHITE)
            .border_style(BLACK)
            .draw()
            .map_err(failed)?;
        area.present().map_err(failed)?;
    }
    Ok(text)
}
