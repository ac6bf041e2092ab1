//! The picture, what lies over it, and the hands on it.

use std::sync::Arc;

use eframe::egui::{self, Align2, Color32, PointerButton, Rect, Sense, Stroke, pos2, vec2};
use glam::{DVec2, DVec3};

use super::app::{OnScreen, Viewer};
use super::settings::Shown;
use super::{legend, navigation, overlay};
use crate::camera::eye::ImageSize;

/// Radians a point of dragging.
const TURN: f64 = 0.008;
/// Natural logarithm of the distance, a point of scrolling.
const ZOOM: f64 = 0.002;
/// Distances to the target a second, flying.
const SPEED: f64 = 0.8;
/// The divider is taken hold of within so many points of it.
const GRIP: f32 = 6.0;
/// Longest side of a picture, pixels.
const MAX_SIDE: u32 = 16_384;

pub(super) fn show(viewer: &mut Viewer, ui: &mut egui::Ui) {
    egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| {
        let rect = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        response.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Image, true, "view of the scene")
        });
        let scale = ui.ctx().pixels_per_point();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let side = |points: f32| ((points * scale).round().max(1.0) as u32).min(MAX_SIDE);
        viewer.size = ImageSize { width: side(rect.width()), height: side(rect.height()) };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "in the window"
        )]
        let from = [rect.left(), rect.top()].map(|points| (points * scale).round() as u32);
        viewer.canvas = from;
        paint(viewer, ui, rect);
        divider(viewer, ui, rect);
        handles(viewer, ui, &response);
        navigate(viewer, ui, &response);
        overlay::show(viewer, &ui.painter_at(rect), rect);
        if let Some(display) = &viewer.display {
            legend::show(display, &ui.painter_at(rect), rect);
        }
        hints(viewer, ui, rect);
    });
}

fn paint(viewer: &Viewer, ui: &egui::Ui, rect: Rect) {
    let painter = ui.painter_at(rect);
    let Some(display) = &viewer.display else {
        painter.rect_filled(rect, 0.0, ui.visuals().extreme_bg_color);
        return;
    };
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    let at = |part: Rect| {
        Rect::from_min_max(
            rect.lerp_inside(part.min.to_vec2()),
            rect.lerp_inside(part.max.to_vec2()),
        )
    };
    let image = |picture: &OnScreen, part: Rect| match picture {
        OnScreen::Whole(blit) => {
            let clip = painter.clip_rect().intersect(at(part));
            blit.paint(&painter.with_clip_rect(clip), rect);
        }
        OnScreen::Scaled(texture) => {
            painter.image(texture.id(), at(part), part, Color32::WHITE);
        }
    };
    let over = || {
        if let Some(map) = &display.map {
            painter.image(map.id(), rect, whole, Color32::WHITE);
        }
    };
    match display.pictures.as_slice() {
        [one] => {
            image(one, whole);
            over();
        }
        [a, b] => {
            if display.map.is_some() && viewer.settings.shown != Shown::Divider {
                over();
            } else {
                let at = viewer.settings.divider;
                image(a, Rect::from_min_max(pos2(0.0, 0.0), pos2(at, 1.0)));
                image(b, Rect::from_min_max(pos2(at, 0.0), pos2(1.0, 1.0)));
            }
        }
        _ => {}
    }
}

fn divider(viewer: &mut Viewer, ui: &egui::Ui, rect: Rect) {
    if !viewer.settings.compare || viewer.settings.shown != Shown::Divider {
        return;
    }
    let x = rect.lerp_inside(vec2(viewer.settings.divider, 0.0)).x;
    let grip = Rect::from_x_y_ranges(x - GRIP..=x + GRIP, rect.y_range());
    let response = ui
        .interact(grip, ui.scope_id().with("divider"), Sense::drag())
        .on_hover_cursor(egui::CursorIcon::ResizeHorizontal);
    response.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::Slider, true, "divider between the two sides")
    });
    if response.dragged()
        && let Some(pointer) = response.interact_pointer_pos()
    {
        let share = (pointer.x - rect.left()) / rect.width().max(1.0);
        viewer.settings.divider = share.clamp(0.02, 0.98);
    }
    let painter = ui.painter_at(rect);
    painter.vline(x, rect.y_range(), Stroke::new(2.0, Color32::WHITE));
    painter.vline(x + 1.5, rect.y_range(), Stroke::new(1.0, Color32::BLACK));
    for (side, align, dx) in [(0, Align2::RIGHT_BOTTOM, -8.0), (1, Align2::LEFT_BOTTOM, 8.0)] {
        let settings = &viewer.settings.sides[side];
        let label = format!("{} · {}", settings.method, settings.backend.word());
        text(&painter, pos2(x + dx, rect.bottom() - 8.0), align, &label, Color32::WHITE);
    }
}

/// Text that can be read on anything.
fn text(painter: &egui::Painter, at: egui::Pos2, align: Align2, what: &str, color: Color32) {
    let font = egui::FontId::proportional(13.0);
    let galley = painter.layout(what.to_owned(), font, color, 420.0);
    let rect = align.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand(4.0), 4.0, Color32::from_black_alpha(170));
    painter.galley(rect.min, galley, color);
}

fn handles(viewer: &mut Viewer, ui: &egui::Ui, response: &egui::Response) {
    let (Some(thing), Some(scene)) = (viewer.selected, viewer.scene.clone()) else {
        viewer.handles.clear();
        return;
    };
    let at = thing.placement(scene.objects.len());
    let Some(&place) = viewer.placements.get(at) else { return };
    let moved = viewer.handles.show(ui, response, &viewer.eye, &scene, (thing, place));
    if let Some(place) = moved {
        viewer.moves.begin(&viewer.placements);
        Arc::make_mut(&mut viewer.placements)[at] = place;
    }
    if !ui.input(|i| i.pointer.any_down()) && !ui.ctx().egui_wants_keyboard_input() {
        viewer.moves.end(&viewer.placements);
    }
}

fn navigate(viewer: &mut Viewer, ui: &egui::Ui, response: &egui::Response) {
    let rect = response.rect;
    let middle = |at: egui::Pos2| {
        let at = at - rect.center();
        DVec2::new(f64::from(at.x), f64::from(at.y))
    };
    let height = f64::from(rect.height());
    let held = |button| response.dragged_by(button) && !viewer.handles.focused;
    let by = response.drag_delta();
    let by = DVec2::new(f64::from(by.x), f64::from(by.y));
    let modifiers = ui.input(|i| i.modifiers);
    let eye = viewer.eye;
    if by != DVec2::ZERO {
        let left = held(PointerButton::Primary);
        if left && !modifiers.shift && !modifiers.ctrl {
            viewer.eye = navigation::orbit(&eye, -by.x * TURN, by.y * TURN);
        } else if left && modifiers.ctrl {
            viewer.eye = navigation::look(&eye, by.x * TURN * 0.5, -by.y * TURN * 0.5);
        } else if left || held(PointerButton::Secondary) || held(PointerButton::Middle) {
            viewer.eye = navigation::pan(&eye, by, height);
        }
    }
    let size = viewer.scene_size();
    if response.hovered() {
        let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta(), i.zoom_delta()));
        let at = response.hover_pos().unwrap_or(rect.center());
        let factor = (-f64::from(scroll.y) * ZOOM).exp() / f64::from(pinch);
        if factor != 1.0 {
            viewer.eye = navigation::zoom(&viewer.eye, factor, middle(at), height, size);
        }
    }
    fly(viewer, ui);
    let share = |at: egui::Pos2| (at - rect.min) / rect.size();
    if response.clicked()
        && !viewer.handles.focused
        && let Some(at) = response.interact_pointer_pos()
    {
        viewer.ask(share(at), true);
    } else if viewer.settings.inspect
        && let Some(at) = response.hover_pos()
        && viewer.asked != Some((at, viewer.shots))
    {
        viewer.asked = Some((at, viewer.shots));
        viewer.ask(share(at), false);
    }
    if response.double_clicked() {
        viewer.frame_selected();
    }
}

/// WASD, Q and E, as long as they are held.
fn fly(viewer: &mut Viewer, ui: &egui::Ui) {
    use egui::Key;
    if ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    let by = ui.input(|i| {
        let axis = |plus, minus| {
            f64::from(u8::from(i.key_down(plus))) - f64::from(u8::from(i.key_down(minus)))
        };
        let any = i.modifiers.command || i.modifiers.alt;
        let fast = if i.modifiers.shift { 4.0 } else { 1.0 };
        let by = DVec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S));
        if any { DVec3::ZERO } else { by * fast * f64::from(i.stable_dt.min(0.1)) }
    });
    if by != DVec3::ZERO {
        let distance = (viewer.eye.target - viewer.eye.position).length();
        viewer.eye = navigation::fly(&viewer.eye, by * (SPEED * distance));
        ui.ctx().request_repaint();
    }
}

/// What happens, and what went wrong.
fn hints(viewer: &mut Viewer, ui: &mut egui::Ui, rect: Rect) {
    let painter = ui.painter_at(rect);
    if let Some((stage, done)) = &viewer.progress {
        let what = format!("{stage} {:.0} %", 100.0 * done);
        text(&painter, rect.left_top() + vec2(12.0, 12.0), Align2::LEFT_TOP, &what, Color32::WHITE);
        let place = Rect::from_min_size(rect.left_top() + vec2(12.0, 40.0), vec2(70.0, 22.0));
        let button = ui.put(place, egui::Button::new("cancel"));
        if button.on_hover_text("Ends loading; what is shown stays").clicked() {
            viewer.cancel_load();
        }
    } else if viewer.prepared.is_none() && viewer.message.is_none() {
        text(&painter, rect.center(), Align2::CENTER_CENTER, "loading …", Color32::WHITE);
    }
    let dropping = ui.input(|i| !i.raw.hovered_files.is_empty());
    if dropping {
        painter.rect_filled(rect, 0.0, Color32::from_black_alpha(140));
        let what = "drop to open: a scene (.toml), or models beside the teapot";
        text(&painter, rect.center(), Align2::CENTER_CENTER, what, Color32::WHITE);
    }
    if viewer.message_is_fresh()
        && let Some((what, is_bad, at)) = &viewer.message
    {
        let tone = if *is_bad { Color32::from_rgb(255, 150, 130) } else { Color32::WHITE };
        let place = rect.left_bottom() + vec2(12.0, -12.0);
        text(&painter, place, Align2::LEFT_BOTTOM, what, tone);
        if !is_bad {
            ui.ctx().request_repaint_after(
                std::time::Duration::from_secs(6).saturating_sub(at.elapsed()),
            );
        }
    }
}
