//! Everything beside the picture: bar, side panel, help. No panel computes anything: each shows state and changes it.

mod help;
mod inspect;
mod method;
mod scene;
mod timing;

use eframe::egui::{self, Key, KeyboardShortcut, Modifiers};

use super::app::{Chosen, Viewer};
use super::command;
use super::dialog::{self, Kind};
use super::navigation::PRESETS;
use super::settings::{Settings, Theme};

/// The side panel is left out of windows narrower than this, points.
const NARROW: f32 = 520.0;

pub(super) const OPEN: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::O);
pub(super) const SAVE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::S);
pub(super) const UNDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Z);
pub(super) const REDO: KeyboardShortcut =
    KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);
const REDO_TOO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Y);
pub(super) const QUIT: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Q);

/// Shortcuts.
pub(super) fn keys(viewer: &mut Viewer, context: &egui::Context) {
    if context.egui_wants_keyboard_input() {
        return;
    }
    let hit = |shortcut: &KeyboardShortcut| context.input_mut(|i| i.consume_shortcut(shortcut));
    if hit(&OPEN) {
        dialog::ask(Kind::Open, viewer.chosen.0.clone(), context);
    }
    if hit(&SAVE) {
        dialog::ask(Kind::Picture, viewer.chosen.0.clone(), context);
    }
    if hit(&QUIT) {
        context.send_viewport_cmd(egui::ViewportCommand::Close);
    }
    // The longer one first: the shorter one is part of it.
    if hit(&REDO) || hit(&REDO_TOO) {
        viewer.redo();
    }
    if hit(&UNDO) {
        viewer.undo();
    }
    let pressed = |key| context.input_mut(|i| i.consume_key(Modifiers::NONE, key));
    if pressed(Key::Home) || pressed(Key::R) {
        viewer.go_home();
    }
    if pressed(Key::F) {
        viewer.frame_all();
    }
    if pressed(Key::C) {
        viewer.settings.compare ^= true;
    }
    if pressed(Key::I) {
        viewer.settings.inspect ^= true;
    }
    if pressed(Key::P) {
        viewer.settings.panel ^= true;
    }
    if pressed(Key::Escape) {
        if viewer.help {
            viewer.help = false;
        } else {
            (viewer.selected, viewer.pinned, viewer.message) = (None, None, None);
            viewer.probed = None;
        }
    }
    if pressed(Key::F1) || pressed(Key::H) {
        viewer.help ^= true;
    }
    let digits = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6];
    for (key, (_, direction)) in digits.into_iter().zip(PRESETS) {
        if pressed(key) {
            viewer.look_from(direction);
        }
    }
}

pub(super) fn show(viewer: &mut Viewer, ui: &mut egui::Ui) {
    let width = ui.available_width();
    let mut frame = egui::Frame::side_top_panel(ui.style());
    if viewer.is_cleared {
        // Painting over it with the same takes time without a graphics card.
        frame.fill = egui::Color32::TRANSPARENT;
    }
    egui::Panel::top("bar").frame(frame).show(ui, |ui| {
        bar(viewer, ui);
    });
    if ui.available_height() > 100.0 {
        egui::Panel::bottom("status").frame(frame).show(ui, |ui| timing::status(viewer, ui));
    }
    if viewer.settings.panel && width >= NARROW {
        let panel = egui::Panel::right("side").default_size(300.0).size_range(220.0..=520.0);
        panel.frame(frame).show(ui, |ui| {
            // Long lines are scrolled to: the picture keeps its size.
            egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| side(viewer, ui));
        });
    }
    help::show(viewer, ui.ctx());
}

fn side(viewer: &mut Viewer, ui: &mut egui::Ui) {
    let section = |ui: &mut egui::Ui,
                   title: &str,
                   open: bool,
                   viewer: &mut Viewer,
                   show: fn(&mut Viewer, &mut egui::Ui)| {
        egui::CollapsingHeader::new(title).default_open(open).show(ui, |ui| show(viewer, ui));
    };
    // What was asked for is not to be looked for.
    if viewer.settings.inspect {
        section(ui, "Under the pointer", true, viewer, inspect::show);
    }
    section(ui, "Method", true, viewer, method::show);
    section(ui, "Time", true, viewer, timing::show);
    if !viewer.settings.inspect {
        section(ui, "Inside", false, viewer, inspect::show);
    }
    section(ui, "Scene", true, viewer, scene::show);
}

fn bar(viewer: &mut Viewer, ui: &mut egui::Ui) {
    ui.horizontal_wrapped(|ui| {
        ui.menu_button("File", |ui| file_menu(viewer, ui));
        ui.menu_button("Edit", |ui| edit_menu(viewer, ui));
        ui.menu_button("View", |ui| view_menu(viewer, ui));
        ui.toggle_value(&mut viewer.settings.compare, "Compare")
            .on_hover_text("two methods, with a divider between them (C)");
        ui.toggle_value(&mut viewer.settings.inspect, "Inspect")
            .on_hover_text("what is under the pointer, and the camera that draws it (I)");
        ui.toggle_value(&mut viewer.settings.panel, "Panel").on_hover_text("the side panel (P)");
        ui.toggle_value(&mut viewer.help, "Help").on_hover_text("mouse and keys (H)");
    });
}

fn file_menu(viewer: &mut Viewer, ui: &mut egui::Ui) {
    let context = ui.ctx().clone();
    let shortcut = |keys: &KeyboardShortcut| context.format_shortcut(keys);
    let ask = |kind| dialog::ask(kind, viewer.chosen.0.clone(), &context);
    if ui.add(egui::Button::new("Open…").shortcut_text(shortcut(&OPEN))).clicked() {
        ask(Kind::Open);
    }
    if ui.add(egui::Button::new("Save picture…").shortcut_text(shortcut(&SAVE))).clicked() {
        ask(Kind::Picture);
    }
    if ui.button("Save what mirrors show (AOVs)…").clicked() {
        ask(Kind::Aov);
    }
    if ui.button("Save scene…").on_hover_text("as it is seen now: places and view").clicked() {
        ask(Kind::Scene);
    }
    ui.separator();
    if ui.button("Copy command").on_hover_text("that renders this picture").clicked() {
        let (command, remark) = command::equivalent(viewer);
        ui.ctx().copy_text(command);
        let remark = remark.map_or(String::new(), |r| format!(": {r}"));
        viewer.tell(format!("copied{remark}"), false);
    }
    ui.separator();
    for name in ["default", "room", "knot"] {
        if ui.button(format!("Built-in scene: {name}")).clicked() {
            let _ = viewer.chosen.0.send(Chosen::Open(vec![name.into()]));
        }
    }
    ui.separator();
    if ui.add(egui::Button::new("Quit").shortcut_text(shortcut(&QUIT))).clicked() {
        ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
    }
}

fn edit_menu(viewer: &mut Viewer, ui: &mut egui::Ui) {
    let context = ui.ctx().clone();
    let shortcut = |keys: &KeyboardShortcut| context.format_shortcut(keys);
    if ui.add(egui::Button::new("Undo move").shortcut_text(shortcut(&UNDO))).clicked() {
        viewer.undo();
    }
    if ui.add(egui::Button::new("Redo move").shortcut_text(shortcut(&REDO))).clicked() {
        viewer.redo();
    }
    ui.separator();
    if ui.button("Everything back in its place").on_hover_text("as the scene has it").clicked() {
        viewer.put_all_back();
    }
    if ui
        .button("Settings as at first")
        .on_hover_text("methods, parameters, maps, theme and size of text")
        .clicked()
    {
        viewer.settings = Settings::default();
    }
}

fn view_menu(viewer: &mut Viewer, ui: &mut egui::Ui) {
    if ui.add(egui::Button::new("As the scene says").shortcut_text("Home")).clicked() {
        viewer.go_home();
    }
    if ui.add(egui::Button::new("All in view").shortcut_text("F")).clicked() {
        viewer.frame_all();
    }
    for (i, (name, direction)) in PRESETS.into_iter().enumerate() {
        let button = egui::Button::new(format!("From {name}"));
        if ui.add(button.shortcut_text(format!("{}", i + 1))).clicked() {
            viewer.look_from(direction);
        }
    }
    ui.separator();
    ui.checkbox(&mut viewer.settings.adapt, "Keep up while moving")
        .on_hover_text("fewer pixels and a draft while something moves, if need be");
    ui.separator();
    let themes = [(Theme::System, "As the system"), (Theme::Dark, "Dark"), (Theme::Light, "Light")];
    for (theme, name) in themes {
        ui.radio_value(&mut viewer.settings.theme, theme, name);
    }
    ui.separator();
    ui.horizontal(|ui| {
        let label = ui.label("Size of text");
        for (scale, name) in [(0.85, "85 %"), (1.0, "100 %"), (1.25, "125 %"), (1.5, "150 %")] {
            ui.selectable_value(&mut viewer.settings.ui_scale, scale, name).labelled_by(label.id);
        }
    });
}
