//! The nearest neighbours of every point.

use std::num::NonZero;

use glam::{Mat3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::stage::Stage;
use crate::error::{Error, Result};
use crate::scene::sample::index;

/// For every point the same number of neighbours, nearest first, not itself.
pub(super) struct Neighbors {
    each: usize,
    ids: Vec<u32>,
}

/// A turn about no axis in particular: the tree halves by coordinates and cannot part points that have one in common, like
/// those of a floor or of a grid.
fn turn() -> Mat3 {
    Mat3::from_axis_angle(Vec3::new(0.6, 0.64, -0.48), 1.0)
}

impl Neighbors {
    /// Finds `each` neighbours, or all others where there are fewer points.
    pub(super) fn find(positions: &[Vec3], each: usize, stage: Stage<'_>) -> Result<Self> {
        stage.step(0.0)?;
        let each = each.min(positions.len().saturating_sub(1));
        let Some(asked) = NonZero::new(each + 1).filter(|_| each > 0) else {
            return Ok(Self { each: 0, ids: Vec::new() });
        };
        let turn = turn();
        let turned: Vec<[f32; 3]> = positions.par_iter().map(|&p| (turn * p).to_array()).collect();
        let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&turned);
        let tree = tree.map_err(|e| Error::input("points", "", e.to_string(), "give fewer"))?;
        drop(turned);
        let mut ids = vec![0; each * positions.len()];
        stage.rows(&mut ids, each, |i, ids| {
            let query = (turn * positions[i]).to_array();
            let found = tree.query(&query).nearest_n::<SquaredEuclidean<f32>>(asked).execute();
            let others = found.iter().map(|n| n.item).filter(|&n| n as usize != i);
            ids.iter_mut().zip(others).for_each(|(id, other)| *id = other);
        })?;
        Ok(Self { each, ids })
    }

    /// Only these points are left, a few less than all: where one of the others was a neighbour, the farthest that is left
    /// stands for it, or the point itself.
    pub(super) fn keep(&mut self, kept: &[u32]) {
        const GONE: u32 = u32::MAX;
        let mut renamed = vec![GONE; self.ids.len().checked_div(self.each).unwrap_or(0)];
        for (new, &old) in kept.iter().enumerate() {
            renamed[old as usize] = index(new);
            let row = old as usize * self.each;
            self.ids.copy_within(row..row + self.each, new * self.each);
        }
        self.ids.truncate(kept.len() * self.each);
        let rows = self.ids.par_chunks_mut(self.each.max(1)).enumerate();
        rows.for_each(|(point, row)| {
            let mut left = 0;
            for k in 0..row.len() {
                let id = renamed[row[k] as usize];
                if id != GONE {
                    row[left] = id;
                    left += 1;
                }
            }
            let last = left.checked_sub(1).map_or(index(point), |last| row[last]);
            row[left..].fill(last);
        });
    }

    /// How many each point has.
    pub(super) fn each(&self) -> usize {
        self.each
    }

    /// Those of point `i`.
    pub(super) fn of(&self, i: usize) -> &[u32] {
        &self.ids[i * self.each..(i + 1) * self.each]
    }
}
