//! Which side of an oriented piece is its outside.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::neighbors::Neighbors;

/// Above this, normals point away from the middle of a piece rather than towards it, and it has an inside, open or closed.
const CONVEX: f64 = 0.1;
/// Above this part of their length, the normals of a piece do not sum up to zero as those of a closed surface do.
const OPEN: f64 = 0.3;

/// What is known of a piece.
#[derive(Default)]
struct Piece {
    area: f64,
    middle: DVec3,
    normal: DVec3,
    /// Sum of area times distance from the middle, and the same along the normals.
    away: f64,
    along: f64,
}

/// Turns each piece outward: closed ones away from their middle, as their volume tells; open sheets towards `up`.
pub(super) fn outward(
    positions: &[Vec3],
    normals: &mut [Vec3],
    neighbors: &Neighbors,
    pieces: &[u32],
    up: Vec3,
) {
    // In proportion to a point's share of the area.
    let area = |i: usize| match neighbors.of(i).last() {
        Some(&j) => f64::from(positions[i].distance_squared(positions[j as usize])),
        None => 1.0,
    };
    let areas: Vec<f64> = (0..positions.len()).into_par_iter().map(area).collect();
    let mut found: BTreeMap<u32, Piece> = BTreeMap::new();
    for (i, &piece) in pieces.iter().enumerate() {
        let piece = found.entry(piece).or_default();
        let area = areas[i];
        piece.area += area;
        piece.middle += positions[i].as_dvec3() * area;
        piece.normal += normals[i].as_dvec3() * area;
    }
    for piece in found.values_mut() {
        piece.middle /= piece.area.max(f64::MIN_POSITIVE);
    }
    for (i, id) in pieces.iter().enumerate() {
        let Some(piece) = found.get_mut(id) else { continue };
        let from_middle = positions[i].as_dvec3() - piece.middle;
        piece.away += areas[i] * from_middle.length();
        piece.along += areas[i] * from_middle.dot(normals[i].as_dvec3());
    }
    let turned = |piece: &Piece| {
        let is_sheet =
            piece.along.abs() < CONVEX * piece.away && piece.normal.length() > OPEN * piece.area;
        if is_sheet { piece.normal.dot(up.as_dvec3()) < 0.0 } else { piece.along < 0.0 }
    };
    let turned: BTreeMap<u32, bool> =
        found.iter().map(|(&id, piece)| (id, turned(piece))).collect();
    for (normal, id) in normals.iter_mut().zip(pieces) {
        if turned.get(id) == Some(&true) {
            *normal = -*normal;
        }
    }
}
