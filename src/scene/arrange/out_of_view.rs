//! Whether an eye sees any of the mirrors: files lie where they lie, which may be far away.

use glam::DVec3;

use crate::scene::description::{EyeDescription, Scene};
use crate::scene::fit::world_bounds;

/// Pictures are at most so many times as wide as they are high.
const WIDEST: f64 = 4.0;
/// What is smaller than this part of a picture's height is not seen in it.
const SMALLEST: f64 = 1e-3;

/// What to say if no mirror shows in pictures from the eye.
pub(super) fn note(scene: &Scene) -> Option<String> {
    let spheres = scene.mirrors.iter().map(|mirror| {
        let (min, max) = world_bounds(&mirror.mesh, &mirror.transform);
        (&mirror.name, 0.5 * (min + max), 0.5 * (max - min).length())
    });
    let mut unseen = Vec::new();
    for (name, center, radius) in spheres {
        if shows(&scene.eye, center, radius) {
            return None;
        }
        unseen.push((name, center, radius));
    }
    let (name, center, radius) = unseen.first()?;
    let away = (*center - scene.eye.position).length();
    Some(format!(
        "no mirror is in view: {name}, {:.3} across, is {away:.3} away, about {:.3},{:.3},{:.3}; choose --eye and --target, \
         or give it as a scene file with fit",
        2.0 * radius,
        center.x,
        center.y,
        center.z
    ))
}

/// Whether a sphere may be in a picture, and large enough to be seen.
fn shows(eye: &EyeDescription, center: DVec3, radius: f64) -> bool {
    let to = center - eye.position;
    let distance = to.length();
    if distance <= radius {
        return true;
    }
    let tan_y = (0.5 * eye.fov_y).tan();
    let half = (tan_y * (1.0 + WIDEST * WIDEST).sqrt()).atan();
    let off = to.angle_between(eye.target - eye.position);
    off - (radius / distance).asin() <= half && radius / distance > SMALLEST * tan_y
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spheres_beside_behind_and_far_away_do_not_show() {
        let eye = EyeDescription {
            position: DVec3::new(0.0, 0.0, 5.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            fov_y: 1.0,
        };
        let seen = |x, y, z, radius| shows(&eye, DVec3::new(x, y, z), radius);
        assert!(seen(0.0, 0.0, 0.0, 1.0) && seen(0.0, 0.0, 0.0, 0.01));
        // A picture may be wide.
        assert!(seen(8.0, 0.0, 0.0, 0.1));
        assert!(!seen(0.0, 0.0, 10.0, 1.0), "behind");
        assert!(seen(0.0, 0.0, 10.0, 5.1), "around the eye");
        assert!(!seen(40.0, 0.0, 0.0, 1.0), "beside");
        assert!(!seen(0.0, 0.0, -1e5, 1.0), "far away");
        assert!(!seen(637_000.0, 400.0, 851_000.0, 500.0), "where surveys lie");
    }
}
