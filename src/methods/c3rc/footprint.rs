//! What a pixel sees of space: how far apart the rays through neighbouring pixels run.

use glam::{DMat2, DMat3, DVec2, DVec3};

use crate::camera::three_ray::Rays;

/// How the point at λ moves with the pixel that sees it, a pixel to the right and a pixel down (columns, the third
/// one unused): `base` + λ `per_lambda`. An affine approximation of the perspective over the triangle; not numbers
/// if the triangle has no area on the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Footprint {
    pub(super) base: DMat3,
    pub(super) per_lambda: DMat3,
    axis: DVec3,
}

impl Footprint {
    /// `corners_px`: where the origins of `rays` are seen.
    pub(super) fn new(corners_px: &[DVec2; 3], rays: &Rays) -> Self {
        let [a, b, c] = *corners_px;
        let to_edges = DMat3::from_mat2(DMat2::from_cols(b - a, c - a).inverse());
        let edges = |p: &[DVec3; 3]| DMat3::from_cols(p[1] - p[0], p[2] - p[0], DVec3::ZERO);
        Self {
            base: edges(&rays.origins) * to_edges,
            per_lambda: edges(&rays.directions) * to_edges,
            axis: rays.axis().unwrap_or(DVec3::Z),
        }
    }

    /// The matrix [a b; b c] that gives the squared distance across the axis by the distance in pixels, as
    /// quadratics in λ.
    pub(super) fn quadratics(&self) -> [[f64; 3]; 3] {
        let across = |m: &DMat3| [m.x_axis, m.y_axis].map(|v| v.reject_from(self.axis));
        let ([x0, y0], [x1, y1]) = (across(&self.base), across(&self.per_lambda));
        let product = |p0: DVec3, p1: DVec3, q0: DVec3, q1: DVec3| {
            [p0.dot(q0), p0.dot(q1) + p1.dot(q0), p1.dot(q1)]
        };
        [product(x0, x1, x0, x1), product(x0, x1, y0, y1), product(y0, y1, y0, y1)]
    }

    /// Area across the axis that a pixel sees, at λ.
    pub(super) fn area_per_px(&self, lambda: f64) -> f64 {
        let map = self.base + self.per_lambda * lambda;
        map.x_axis.reject_from(self.axis).cross(map.y_axis.reject_from(self.axis)).length()
    }

    /// Half the extent, in pixels along two directions of the picture that are at right angles, of what lies within a
    /// unit of the ray at λ. Not numbers or infinite where T(λ) has no area.
    pub(super) fn extent_px(&self, lambda: f64, along: DVec2) -> DVec2 {
        let map = self.base + self.per_lambda * lambda;
        let (x, y) = (map.x_axis.reject_from(self.axis), map.y_axis.reject_from(self.axis));
        let (along, across) = (x * along.x + y * along.y, y * along.x - x * along.y);
        // The diagonal of the inverse of the Gram matrix.
        let det = along.length_squared() * across.length_squared() - along.dot(across).powi(2);
        DVec2::new((across.length_squared() / det).sqrt(), (along.length_squared() / det).sqrt())
    }

    /// How many pixels a unit across the rays covers at most, at λ. Not a number or infinite where T(λ) has no area.
    pub(super) fn px_per_unit(&self, lambda: f64) -> f64 {
        let map = self.base + self.per_lambda * lambda;
        let (x, y) = (map.x_axis.reject_from(self.axis), map.y_axis.reject_from(self.axis));
        // One over the smaller singular value.
        let mean = 0.5 * (x.length_squared() + y.length_squared());
        let det = x.cross(y).length_squared();
        ((mean + (mean * mean - det).max(0.0).sqrt()) / det).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_mirror_shows_things_as_large_as_their_distance_says() {
        // An eye 2 above a mirror that lies in the plane y = 0, whose rays go up again; 100 pixels a unit at 2.
        let origins = [DVec3::ZERO, DVec3::new(0.3, 0.0, 0.0), DVec3::new(0.1, 0.0, 0.2)];
        let directions = origins.map(|v| v - DVec3::new(0.0, -2.0, 0.0));
        let rays = Rays { origins, directions };
        let px = origins.map(|v| DVec2::new(100.0 * v.x, 100.0 * v.z));
        let footprint = Footprint::new(&px, &rays);
        for lambda in [0.0, 0.5, 3.0] {
            // The mean ray is not quite upright: that foreshortens the triangle by less than a percent.
            let exact = 100.0 / (1.0 + lambda);
            let found = footprint.px_per_unit(lambda);
            assert!((found - exact).abs() < 0.01 * exact, "{found} is not {exact} at {lambda}");
        }
        let flat = Footprint::new(&[DVec2::ZERO, DVec2::X, 2.0 * DVec2::X], &rays);
        assert!(!flat.px_per_unit(1.0).is_finite() || flat.px_per_unit(1.0) == 0.0);
    }
}
