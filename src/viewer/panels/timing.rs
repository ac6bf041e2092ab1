//! Where the time goes.

use eframe::egui::{self, Color32};
use egui_plot::{Bar, BarChart, Plot};

use super::super::app::Viewer;
use crate::frame::FrameReport;

/// Of a report: what is told, and in which colour.
type Stage = (&'static str, fn(&FrameReport) -> Option<f64>, Color32);

/// Bottom first. Culling, projection and splatting are of all threads together by their number.
const STAGES: [Stage; 7] = [
    ("visibility", |r| r.ids_ms, Color32::from_rgb(128, 128, 128)),
    ("cameras", |r| r.cameras_ms, Color32::from_rgb(230, 170, 60)),
    ("culling", |r| r.cull_ms, Color32::from_rgb(220, 90, 70)),
    ("projection", |r| r.project_ms, Color32::from_rgb(80, 130, 220)),
    ("splatting", |r| r.splat_ms, Color32::from_rgb(90, 180, 120)),
    ("rays", |r| r.rays_ms, Color32::from_rgb(170, 100, 200)),
    ("direct view", |r| r.composite_ms, Color32::from_rgb(90, 90, 110)),
];

/// One line below the picture.
pub(super) fn status(viewer: &Viewer, ui: &mut egui::Ui) {
    ui.horizontal_wrapped(|ui| {
        let Some(display) = &viewer.display else {
            ui.label("no picture yet");
            return;
        };
        let size = display.view.size;
        if let Some(report) = display.reports.first() {
            let ms = report.frame_ms.unwrap_or(0.0);
            ui.label(format!("{} · {} · {ms:.0} ms", report.method, report.backend));
        }
        ui.label(format!("{} × {}", size.width, size.height));
        if viewer.is_slow() {
            ui.label("drawing …");
        }
        if let Some(prepared) = &viewer.prepared {
            let more = if prepared.complete { "" } else { " (more to come)" };
            ui.label(format!("{} surfels{more}", prepared.surfels));
        }
    });
}

pub(super) fn show(viewer: &mut Viewer, ui: &mut egui::Ui) {
    let Some(report) = viewer.history.back().cloned() else {
        ui.weak("nothing drawn yet");
        return;
    };
    let mut charts: Vec<BarChart> = Vec::new();
    for (name, pick, color) in STAGES {
        let bars = viewer.history.iter().enumerate();
        let bars =
            bars.map(|(i, r)| Bar::new(i as f64, pick(r).unwrap_or(0.0)).width(1.0).fill(color));
        let below: Vec<&BarChart> = charts.iter().collect();
        let chart = BarChart::new(name, bars.collect()).color(color).stack_on(&below);
        charts.push(chart);
    }
    Plot::new("stages")
        .height(110.0)
        .show_x(false)
        .show_axes([false, true])
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .include_y(0.0)
        .show(ui, |plot| {
            for chart in charts {
                plot.bar_chart(chart);
            }
        });
    egui::Grid::new("stages of the last frame").num_columns(2).show(ui, |ui| {
        for (name, pick, color) in STAGES {
            if let Some(ms) = pick(&report) {
                ui.horizontal(|ui| {
                    let (rect, _) =
                        ui.allocate_exact_size(egui::vec2(10.0, 10.0), egui::Sense::hover());
                    ui.painter().rect_filled(rect, 2.0, color);
                    ui.label(name);
                });
                ui.label(format!("{ms:.1} ms"));
                ui.end_row();
            }
        }
        let numbers = [
            ("cameras", report.cameras.map(|n| n.to_string())),
            ("projections", report.projections.map(|n| n.to_string())),
            ("valid share", report.valid_share().map(|s| format!("{:.1} %", s * 100.0))),
            ("mirror pixels", Some(report.mirror_pixels.to_string())),
        ];
        for (name, value) in numbers {
            if let Some(value) = value {
                ui.label(name);
                ui.label(value);
                ui.end_row();
            }
        }
    });
}
