//! Signs of normals, so that neighbours agree.

use glam::Vec3;
use rayon::prelude::*;

use super::neighbors::Neighbors;
use crate::context::Context;
use crate::error::Result;
use crate::scene::sample::index;

/// Parts of the cloud that are known to belong together, and on which side each point is of its part's normal.
struct Parts {
    /// A point of the same part, nearer to its root; a root is its own.
    parent: Vec<u32>,
    /// Whether the point's normal has to be turned when the parent's has not.
    turned: Vec<bool>,
}

impl Parts {
    fn new(count: usize) -> Self {
        Self { parent: (0..index(count)).collect(), turned: vec![false; count] }
    }

    /// The root of a point, and whether the point is turned against it.
    fn root(&mut self, point: u32) -> (u32, bool) {
        let (mut at, mut turned) = (point as usize, false);
        while self.parent[at] as usize != at {
            let parent = self.parent[at] as usize;
            // Halves the path.
            self.turned[at] ^= self.turned[parent];
            self.parent[at] = self.parent[parent];
            turned ^= self.turned[at];
            at = self.parent[at] as usize;
        }
        (index(at), turned)
    }

    /// Joins two parts; `against`: whether their points should have opposite signs.
    fn join(&mut self, a: u32, b: u32, against: bool) {
        let ((a, a_turned), (b, b_turned)) = (self.root(a), self.root(b));
        if a != b {
            // The lower one stays: so the result depends on the order of the calls only.
            let (low, high) = (a.min(b), a.max(b));
            self.parent[high as usize] = low;
            self.turned[high as usize] = against ^ a_turned ^ b_turned;
        }
    }
}

/// What speaks for it that two normals agree (positive) or that one has to be turned.
fn vote(from: Vec3, from_normal: Vec3, to: Vec3, to_normal: Vec3) -> i32 {
    let Some(along) = (to - from).try_normalize() else { return 0 };
    // On an arc, the normal at one end is that at the other, mirrored across the chord.
    let mirrored = to_normal - along * (2.0 * along.dot(to_normal));
    let alike = from_normal.dot(mirrored);
    let across = from_normal.dot(along).abs().max(to_normal.dot(along).abs());
    let sure = alike.abs().powi(VOTE_POWER) * (1.0 - ACROSS * across * across);
    #[expect(clippy::cast_possible_truncation, reason = "at most SCALE")]
    {
        (alike * sure * SCALE) as i32
    }
}

const VOTE_POWER: i32 = 3;
const ACROSS: f32 = 0.9;
const SCALE: f32 = (1 << 20) as f32;

/// A pair of parts and the sum of the votes between them.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Link {
    parts: [u32; 2],
    votes: i64,
}

/// Turns normals so that neighbours agree; returns the connected piece of each point as a point of it.
pub(super) fn orient(
    positions: &[Vec3],
    normals: &mut [Vec3],
    neighbors: &Neighbors,
    each: usize,
    cx: &Context,
) -> Result<Vec<u32>> {
    let count = positions.len();
    let mut parts = Parts::new(count);
    let given = &*normals;
    let vote_of = |i: usize, j: u32| {
        let j = j as usize;
        vote(positions[i], given[i], positions[j], given[j])
    };
    // The surest neighbour of each.
    let best = |i: usize| {
        let surest = |&j: &u32| (vote_of(i, j).abs(), std::cmp::Reverse(j));
        neighbors.of(i).iter().take(each).copied().max_by_key(surest)
    };
    let best: Vec<Option<u32>> = (0..count).into_par_iter().map(best).collect();
    for (i, j) in best.into_iter().enumerate() {
        if let Some(j) = j {
            parts.join(index(i), j, vote_of(i, j) < 0);
        }
    }
    let flat: Vec<(u32, bool)> = (0..index(count)).map(|i| parts.root(i)).collect();
    let mut links: Vec<Link> = (0..count)
        .into_par_iter()
        .flat_map_iter(|i| {
            let (flat, vote_of) = (&flat, &vote_of);
            neighbors
                .of(i)
                .iter()
                .take(each)
                .filter_map(move |&j| link(flat, index(i), j, i64::from(vote_of(i, j))))
        })
        .collect();
    drop(flat);
    loop {
        cx.check()?;
        add_up(&mut links);
        if links.is_empty() {
            break;
        }
        let mut surest: Vec<Option<u32>> = vec![None; count];
        for (k, link) in links.iter().enumerate() {
            for part in link.parts {
                let best = &mut surest[part as usize];
                let is_better = |&b: &u32| links[b as usize].votes.abs() < link.votes.abs();
                if best.as_ref().is_none_or(is_better) {
                    *best = Some(index(k));
                }
            }
        }
        for k in surest.into_iter().flatten() {
            let Link { parts: [a, b], votes } = links[k as usize];
            parts.join(a, b, votes < 0);
        }
        let flat: Vec<(u32, bool)> = (0..index(count)).map(|i| parts.root(i)).collect();
        links = links
            .into_par_iter()
            .filter_map(|l| link(&flat, l.parts[0], l.parts[1], l.votes))
            .collect();
    }
    let roots: Vec<(u32, bool)> = (0..index(count)).map(|i| parts.root(i)).collect();
    normals.par_iter_mut().zip(&roots).for_each(|(normal, &(_, turned))| {
        if turned {
            *normal = -*normal;
        }
    });
    Ok(roots.into_iter().map(|(root, _)| root).collect())
}

/// Votes between two points as votes between their parts; `None` within one.
fn link(roots: &[(u32, bool)], a: u32, b: u32, votes: i64) -> Option<Link> {
    let ((a, a_turned), (b, b_turned)) = (roots[a as usize], roots[b as usize]);
    let votes = if a_turned ^ b_turned { -votes } else { votes };
    (a != b).then_some(Link { parts: [a.min(b), a.max(b)], votes })
}

/// One link for each pair of parts.
fn add_up(links: &mut Vec<Link>) {
    links.par_sort_unstable();
    links.dedup_by(|next, kept| {
        let same = next.parts == kept.parts;
        if same {
            kept.votes += next.votes;
        }
        same
    });
}
