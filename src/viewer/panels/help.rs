//! Mouse and keys.

use eframe::egui;

use super::super::app::Viewer;

const ROWS: [(&str, &str); 22] = [
    ("drag", "orbit about the middle"),
    ("right drag, Shift + drag", "pan"),
    ("wheel, pinch", "zoom to the pointer"),
    ("Ctrl + drag", "look around"),
    ("W A S D, Q E", "fly; Shift: faster"),
    ("click", "select; drag arrows to move, arcs to turn, the ring to scale"),
    ("double click", "look at what is selected"),
    ("Esc", "select nothing, close messages"),
    ("Home, R", "the scene's own view"),
    ("F", "all in view"),
    ("1 … 6", "front, right, back, left, above, corner"),
    ("C", "compare two methods"),
    ("I", "inspect: the camera under the pointer; click keeps it"),
    ("P", "side panel"),
    ("H, F1", "this sheet"),
    ("Ctrl + Z, Ctrl + Y", "undo a move, make it again"),
    ("Ctrl + O", "open a scene or models"),
    ("Ctrl + S", "save the picture"),
    ("Ctrl + Q", "quit"),
    ("Ctrl + plus, minus, 0", "size of text"),
    ("drop files", "open them: a scene (.toml), or models beside the teapot"),
    ("drag the divider", "between the two sides of a comparison"),
];

pub(super) fn show(viewer: &mut Viewer, context: &egui::Context) {
    let mut open = viewer.help;
    let window = egui::Window::new("Mouse and keys").open(&mut open).resizable(false);
    let middle = egui::Align2::CENTER_CENTER;
    window.anchor(middle, egui::Vec2::ZERO).show(context, |ui| {
        egui::ScrollArea::vertical().show(ui, |ui| {
            egui::Grid::new("keys").num_columns(2).striped(true).show(ui, |ui| {
                for (keys, what) in ROWS {
                    ui.strong(keys);
                    ui.label(what);
                    ui.end_row();
                }
            });
        });
    });
    viewer.help = open;
}
