//! Where on a triangle a view ray meets it.

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::camera::Eye;

/// Finds the barycentric weights of a triangle's plane along view rays: made once a triangle, asked for
/// every ray.
///
/// With the corners c in homogeneous picture coordinates, the weights at picture position p = (x, y, 1) are
/// proportional to (c₁×c₂)·p, (c₂×c₀)·p and (c₀×c₁)·p (Olano and Greer 1997, section 3).
#[derive(Clone, Copy, Debug)]
pub struct RayWeights {
    rows: [DVec3; 3],
    /// The determinant of the corners; divided by the sum of the above it is the depth.
    volume: f64,
    middle: DVec2,
}

impl RayWeights {
    /// For the triangle with these corners (scene space).
    pub fn new(eye: &Eye, corners: [Vec3; 3]) -> Self {
        let focal = f64::from(eye.focal_px);
        let [a, b, c] = corners.map(|corner| {
            let p = corner.as_dvec3() - eye.position.as_dvec3();
            let along = |axis: Vec3| p.dot(axis.as_dvec3());
            DVec3::new(focal * along(eye.right), -focal * along(eye.up), along(eye.forward))
        });
        let rows = [b.cross(c), c.cross(a), a.cross(b)];
        Self { rows, volume: rows[0].dot(a), middle: middle_px(eye) }
    }

    /// The weights where the view ray through a picture position meets the triangle's plane. They sum to
    /// 1; outside the triangle some are negative. `None` where it does not meet it in front of the eye.
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "weights are f32 everywhere")]
    pub fn at(&self, px: DVec2) -> Option<[f32; 3]> {
        let p = (px - self.middle).extend(1.0);
        let share = [self.rows[0].dot(p), self.rows[1].dot(p), self.rows[2].dot(p)];
        let sum = share[0] + share[1] + share[2];
        let scale = 1.0 / sum;
        let weights = [share[0] * scale, share[1] * scale, share[2] * scale].map(|w| w as f32);
        let in_front = sum * self.volume > 0.0;
        let finite = weights[0].abs().max(weights[1].abs()).max(weights[2].abs()) < f32::INFINITY;
        (in_front && finite).then_some(weights)
    }

    /// The functions that the weights are proportional to, about a picture position: there, and what they change by per
    /// pixel in x and y. Where the triangle's plane is in front of the eye their sum is positive, and about 1 near the
    /// position; all zero if the triangle is seen edge-on.
    #[expect(clippy::cast_possible_truncation, reason = "weights are f32 everywhere")]
    pub fn shares_about(&self, px: DVec2) -> [[f32; 3]; 3] {
        let p = (px - self.middle).extend(1.0);
        let start = self.rows.map(|row| row.dot(p));
        let total = |list: [f64; 3]| list[0] + list[1] + list[2];
        let by = [self.rows.map(|row| row.x), self.rows.map(|row| row.y)];
        let size = total(start).abs() + total(by[0]).abs() + total(by[1]).abs();
        let scale = self.volume.signum() / size;
        if !(scale.abs() < f64::INFINITY && self.volume != 0.0) {
            return [[0.0; 3]; 3];
        }
        [start, by[0], by[1]].map(|list| list.map(|share| (share * scale) as f32))
    }
}

/// The weights of `corners` (scene space) where the view ray through a picture position meets their
/// plane: see [`RayWeights::at`].
pub fn barycentrics(eye: &Eye, corners: [Vec3; 3], px: Vec2) -> Option<[f32; 3]> {
    RayWeights::new(eye, corners).at(px.as_dvec2())
}

fn middle_px(eye: &Eye) -> DVec2 {
    DVec2::new(f64::from(eye.size.width), f64::from(eye.size.height)) * 0.5
}
