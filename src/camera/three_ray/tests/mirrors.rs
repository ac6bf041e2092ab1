//! Cameras of random triangles of curved mirrors with a largest curvature of 1, and laws for the points that they see.

use glam::{DVec2, DVec3};

use super::Numbers;
use crate::camera::mirror_ray::reflect;
use crate::camera::three_ray::{RayScale, Rays};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    Convex,
    Concave,
    Saddle,
    NearlyFlat,
}

pub(crate) const SHAPES: [Shape; 4] =
    [Shape::Convex, Shape::Concave, Shape::Saddle, Shape::NearlyFlat];

/// Curvature times edge length.
pub(crate) const KH: [f64; 4] = [0.05, 0.2, 0.5, 1.0];

/// Points lie at distances from 0 to this, uniformly, in radii of curvature.
pub(crate) const LAWS: [f64; 3] = [1.0, 4.0, 20.0];

/// How a mirror curves at the origin: z = -(k1 x² + k2 y²)/2, seen from above.
pub(crate) fn curvatures(numbers: &mut Numbers, shape: Shape) -> DVec2 {
    let mut size = || numbers.between(0.3, 1.0);
    let k = DVec2::new(1.0, size());
    match shape {
        Shape::Convex => k,
        Shape::Concave => -k,
        Shape::Saddle => k * DVec2::new(1.0, -1.0),
        Shape::NearlyFlat => k * DVec2::new(1e-3, -1e-3),
    }
}

/// A triangle of it: corners at these places, seen from `eye`; `None` if it turns away from the eye.
pub(crate) fn camera_of(
    k: DVec2,
    corners: [DVec2; 3],
    eye: DVec3,
    scale: RayScale,
) -> Option<Rays> {
    let ray = |p: DVec2| {
        let v = p.extend(-0.5 * (k * p).dot(p));
        let n = (k * p).extend(1.0).normalize_or(DVec3::Z);
        let view = v - eye;
        let length = if scale == RayScale::Unit { view.length() } else { 1.0 };
        (n.dot(view) < 0.0).then(|| (v, reflect(view, n) / length))
    };
    let [a, b, c] = corners.map(ray);
    let (a, b, c) = (a?, b?, c?);
    Some(Rays { origins: [a.0, b.0, c.0], directions: [a.1, b.1, c.1] })
}

/// A triangle with edges of about `kh`, no sliver, whose corners all face the eye.
pub(crate) fn camera(numbers: &mut Numbers, shape: Shape, kh: f64, scale: RayScale) -> Rays {
    loop {
        let k = curvatures(numbers, shape);
        let center = DVec2::new(numbers.between(-0.7, 0.7), numbers.between(-0.7, 0.7));
        let turn = numbers.between(0.0, 6.3);
        let corners = [0.0, 1.0, 2.0].map(|i| {
            let angle = turn + (i + numbers.between(-0.15, 0.15)) * 2.094;
            center + DVec2::from_angle(angle) * (kh * 0.577 * numbers.between(0.7, 1.3))
        });
        let eye = DVec3::new(
            numbers.between(-3.0, 3.0),
            numbers.between(-3.0, 3.0),
            numbers.between(0.5, 4.0),
        );
        if let Some(rays) = camera_of(k, corners, eye, scale) {
            return rays;
        }
    }
}

/// The largest λ of a law: that of `law` radii of curvature, by the mean length of the rays.
pub(crate) fn largest_lambda(rays: &Rays, law: f64) -> f64 {
    law * 3.0 / rays.directions.iter().map(|d| d.length()).sum::<f64>()
}
