//! The cameras of an eye: one for each mirror triangle that faces it in part.

use glam::DVec3;

use super::TIE;
use super::roots::roots;
use super::surfaces::PathScene;
use crate::camera::mirror_ray::{RayScale, reflect};
use crate::camera::three_ray::{Rays, ThreeRay};

/// A camera and where it comes from.
pub(super) struct Camera {
    pub(super) mirror: u32,
    /// In its mirror.
    pub(super) triangle: u32,
    pub(super) rays: Rays,
    pub(super) three_ray: ThreeRay<f64>,
    /// n_i·(E - v_i); Σ w_i of them is positive where rays leave the front.
    facing: [f64; 3],
    /// |v_i - E|.
    eye_distance: [f64; 3],
    /// Longest edge.
    pub(super) size: f64,
}

/// An image of a point, as a camera has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Image {
    /// Index of the camera.
    pub(super) camera: u32,
    pub(super) lambda: f64,
    pub(super) weights: [f64; 3],
    /// Some weight is within [`TIE`] of zero.
    pub(super) on_edge: bool,
}

/// All cameras, mirror by mirror in the order of the triangles. `eye` is relative to the scene's origin.
pub(super) fn cameras(scene: &PathScene, eye: DVec3, scale: RayScale) -> Vec<Camera> {
    let mut list = Vec::new();
    for (mirror, surface) in (0..).zip(&scene.mirrors) {
        let count = surface.mesh.triangles().len();
        for (triangle, t) in (0..).zip(0..count) {
            let (origins, normals) = (surface.corners(t), surface.corner_normals(t));
            let facing = [0, 1, 2].map(|i| normals[i].dot(eye - origins[i]));
            if !facing.iter().any(|f| *f > 0.0) {
                continue;
            }
            let directions = [0, 1, 2].map(|i| {
                let view = origins[i] - eye;
                let view = match scale {
                    RayScale::EyeDistance => view,
                    RayScale::Unit => view.normalize_or_zero(),
                };
                reflect(view, normals[i])
            });
            let rays = Rays { origins, directions };
            let edge = |i: usize, j: usize| origins[i].distance(origins[j]);
            list.push(Camera {
                mirror,
                triangle,
                rays,
                three_ray: ThreeRay::new(&rays, &rays),
                facing,
                eye_distance: origins.map(|v| v.distance(eye)),
                size: edge(0, 1).max(edge(1, 2)).max(edge(2, 0)),
            });
        }
    }
    list
}

impl Camera {
    /// Hands every image of a point (relative to the scene's origin) to `visit`, λ rising.
    pub(super) fn images(&self, index: u32, point: DVec3, visit: impl FnMut(Image)) {
        let q = (point - self.rays.origins[0]).to_array();
        let roots = roots(&self.three_ray, q);
        let images = roots.as_slice().iter().filter_map(|l| self.image_at(index, point, *l));
        images.for_each(visit);
    }

    /// The image of a point at a root λ of its cubic, if it lies in the camera.
    pub(super) fn image_at(&self, index: u32, point: DVec3, lambda: f64) -> Option<Image> {
        let q = (point - self.rays.origins[0]).to_array();
        let image = self.three_ray.image_at(q, lambda, true);
        let weights = [image.b1(), image.b2, image.b3];
        let sum = |values: [f64; 3]| (0..3).map(|i| weights[i] * values[i]).sum::<f64>();
        let inside = image.found && weights.iter().all(|w| *w >= -TIE);
        let in_front = sum(self.facing) > 0.0;
        if !(inside && in_front) {
            return None;
        }
        let (_, d) = self.rays.at(DVec3::from_array(weights));
        let apart = lambda * d.length() > TIE * sum(self.eye_distance);
        let on_edge = weights.iter().any(|w| *w < TIE);
        apart.then_some(Image { camera: index, lambda, weights, on_edge })
    }

    /// N(λ), the normal of T(λ).
    pub(super) fn normal(&self, lambda: f64) -> DVec3 {
        let [v, d] = [self.rays.origins, self.rays.directions];
        let e = |i: usize| v[i] - v[0] + (d[i] - d[0]) * lambda;
        e(1).cross(e(2))
    }

    /// A camera of no mirror, whose rays all leave its front.
    #[cfg(test)]
    pub(super) fn alone(rays: Rays) -> Self {
        Self {
            mirror: 0,
            triangle: 0,
            rays,
            three_ray: ThreeRay::new(&rays, &rays),
            facing: [1.0; 3],
            eye_distance: [0.0; 3],
            size: 1.0,
        }
    }

    /// Whether the ray at `w` leaves the front of the smooth surface.
    #[cfg(test)]
    pub(super) fn faces(&self, w: [f64; 3]) -> bool {
        (0..3).map(|i| w[i] * self.facing[i]).sum::<f64>() > 1e-9
    }

    /// v(w).
    pub(super) fn mirror_point(&self, weights: [f64; 3]) -> DVec3 {
        self.rays.at(DVec3::from_array(weights)).0
    }
}
