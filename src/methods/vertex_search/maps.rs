//! Reflector maps from meshes: a ray for every texel.

use glam::Vec3;
use rayon::prelude::*;

use super::parts::Shape;
use crate::accel::{Ray, TriangleBvh};
use crate::camera::reflector::ReflectorMap;
use crate::camera::reflector::cube::directions;
use crate::plan::search::ReflectorPart;
use crate::scene::prepared::PreparedScene;

/// Points of the surface that say how it goes on where it is open.
const MOST_KNOWN: usize = 4_096;

/// Maps a part of a mirror.
pub(super) fn reflector(
    scene: &PreparedScene,
    mirror: usize,
    shape: &Shape,
    side: u32,
) -> ReflectorPart {
    let center = shape.center.point.as_vec3();
    let surface = surface(shape, center, side);
    let first = scene.mirrors[mirror].first_triangle;
    ReflectorPart {
        name: shape.name.clone(),
        mirror,
        triangles: first + shape.triangles.start..first + shape.triangles.end,
        center,
        map: ReflectorMap::new(side, &surface, shape.center.inward),
        bend: shape.bend,
    }
}

/// The radius and the unit normal in every direction of a map.
pub(super) fn surface(shape: &Shape, center: Vec3, side: u32) -> Vec<(f32, Vec3)> {
    let relative: Vec<[Vec3; 3]> =
        shape.corners.iter().map(|corners| corners.map(|c| c - center)).collect();
    let bvh = TriangleBvh::build(&relative);
    let directions = directions(side);
    let rays: Vec<Ray> = directions.par_iter().map(|&d| Ray::new(Vec3::ZERO, d)).collect();
    let mut hits = vec![None; rays.len()];
    bvh.trace_closest(&rays, &mut hits);
    let of_hit = |hit: crate::accel::Hit| {
        let [a, b, c] = shape.normals[hit.triangle as usize];
        let [u, v, w] = hit.barycentrics;
        (hit.t, (a * u + b * v + c * w).normalize_or(Vec3::Y))
    };
    let known: Vec<(Vec3, Vec3)> = known(shape, &relative);
    hits.into_par_iter()
        .zip(&directions)
        .map(|(hit, &direction)| {
            hit.map_or_else(|| beyond(&known, direction, shape.center.inward), of_hit)
        })
        .collect()
}

/// Some of the surface's corners with their normals, relative to the centre.
fn known(shape: &Shape, relative: &[[Vec3; 3]]) -> Vec<(Vec3, Vec3)> {
    let every = relative.len().div_ceil(MOST_KNOWN).max(1);
    let all = relative.iter().zip(&shape.normals).step_by(every);
    all.map(|(corners, normals)| (corners[0], normals[0])).collect()
}

/// How an open surface goes on in a direction that it leaves free: the tangent planes of its points, the nearest most. So a
/// search may cross its edge and come back.
fn beyond(known: &[(Vec3, Vec3)], direction: Vec3, inward: bool) -> (f32, Vec3) {
    /// Planes that are seen nearer to edge-on than this (a cosine) say nothing.
    const LEAST: f32 = 0.3;
    let (mut weights, mut radius, mut normal) = (0.0, 0.0, Vec3::ZERO);
    for &(point, n) in known {
        let length = point.length();
        let apart = 1.0 - point.dot(direction) / length.max(f32::MIN_POSITIVE);
        let weight = 1.0 / (apart * apart * apart + 1e-9);
        let along = n.dot(direction) * if inward { -1.0 } else { 1.0 };
        let plane = (n.dot(point) / n.dot(direction)).abs();
        let r = if along > LEAST { plane.min(2.0 * length) } else { length };
        weights += weight;
        radius += weight * r;
        normal += n * weight;
    }
    let facing = if inward { -direction } else { direction };
    let normal = normal.normalize_or(facing);
    // Seen from the centre, a map has one side.
    let normal = if normal.dot(facing) > 0.0 { normal } else { facing };
    (radius / weights, normal)
}
