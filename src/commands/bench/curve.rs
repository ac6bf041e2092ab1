//! Times over something that grows: table, plot, exponents, figures.

use catoptric::analysis::balance::exponent;
use catoptric::analysis::measure::{Quantity, Timed};
use catoptric::frame::FrameReport;
use serde_json::{Value, json};

use super::report::{Block, Image, Plot, Table, median, number, ratio, times};
use super::tables::frame_figures;
use crate::commands::plots::{Axis, Dot, LinePlot, Series, lines};

/// A stage and its time.
pub(super) type Stage = (&'static str, fn(&FrameReport) -> Option<f64>);

/// Only the whole.
pub(super) const TOTAL: [Stage; 1] = [("", |r| Some(r.reflection_ms()))];
/// With the two that are balanced.
pub(super) const BALANCE: [Stage; 3] = [
    ("total", |r| Some(r.reflection_ms())),
    ("culling", |r| r.cull_ms),
    ("projection", |r| r.project_ms),
];

/// Some sides measured at several x, in turn with a reference.
pub(super) struct Curve {
    /// One word, for files.
    pub(super) id: &'static str,
    pub(super) title: String,
    pub(super) x: Axis,
    pub(super) sides: Vec<&'static str>,
    pub(super) stages: &'static [Stage],
    pub(super) rows: Vec<Row>,
    /// What the reference is.
    pub(super) reference: &'static str,
}

pub(super) struct Row {
    pub(super) x: f64,
    /// By side.
    pub(super) timed: Vec<Timed>,
    /// More columns: names, texts for people, figures.
    pub(super) more: Vec<(&'static str, String, Value)>,
}

impl Curve {
    /// Adds what it shows.
    pub(super) fn show(&self, blocks: &mut Vec<Block>) -> anyhow::Result<()> {
        blocks.push(Block::Plot(self.plot()?));
        let growth = self.growth();
        if self.x.log && !growth.is_empty() {
            blocks.push(Block::Text(format!(
                "As a power of the {} (1 is linear, 0 is constant): {}.",
                self.x.label,
                growth.join("; ")
            )));
        }
        blocks.push(Block::Table(self.table()));
        Ok(())
    }

    fn name(&self, side: usize, stage: &str) -> String {
        let name = self.sides[side];
        if stage.is_empty() { name.to_owned() } else { format!("{name}: {stage}") }
    }

    fn curves(&self) -> Vec<(String, Vec<(f64, Quantity)>)> {
        let mut list = Vec::new();
        for side in 0..self.sides.len() {
            for (stage, pick) in self.stages {
                let of = |row: &Row| Some((row.x, row.timed[side].relative(*pick)?));
                let points: Vec<(f64, Quantity)> = self.rows.iter().filter_map(of).collect();
                if !points.is_empty() {
                    list.push((self.name(side, stage), points));
                }
            }
        }
        list
    }

    fn growth(&self) -> Vec<String> {
        let power = |(name, points): (String, Vec<(f64, Quantity)>)| {
            let points: Vec<[f64; 2]> = points.iter().map(|(x, q)| [*x, q.median]).collect();
            Some(format!("{name} {:.2}", exponent(&points)?))
        };
        self.curves().into_iter().filter_map(power).collect()
    }

    fn plot(&self) -> anyhow::Result<Plot> {
        let dot = |&(x, q): &(f64, Quantity)| Dot { x, y: q.median, quartiles: [q.q1, q.q3] };
        let series = self.curves().into_iter().map(|(name, points)| Series {
            name,
            dots: points.iter().map(dot).collect(),
            joined: true,
        });
        let series: Vec<Series> = series.collect();
        let y = Axis { label: "time / time of the reference", log: true };
        let plot = LinePlot { title: &self.title, x: self.x, y, series: &series, level: None };
        Ok(Plot {
            name: self.id.to_owned(),
            caption: format!(
                "{}: time by that of {}, measured in turn (medians; bars span the quartiles).",
                self.title, self.reference
            ),
            image: Image::Svg(lines(&plot)?),
        })
    }

    fn table(&self) -> Table {
        let mut head = vec![self.x.label];
        head.extend(self.rows.first().into_iter().flat_map(|r| r.more.iter().map(|m| m.0)));
        let cells = ["setting", "total ms", "culling ms", "projection ms", "projections"];
        head.extend(cells);
        let to = format!("to {}", self.reference);
        head.push(&to);
        let mut table = Table::new(self.title.clone(), &head);
        for row in &self.rows {
            for (side, timed) in self.sides.iter().zip(&row.timed) {
                let mut cells =
                    vec![if row.x.fract() == 0.0 { row.x.to_string() } else { number(row.x) }];
                cells.extend(row.more.iter().map(|m| m.1.clone()));
                cells.extend([
                    (*side).to_owned(),
                    median(timed.total()),
                    median(timed.quantity(|r| r.cull_ms)),
                    median(timed.quantity(|r| r.project_ms)),
                    timed.report().projections.map_or("–".into(), |n| n.to_string()),
                    times(timed.ratio()),
                ]);
                table.row(cells);
            }
        }
        table
    }

    /// For JSON: `key` is what x is.
    pub(super) fn figures(&self, key: &str) -> Value {
        let row = |row: &Row| {
            let side = |(name, timed): (&&str, &Timed)| {
                let mut value = frame_figures(timed);
                value["setting"] = json!(name);
                value["ratio_to_reference"] = ratio(timed.ratio());
                value
            };
            let mut value = json!({ key: row.x });
            for (name, _, figure) in &row.more {
                value[name.replace(' ', "_")] = figure.clone();
            }
            value["settings"] = self.sides.iter().zip(&row.timed).map(side).collect();
            value
        };
        let curves = self.curves().into_iter().filter_map(|(name, points)| {
            let points: Vec<[f64; 2]> = points.iter().map(|(x, q)| [*x, q.median]).collect();
            Some(json!({ "of": name, "exponent": exponent(&points)? }))
        });
        let exponents: Vec<Value> = if self.x.log { curves.collect() } else { Vec::new() };
        json!({
            "reference": self.reference,
            "rows": self.rows.iter().map(row).collect::<Vec<_>>(),
            "exponents": exponents,
        })
    }
}
