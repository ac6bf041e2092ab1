//! Normals without a sign: the direction in which the neighbours of a point vary least.

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::neighbors::Neighbors;
use super::stage::Stage;
use crate::error::Result;

/// Fits a plane to each point and its neighbours (Hoppe et al. 1992), the near ones with more weight.
pub(super) fn estimate(
    positions: &[Vec3],
    neighbors: &Neighbors,
    stage: Stage<'_>,
) -> Result<Vec<Vec3>> {
    let normal = |i: usize| {
        let at = positions[i];
        let near = neighbors.of(i);
        let reach = reach_squared(positions, near, at);
        let points = near.iter().map(|&j| {
            let to = positions[j as usize] - at;
            (to, 1.0 - to.length_squared() / reach)
        });
        flattest(points)
    };
    stage.map(positions.len(), normal)
}

/// Fits again, and leaves out neighbours whose normal says that they are on another side of an edge or of a thin sheet.
pub(super) fn refine(
    positions: &[Vec3],
    normals: &[Vec3],
    neighbors: &Neighbors,
    stage: Stage<'_>,
) -> Result<Vec<Vec3>> {
    let normal = |i: usize| {
        let (at, own) = (positions[i], normals[i]);
        let near = neighbors.of(i);
        let reach = reach_squared(positions, near, at);
        let points = near.iter().map(|&j| {
            let to = positions[j as usize] - at;
            let alike = own.dot(normals[j as usize]).max(0.0);
            (to, (1.0 - to.length_squared() / reach) * alike.powi(ALIKE_POWER))
        });
        let found = flattest(points);
        if found.dot(own) < 0.0 { -found } else { found }
    };
    stage.map(positions.len(), normal)
}

/// Makes given normals unit; where one has no direction, it becomes that of the next point that has. `false` if there are none,
/// or fewer than half of them have a direction.
pub(super) fn complete(normals: &mut [Vec3]) -> bool {
    let is_unit = |n: &Vec3| *n != Vec3::ZERO;
    normals.par_iter_mut().for_each(|n| {
        *n = n.as_dvec3().try_normalize().unwrap_or_default().as_vec3();
    });
    let good = normals.par_iter().filter(|n| is_unit(n)).count();
    if normals.is_empty() || 2 * good < normals.len() {
        return false;
    }
    // The points are in the order of a curve through space: the last good one is near.
    let mut last = normals.iter().copied().find(is_unit).unwrap_or(Vec3::Y);
    for normal in normals {
        if is_unit(normal) {
            last = *normal;
        }
        *normal = last;
    }
    true
}

/// How fast the weight falls as normals part. Measured: on scans, from 1 to 4 it makes little difference; 4 keeps sharp edges.
const ALIKE_POWER: i32 = 4;
/// Weights reach zero a little beyond the farthest neighbour (squared). Measured: both 1.05 and 2 are a little worse.
const BEYOND: f32 = 1.2;

fn reach_squared(positions: &[Vec3], near: &[u32], at: Vec3) -> f32 {
    let farthest = near.iter().map(|&j| positions[j as usize].distance_squared(at));
    (farthest.fold(0.0, f32::max) * BEYOND).max(f32::MIN_POSITIVE)
}

/// The direction across which weighted points around zero, and zero itself, vary least; unit.
fn flattest(points: impl Iterator<Item = (Vec3, f32)> + Clone) -> Vec3 {
    // Squares of small distances vanish in f32.
    let points = points.map(|(p, weight)| (p.as_dvec3(), f64::from(weight)));
    let (mut sum, mut total) = (DVec3::ZERO, 1.0);
    for (p, weight) in points.clone() {
        sum += p * weight;
        total += weight;
    }
    let mean = sum / total;
    let mut spread = square(mean, 1.0);
    for (p, weight) in points {
        spread += square(p - mean, weight);
    }
    least_eigenvector(spread).as_vec3().try_normalize().unwrap_or(Vec3::Y)
}

fn square(v: DVec3, weight: f64) -> DMat3 {
    let w = v * weight;
    DMat3::from_cols(v * w.x, v * w.y, v * w.z)
}

/// The eigenvector of the least eigenvalue of a symmetric matrix; any of them where several are least.
fn least_eigenvector(m: DMat3) -> DVec3 {
    let largest = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.abs().max_element());
    let largest = largest[0].max(largest[1]).max(largest[2]);
    if largest <= 0.0 {
        return DVec3::Y;
    }
    let m = m * largest.recip();
    // The trigonometric solution of the characteristic equation (Smith 1961).
    let mean = (m.x_axis.x + m.y_axis.y + m.z_axis.z) / 3.0;
    let centered = m - DMat3::from_diagonal(DVec3::splat(mean));
    let [a, b, c] = [centered.x_axis, centered.y_axis, centered.z_axis];
    let scale = ((a.length_squared() + b.length_squared() + c.length_squared()) / 6.0).sqrt();
    if scale <= 1e-12 {
        return DVec3::Y;
    }
    let half_det = (centered.determinant() / (2.0 * scale.powi(3))).clamp(-1.0, 1.0);
    let angle = half_det.acos() / 3.0;
    let least = 2.0 * scale * (angle + std::f64::consts::TAU / 3.0).cos();
    let shifted = centered - DMat3::from_diagonal(DVec3::splat(least));
    // Its columns span the plane across the vector: the best conditioned two give it.
    let [a, b, c] = [shifted.x_axis, shifted.y_axis, shifted.z_axis];
    let crosses = [a.cross(b), b.cross(c), c.cross(a)];
    let best = crosses.into_iter().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let best = best.unwrap_or(DVec3::ZERO);
    if best.length_squared() > 1e-24 {
        return best;
    }
    // On a line: anything across it.
    let along =
        [a, b, c].into_iter().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    along.unwrap_or(DVec3::X).any_orthogonal_vector()
}
