//! What stands in the way of paths.

use glam::DVec3;

use super::surfaces::PathScene;
use super::{Occluder, Path};
use crate::accel::Ray;

/// An object hides nothing from here on of a leg's length (or the last part of it): P or Q may lie on it, rounded to f32.
const CONTACT: f64 = 1e-4;

/// A leg: relative to the scene's origin.
#[derive(Clone, Copy)]
struct Leg {
    from: DVec3,
    to: DVec3,
    /// Lengths at both ends in which mirrors do not count.
    clear: [f64; 2],
}

/// Looks up both legs of paths that start at `eye`; `points[i]` is the end of `paths[i]` (both relative to the origin).
pub(super) fn occlude(scene: &PathScene, eye: DVec3, points: &[DVec3], paths: &mut [Path]) {
    let clear = scene.clearance;
    let to_mirror =
        |path: &Path| Leg { from: eye, to: path.mirror_point - scene.origin, clear: [0.0, clear] };
    let to_point = |path: &Path, point: DVec3| Leg {
        from: path.mirror_point - scene.origin,
        to: point,
        clear: [clear, clear],
    };
    let legs: Vec<Leg> = paths.iter().map(to_mirror).collect();
    for (path, found) in paths.iter_mut().zip(look_up(scene, &legs)) {
        path.eye_leg = found;
    }
    let legs: Vec<Leg> = paths.iter().zip(points).map(|(path, q)| to_point(path, *q)).collect();
    for (path, found) in paths.iter_mut().zip(look_up(scene, &legs)) {
        path.point_leg = found;
    }
}

fn look_up(scene: &PathScene, legs: &[Leg]) -> Vec<Occluder> {
    let ray = |leg: &Leg, clear: [f64; 2]| {
        let direction = leg.to - leg.from;
        let length = direction.length();
        Ray {
            origin: leg.from.as_vec3(),
            direction: direction.as_vec3(),
            t_min: share(clear[0] / length),
            t_max: share(1.0 - clear[1] / length),
        }
    };
    let mut hidden = vec![false; legs.len()];
    let rays: Vec<Ray> = legs.iter().map(|leg| ray(leg, leg.clear)).collect();
    scene.mirror_triangles.occluded_in_turn(&rays, &mut hidden);
    let mirrors = hidden.clone();
    let rays: Vec<Ray> =
        legs.iter().map(|leg| ray(leg, [0.0, CONTACT * (leg.to - leg.from).length()])).collect();
    scene.object_triangles.occluded_in_turn(&rays, &mut hidden);
    let which = |(mirror, object): (&bool, &bool)| match (mirror, object) {
        (true, _) => Occluder::Mirror,
        (false, true) => Occluder::Object,
        (false, false) => Occluder::None,
    };
    mirrors.iter().zip(&hidden).map(which).collect()
}

#[expect(clippy::cast_possible_truncation, reason = "a part of a leg")]
fn share(t: f64) -> f32 {
    t as f32
}
