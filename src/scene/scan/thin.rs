//! Fewer points, evenly: dart throwing with a radius that leaves as many as are wanted (Cook 1986).

use std::cmp::Reverse;

use glam::Vec3;
use rayon::prelude::*;

use super::neighbors::Neighbors;
use super::order::{CODE_BITS, codes};
use super::stage::Stage;
use crate::context::Context;
use crate::error::Result;
use crate::scene::sample::{hash, index};

/// Candidates a point that is wanted: the first choice, which halves space, leaves no more than about twice as many.
const CANDIDATES: usize = 4;
/// Neighbours of a candidate that are looked at. Within the radius there are half as many as a rule.
const NEIGHBORS: usize = 24;
/// The number that is found is this near to the one that is wanted.
const TOLERANCE: f64 = 0.005;
/// Halvings of the range of the radius, at most.
const STEPS: u32 = 24;

/// Which of the points stay, in order: at most `most`, and nearly so many. They are sorted along a Morton curve.
pub(super) fn thin(positions: &[Vec3], most: usize, seed: u64, cx: &Context) -> Result<Vec<u32>> {
    let all: Vec<u32> = (0..index(positions.len())).collect();
    if positions.len() <= most {
        return Ok(all);
    }
    let chosen = one_a_cell(positions, most.saturating_mul(CANDIDATES), seed);
    let places: Vec<Vec3> = chosen.par_iter().map(|&i| positions[i as usize]).collect();
    let neighbors = Neighbors::find(&places, NEIGHBORS, Stage::new(cx, super::THINNING, 0.0, 0.7))?;
    let thrower = Thrower { places: &places, neighbors: &neighbors, seed };
    let kept = thrower.search(most, cx)?;
    Ok(kept.into_iter().map(|k| chosen[k as usize]).collect())
}

/// A random point of each cell of a tree that halves space, as deep as gives `least` cells or somewhat more.
fn one_a_cell(positions: &[Vec3], least: usize, seed: u64) -> Vec<u32> {
    let codes = codes(positions);
    // Two neighbours along the curve are in different cells once the cells' codes are longer than what theirs share.
    let mut parted = [0_usize; CODE_BITS as usize + 2];
    for pair in codes.windows(2) {
        let shared = (pair[0] ^ pair[1]).leading_zeros() - (u64::BITS - CODE_BITS);
        parted[shared as usize + 1] += 1;
    }
    let mut cells = 1;
    let depth = parted.iter().position(|parted| {
        cells += parted;
        cells >= least
    });
    let Some(depth) = depth.filter(|&depth| depth <= CODE_BITS as usize) else {
        return (0..index(positions.len())).collect();
    };
    let cell = |i: usize| codes[i].checked_shr(CODE_BITS - index(depth)).unwrap_or(0);
    let mut chosen: Vec<u32> = Vec::new();
    let mut last = None;
    for i in 0..positions.len() {
        let (this, at) = (cell(i), index(i));
        let luck = |i: u32| hash(seed ^ u64::from(i));
        match chosen.last_mut() {
            Some(best) if last == Some(this) => {
                if luck(at) > luck(*best) {
                    *best = at;
                }
            }
            _ => chosen.push(at),
        }
        last = Some(this);
    }
    chosen
}

/// Throws darts at candidates.
struct Thrower<'a> {
    places: &'a [Vec3],
    neighbors: &'a Neighbors,
    seed: u64,
}

#[derive(Clone, Copy, PartialEq)]
enum Fate {
    Open,
    Kept,
    Refused,
}

impl Thrower<'_> {
    /// The candidates that stay with the radius that leaves `most`, or nearly.
    fn search(&self, most: usize, cx: &Context) -> Result<Vec<u32>> {
        let farthest = |i: usize| self.distance_squared(i, self.neighbors.of(i).last().copied());
        let farthest = (0..self.places.len()).into_par_iter().map(farthest);
        let (mut low, mut high) = (0.0, f64::from(farthest.reduce(|| 0.0, f32::max)).sqrt());
        let mut best: Option<Vec<u32>> = None;
        for step in 0..STEPS {
            cx.step(super::THINNING, 0.7 + 0.3 * f64::from(step) / f64::from(STEPS))?;
            // Once both ends are near, numbers go with the inverse square.
            let radius = if low > 0.0 { (low * high).sqrt() } else { high / 16.0 };
            let kept = self.throw(radius);
            if kept.len() > most {
                low = radius;
            } else {
                high = radius;
                let is_near = kept.len() as f64 >= (1.0 - TOLERANCE) * most as f64;
                best = Some(kept);
                if is_near {
                    break;
                }
            }
        }
        // No radius within what the neighbours tell leaves so few: the luckiest stay.
        Ok(best.unwrap_or_else(|| {
            let mut all: Vec<u32> = (0..index(self.places.len())).collect();
            all.sort_unstable_by_key(|&i| Reverse(self.luck(i)));
            all.truncate(most);
            all.sort_unstable();
            all
        }))
    }

    /// Goes through the candidates by luck and keeps those that are `radius` from all kept before. A candidate is decided once
    /// the luckier ones around it are, so many are at the same time, and the result is that of one after the other.
    fn throw(&self, radius: f64) -> Vec<u32> {
        #[expect(clippy::cast_possible_truncation, reason = "rounded")]
        let near = (radius * radius) as f32;
        let mut fates = vec![Fate::Open; self.places.len()];
        let mut open: Vec<u32> = (0..index(self.places.len())).collect();
        while !open.is_empty() {
            let decided: Vec<Fate> =
                open.par_iter().map(|&i| self.decide(i as usize, near, &fates)).collect();
            for (&i, &fate) in open.iter().zip(&decided) {
                fates[i as usize] = fate;
            }
            open.retain(|&i| fates[i as usize] == Fate::Open);
        }
        (0..index(fates.len())).filter(|&i| fates[i as usize] == Fate::Kept).collect()
    }

    fn decide(&self, i: usize, near: f32, fates: &[Fate]) -> Fate {
        let own = self.luck(index(i));
        let mut fate = Fate::Kept;
        for &j in self.neighbors.of(i) {
            if self.distance_squared(i, Some(j)) >= near {
                break;
            }
            match fates[j as usize] {
                Fate::Kept => return Fate::Refused,
                Fate::Open if self.luck(j) > own => fate = Fate::Open,
                Fate::Open | Fate::Refused => {}
            }
        }
        fate
    }

    fn distance_squared(&self, i: usize, j: Option<u32>) -> f32 {
        j.map_or(0.0, |j| self.places[j as usize].distance_squared(self.places[i]))
    }

    /// Different for all.
    fn luck(&self, i: u32) -> u64 {
        hash(self.seed.wrapping_add(u64::from(i)))
    }
}
