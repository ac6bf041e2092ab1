//! How the eye moves: pure functions of where it is. Angles in radians, lengths in world units.

use glam::{DQuat, DVec2, DVec3};

use crate::scene::description::EyeDescription;

/// The eye comes no nearer to straight up or down than this.
const POLE: f64 = 0.02;
/// Shares of the distance to the target that one step may take.
const ZOOM_STEP: std::ops::RangeInclusive<f64> = 0.2..=5.0;
/// A view is kept between these distances to its target, as shares of the scene's size.
const DISTANCES: [f64; 2] = [1e-4, 1e3];

/// What is framed leaves a little of the view free.
const FRAME: f64 = 1.05;

/// Directions to look from, with names. World space, for up = y.
pub(super) const PRESETS: [(&str, DVec3); 6] = [
    ("front", DVec3::new(0.0, 0.3, 1.0)),
    ("right", DVec3::new(1.0, 0.3, 0.0)),
    ("back", DVec3::new(0.0, 0.3, -1.0)),
    ("left", DVec3::new(-1.0, 0.3, 0.0)),
    ("above", DVec3::new(0.0, 1.0, 0.001)),
    ("corner", DVec3::new(1.0, 0.8, 1.0)),
];

/// Right, up and forward of an eye; unit.
pub(super) fn axes(eye: &EyeDescription) -> [DVec3; 3] {
    let forward = (eye.target - eye.position).normalize_or(DVec3::NEG_Z);
    let right = forward.cross(eye.up).normalize_or(DVec3::X);
    [right, right.cross(forward), forward]
}

/// Around the target: `right` to the right about `up`, `up` upwards, short of the poles.
pub(super) fn orbit(eye: &EyeDescription, right: f64, up: f64) -> EyeDescription {
    let away = turned(eye.up, eye.position - eye.target, right, up);
    EyeDescription { position: eye.target + away, ..*eye }
}

/// The view turns, the eye stays.
pub(super) fn look(eye: &EyeDescription, right: f64, up: f64) -> EyeDescription {
    let toward = turned(eye.up, eye.target - eye.position, -right, up);
    EyeDescription { target: eye.position + toward, ..*eye }
}

/// `arm` turned about `axis` and towards it, short of both poles.
fn turned(axis: DVec3, arm: DVec3, about: f64, towards: f64) -> DVec3 {
    let axis = axis.normalize_or(DVec3::Y);
    let arm = DQuat::from_axis_angle(axis, about) * arm;
    let side = arm.cross(axis).normalize_or(DVec3::X);
    let angle = arm.angle_between(axis);
    let wanted = (angle - towards).clamp(POLE, std::f64::consts::PI - POLE);
    DQuat::from_axis_angle(side, angle - wanted) * arm
}

/// Moves eye and target so that what is at the target's depth follows a pointer that moved by `by_px`, in a view
/// of `height_px`.
pub(super) fn pan(eye: &EyeDescription, by_px: DVec2, height_px: f64) -> EyeDescription {
    let [right, up, _] = axes(eye);
    let scale = unit_px(eye, height_px);
    let by = (up * by_px.y - right * by_px.x) * scale;
    EyeDescription { position: eye.position + by, target: eye.target + by, ..*eye }
}

/// World length at the target's depth that a pixel shows.
fn unit_px(eye: &EyeDescription, height_px: f64) -> f64 {
    let distance = (eye.target - eye.position).length();
    2.0 * distance * (0.5 * eye.fov_y).tan() / height_px.max(1.0)
}

/// Nearer by `factor` < 1, or farther, about what is under the pointer at the target's depth. `at_px` is relative to
/// the view's middle, y down; `scale` is the scene's size.
pub(super) fn zoom(
    eye: &EyeDescription,
    factor: f64,
    at_px: DVec2,
    height_px: f64,
    scale: f64,
) -> EyeDescription {
    let distance = (eye.target - eye.position).length();
    let factor = factor.clamp(*ZOOM_STEP.start(), *ZOOM_STEP.end());
    let factor = (distance * factor).clamp(DISTANCES[0] * scale, DISTANCES[1] * scale) / distance;
    let [right, up, _] = axes(eye);
    let fixed = eye.target + (right * at_px.x - up * at_px.y) * unit_px(eye, height_px);
    let about = |p: DVec3| fixed + (p - fixed) * factor;
    EyeDescription { position: about(eye.position), target: about(eye.target), ..*eye }
}

/// Moves eye and target by `by`: right, up, forward.
pub(super) fn fly(eye: &EyeDescription, by: DVec3) -> EyeDescription {
    let [right, up, forward] = axes(eye);
    let by = right * by.x + up * by.y + forward * by.z;
    EyeDescription { position: eye.position + by, target: eye.target + by, ..*eye }
}

/// Looks the same way at the middle of a box, from where all of it is in a view of this width by height.
pub(super) fn frame(eye: &EyeDescription, bounds: [DVec3; 2], aspect: f64) -> EyeDescription {
    let middle = 0.5 * (bounds[0] + bounds[1]);
    let half = 0.5 * (bounds[1] - bounds[0]);
    let high = (0.5 * eye.fov_y).tan();
    let wide = high * aspect;
    let [right, up, forward] = axes(eye);
    let distance = (0..8_usize)
        .map(|i| {
            let sign = |k: usize| if i >> k & 1 == 0 { -1.0 } else { 1.0 };
            let corner = half * DVec3::new(sign(0), sign(1), sign(2));
            let across = (corner.dot(right).abs() / wide).max(corner.dot(up).abs() / high);
            across * FRAME - corner.dot(forward)
        })
        .fold(half.length().max(1e-9), f64::max);
    EyeDescription { position: middle - forward * distance, target: middle, ..*eye }
}

/// Looks at the target from a direction, at the same distance.
pub(super) fn from_direction(eye: &EyeDescription, direction: DVec3) -> EyeDescription {
    let distance = (eye.position - eye.target).length();
    let to_up = DQuat::from_rotation_arc(DVec3::Y, eye.up.normalize_or(DVec3::Y));
    let away = to_up * direction.normalize_or(DVec3::Z) * distance;
    EyeDescription { position: eye.target + away, ..*eye }
}

#[cfg(test)]
mod tests {
    use glam::dvec3;

    use super::*;
    use crate::camera::Eye;
    use crate::camera::eye::ImageSize;

    const SIZE: ImageSize = ImageSize { width: 300, height: 200 };

    fn eye() -> EyeDescription {
        EyeDescription {
            position: dvec3(1.0, 2.0, 5.0),
            target: dvec3(0.5, 0.2, -1.0),
            up: DVec3::Y,
            fov_y: 0.8,
        }
    }

    fn seen(eye: &EyeDescription, point: DVec3) -> DVec2 {
        let EyeDescription { position, target, up, fov_y } = *eye;
        let eye = Eye::new(position, target, up, fov_y, SIZE).expect("a view");
        eye.project_px(point.as_vec3()).expect("in front").as_dvec2()
    }

    fn distance(eye: &EyeDescription) -> f64 {
        (eye.target - eye.position).length()
    }

    #[test]
    fn orbits_keep_the_distance_and_stop_short_of_the_poles() {
        let mut now = eye();
        for _ in 0..200 {
            now = orbit(&now, 0.3, 0.2);
            assert!((distance(&now) - distance(&eye())).abs() < 1e-9);
            assert!(Eye::new(now.position, now.target, now.up, now.fov_y, SIZE).is_some());
        }
        let away = (now.position - now.target).normalize_or_zero();
        assert!(away.y > 0.999 && away.y < 1.0, "{away}");
        // To the right and upwards, as the names say.
        let right = orbit(&eye(), 0.1, 0.1);
        let [side, ..] = axes(&eye());
        assert!((right.position - eye().position).dot(side) > 0.0);
        assert!(right.position.y > eye().position.y);
    }

    #[test]
    fn looking_up_and_right_lowers_and_moves_left_what_was_in_the_middle() {
        let before = seen(&eye(), eye().target);
        let after = seen(&look(&eye(), 0.1, 0.1), eye().target);
        assert!(after.x < before.x - 5.0 && after.y > before.y + 5.0, "{before} {after}");
    }

    #[test]
    fn what_is_panned_follows_the_pointer() {
        let by = DVec2::new(17.0, -9.0);
        let moved = pan(&eye(), by, 200.0);
        let found = seen(&moved, eye().target) - seen(&eye(), eye().target);
        assert!((found - by).length() < 1e-3, "{found}");
    }

    #[test]
    fn zooming_keeps_what_is_under_the_pointer() {
        let at = DVec2::new(60.0, -40.0);
        let [right, up, _] = axes(&eye());
        let point = eye().target + (right * at.x - up * at.y) * unit_px(&eye(), 200.0);
        for factor in [0.7, 1.0, 1.4] {
            let zoomed = zoom(&eye(), factor, at, 200.0, 1.0);
            assert!((seen(&zoomed, point) - seen(&eye(), point)).length() < 1e-3);
            assert!((distance(&zoomed) - factor * distance(&eye())).abs() < 1e-9);
        }
        let mut near = eye();
        for _ in 0..100 {
            near = zoom(&near, 0.3, at, 200.0, 1.0);
        }
        assert!(distance(&near) >= 0.99e-4, "the target is never reached");
    }

    #[test]
    fn framed_boxes_are_in_view() {
        let bounds = [dvec3(-3.0, 1.0, 2.0), dvec3(4.0, 1.5, 9.0)];
        let framed = frame(&eye(), bounds, 1.5);
        for i in 0..8_usize {
            let pick = |k: usize| bounds[i >> k & 1][k];
            let px = seen(&framed, dvec3(pick(0), pick(1), pick(2)));
            assert!((0.0..=300.0).contains(&px.x) && (0.0..=200.0).contains(&px.y), "{px}");
        }
        // And not much smaller than it.
        let corners = (0..8_usize).map(|i| {
            let pick = |k: usize| bounds[i >> k & 1][k];
            seen(&framed, dvec3(pick(0), pick(1), pick(2)))
        });
        let middle = DVec2::new(150.0, 100.0);
        let reach =
            corners.map(|px| ((px - middle) / middle).abs().max_element()).fold(0.0, f64::max);
        assert!(reach > 0.9, "{reach}");
        let turn = axes(&framed)[2].dot(axes(&eye())[2]);
        assert!(turn > 1.0 - 1e-12, "the direction stays");
    }

    #[test]
    fn presets_keep_distance_and_target_and_make_views() {
        for (name, direction) in PRESETS {
            let now = from_direction(&eye(), direction);
            assert_eq!(now.target, eye().target);
            assert!((distance(&now) - distance(&eye())).abs() < 1e-9, "{name}");
            let view = Eye::new(now.position, now.target, now.up, now.fov_y, SIZE);
            assert!(view.is_some(), "{name}");
        }
    }

    #[test]
    fn flying_forward_goes_where_one_looks() {
        let flown = fly(&eye(), dvec3(0.0, 0.0, 0.5));
        assert!((flown.position - eye().position - axes(&eye())[2] * 0.5).length() < 1e-12);
        assert!((distance(&flown) - distance(&eye())).abs() < 1e-12);
    }
}
