//! What the scene consists of, and how finely it is sampled.

use eframe::egui;

use super::super::app::Viewer;
use super::super::worker::Thing;
use crate::scene::description::Source;

/// Of the slider; the command line takes more.
const MOST_SURFELS: usize = 20_000_000;
/// Longer lists are cut: nobody picks from them by name.
const MOST_NAMES: usize = 200;

pub(super) fn show(viewer: &mut Viewer, ui: &mut egui::Ui) {
    let Some(scene) = viewer.scene.clone() else { return };
    ui.strong(&scene.name);
    sampling(viewer, ui);
    let mirrors = scene.mirrors.iter().enumerate();
    let mirrors = mirrors.map(|(i, m)| (Thing::Mirror(i), &m.name));
    let objects = scene.objects.iter().enumerate().map(|(i, o)| (Thing::Object(i), &o.name));
    for (title, things) in
        [("Mirrors", mirrors.collect::<Vec<_>>()), ("Objects", objects.collect::<Vec<_>>())]
    {
        ui.label(format!("{title} ({})", things.len()));
        ui.indent(title, |ui| {
            for (thing, name) in things.into_iter().take(MOST_NAMES) {
                let selected = viewer.selected == Some(thing);
                if ui.selectable_label(selected, name).clicked() {
                    viewer.selected = (!selected).then_some(thing);
                }
            }
        });
    }
}

fn sampling(viewer: &mut Viewer, ui: &mut egui::Ui) {
    let mut again = false;
    egui::Grid::new("sampling").num_columns(2).show(ui, |ui| {
        let label = ui.label("surfels");
        let slider = egui::Slider::new(&mut viewer.prepare.surfels, 1000..=MOST_SURFELS);
        let slider = ui.add(slider.logarithmic(true)).labelled_by(label.id);
        again |= slider.drag_stopped() || slider.lost_focus();
        ui.end_row();
        let label = ui.label("leaf").on_hover_text("surfels a tree leaf holds at most");
        let leaf = &mut viewer.prepare.tree.leaf_points;
        let slider = ui.add(egui::Slider::new(leaf, 1..=1024).logarithmic(true));
        let slider = slider.labelled_by(label.id);
        again |= slider.drag_stopped() || slider.lost_focus();
        ui.end_row();
        let label = ui
            .label("leaf size")
            .on_hover_text("nodes of at most this share of their object's size are leaves");
        let share = &mut viewer.prepare.tree.leaf_size;
        let slider = ui.add(egui::Slider::new(share, 0.0..=0.2)).labelled_by(label.id);
        again |= slider.drag_stopped() || slider.lost_focus();
        ui.end_row();
        let Some(scene) = viewer.scene.clone() else { return };
        let shapes = scene.mirrors.iter().any(|m| matches!(m.source, Some(Source::Shape { .. })));
        if shapes {
            let label = ui.label("mirror triangles");
            let now = viewer.prepared.as_ref().map_or(4000, |p| p.mirror_triangles);
            let mut wanted = viewer.mirror_triangles.unwrap_or(now);
            let slider = egui::Slider::new(&mut wanted, 100..=100_000).logarithmic(true);
            let slider = ui.add(slider).labelled_by(label.id);
            if slider.changed() {
                viewer.mirror_triangles = Some(wanted);
            }
            again |=
                (slider.drag_stopped() || slider.lost_focus()) && viewer.mirror_triangles.is_some();
            ui.end_row();
        }
    });
    if again && viewer.prepare_differs() {
        viewer.prepare_again();
    }
}
