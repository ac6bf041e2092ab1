//! How much of the surface each point stands for.

use glam::{Vec2, Vec3};

use super::neighbors::Neighbors;
use super::stage::Stage;
use crate::error::Result;

/// Neighbours of a point on a surface that can bound its cell; farther ones hardly ever do.
const AROUND: usize = 14;
/// The neighbour whose distance bounds a cell on the side where there is none, and tells the density there.
const WHICH: usize = 8;
const BOUND: f32 = 1.2;
/// Normals that are further apart (a cosine) are those of another sheet.
const SAME_SHEET: f32 = 0.3;
/// A disk reaches so much of the way to the farthest corner of its cell. Measured: random points then leave as much of a plane
/// further than 1.3 extents from all of them (2 %) as evenly spread ones with disks of their share of the area do, and the
/// disks of evenly spread ones are that large in the mean.
const REACH: f32 = 0.68;

/// A disk is at most so many times as large as density says: cells at the rim of a surface reach far out.
const MOST: f32 = 1.7;

/// Radii of disks that leave no larger holes between them than those of evenly spread points, each as large as the point's share
/// of the area at least: that of its cell in the Voronoi diagram of its neighbours, seen along the normal.
pub(super) fn extents(
    positions: &[Vec3],
    normals: &[Vec3],
    neighbors: &Neighbors,
    stage: Stage<'_>,
) -> Result<Vec<f32>> {
    let extent = |i: usize| {
        let near = neighbors.of(i);
        let which = WHICH.min(near.len());
        if which == 0 {
            return ALONE;
        }
        let distance = positions[near[which - 1] as usize].distance(positions[i]);
        // As many points as there are, and a half for the one in the middle.
        let by_density = distance / (which as f32 + 0.5).sqrt();
        let normal = normals[i];
        let (right, up) = normal.any_orthonormal_pair();
        let mut cell = Cell::new(BOUND * distance);
        for &j in &near[..near.len().min(AROUND)] {
            let to = positions[j as usize] - positions[i];
            let flat = Vec2::new(to.dot(right), to.dot(up));
            let is_level = flat.length_squared() > to.dot(normal).powi(2);
            if is_level && normal.dot(normals[j as usize]) > SAME_SHEET {
                cell.cut(flat);
            }
        }
        let by_cell = (cell.area() / std::f32::consts::PI).sqrt();
        by_cell.min(by_density).max((REACH * cell.reach()).min(MOST * by_density))
    };
    stage.map(positions.len(), extent)
}

/// Of a point that has no other.
const ALONE: f32 = 0.01;

/// A convex polygon around zero.
struct Cell {
    /// Each with whether the edge to the next one was cut; counterclockwise.
    corners: Vec<(Vec2, bool)>,
    spare: Vec<(Vec2, bool)>,
}

impl Cell {
    /// An octagon.
    fn new(radius: f32) -> Self {
        let corner =
            |k: u8| (Vec2::from_angle(f32::from(k) * std::f32::consts::FRAC_PI_4) * radius, false);
        Self { corners: (0..8).map(corner).collect(), spare: Vec::with_capacity(16) }
    }

    /// Keeps what is nearer to zero than to `other`.
    fn cut(&mut self, other: Vec2) {
        let half = 0.5 * other.length_squared();
        let beyond = |p: Vec2| p.dot(other) - half;
        let corners = &self.corners;
        if corners.iter().all(|c| beyond(c.0) <= 0.0) {
            return;
        }
        self.spare.clear();
        for (k, &(p, is_cut)) in corners.iter().enumerate() {
            let (q, _) = corners[(k + 1) % corners.len()];
            let (from, to) = (beyond(p), beyond(q));
            if from <= 0.0 {
                self.spare.push((p, is_cut));
            }
            if (from <= 0.0) != (to <= 0.0) {
                let crossing = p + (q - p) * (from / (from - to));
                // Where it leaves, the new edge begins.
                self.spare.push((crossing, if from <= 0.0 { true } else { is_cut }));
            }
        }
        std::mem::swap(&mut self.corners, &mut self.spare);
    }

    fn area(&self) -> f32 {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).map(|(p, q)| 0.5 * p.0.perp_dot(q.0)).sum()
    }

    /// Distance of the farthest corner; zero where the cell is open, at the rim of a surface.
    fn reach(&self) -> f32 {
        if !self.corners.iter().all(|c| c.1) {
            return 0.0;
        }
        self.corners.iter().map(|c| c.0.length()).fold(0.0, f32::max)
    }
}
