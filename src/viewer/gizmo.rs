//! Handles to move, turn and scale what is selected. The `transform-gizmo` crate does the geometry; here it meets
//! the window.

use eframe::egui::{self, Rgba, epaint};
use glam::{DQuat, DVec3};
use transform_gizmo::math::{DMat4, Rect, Transform};
use transform_gizmo::{EnumSet, Gizmo, GizmoConfig, GizmoInteraction, GizmoMode, GizmoOrientation};

use super::navigation::axes;
use super::worker::Thing;
use crate::geometry::Similarity;
use crate::scene::description::{EyeDescription, Scene};
use crate::scene::fit::world_bounds;

/// See the module.
#[derive(Default)]
pub(super) struct Handles {
    gizmo: Gizmo,
    /// Of what is selected: the middle of its mesh, local space.
    pivot: Option<(Thing, DVec3)>,
    /// The pointer is on a handle, or drags one.
    pub(super) focused: bool,
}

impl Handles {
    /// Draws the handles of `thing`, which is at `place`. Returns its new place while it is dragged.
    pub(super) fn show(
        &mut self,
        ui: &egui::Ui,
        response: &egui::Response,
        eye: &EyeDescription,
        scene: &Scene,
        (thing, place): (Thing, Similarity),
    ) -> Option<Similarity> {
        let pivot = self.pivot(scene, thing);
        let target = Transform::from_scale_rotation_translation(
            [place.scale; 3],
            place.rotation.to_array(),
            place.point(pivot).to_array(),
        );
        self.gizmo.update_config(config(eye, response.rect, ui.ctx().pixels_per_point()));
        let primary = egui::PointerButton::Primary;
        // A drag is known for one some points after it began; the handle is the one at its beginning.
        let begins = response.drag_started_by(primary);
        let pointer =
            ui.input(|i| if begins { i.pointer.press_origin() } else { i.pointer.hover_pos() });
        let pointer = pointer.unwrap_or_default();
        let interaction = GizmoInteraction {
            cursor_pos: (pointer.x, pointer.y),
            hovered: response.hovered(),
            drag_started: begins,
            dragging: response.dragged_by(primary),
        };
        let moved = self.gizmo.update(interaction, &[target]);
        self.focused = self.gizmo.is_focused();
        self.paint(&ui.painter_at(response.rect));
        let (_, moved) = moved?;
        let Transform { scale, rotation, translation } = *moved.first()?;
        let scale = scale.x.abs().max(1e-9);
        let rotation = DQuat::from_xyzw(rotation.v.x, rotation.v.y, rotation.v.z, rotation.s);
        let middle = DVec3::new(translation.x, translation.y, translation.z);
        let placed = Similarity { rotation: rotation.normalize(), scale, translation: DVec3::ZERO };
        let placed = Similarity { translation: middle - placed.point(pivot), ..placed };
        let sound = placed.translation.is_finite() && placed.rotation.is_finite();
        (sound && scale.is_finite()).then_some(placed)
    }

    pub(super) fn pivot(&mut self, scene: &Scene, thing: Thing) -> DVec3 {
        if let Some((same, pivot)) = self.pivot
            && same == thing
        {
            return pivot;
        }
        let mesh = match thing {
            Thing::Object(i) => &scene.objects[i].mesh,
            Thing::Mirror(i) => &scene.mirrors[i].mesh,
        };
        let (min, max) = world_bounds(mesh, &Similarity::IDENTITY);
        let pivot = 0.5 * (min + max);
        self.pivot = Some((thing, pivot));
        pivot
    }

    /// Forgets the last selection: another scene may have something else under its name.
    pub(super) fn clear(&mut self) {
        (self.pivot, self.focused) = (None, false);
    }

    fn paint(&self, painter: &egui::Painter) {
        let drawn = self.gizmo.draw();
        let mut mesh = epaint::Mesh { indices: drawn.indices, ..epaint::Mesh::default() };
        for (&[x, y], &[r, g, b, a]) in drawn.vertices.iter().zip(&drawn.colors) {
            mesh.colored_vertex(egui::pos2(x, y), Rgba::from_rgba_premultiplied(r, g, b, a).into());
        }
        if mesh.is_valid() {
            painter.add(egui::Shape::mesh(mesh));
        }
    }
}

fn config(eye: &EyeDescription, rect: egui::Rect, pixels_per_point: f32) -> GizmoConfig {
    let [right, up, forward] = axes(eye);
    let at = eye.position;
    let row = |axis: DVec3| [axis.x, axis.y, axis.z, -axis.dot(at)];
    let [x, y, z] = [row(right), row(up), row(-forward)];
    let view = DMat4::from_cols_array_2d(&[x, y, z, [0.0, 0.0, 0.0, 1.0]]).transpose();
    let distance = (eye.target - eye.position).length();
    let aspect = f64::from(rect.width() / rect.height().max(1.0));
    let projection = DMat4::perspective_rh(eye.fov_y, aspect, 1e-3 * distance, 1e3 * distance);
    let modes = [
        GizmoMode::TranslateX,
        GizmoMode::TranslateY,
        GizmoMode::TranslateZ,
        GizmoMode::TranslateView,
        GizmoMode::RotateX,
        GizmoMode::RotateY,
        GizmoMode::RotateZ,
        GizmoMode::ScaleUniform,
    ];
    GizmoConfig {
        view_matrix: view.into(),
        projection_matrix: projection.into(),
        viewport: Rect::from_min_max(
            [rect.min.x, rect.min.y].into(),
            [rect.max.x, rect.max.y].into(),
        ),
        modes: modes.into_iter().collect::<EnumSet<_>>(),
        orientation: GizmoOrientation::Global,
        pixels_per_point,
        ..GizmoConfig::default()
    }
}
