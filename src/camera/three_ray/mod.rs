//! The continuous 3-ray camera (C3RC) of Popescu et al. 2006 as used by Mei, Popescu & Sacks 2007.
//!
//! A triangle `v1 v2 v3` with rays `d1 d2 d3`; barycentrics w = (1-b2-b3, b2, b3) name the ray that starts
//! at v(w) = Σ w_i v_i and runs along d(w) = Σ w_i d_i. The triangle T(λ) of the points v_i + λ d_i sweeps
//! the view volume. Constants are made in f64 and rounded once.

pub mod caustic;
pub mod multiplicity;
mod paper_test;
pub mod project;
pub mod solve;
#[cfg(test)]
pub(crate) mod tests;
pub mod volume;

use glam::DVec3;

use crate::geometry::lanes::Scalar;

pub use super::mirror_ray::RayScale;
pub use project::{Image, project};
pub use volume::{BoxTest, Boxes, Verdict, ViewVolume};

/// The three construction rays, in f64, or those at the corners of a polygon of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rays<const N: usize = 3> {
    /// Where they start: the triangle.
    pub origins: [DVec3; N],
    /// Their directions; the lengths matter, see [`RayScale`].
    pub directions: [DVec3; N],
}

impl Rays {
    /// The ray at barycentrics `w`: origin and direction.
    pub fn at(&self, w: DVec3) -> (DVec3, DVec3) {
        let mix = |a: &[DVec3; 3]| a[0] * w.x + a[1] * w.y + a[2] * w.z;
        (mix(&self.origins), mix(&self.directions))
    }

    /// The rays of the part of the triangle's plane with these corners (barycentrics). A triangle's make the same camera,
    /// since v and d are linear in w.
    pub fn part<const N: usize>(&self, corners: [DVec3; N]) -> Rays<N> {
        let rays = corners.map(|w| self.at(w));
        Rays { origins: rays.map(|r| r.0), directions: rays.map(|r| r.1) }
    }

    /// The camera whose triangle is {w_i ≥ -margin_i}: it contains the guard band.
    pub fn grown(&self, margin: DVec3) -> Self {
        let m = margin;
        self.part([
            DVec3::new(1.0 + m.y + m.z, -m.y, -m.z),
            DVec3::new(-m.x, 1.0 + m.x + m.z, -m.z),
            DVec3::new(-m.x, -m.y, 1.0 + m.x + m.y),
        ])
    }
}

impl<const N: usize> Rays<N> {
    /// Mean direction, unit; `None` if the directions cancel.
    pub fn axis(&self) -> Option<DVec3> {
        let unit = |d: DVec3| d.try_normalize().unwrap_or(DVec3::ZERO);
        self.directions.into_iter().map(unit).sum::<DVec3>().try_normalize()
    }
}

/// The projection's constants: three dot products make the cubic (maths: F(λ) = N(λ)·(q - λ d1)).
#[derive(Clone, Copy, Debug)]
pub struct ThreeRay<T> {
    /// First origin: points are projected as q = Q - v1.
    pub v1: [T; 3],
    /// First direction.
    pub d1: [T; 3],
    /// v2 - v1.
    pub e1: [T; 3],
    /// v3 - v1.
    pub e2: [T; 3],
    /// d2 - d1.
    pub f1: [T; 3],
    /// d3 - d1.
    pub f2: [T; 3],
    /// N(λ) = n0 + λ n1 + λ² n2 is the normal of T(λ).
    pub n0: [T; 3],
    /// See `n0`.
    pub n1: [T; 3],
    /// See `n0`.
    pub n2: [T; 3],
    /// n0·d1, n1·d1, n2·d1.
    pub nd: [T; 3],
    /// Unit mean direction: λ lies between the least and largest (axis·q - start_i)·per_axis_i.
    pub axis: [T; 3],
    /// axis·(v_i - v1), v_i the corners of the grown camera; a triangle's last one twice.
    pub start: [T; 4],
    /// 1 / axis·d_i; not used if `wide`.
    pub per_axis: [T; 4],
    /// The directions open so wide that the axis bounds nothing.
    pub wide: bool,
    /// Points stand for disks of this radius: where the disk reaches the caustic and the point lies beyond it, its image is
    /// on the caustic. 0 for points proper.
    pub disk: T,
}

/// Directions whose component along the axis is less than this share of their length make a camera `wide`
/// (untuned: a cone of 84°).
const WIDE_COSINE: f64 = 0.1;

pub(crate) fn array<T: Scalar>(v: DVec3) -> [T; 3] {
    v.to_array().map(T::from_f64)
}

impl<T: Scalar> ThreeRay<T> {
    /// The constants of `rays`; images are looked for between the rays of `grown` (the same camera's, see
    /// [`Rays::grown`] and [`Rays::part`]; three or four). Degenerate triangles give a camera that sees nothing.
    pub fn new<const N: usize>(rays: &Rays, grown: &Rays<N>) -> Self {
        let ([v1, v2, v3], [d1, d2, d3]) = (rays.origins, rays.directions);
        let (e1, e2, f1, f2) = (v2 - v1, v3 - v1, d2 - d1, d3 - d1);
        let (n0, n1, n2) = (e1.cross(e2), e1.cross(f2) + f1.cross(e2), f1.cross(f2));
        let axis = grown.axis().unwrap_or(DVec3::ZERO);
        let along = grown.directions.map(|d| axis.dot(d));
        let wide = (0..N).any(|i| along[i] <= WIDE_COSINE * grown.directions[i].length());
        let corner = [0, 1, 2, 3].map(|i| i.min(N - 1));
        Self {
            v1: array(v1),
            d1: array(d1),
            e1: array(e1),
            e2: array(e2),
            f1: array(f1),
            f2: array(f2),
            n0: array(n0),
            n1: array(n1),
            n2: array(n2),
            nd: [n0, n1, n2].map(|n| T::from_f64(n.dot(d1))),
            axis: array(axis),
            start: corner.map(|i| T::from_f64(axis.dot(grown.origins[i] - v1))),
            per_axis: corner.map(|i| T::from_f64(if wide { 0.0 } else { 1.0 / along[i] })),
            wide,
            disk: T::from_f64(0.0),
        }
    }
}
