//! Rays that a curved mirror sends on: exactly (at the interpolated normal) and as the continuous 3-ray camera has
//! them (interpolated between the rays of the corners).

use glam::{DVec3, Vec2, Vec3};

use super::Eye;

/// Which length the rays of a 3-ray camera's corners have. It decides between what rays the camera's own lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RayScale {
    /// The distance from the eye to the corner: exact for plane mirrors.
    #[default]
    EyeDistance,
    /// 1, as in Mei, Popescu & Sacks 2007.
    Unit,
}

/// A mirror triangle: what its rays depend on, beside the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MirrorTriangle {
    /// Scene space.
    pub corners: [Vec3; 3],
    /// Unit.
    pub normals: [Vec3; 3],
}

/// `incident`, of any length, reflected by a plane with this unit normal.
pub fn reflect(incident: DVec3, normal: DVec3) -> DVec3 {
    incident - normal * (2.0 * incident.dot(normal))
}

/// `Σ w_i v_i`.
pub fn interpolate(values: [Vec3; 3], weights: [f64; 3]) -> DVec3 {
    values[0].as_dvec3() * weights[0]
        + values[1].as_dvec3() * weights[1]
        + values[2].as_dvec3() * weights[2]
}

/// The weights of the corners at the point of their plane that a line meets: the exact barycentrics of a pixel. They sum
/// to 1, with negative ones outside the triangle. `None` if the line is parallel to the plane or the triangle
/// degenerate.
pub fn weights_on_line(origin: DVec3, direction: DVec3, corners: [Vec3; 3]) -> Option<[f64; 3]> {
    let c = corners.map(|corner| corner.as_dvec3() - origin);
    let volumes =
        [c[1].cross(c[2]), c[2].cross(c[0]), c[0].cross(c[1])].map(|face| face.dot(direction));
    let sum = volumes[0] + volumes[1] + volumes[2];
    let weights = volumes.map(|volume| volume / sum);
    weights.iter().all(|w| w.is_finite()).then_some(weights)
}

/// Which rays a mirror sends on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RaySource {
    /// Reflected at the interpolated normals: the truth.
    #[default]
    Surface,
    /// The continuous 3-ray camera's own: the truth for the camera model.
    Camera,
}

impl MirrorTriangle {
    /// The unit direction of the ray from `eye` reflected at the point with these weights by the interpolated (Phong)
    /// normal: the truth for a smooth mirror.
    ///
    /// `None` where the normals cancel or the eye is on the point.
    pub fn surface_direction(&self, eye: Vec3, weights: [f64; 3]) -> Option<DVec3> {
        let view = (interpolate(self.corners, weights) - eye.as_dvec3()).try_normalize()?;
        Some(reflect(view, interpolate(self.normals, weights).try_normalize()?))
    }

    /// The rays `d_i` of the 3-ray camera at the corners (Mei, Popescu & Sacks 2007, section 5).
    pub fn corner_directions(&self, eye: Vec3, scale: RayScale) -> [DVec3; 3] {
        std::array::from_fn(|i| {
            let view = self.corners[i].as_dvec3() - eye.as_dvec3();
            let view = match scale {
                RayScale::EyeDistance => view,
                RayScale::Unit => view.normalize_or_zero(),
            };
            reflect(view, self.normals[i].as_dvec3())
        })
    }

    /// n_i·(eye - v_i) at each corner; `Σ w_i` of them is positive where a ray leaves the front side of the
    /// smooth surface.
    pub fn facing(&self, eye: Vec3) -> [f64; 3] {
        std::array::from_fn(|i| {
            self.normals[i].as_dvec3().dot(eye.as_dvec3() - self.corners[i].as_dvec3())
        })
    }

    /// Whether the flat triangle is seen on the side that its normals do not point to: an open mirror's back, a closed one from
    /// within, or any with normals that point inwards.
    pub fn is_seen_from_behind(&self, eye: Vec3) -> bool {
        let [a, b, c] = self.corners.map(|corner| corner.as_dvec3());
        let flat = (b - a).cross(c - a);
        let outward = flat.dot(interpolate(self.normals, [1.0; 3]));
        flat.dot(eye.as_dvec3() - a) * outward.signum() < 0.0
    }

    /// [`Self::facing`] of the side that is seen: rays reflect alike on both.
    pub fn facing_seen(&self, eye: Vec3) -> [f64; 3] {
        let facing = self.facing(eye);
        if self.is_seen_from_behind(eye) { facing.map(|f| -f) } else { facing }
    }

    /// The direction `Σ w_i d_i` of the 3-ray camera's own ray at the point with these weights; not unit.
    pub fn camera_direction(&self, eye: Vec3, weights: [f64; 3], scale: RayScale) -> DVec3 {
        let d = self.corner_directions(eye, scale);
        d[0] * weights[0] + d[1] * weights[1] + d[2] * weights[2]
    }
}

/// Origin and direction of the ray that a mirror triangle sends on from where it is seen at a picture position. Its direction has unit
/// length for [`RaySource::Surface`] and the camera's for [`RaySource::Camera`].
///
/// The point is that of the triangle's plane, even a little outside the triangle: a sample belongs to the triangle that it
/// names. `None` if the triangle is seen exactly edge-on or its normals cancel.
pub fn reflected_ray(
    eye: &Eye,
    px: Vec2,
    mirror: &MirrorTriangle,
    source: RaySource,
    scale: RayScale,
) -> Option<(Vec3, Vec3)> {
    let weights =
        weights_on_line(eye.position.as_dvec3(), view_direction(eye, px), mirror.corners)?;
    let direction = match source {
        RaySource::Surface => mirror.surface_direction(eye.position, weights)?,
        RaySource::Camera => mirror.camera_direction(eye.position, weights, scale),
    };
    Some((interpolate(mirror.corners, weights).as_vec3(), direction.as_vec3()))
}

/// [`Eye::ray_through_px`] in f64.
fn view_direction(eye: &Eye, px: Vec2) -> DVec3 {
    let focal = f64::from(eye.focal_px);
    let x = (f64::from(px.x) - 0.5 * f64::from(eye.size.width)) / focal;
    let y = (f64::from(px.y) - 0.5 * f64::from(eye.size.height)) / focal;
    eye.forward.as_dvec3() + eye.right.as_dvec3() * x - eye.up.as_dvec3() * y
}

#[cfg(test)]
mod tests {
    use super::*;

    const EYE: Vec3 = Vec3::new(0.3, 2.0, -0.5);

    #[test]
    fn the_side_that_is_seen_faces() {
        let mirror = curved();
        let other = MirrorTriangle { normals: mirror.normals.map(|n| -n), ..mirror };
        let turned = [mirror.corners[0], mirror.corners[2], mirror.corners[1]];
        let turned = MirrorTriangle {
            corners: turned,
            normals: [mirror.normals[0], mirror.normals[2], mirror.normals[1]],
        };
        let below = Vec3::new(EYE.x, -EYE.y, EYE.z);
        for (mirror, above) in [(mirror, true), (other, false), (turned, true)] {
            for (eye, seen) in [(EYE, !above), (below, above)] {
                assert_eq!(mirror.is_seen_from_behind(eye), seen, "{mirror:?}");
                assert!(mirror.facing_seen(eye).iter().all(|f| *f > 0.0), "{mirror:?}");
            }
        }
        let flat = MirrorTriangle { corners: [Vec3::ZERO; 3], ..mirror };
        assert!(!flat.is_seen_from_behind(EYE));
    }

    fn curved() -> MirrorTriangle {
        let corners = [Vec3::ZERO, Vec3::new(1.0, 0.1, 0.0), Vec3::new(0.2, -0.1, 1.0)];
        let normals =
            [Vec3::new(0.1, 1.0, 0.0), Vec3::new(0.0, 1.0, 0.3), Vec3::new(-0.2, 1.0, 0.1)];
        MirrorTriangle { corners, normals: normals.map(|n| n.normalize_or(Vec3::Y)) }
    }

    #[test]
    fn the_angle_of_reflection_is_that_of_incidence() {
        let normal = DVec3::new(0.36, 0.48, 0.8);
        let incident = DVec3::new(1.5, -2.0, 0.25);
        let reflected = reflect(incident, normal);
        assert!((reflected.dot(normal) + incident.dot(normal)).abs() < 1e-14);
        assert!((reflected - incident).cross(normal).length() < 1e-14, "in one plane");
        assert!((reflected.length() - incident.length()).abs() < 1e-14);
    }

    #[test]
    fn rays_of_a_plane_mirror_come_from_the_mirrored_eye() {
        let plane =
            MirrorTriangle { corners: [Vec3::ZERO, Vec3::X, Vec3::Z], normals: [Vec3::Y; 3] };
        let mirrored = (EYE * Vec3::new(1.0, -1.0, 1.0)).as_dvec3();
        for weights in [[0.2, 0.3, 0.5], [1.0, 0.0, 0.0], [0.05, 0.9, 0.05]] {
            let from = interpolate(plane.corners, weights) - mirrored;
            let camera = plane.camera_direction(EYE, weights, RayScale::EyeDistance);
            assert!(camera.distance(from) < 1e-12, "of the very length");
            let surface = plane.surface_direction(EYE, weights).unwrap();
            assert!(surface.cross(from).length() < 1e-12 && surface.dot(from) > 0.0);
        }
        // With unit rays they do not meet in a point.
        let unit = plane.camera_direction(EYE, [0.4, 0.3, 0.3], RayScale::Unit);
        let from = interpolate(plane.corners, [0.4, 0.3, 0.3]) - mirrored;
        assert!(unit.cross(from).length() > 1e-4 * unit.length() * from.length());
    }

    #[test]
    fn both_kinds_agree_at_the_corners_and_neighbours_along_edges() {
        let (first, far) = (curved(), Vec3::new(2.0, 0.4, 1.0));
        let second = MirrorTriangle {
            corners: [first.corners[2], first.corners[1], far],
            normals: [first.normals[2], first.normals[1], Vec3::Y],
        };
        for scale in [RayScale::EyeDistance, RayScale::Unit] {
            for (i, weights) in [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].into_iter().enumerate() {
                let camera = first.camera_direction(EYE, weights, scale);
                let surface = first.surface_direction(EYE, weights).unwrap();
                let length = match scale {
                    RayScale::Unit => 1.0,
                    RayScale::EyeDistance => f64::from(first.corners[i].distance(EYE)),
                };
                assert!(camera.distance(surface * length) < 1e-6);
            }
            let here = first.camera_direction(EYE, [0.0, 0.3, 0.7], scale);
            let there = second.camera_direction(EYE, [0.7, 0.3, 0.0], scale);
            assert!(here.distance(there) < 1e-12);
        }
    }

    #[test]
    fn weights_reproduce_the_point_and_know_the_outside() {
        let corners = curved().corners;
        for weights in [[0.2, 0.3, 0.5], [1.2, -0.1, -0.1]] {
            let toward = interpolate(corners, weights) - EYE.as_dvec3();
            let found = weights_on_line(EYE.as_dvec3(), toward * 3.0, corners).unwrap();
            assert!((0..3).all(|i| (found[i] - weights[i]).abs() < 1e-12), "{found:?}");
        }
        let along = (corners[1] - corners[0]).as_dvec3();
        assert!(weights_on_line(DVec3::ZERO, along, [Vec3::Y, Vec3::Y, Vec3::Y]).is_none());
    }
}
