//! What the colours of a map mean.

use eframe::egui::{self, Color32, Rect, pos2, vec2};

use super::app::Display;
use super::worker::{Map, class_colors, heat};

const WIDTH: f32 = 170.0;
const LINE: f32 = 16.0;
const MARGIN: f32 = 8.0;

/// Below on the right.
pub(super) fn show(display: &Display, painter: &egui::Painter, rect: Rect) {
    let most = display.most.map_or(String::new(), |most| format!("{most:.0}"));
    match display.view.map {
        _ if display.map.is_none() => {}
        Map::None => {}
        Map::Cost => ramp(painter, rect, "projections a pixel", ["0", &most], |t| heat(t.sqrt())),
        Map::Flip => ramp(painter, rect, "FLIP: seen difference", ["0", "1"], heat),
        Map::Difference => {
            ramp(painter, rect, "difference of display values", ["0", "255"], |t| {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "0 to 255"
                )]
                let level = (t * 255.0) as u8;
                Color32::from_gray(level)
            });
        }
        Map::Class => {
            let lines = class_colors();
            let area = board(painter, rect, lines.len());
            for (i, (color, what)) in lines.into_iter().enumerate() {
                let at = area.min + vec2(0.0, LINE * i as f32);
                painter.rect_filled(
                    Rect::from_min_size(at + vec2(0.0, 3.0), vec2(10.0, 10.0)),
                    2.0,
                    color,
                );
                write(painter, at + vec2(16.0, 0.0), egui::Align2::LEFT_TOP, what);
            }
        }
    }
}

fn ramp(
    painter: &egui::Painter,
    rect: Rect,
    title: &str,
    ends: [&str; 2],
    color: impl Fn(f32) -> Color32,
) {
    const STEPS: u8 = 64;
    let area = board(painter, rect, 3);
    write(painter, area.min, egui::Align2::LEFT_TOP, title);
    let top = area.top() + LINE;
    for i in 0..STEPS {
        let [from, to] =
            [i, i + 1].map(|i| area.left() + area.width() * f32::from(i) / f32::from(STEPS));
        let bar = Rect::from_min_max(pos2(from, top + 3.0), pos2(to, top + LINE - 3.0));
        painter.rect_filled(bar, 0.0, color(f32::from(i) / f32::from(STEPS - 1)));
    }
    let below = top + LINE;
    write(painter, pos2(area.left(), below), egui::Align2::LEFT_TOP, ends[0]);
    write(painter, pos2(area.right(), below), egui::Align2::RIGHT_TOP, ends[1]);
}

/// A dark ground for so many lines.
fn board(painter: &egui::Painter, rect: Rect, lines: usize) -> Rect {
    let size = vec2(WIDTH, LINE * lines as f32);
    let min = rect.right_bottom() - size - vec2(MARGIN, MARGIN) * 2.0;
    let area = Rect::from_min_size(min, size);
    painter.rect_filled(area.expand(MARGIN * 0.75), 4.0, Color32::from_black_alpha(190));
    area
}

fn write(painter: &egui::Painter, at: egui::Pos2, align: egui::Align2, what: &str) {
    painter.text(at, align, what, egui::FontId::proportional(12.0), Color32::WHITE);
}
