//! The camera under the pointer, or the one that was kept: its rays, the boxes it visited, its surfels.

use eframe::egui::{self, Color32, Pos2, Rect, Stroke, vec2};
use glam::Vec3;

use super::app::Viewer;
use crate::analysis::{CameraTrace, Outcome};
use crate::camera::Eye;

/// So many boxes and surfels are drawn at most: more is a blur.
const MOST: usize = 4000;
const EDGES: [(usize, usize); 12] = [
    (0, 1),
    (1, 3),
    (3, 2),
    (2, 0),
    (4, 5),
    (5, 7),
    (7, 6),
    (6, 4),
    (0, 4),
    (1, 5),
    (2, 6),
    (3, 7),
];

pub(super) fn show(viewer: &Viewer, painter: &egui::Painter, rect: Rect) {
    if !viewer.settings.inspect {
        return;
    }
    let probed = viewer.pinned.as_ref().or(viewer.probed.as_ref());
    let (Some(trace), Some(prepared)) = (probed.and_then(|p| p.trace.as_ref()), &viewer.prepared)
    else {
        return;
    };
    let eye = viewer.eye;
    let at = eye.position - prepared.origin;
    let Some(eye) = Eye::new(at, eye.target - prepared.origin, eye.up, eye.fov_y, viewer.size)
    else {
        return;
    };
    let size = vec2(viewer.size.width as f32, viewer.size.height as f32);
    let place = |point: Vec3| -> Option<Pos2> {
        let px = eye.project_px(point)?;
        Some(rect.min + vec2(px.x, px.y) / size * rect.size())
    };
    draw(trace, painter, &place);
}

fn draw(trace: &CameraTrace, painter: &egui::Painter, place: &impl Fn(Vec3) -> Option<Pos2>) {
    let line = |a: Vec3, b: Vec3, stroke: Stroke| {
        if let (Some(a), Some(b)) = (place(a), place(b)) {
            painter.line_segment([a, b], stroke);
        }
    };
    let mut boxes = 0;
    for visited in trace.clouds.iter().flat_map(|cloud| &cloud.boxes) {
        let color = match visited.outcome {
            Outcome::Refused | Outcome::TurnedAway => continue,
            Outcome::Opened => Color32::from_rgba_unmultiplied(90, 160, 255, 50),
            _ => Color32::from_rgba_unmultiplied(255, 220, 80, 130),
        };
        boxes += 1;
        if boxes > MOST {
            break;
        }
        for (a, b) in EDGES {
            line(visited.corners[a], visited.corners[b], Stroke::new(1.0, color));
        }
    }
    for surfel in trace.clouds.iter().flat_map(|cloud| &cloud.surfels).take(MOST) {
        let color = if surfel.valid {
            Color32::from_rgb(80, 255, 120)
        } else {
            Color32::from_rgb(255, 70, 60)
        };
        if let Some(at) = place(surfel.position) {
            painter.circle_filled(at, 1.5, color);
        }
    }
    let reach = trace.clouds.iter().map(|cloud| cloud.lambda[1]).fold(0.0, f32::max);
    let ends = [0, 1, 2].map(|i| trace.corners[i] + trace.directions[i] * reach.min(1e6));
    for i in 0..3 {
        let next = (i + 1) % 3;
        line(trace.corners[i], trace.corners[next], Stroke::new(2.0, Color32::WHITE));
        line(trace.corners[i], ends[i], Stroke::new(1.5, Color32::from_rgb(255, 120, 220)));
        line(ends[i], ends[next], Stroke::new(1.0, Color32::from_rgb(255, 120, 220)));
    }
}
