//! What the scene consists of, and how finely it is sampled.

use std::sync::Arc;

use eframe::egui::{self, DragValue};
use glam::{DQuat, DVec3, EulerRot};

use super::super::app::Viewer;
use super::super::worker::Thing;
use crate::geometry::Similarity;
use crate::scene::description::Source;

/// Of the slider; the command line takes more.
const MOST_SURFELS: usize = 20_000_000;
/// Longer lists are cut: nobody picks from them by name.
const MOST_NAMES: usize = 200;

pub(super) fn show(viewer: &mut Viewer, ui: &mut egui::Ui) {
    let Some(scene) = viewer.scene.clone() else { return };
    ui.strong(&scene.name);
    sampling(viewer, ui);
    place(viewer, ui);
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

/// Where the selected thing is, in numbers.
fn place(viewer: &mut Viewer, ui: &mut egui::Ui) {
    let (Some(thing), Some(scene)) = (viewer.selected, viewer.scene.clone()) else { return };
    let at = thing.placement(scene.objects.len());
    let Some(&was) = viewer.placements.get(at) else { return };
    let name = match thing {
        Thing::Object(i) => &scene.objects[i].name,
        Thing::Mirror(i) => &scene.mirrors[i].name,
    };
    let pivot = viewer.handles.pivot(&scene, thing);
    let step = viewer.scene_size() * 2e-3;
    ui.separator();
    ui.strong(name);
    let (mut middle, mut scale) = (was.point(pivot), was.scale);
    let (y, x, z) = was.rotation.to_euler(EulerRot::YXZ);
    // Not minus zero.
    let shown = [x, y, z].map(|angle| angle.to_degrees() + 0.0);
    let mut angles = shown;
    egui::Grid::new("place").num_columns(4).show(ui, |ui| {
        ui.label("middle")
            .on_hover_text("of its box, world units; drag a number, or click to type");
        for value in [&mut middle.x, &mut middle.y, &mut middle.z] {
            ui.add(DragValue::new(value).speed(step).max_decimals(4));
        }
        ui.end_row();
        ui.label("turned").on_hover_text("about x, y (up) and z, in degrees, about its middle");
        for value in &mut angles {
            ui.add(DragValue::new(value).speed(0.5).suffix("°").max_decimals(2));
        }
        ui.end_row();
        ui.label("scale");
        let range = 1e-6..=1e6;
        ui.add(DragValue::new(&mut scale).speed(was.scale * 5e-3).range(range).max_decimals(5));
        let own = viewer.own_places().get(at).copied();
        let moved = own.is_some_and(|own| own != was);
        if ui.add_enabled(moved, egui::Button::new("put back")).clicked()
            && let Some(own) = own
        {
            put(viewer, at, own);
        }
        ui.end_row();
    });
    ui.separator();
    let unmoved = middle == was.point(pivot) && scale == was.scale;
    let turned = angles != shown;
    if unmoved && !turned {
        return;
    }
    let [ax, ay, az] = angles.map(f64::to_radians);
    let rotation = if turned { DQuat::from_euler(EulerRot::YXZ, ay, ax, az) } else { was.rotation };
    let placed = Similarity { rotation, scale, translation: DVec3::ZERO };
    let placed = Similarity { translation: middle - placed.point(pivot), ..placed };
    if placed.translation.is_finite() && rotation.is_finite() && scale.is_finite() {
        put(viewer, at, placed);
    }
}

fn put(viewer: &mut Viewer, at: usize, place: Similarity) {
    viewer.moves.begin(&viewer.placements);
    Arc::make_mut(&mut viewer.placements)[at] = place;
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
