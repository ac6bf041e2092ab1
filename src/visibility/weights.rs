//! Where on a triangle a view ray meets it.

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::camera::Eye;

/// Finds the barycentric weights of a triangle's plane along view rays: made once a triangle, asked for
/// every ray.
///
/// With the corners c relative to the eye, the weights of direction d are proportional to
/// (c₁×c₂)·d, (c₂×c₀)·d and (c₀×c₁)·d.
#[derive(Clone, Copy, Debug)]
pub struct RayWeights {
    rows: [DVec3; 3],
    /// Six times the signed volume of the tetrahedron that the triangle spans with the eye.
    volume: f64,
}

impl RayWeights {
    /// For the triangle with these corners (scene space).
    pub fn new(eye: &Eye, corners: [Vec3; 3]) -> Self {
        let c = corners.map(|p| p.as_dvec3() - eye.position.as_dvec3());
        let rows = [c[1].cross(c[2]), c[2].cross(c[0]), c[0].cross(c[1])];
        Self { rows, volume: rows[0].dot(c[0]) }
    }

    /// The weights where the ray from the eye in `direction` (any length) meets the triangle's plane.
    /// They sum to 1; outside the triangle some are negative. `None` where it does not meet it in front
    /// of the eye.
    #[expect(clippy::cast_possible_truncation, reason = "weights are f32 everywhere")]
    pub fn at(&self, direction: DVec3) -> Option<[f32; 3]> {
        let share = self.rows.map(|row| row.dot(direction));
        let sum = share[0] + share[1] + share[2];
        let in_front = sum * self.volume > 0.0;
        let weights = share.map(|w| (w / sum) as f32);
        (in_front && weights.iter().all(|w| w.is_finite())).then_some(weights)
    }
}

/// The weights of `corners` (scene space) where the view ray through a picture position meets their
/// plane: see [`RayWeights::at`].
pub fn barycentrics(eye: &Eye, corners: [Vec3; 3], px: Vec2) -> Option<[f32; 3]> {
    RayWeights::new(eye, corners).at(view_ray(eye, px.as_dvec2()))
}

/// [`Eye::ray_through_px`] in f64.
pub(crate) fn view_ray(eye: &Eye, px: DVec2) -> DVec3 {
    let middle = DVec2::new(f64::from(eye.size.width), f64::from(eye.size.height)) * 0.5;
    let slope = (px - middle) / f64::from(eye.focal_px);
    eye.forward.as_dvec3() + eye.right.as_dvec3() * slope.x - eye.up.as_dvec3() * slope.y
}
