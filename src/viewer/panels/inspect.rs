//! What is under the pointer, and inside the camera that draws it.

use eframe::egui;

use super::super::app::Viewer;
use super::super::worker::{Probed, Thing};
use crate::scene::description::Scene;

pub(super) fn show(viewer: &mut Viewer, ui: &mut egui::Ui) {
    ui.checkbox(&mut viewer.settings.inspect, "What is under the pointer");
    ui.checkbox(&mut viewer.settings.costs, "Mirror coloured by cost")
        .on_hover_text("projections a pixel, of each triangle: black none, white most");
    if !viewer.settings.inspect {
        return;
    }
    ui.weak("Click on a mirror to keep its camera; Esc lets it go.");
    let Some(scene) = viewer.scene.clone() else { return };
    let pinned = viewer.pinned.is_some();
    let Some(probed) = viewer.pinned.as_ref().or(viewer.probed.as_ref()) else { return };
    if pinned {
        ui.strong("kept");
    }
    egui::Grid::new("probe").num_columns(2).striped(true).show(ui, |ui| {
        for (name, value) in rows(probed, &scene) {
            ui.label(name);
            ui.label(value);
            ui.end_row();
        }
    });
}

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
            ("at (world)", mirror.position.map(|p| format!("{:.3} {:.3} {:.3}", p.x, p.y, p.z))),
            ("coverage", mirror.coverage.map(|c| format!("{c:.2}"))),
        ];
        rows.extend(numbers.into_iter().filter_map(|(name, value)| Some((name, value?))));
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
        rows.push(("surfels", format!("{surfels}, {valid} valid, {} rejected", surfels - valid)));
    }
    rows
}
