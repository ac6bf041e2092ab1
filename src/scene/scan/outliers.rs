//! Points that belong to no surface.

use glam::Vec3;
use rayon::prelude::*;

use super::neighbors::Neighbors;

/// A point is one if its neighbours are so many times as far away as those of its neighbours are. Measured: of evenly random
/// points on planes, edges and corners included, fewer than one in a million is.
const APART: f32 = 3.0;
/// The neighbour that is looked at: as many points may stray together. Fewer are more often apart by chance.
const WHICH: usize = 10;

/// The points that are none, in order. Distances are compared within a neighbourhood only, so density may vary.
pub(super) fn keep(positions: &[Vec3], neighbors: &Neighbors) -> Vec<u32> {
    let which = WHICH.min(neighbors.each());
    let all = 0..crate::scene::sample::index(positions.len());
    if which < WHICH {
        return all.collect();
    }
    let distance = |i: usize| positions[neighbors.of(i)[which - 1] as usize].distance(positions[i]);
    let distances: Vec<f32> = (0..positions.len()).into_par_iter().map(distance).collect();
    let belongs = |i: &u32| {
        let mut around = [0.0; WHICH];
        for (around, &j) in around.iter_mut().zip(neighbors.of(*i as usize)) {
            *around = distances[j as usize];
        }
        around.sort_unstable_by(f32::total_cmp);
        distances[*i as usize] <= APART * around[WHICH / 2]
    };
    all.into_par_iter().filter(belongs).collect()
}
