//! The camera under the pointer, or the one that was kept: its rays, the boxes it visited, its surfels.

use eframe::egui::{self, Color32, Pos2, Rect, Stroke, vec2};
use glam::{DVec3, Vec3};

use super::app::Viewer;
use super::worker::{Probed, SeenPath};
use crate::analysis::{CameraTrace, Outcome};
use crate::camera::Eye;

/// So many boxes and surfels are drawn at most: more is a blur.
const MOST: usize = 4000;
/// So many are drawn large.
const FEW: usize = 300;
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
    let Some(prepared) = &viewer.prepared else { return };
    let probed = viewer.pinned.as_ref().or(viewer.probed.as_ref());
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
    if viewer.settings.caustic
        && let Some(display) = &viewer.display
    {
        draw_caustic(&display.caustic, painter, &place);
    }
    if viewer.settings.paths
        && let Some(Probed { point: Some(point), paths, .. }) = probed
    {
        let local = |p: DVec3| (p - prepared.origin).as_vec3();
        draw_paths(local(*point), paths, local, painter, &place);
    }
    if viewer.settings.inspect
        && let Some(trace) = probed.and_then(|p| p.trace.as_ref())
    {
        draw(trace, painter, &place);
    }
}

/// Lines of the caustic surface that are drawn at most: more is a blur.
const MOST_RULINGS: usize = 12_000;

fn draw_caustic(
    rulings: &[[Vec3; 2]],
    painter: &egui::Painter,
    place: &impl Fn(Vec3) -> Option<Pos2>,
) {
    let stroke = Stroke::new(1.0, Color32::from_rgba_unmultiplied(255, 190, 60, 90));
    for [a, b] in rulings.iter().step_by(rulings.len().div_ceil(MOST_RULINGS).max(1)) {
        if let (Some(a), Some(b)) = (place(*a), place(*b)) {
            painter.line_segment([a, b], stroke);
        }
    }
}

/// From the point to each mirror point in which it is seen; hidden ways are faint.
fn draw_paths(
    point: Vec3,
    paths: &[SeenPath],
    local: impl Fn(DVec3) -> Vec3,
    painter: &egui::Painter,
    place: &impl Fn(Vec3) -> Option<Pos2>,
) {
    let Some(from) = place(point) else { return };
    for path in paths {
        let Some(to) = place(local(path.mirror_point)) else { continue };
        let color = match (path.hidden, path.parity < 0) {
            (true, _) => Color32::from_rgba_unmultiplied(200, 200, 200, 70),
            (false, false) => Color32::from_rgb(90, 220, 255),
            (false, true) => Color32::from_rgb(255, 150, 60),
        };
        painter.line_segment([from, to], Stroke::new(1.5, color));
        painter.circle_filled(to, 3.0, color);
    }
    painter.circle_stroke(from, 5.0, Stroke::new(2.0, Color32::WHITE));
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
            Outcome::Opened => Color32::from_rgba_unmultiplied(90, 160, 255, 110),
            _ => Color32::from_rgba_unmultiplied(255, 220, 80, 190),
        };
        boxes += 1;
        if boxes > MOST {
            break;
        }
        for (a, b) in EDGES {
            line(visited.corners[a], visited.corners[b], Stroke::new(1.0, color));
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
    // Over all lines, and those that are seen over those that are not: few are to be found, many not to be a blot.
    for (valid, color) in
        [(false, Color32::from_rgb(255, 70, 60)), (true, Color32::from_rgb(80, 255, 120))]
    {
        let surfels = trace.clouds.iter().flat_map(|cloud| &cloud.surfels);
        let like = surfels.filter(|surfel| surfel.valid == valid);
        let few = valid && like.clone().count() < FEW;
        for at in like.take(MOST).filter_map(|surfel| place(surfel.position)) {
            if few {
                painter.circle_filled(at, 3.5, Color32::BLACK);
            }
            painter.circle_filled(at, if few { 2.5 } else { 1.2 }, color);
        }
    }
}
