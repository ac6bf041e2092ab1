//! The method of each side, and its parameters, as the registry describes them.

use eframe::egui;

use super::super::app::Viewer;
use super::super::settings::{Shown, SideSettings};
use super::super::worker::BackendChoice;
use crate::methods::{METHODS, ParamInfo, ParamKind};

pub(super) fn show(viewer: &mut Viewer, ui: &mut egui::Ui) {
    let compare = viewer.settings.compare;
    let refusals = viewer.prepared.as_ref().map_or(&[][..], |prepared| &prepared.refusals);
    let [left, right] = &mut viewer.settings.sides;
    if !compare {
        side(ui, "one", left, refusals);
        return;
    }
    ui.strong("Left");
    side(ui, "left", left, refusals);
    ui.separator();
    ui.strong("Right");
    side(ui, "right", right, refusals);
    ui.separator();
    if ui.button("Exchange the sides").clicked() {
        viewer.settings.sides.swap(0, 1);
    }
    ui.horizontal_wrapped(|ui| {
        let words =
            [(Shown::Divider, "Divider"), (Shown::Difference, "Difference"), (Shown::Flip, "FLIP")];
        for (shown, word) in words {
            ui.selectable_value(&mut viewer.settings.shown, shown, word);
        }
    });
    if let Some((rmse, psnr, flip)) = viewer.display.as_ref().and_then(|d| d.errors) {
        let psnr = psnr.map_or("equal".into(), |db| format!("{db:.1} dB"));
        ui.label(format!("RMSE {rmse:.4} · PSNR {psnr} · FLIP {flip:.4}"));
    }
}

/// `refusals`: methods that cannot draw the scene, and why not.
fn side(
    ui: &mut egui::Ui,
    salt: &str,
    settings: &mut SideSettings,
    refusals: &[(&'static str, String)],
) {
    ui.push_id(salt, |ui| {
        egui::Grid::new("side").num_columns(2).show(ui, |ui| {
            let label = ui.label("method");
            egui::ComboBox::from_id_salt("method")
                .selected_text(settings.method().info().id)
                .show_ui(ui, |ui| {
                    for info in METHODS.iter().map(|m| m.info()) {
                        let refusal = refusals.iter().find(|(id, _)| *id == info.id);
                        let chosen = settings.method == info.id;
                        let entry = egui::Button::selectable(chosen, info.id);
                        let shown = ui
                            .add_enabled(refusal.is_none(), entry)
                            .on_hover_text(format!("{}\n{}", info.about, info.citation))
                            .on_disabled_hover_text(refusal.map_or("", |(_, why)| why));
                        if shown.clicked() {
                            info.id.clone_into(&mut settings.method);
                        }
                    }
                })
                .response
                .labelled_by(label.id);
            ui.end_row();
            let label = ui.label("backend");
            egui::ComboBox::from_id_salt("backend")
                .selected_text(settings.backend.word())
                .show_ui(ui, |ui| {
                    for (choice, word) in BackendChoice::ALL {
                        ui.selectable_value(&mut settings.backend, choice, word);
                    }
                })
                .response
                .labelled_by(label.id);
            ui.end_row();
            let info = settings.method().info();
            if !info.qualities.is_empty() {
                quality(ui, settings);
                ui.end_row();
            }
            for param in info.params {
                parameter(ui, param, settings);
                ui.end_row();
            }
        });
    });
}

/// Named values of several parameters together.
fn quality(ui: &mut egui::Ui, settings: &mut SideSettings) {
    let info = settings.method().info();
    let names = info.qualities.iter().chain(info.presets).map(|q| q.id);
    let all = ["default"].into_iter().chain(names).map(|name| {
        let mut like = settings.clone();
        like.set_quality(name);
        (name, like)
    });
    let all: Vec<(&str, SideSettings)> = all.collect();
    let now = all.iter().find(|(_, like)| like.side() == settings.side());
    let label = ui.label("quality").on_hover_text("sets several of the parameters below");
    egui::ComboBox::from_id_salt("quality")
        .selected_text(now.map_or("as set below", |(name, _)| name))
        .show_ui(ui, |ui| {
            for (name, like) in &all {
                let same = like.side() == settings.side();
                if ui.selectable_label(same, *name).clicked() {
                    *settings = like.clone();
                }
            }
        })
        .response
        .labelled_by(label.id);
}

fn parameter(ui: &mut egui::Ui, param: &ParamInfo, settings: &mut SideSettings) {
    let side = settings.side();
    let label = ui.label(param.id).on_hover_text(param.about);
    let chosen = match param.kind {
        ParamKind::Choice(words) => {
            let mut word = side.params.choice(param.id);
            egui::ComboBox::from_id_salt(param.id)
                .selected_text(word)
                .show_ui(ui, |ui| {
                    for choice in words {
                        ui.selectable_value(&mut word, choice, *choice);
                    }
                })
                .response
                .labelled_by(label.id)
                .on_hover_text(param.about);
            word.to_owned()
        }
        ParamKind::Integer(min, max) => {
            let mut number = side.params.integer(param.id);
            let slider = egui::Slider::new(&mut number, min..=max).logarithmic(max > 100);
            ui.add(slider).labelled_by(label.id).on_hover_text(param.about);
            number.to_string()
        }
        ParamKind::Number(min, max) => {
            let mut number = side.params.number(param.id);
            let slider = egui::Slider::new(&mut number, min..=max).smallest_positive(1e-3);
            ui.add(slider.logarithmic(true)).labelled_by(label.id).on_hover_text(param.about);
            number.to_string()
        }
    };
    if side.params.get(param.id).is_some_and(|now| now.to_string() != chosen) {
        settings.params.insert(param.id.to_owned(), chosen);
    }
}
