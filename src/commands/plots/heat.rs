//! Maps of ratios: which side wins where.

use plotters::prelude::*;

use super::{Area, FONT, TITLE, failed, svg};

/// Ratios over two lists.
pub(crate) struct HeatMap {
    pub(crate) title: String,
    /// Of the columns.
    pub(crate) columns: Vec<String>,
    /// Of the rows, from the bottom up.
    pub(crate) rows: Vec<String>,
    /// By row, then by column; `None`: there is none.
    pub(crate) ratios: Vec<Vec<Option<f64>>>,
}

/// Of one map, pixels.
const SIZE: (u32, u32) = (420, 330);
/// Ratios beyond this, either way, have one colour.
const FULL: f64 = 16.0;
/// Below 1, and above.
const ENDS: [RGBColor; 2] = [RGBColor(70, 150, 215), RGBColor(230, 130, 60)];

/// Maps side by side. `labels`: of the columns and of the rows.
pub(crate) fn heat_maps(
    maps: &[HeatMap],
    across: usize,
    labels: [&str; 2],
) -> anyhow::Result<String> {
    let across = across.clamp(1, maps.len().max(1));
    let down = maps.len().div_ceil(across).max(1);
    let size = (SIZE.0 * u32::try_from(across)?, SIZE.1 * u32::try_from(down)?);
    svg(size, |area| {
        for (map, area) in maps.iter().zip(area.split_evenly((down, across))) {
            draw(&area, map, labels)?;
        }
        Ok(())
    })
}

/// White at 1.
fn color(ratio: f64) -> RGBColor {
    let share = (ratio.ln() / FULL.ln()).clamp(-1.0, 1.0);
    let end = ENDS[usize::from(share > 0.0)];
    let share = 0.12 + 0.88 * share.abs();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 255")]
    let mix = |end: u8| (255.0 + (f64::from(end) - 255.0) * share).round() as u8;
    RGBColor(mix(end.0), mix(end.1), mix(end.2))
}

fn draw(area: &Area<'_>, map: &HeatMap, labels: [&str; 2]) -> anyhow::Result<()> {
    let (columns, rows) = (map.columns.len(), map.rows.len());
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .caption(&map.title, TITLE)
        .x_label_area_size(42)
        .y_label_area_size(72)
        .build_cartesian_2d(-0.5..columns as f64 - 0.5, -0.5..rows as f64 - 0.5)
        .map_err(failed)?;
    let name = |list: &[String], at: f64| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place")]
        let here = (at >= -0.1 && (at - at.round()).abs() < 1e-6).then(|| at.round() as usize);
        here.and_then(|i| list.get(i).cloned()).unwrap_or_default()
    };
    chart
        .configure_mesh()
        .disable_mesh()
        .x_desc(labels[0])
        .y_desc(labels[1])
        .x_labels(columns + 1)
        .y_labels(rows + 1)
        .x_label_formatter(&|x| name(&map.columns, *x))
        .y_label_formatter(&|y| name(&map.rows, *y))
        .label_style(("sans-serif", 13))
        .draw()
        .map_err(failed)?;
    let places = (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c)));
    for (r, c) in places {
        let (x, y) = (c as f64, r as f64);
        let ratio = map.ratios[r][c];
        let fill = ratio.map_or(RGBColor(215, 215, 215), color);
        let square = Rectangle::new([(x - 0.48, y - 0.48), (x + 0.48, y + 0.48)], fill.filled());
        chart.draw_series([square]).map_err(failed)?;
        let text = ratio.map_or("–".to_owned(), |r| {
            if r >= 9.95 { format!("{r:.0}") } else { format!("{r:.2}") }
        });
        // Black on a light square in either theme: a hair off black keeps it from being turned with the axes.
        let style = TextStyle::from(FONT.into_font()).color(&RGBColor(1, 1, 1)).pos(
            plotters::style::text_anchor::Pos::new(
                plotters::style::text_anchor::HPos::Center,
                plotters::style::text_anchor::VPos::Center,
            ),
        );
        chart.draw_series([Text::new(text, (x, y), style)]).map_err(failed)?;
    }
    Ok(())
}
