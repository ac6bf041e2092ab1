//! Paths as data: every image of a point in every camera of every mirror, in f64, without a picture or a backend.
//!
//! ```text
//! Scene ─► PathScene            mirrors in f64, what hides
//! eye   ─► PathFinder           a continuous 3-ray camera for each mirror triangle that faces the eye, in a tree
//! points ─► PathSet             all paths eye ─► mirror ─► point, by point
//! ```
//!
//! An image of the point Q in the camera of a triangle is a λ > 0 with Q = v(w) + λ d(w), w inside the (ungrown) triangle,
//! where the ray leaves the front of the smooth surface. Positions are in world space; lengths have the author's unit.

mod cameras;
mod find;
mod hierarchy;
mod occlusion;
mod packet;
mod refine;
mod roots;
mod surfaces;
#[cfg(feature = "cli")]
pub mod table;
#[cfg(test)]
mod tests;

use glam::DVec3;

pub use find::{ImageCount, PathFinder, PathOptions, PathSet};
pub use surfaces::PathScene;

/// A weight or a λ this near to its bound is on it: an image on an edge or corner of several triangles is that of
/// the lowest index, and a point this near to the mirror (as a share of the eye's distance) touches it and has no image.
/// Some million roundings of f64, a thousandth of what f32 positions can tell apart.
pub const TIE: f64 = 1e-9;

/// Below this share |N·d| / (|N| |d|) a path is [near a caustic](Path::near_caustic): an image moves a hundred times as far
/// across T(λ) as its point, so that what f32 meshes leave open (1e-7) may be seen (1e-5). Untuned.
pub const NEAR_CAUSTIC: f64 = 1e-2;

/// What stands in the way of a leg of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Occluder {
    /// Nothing.
    #[default]
    None,
    /// A mirror (perhaps also an object).
    Mirror,
    /// An object.
    Object,
}

/// Where on the mirror the path's point comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Refinement {
    /// From the camera: rays interpolated over a flat triangle.
    #[default]
    Camera,
    /// From the smooth surface.
    Surface,
    /// From the camera: on the smooth surface no path was found nearby.
    Failed,
}

/// One way of light from the eye E over a mirror point P to the point Q.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path {
    /// Index of the mirror.
    pub mirror: u32,
    /// Index of the triangle in that mirror's mesh.
    pub triangle: u32,
    /// Barycentrics of P in that triangle, of the camera's image; at least -[`TIE`], and their sum is 1.
    pub weights: [f64; 3],
    /// P, world space.
    pub mirror_point: DVec3,
    /// Ray parameter of the camera's image: Q = v(w) + λ d(w).
    pub lambda: f64,
    /// |EP| + |PQ|, world units.
    pub length: f64,
    /// The determinant N(λ)·d(w) of (b2, b3, λ) ↦ Q; 0 on the caustic.
    pub det_j: f64,
    /// |N·d| / (|N| |d|): sine of the angle between the ray and T(λ).
    pub caustic_sine: f64,
    /// By how much the ray that the smooth surface (its interpolated normals, or its own after a refinement) reflects at P
    /// misses Q, world units: 0 for an exact path.
    pub miss: f64,
    /// What is in the way from E to P.
    pub eye_leg: Occluder,
    /// What is in the way from P to Q.
    pub point_leg: Occluder,
    /// Where P comes from.
    pub refinement: Refinement,
}

impl Path {
    /// 1 for an image that is mirrored as by a plane mirror, -1 for one that is mirrored once more; 0 on the caustic.
    pub fn parity(&self) -> i8 {
        i8::from(self.det_j > 0.0) - i8::from(self.det_j < 0.0)
    }

    /// Whether the point is where the mirror focuses light, see [`NEAR_CAUSTIC`].
    pub fn near_caustic(&self) -> bool {
        self.caustic_sine < NEAR_CAUSTIC
    }

    /// Whether something is in the way on either leg.
    pub fn is_occluded(&self) -> bool {
        self.eye_leg != Occluder::None || self.point_leg != Occluder::None
    }

    /// Unit directions from `eye` to P and from P to `point`; all world space. Zero for a leg without length.
    pub fn directions(&self, eye: DVec3, point: DVec3) -> [DVec3; 2] {
        [self.mirror_point - eye, point - self.mirror_point].map(DVec3::normalize_or_zero)
    }

    /// Where a range sensor at `eye` that takes the way for straight would see the point: E + unit(P - E)·(|EP| + |PQ|),
    /// world space.
    pub fn ghost(&self, eye: DVec3) -> DVec3 {
        eye + (self.mirror_point - eye).normalize_or_zero() * self.length
    }
}
