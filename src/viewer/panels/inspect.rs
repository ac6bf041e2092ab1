//! What is under the pointer, and inside the camera that draws it.

use eframe::egui;

use super::super::app::Viewer;
use super::super::settings::MirrorColors;
use super::super::worker::{Probed, SeenPath, Thing};
use crate::scene::description::Scene;

/// Paths that are listed.
const MOST_ROWS: usize = 12;

pub(super) fn show(viewer: &mut Viewer, ui: &mut egui::Ui) {
    ui.checkbox(&mut viewer.settings.inspect, "What is under the pointer");
    ui.checkbox(&mut viewer.settings.paths, "All paths of the point that is clicked")
        .on_hover_text("everywhere that mirrors show it: on objects and on their reflections");
    ui.checkbox(&mut viewer.settings.caustic, "Caustic surface")
        .on_hover_text("where neighbouring reflected rays meet, and points gain or lose images");
    ui.horizontal_wrapped(|ui| {
        ui.label("mirror shows");
        for (colors, word, about) in MIRRORS {
            ui.selectable_value(&mut viewer.settings.mirror, colors, word).on_hover_text(about);
        }
    });
    if !viewer.settings.inspect && !viewer.settings.paths {
        return;
    }
    ui.weak("Click to keep what is there; Esc lets it go.");
    let Some(scene) = viewer.scene.clone() else { return };
    let pinned = viewer.pinned.is_some();
    let Some(probed) = viewer.pinned.as_ref().or(viewer.probed.as_ref()) else { return };
    if pinned {
        ui.strong("kept");
    }
    if !viewer.settings.inspect && probed.paths.is_empty() {
        return;
    }
    egui::Grid::new("probe").num_columns(2).striped(true).show(ui, |ui| {
        for (name, value) in rows(probed, &scene) {
            ui.label(name);
            ui.label(value);
            ui.end_row();
        }
    });
}

const MIRRORS: [(MirrorColors, &str, &str); 3] = [
    (MirrorColors::Reflection, "its reflection", "what it reflects"),
    (MirrorColors::Cost, "cost", "projections a pixel, of each triangle: black none, white most"),
    (
        MirrorColors::Class,
        "camera class",
        "how a triangle's rays run: blue only apart; green together, then apart; orange: they cross, so that a point may have several images",
    ),
];

fn rows(probed: &Probed, scene: &Scene) -> Vec<(&'static str, String)> {
    let name = match probed.thing {
        Some(Thing::Mirror(i)) => format!("mirror {}", scene.mirrors[i].name),
        Some(Thing::Object(i)) => scene.objects[i].name.clone(),
        None => "sky".into(),
    };
    let mut rows = vec![("seen", name)];
    if let Some(mirror) = &probed.reflected {
        let [a, b, c] = mirror.weights;
        rows.push(("triangle", mirror.triangle.to_string()));
        rows.push(("barycentrics", format!("{a:.3} {b:.3} {c:.3}")));
        let object = mirror.object.and_then(|i| scene.objects.get(i));
        rows.push(("reflects", object.map_or("environment".into(), |o| o.name.clone())));
        let numbers = [
            ("λ", mirror.lambda.map(|l| format!("{l:.4}"))),
            ("surfel", mirror.surfel.map(|n| n.to_string())),
            ("images", mirror.images.map(|n| n.to_string())),
            ("search steps", mirror.steps.map(|n| n.to_string())),
            ("at (world)", mirror.position.map(|p| format!("{:.3} {:.3} {:.3}", p.x, p.y, p.z))),
            ("coverage", mirror.coverage.map(|c| format!("{c:.2}"))),
        ];
        rows.extend(numbers.into_iter().filter_map(|(name, value)| Some((name, value?))));
    }
    if probed.probe.paths {
        let hidden = probed.paths.iter().filter(|path| path.hidden).count();
        rows.push(("paths", format!("{}, {hidden} of them hidden", probed.paths.len())));
        for path in probed.paths.iter().take(MOST_ROWS) {
            let mirror = scene.mirrors.get(path.mirror).map_or("mirror", |m| m.name.as_str());
            let turned = if path.parity < 0 { ", mirrored twice" } else { "" };
            let near = if path.near_caustic { ", near the caustic" } else { "" };
            let hidden = if path.hidden { ", hidden" } else { "" };
            let SeenPath { triangle, length, .. } = path;
            rows.push(("", format!("{mirror} {triangle}: {length:.3}{turned}{near}{hidden}")));
        }
    }
    if let Some(trace) = &probed.trace {
        let sum = |of: fn(&crate::analysis::CloudTrace) -> usize| -> usize {
            trace.clouds.iter().map(of).sum()
        };
        let surfels = sum(|c| c.surfels.len());
        let valid = sum(|c| c.surfels.iter().filter(|s| s.valid).count());
        rows.push(("camera draws", format!("{} pixels", trace.pixels)));
        rows.push(("objects culled", trace.clouds.len().to_string()));
        rows.push(("boxes visited", sum(|c| c.boxes.len()).to_string()));
        rows.push(("surfels", format!("{valid} valid, {} rejected", surfels - valid)));
    }
    rows
}
