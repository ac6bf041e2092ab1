//! The caustics of all cameras of an eye: where the mirrors focus its rays.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::MirrorCameras;
use crate::camera::three_ray::caustic::caustic;

/// A strip of the caustic: one mixed interval of one camera.
#[derive(Clone, Debug, PartialEq)]
pub struct CausticStrip {
    /// Index of the mirror triangle over all mirrors.
    pub triangle: u32,
    /// The ends of straight lines on the surface, one behind the other, scene space.
    pub rulings: Vec<[Vec3; 2]>,
    /// The λ of each of them.
    pub lambdas: Vec<f32>,
}

/// The surface that the rays touch; neighbouring cameras' strips continue one another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CausticSurface {
    /// By mirror triangle, then by λ.
    pub strips: Vec<CausticStrip>,
    /// World position of scene space's zero.
    pub origin: DVec3,
}

impl MirrorCameras {
    /// The caustic up to each camera's reach, within 1 % of T(λ)'s longest edge.
    #[expect(clippy::cast_possible_truncation, reason = "for pictures and files")]
    pub fn caustic(&self) -> CausticSurface {
        let of = |camera: &super::FrontCamera| {
            let triangle = camera.triangle;
            let reach = camera.reach;
            let strips = camera.parts().flat_map(move |part| caustic(&part, 0.0, reach));
            strips.map(move |strip| CausticStrip {
                triangle,
                rulings: strip.iter().map(|r| r.points.map(|p| p.as_vec3())).collect(),
                lambdas: strip.iter().map(|r| r.lambda as f32).collect(),
            })
        };
        let strips = self.cameras.par_iter().flat_map_iter(of).collect();
        CausticSurface { strips, origin: self.origin }
    }
}

impl CausticSurface {
    /// Two triangles between neighbouring rulings: the vertices (two a ruling, in order) and their indices.
    pub fn triangles(&self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let rulings = self.strips.iter().map(|strip| strip.rulings.len()).sum::<usize>();
        let mut positions = Vec::with_capacity(2 * rulings);
        let mut triangles = Vec::with_capacity(2 * rulings);
        for strip in &self.strips {
            let first = u32::try_from(positions.len()).expect("fewer than 2^31 rulings");
            positions.extend(strip.rulings.iter().flatten());
            for k in (first..).step_by(2).take(strip.rulings.len().saturating_sub(1)) {
                triangles.extend([[k, k + 1, k + 3], [k, k + 3, k + 2]]);
            }
        }
        (positions, triangles)
    }
}
