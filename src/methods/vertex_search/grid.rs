//! The interpolation grid of Estalella et al. 2005, section 5.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use crate::geometry::Aabb;
use crate::plan::search::Grid;

/// A grid about `vertices` with about `share` as many cells as there are vertices, nearly cubic ones; only those that hold
/// a vertex have corners.
pub(super) fn grid(vertices: &[Vec3], share: f64) -> Grid {
    let bounds = Aabb::of(vertices.iter().copied());
    if bounds.is_empty() {
        return Grid::default();
    }
    let cells = cells(bounds, (vertices.len() as f64 * share).max(1.0));
    let extent = (bounds.max - bounds.min).max(Vec3::splat(f32::MIN_POSITIVE));
    let mut corners: BTreeMap<[u32; 3], u32> = BTreeMap::new();
    let mut grid = Grid::default();
    for &vertex in vertices {
        let (mut cell, mut place) = ([0; 3], [0.0; 3]);
        for k in 0..3 {
            let along = (vertex[k] - bounds.min[k]) / extent[k] * cells[k] as f32;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
            let at = along.floor().clamp(0.0, (cells[k] - 1) as f32) as u32;
            (cell[k], place[k]) = (at, along - at as f32);
        }
        let corner = |i: u32| {
            let at = [cell[0] + (i & 1), cell[1] + (i >> 1 & 1), cell[2] + (i >> 2 & 1)];
            *corners.entry(at).or_insert_with(|| {
                let share = Vec3::from_array([0, 1, 2].map(|k| at[k] as f32 / cells[k] as f32));
                grid.corners.push(bounds.min + extent * share);
                u32::try_from(grid.corners.len() - 1).expect("fewer than 2^32 corners")
            })
        };
        let own = [0, 1, 2, 3, 4, 5, 6, 7].map(corner);
        grid.vertices.push((own, place));
    }
    grid
}

/// How many cells each side of a box is cut into, about `wanted` in all.
fn cells(bounds: Aabb, wanted: f64) -> [u32; 3] {
    let sides = (bounds.max - bounds.min).as_dvec3();
    // A flat object has one layer of cells.
    let thin = 1e-3 * sides.max_element();
    let wide = sides.to_array().into_iter().filter(|&side| side > thin).count().max(1);
    let volume: f64 = sides.to_array().into_iter().filter(|&side| side > thin).product();
    let edge = (volume / wanted).powf(1.0 / wide as f64).max(f64::MIN_POSITIVE);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let count = |side: f64| (side / edge).round().clamp(1.0, 4096.0) as u32;
    let DVec3 { x, y, z } = sides;
    [count(x), count(y), count(z)]
}
