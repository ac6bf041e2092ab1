//! Whether a surface is star-shaped, and the point that sees all of it.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::geometry::Aabb;

/// A point from which every ray meets a surface once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Center {
    pub(super) point: DVec3,
    /// The mirror side faces the point.
    pub(super) inward: bool,
    /// Least cosine between a triangle's normal and the rays to its corners: how far from edge-on the surface is seen.
    pub(super) cosine: f64,
}

/// Triangles that a search looks at; all of them decide in the end.
const SAMPLE: usize = 2_000;
/// Rounds in which triangles that were overlooked join the sample.
const ROUNDS: usize = 6;

/// What is seen nearer to edge-on from the centre than this (a cosine) has too few texels to be searched on. The knob of the
/// teapot's lid, whose neck hides it from below, is.
const LEAST_COSINE: f64 = 0.05;

/// See [`center`].
const HOLLOW_MARGIN: f64 = 0.1;

/// A triangle's plane and its farthest corner decide.
struct Face {
    normal: DVec3,
    corners: [DVec3; 3],
}

/// Finds the centre for triangles that are counter-clockwise seen from the mirror side; `None` if some of them turn another
/// side to every point near the surface, or there are none.
pub(super) fn center(triangles: &[[Vec3; 3]]) -> Option<Center> {
    let faces: Vec<Face> = triangles
        .iter()
        .filter_map(|corners| {
            let corners = corners.map(|c| c.as_dvec3());
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            Some(Face { normal: normal.try_normalize()?, corners })
        })
        .collect();
    if faces.is_empty() {
        return None;
    }
    let bounds = Aabb::of(triangles.iter().flatten().copied());
    let [out, within] = [false, true].map(|inward| sided(&faces, bounds, inward));
    // A flat mirror is seen as well from before as from behind: only a hollow one is better seen from before.
    let best = if within.cosine > out.cosine + HOLLOW_MARGIN { within } else { out };
    (best.cosine > LEAST_COSINE).then_some(best)
}

/// The best centre for one side.
fn sided(faces: &[Face], bounds: Aabb, inward: bool) -> Center {
    let mut sample: Vec<&Face> = faces.iter().step_by(faces.len().div_ceil(SAMPLE)).collect();
    let mut best = Center { point: DVec3::ZERO, inward, cosine: f64::NEG_INFINITY };
    let mut start: Option<DVec3> = None;
    for _ in 0..ROUNDS {
        let point = climb(&sample, bounds, inward, start);
        let value = |face: &&Face| cosine(face, point, inward);
        let cosine = faces.par_iter().map(|f| value(&f)).reduce(|| f64::INFINITY, f64::min);
        if cosine > best.cosine {
            best = Center { point, inward, cosine };
        }
        let seen = sample.iter().map(value).fold(f64::INFINITY, f64::min);
        if cosine >= seen - 1e-3 {
            break;
        }
        let overlooked = faces.iter().filter(|f| value(f) < seen);
        sample.extend(overlooked.take(SAMPLE));
        start = Some(point);
    }
    best
}

/// How far from edge-on a face is seen; negative from its other side.
fn cosine(face: &Face, point: DVec3, inward: bool) -> f64 {
    let along = face.normal.dot(face.corners[0] - point);
    let far = face.corners.iter().map(|c| c.distance(point)).fold(0.0, f64::max);
    let cosine = along / far.max(f64::MIN_POSITIVE);
    if inward { -cosine } else { cosine }
}

/// Hill climbing from the best point of a coarse grid, over the box and a quarter of its diagonal around it.
fn climb(sample: &[&Face], bounds: Aabb, inward: bool, start: Option<DVec3>) -> DVec3 {
    let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
    let diagonal = (max - min).length();
    let (low, high) = (min - 0.25 * diagonal, max + 0.25 * diagonal);
    let value =
        |p: DVec3| sample.iter().map(|face| cosine(face, p, inward)).fold(f64::INFINITY, f64::min);
    let number = |k: i32| f64::from(k) / 4.0;
    let at =
        |i: i32, j: i32, k: i32| low + (high - low) * DVec3::new(number(i), number(j), number(k));
    let grid = (0..125).map(|n| at(n % 5, n / 5 % 5, n / 25));
    let candidates: Vec<DVec3> = start.map_or_else(|| grid.collect(), |p| vec![p]);
    let values: Vec<f64> = candidates.par_iter().map(|&p| value(p)).collect();
    let first = (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0);
    let (mut best, mut most) = (candidates[first], values[first]);
    let mut step = 0.15 * diagonal;
    while step > 1e-4 * diagonal {
        let moves = (0..27).filter(|&n| n != 13).map(|n: i32| {
            DVec3::new(f64::from(n % 3 - 1), f64::from(n / 3 % 3 - 1), f64::from(n / 9 - 1))
        });
        let nearby: Vec<DVec3> = moves.map(|m| (best + m * step).clamp(low, high)).collect();
        let values: Vec<f64> = nearby.par_iter().map(|&p| value(p)).collect();
        let next = (0..26).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0);
        if values[next] > most {
            (best, most) = (nearby[next], values[next]);
        } else {
            step *= 0.5;
        }
    }
    best
}
