//! The one shading function of every method, and the sun's visibility that is baked into surfels.
//!
//! radiance = albedo · (ambient + max(n·l, 0) · sun · visibility). Surfaces are one-sided: the given normal
//! decides, so the inside of an open mesh has ambient light only.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use crate::accel::triangle_bvh::{CHUNK, Obstacle, Ray, TriangleBvh};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::{Similarity, Surfels};
use crate::scene::description::Light;

/// Radiance (linear RGB) of a diffuse surface with this reflectance and unit normal (world axes).
pub fn shade(albedo: Vec3, normal: Vec3, sun_visible: bool, light: &Light) -> Vec3 {
    let lit = if sun_visible { normal.dot(light.to_sun).max(0.0) } else { 0.0 };
    albedo * (light.ambient + light.sun * lit)
}

/// Surfels a task and between two reports.
const BLOCK: usize = 64 * CHUNK;

/// Sets the radiance of the surfels in `range`, which belong to an object that `to_scene` takes to scene space,
/// with `occluders` between them and the sun. Detail that is smaller than a surfel, or than `detail` (scene units), casts no
/// shadow on it. Fastest if surfels that follow each other are close.
///
/// # Errors
/// [`crate::Error::Cancelled`].
///
/// # Panics
/// If there are no such surfels.
pub fn bake(
    surfels: &mut Surfels,
    range: Range<usize>,
    to_scene: &Similarity,
    detail: f32,
    occluders: &TriangleBvh,
    light: &Light,
    cx: &Context,
) -> Result<()> {
    let count = range.len().max(1);
    let sun = Sun::new(occluders, light);
    let Surfels { x, y, z, normals, albedo, radiance, extent } = surfels;
    for start in range.clone().step_by(BLOCK) {
        cx.step("shading", (start - range.start) as f64 / count as f64)?;
        let block = start..(start + BLOCK).min(range.end);
        radiance[block.clone()].par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, radiance)| {
            let first = block.start + chunk * CHUNK;
            let points: Vec<SurfacePoint> = (first..first + radiance.len())
                .map(|i| SurfacePoint {
                    position: place(to_scene, Vec3::new(x[i], y[i], z[i])),
                    normal: to_scene.direction(normals[i].as_dvec3()).as_vec3(),
                    extent: (extent[i] * scale_of(to_scene)).max(detail),
                })
                .collect();
            for ((i, radiance), visible) in (first..).zip(radiance).zip(sun.visible(&points)) {
                *radiance = shade(albedo[i], points[i - first].normal, visible, light);
            }
        });
    }
    cx.step("shading", 1.0)
}

fn place(to_scene: &Similarity, point: Vec3) -> Vec3 {
    to_scene.point(point.as_dvec3()).as_vec3()
}

#[expect(clippy::cast_possible_truncation, reason = "lengths are f32 everywhere")]
fn scale_of(to_scene: &Similarity) -> f32 {
    to_scene.scale as f32
}

impl SurfacePoint {
    /// Where shadows are asked for, as far as its own extent says.
    pub fn lifted(&self) -> Vec3 {
        self.position + self.normal * (LIFT * self.extent)
    }
}

/// A point of a surface, as the shadow rays need it.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Scene space.
    pub position: Vec3,
    /// Unit, the smooth one, world axes.
    pub normal: Vec3,
    /// Size of the smallest detail that is of interest, scene units: a surfel's extent; 0 if unknown.
    pub extent: f32,
}

/// What the sun sees of a scene.
pub struct Sun<'a> {
    occluders: &'a TriangleBvh,
    to_sun: Vec3,
    /// Distance that rounding cannot bridge, scene units.
    pub(crate) apart: f32,
}

/// Rounding of positions in units of the scene's size, with a margin of ten.
const APART: f32 = 2e-6;

/// The squares that stand for points overlap each other: where their normals are estimated, up to about an extent
/// off the surface (looked at on scans). So detail smaller than this times an extent casts none.
pub const CLOUD_ROUGHNESS: f32 = 1.0 / LIFT;

/// Shadow rays start this part of a surfel's extent off the surface: detail finer than a surfel casts none.
const LIFT: f32 = 0.1;

/// A smooth surface made of flat triangles shadows itself by mistake only where the sun stands lower over it than
/// this (as n·l): the normal of an eight-sided cylinder turns by less within a side.
pub(crate) const TERMINATOR: f32 = 0.5;

/// The surface itself is at most this number of triangles away.
pub(crate) const NEIGHBORHOOD: f32 = 2.0;

/// Triangles that may be passed on the way out of the surface itself.
pub(crate) const PASSES: usize = 8;

impl<'a> Sun<'a> {
    /// The light's sun behind these occluders.
    pub fn new(occluders: &'a TriangleBvh, light: &Light) -> Self {
        let bounds = occluders.bounds();
        let size = if bounds.is_empty() {
            0.0
        } else {
            bounds.diagonal().max(bounds.min.abs().max(bounds.max.abs()).max_element())
        };
        Self { occluders, to_sun: light.to_sun, apart: APART * size }
    }

    /// Whether the sun lights each point. Points that face away from it are not lit.
    pub fn visible(&self, points: &[SurfacePoint]) -> Vec<bool> {
        let rays: Vec<Ray> = points.iter().map(|point| self.shadow_ray(point)).collect();
        let mut obstacles = vec![None; points.len()];
        self.occluders.obstacles_in_turn(&rays, &mut obstacles);
        let lit = |((point, ray), obstacle): ((&SurfacePoint, &Ray), Option<Obstacle>)| {
            point.normal.dot(self.to_sun) > 0.0
                && obstacle
                    .is_none_or(|o| self.is_itself(point, &o) && self.only_itself(point, *ray))
        };
        points.iter().zip(&rays).zip(obstacles).map(lit).collect()
    }

    /// Whether the sun lights one point.
    #[inline(always)]
    pub fn visible_from(&self, point: &SurfacePoint) -> bool {
        let facing = point.normal.dot(self.to_sun);
        let ray = self.shadow_ray(point);
        facing > 0.0
            && (!self.occluders.occluded(ray.origin, ray.direction, ray.t_min, ray.t_max)
                || (facing < TERMINATOR && self.only_itself(point, ray)))
    }

    /// From a little above the surface to the sun; an empty one for a point that faces away.
    fn shadow_ray(&self, point: &SurfacePoint) -> Ray {
        let faces = point.normal.dot(self.to_sun) > 0.0;
        Ray {
            origin: point.position + point.normal * self.lift(point),
            direction: self.to_sun,
            t_min: 0.0,
            t_max: if faces { f32::INFINITY } else { -1.0 },
        }
    }

    /// How far above the surface a shadow ray starts.
    fn lift(&self, point: &SurfacePoint) -> f32 {
        self.apart.max(LIFT * point.extent)
    }

    /// Whether an obstacle belongs to the faceted surface that the point is on. Such facets would shade those beside
    /// the shadow's edge as a whole, where the smooth surface is lit (cf. Hanika 2021). They are close in
    /// their own measure, grazed by the light, and as far below the point as a surface gets by bending from
    /// the point's normal to theirs; a plate above the ground is not.
    fn is_itself(&self, point: &SurfacePoint, obstacle: &Obstacle) -> bool {
        let [a, b, c] = obstacle.corners;
        let edge = (b - a).length().max((c - b).length()).max((a - c).length());
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { return false };
        let bend = normal.cross(point.normal).length();
        let away = normal.dot(point.position - a).abs();
        point.normal.dot(self.to_sun) < TERMINATOR
            && normal.dot(self.to_sun).abs() < TERMINATOR
            && obstacle.t < NEIGHBORHOOD * edge
            && away < 0.75 * NEIGHBORHOOD * edge * bend + 2.0 * self.lift(point)
    }

    /// Whether all that a ray meets is the surface that it starts from.
    fn only_itself(&self, point: &SurfacePoint, mut ray: Ray) -> bool {
        for _ in 0..PASSES {
            match self.occluders.closest_obstacle(&ray) {
                None => return true,
                Some(obstacle) if !self.is_itself(point, &obstacle) => return false,
                Some(obstacle) => ray.t_min = obstacle.t + self.apart,
            }
        }
        false
    }
}

#[cfg(test)]
#[path = "shade_tests.rs"]
mod tests;
