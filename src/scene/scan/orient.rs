//! Signs of normals, so that neighbours agree.

use std::cmp::Reverse;

use glam::Vec3;
use rayon::prelude::*;

use super::neighbors::Neighbors;
use super::stage::Stage;
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

impl Parts {
    /// The parts numbered from zero: that of each point, and whether the point is turned; and how many there are.
    fn numbered(mut self) -> (Vec<(u32, bool)>, usize) {
        let mut of: Vec<(u32, bool)> =
            (0..index(self.parent.len())).map(|i| self.root(i)).collect();
        let mut count = 0;
        // A root is the lowest of its part: it has its number before the others ask for it.
        for i in 0..of.len() {
            let root = of[i].0 as usize;
            of[i].0 = if root == i { count } else { of[root].0 };
            count += u32::from(root == i);
        }
        (of, count as usize)
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

/// Votes of normals that hardly agree with each other count less by this power. Measured: 1 to 3 are alike, 7 is worse.
const VOTE_POWER: i32 = 2;
/// Part of a vote that is lost where the chord runs along a normal: noise puts points of one sheet above each other, and only
/// where nothing else tells do the two sides of a thin one have a say. Measured: from 0.9 to 0.97 it makes no difference, without
/// it a part in 200 of noisy points is wrong.
const ACROSS: f32 = 0.97;
const SCALE: f32 = (1 << 20) as f32;

/// A pair of parts and the sum of the votes between them.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Link {
    parts: [u32; 2],
    votes: i64,
}

/// Turns normals so that neighbours agree; returns the connected piece of each point.
///
/// Each point joins the neighbour that is surest about it; parts of the cloud then join the part next to them that they have the
/// most votes with, all votes along their border added up, until whole pieces remain. So the strongest of many votes decides
/// between large parts, where the spanning tree of Hoppe et al. (1992) leaves it to the surest pair of points.
///
/// `each`: how many neighbours have a vote.
pub(super) fn orient(
    positions: &[Vec3],
    normals: &mut [Vec3],
    neighbors: &Neighbors,
    each: usize,
    stage: Stage<'_>,
) -> Result<Vec<u32>> {
    let count = positions.len();
    let given = &*normals;
    let vote_of = |i: usize, j: u32| {
        let j = j as usize;
        vote(positions[i], given[i], positions[j], given[j])
    };
    let near = |i: usize| neighbors.of(i).iter().copied().take(each);
    let best = |i: usize| near(i).max_by_key(|&j| (vote_of(i, j).abs(), Reverse(j)));
    let best = Stage { to: 0.7 * stage.from + 0.3 * stage.to, ..stage }.map(count, best)?;
    let mut parts = Parts::new(count);
    for (i, j) in best.into_iter().enumerate() {
        if let Some(j) = j {
            parts.join(index(i), j, vote_of(i, j) < 0);
        }
    }
    let (mut of_points, part_count) = parts.numbered();
    let mut links = Vec::new();
    for start in (0..count).step_by(BLOCK) {
        stage.step(0.3 + 0.6 * start as f64 / count as f64)?;
        let block = start..count.min(start + BLOCK);
        let block = block.into_par_iter().flat_map_iter(|i| {
            let (of_points, vote_of) = (&of_points, &vote_of);
            near(i).filter_map(move |j| link(of_points, [index(i), j], i64::from(vote_of(i, j))))
        });
        let mut block = block.collect();
        add_up(&mut block);
        links.append(&mut block);
    }
    settle(&mut of_points, part_count, links, stage.cx)?;
    normals.par_iter_mut().zip(&of_points).for_each(|(normal, &(_, turned))| {
        if turned {
            *normal = -*normal;
        }
    });
    Ok(of_points.into_iter().map(|(piece, _)| piece).collect())
}

/// Points whose votes are added up at once: those between parts are many, the sums few.
const BLOCK: usize = 1 << 20;

/// Joins parts until there are no votes between them. `of_items`: the part of whatever they consist of, and whether it is turned.
fn settle(
    of_items: &mut [(u32, bool)],
    parts: usize,
    mut links: Vec<Link>,
    cx: &Context,
) -> Result<()> {
    cx.check()?;
    add_up(&mut links);
    if links.is_empty() {
        return Ok(());
    }
    let mut surest = vec![u32::MAX; parts];
    for (k, link) in links.iter().enumerate() {
        for part in link.parts {
            let best = &mut surest[part as usize];
            if links.get(*best as usize).is_none_or(|b| b.votes.abs() < link.votes.abs()) {
                *best = index(k);
            }
        }
    }
    let mut joined = Parts::new(parts);
    for k in surest {
        if let Some(Link { parts: [a, b], votes }) = links.get(k as usize) {
            joined.join(*a, *b, *votes < 0);
        }
    }
    let (mut of_parts, larger_parts) = joined.numbered();
    let links = links.into_par_iter().filter_map(|l| link(&of_parts, l.parts, l.votes)).collect();
    settle(&mut of_parts, larger_parts, links, cx)?;
    of_items.par_iter_mut().for_each(|(part, turned)| {
        let (larger, larger_turned) = of_parts[*part as usize];
        (*part, *turned) = (larger, *turned ^ larger_turned);
    });
    Ok(())
}

/// Votes between two items as votes between their parts; `None` within one.
fn link(of_items: &[(u32, bool)], items: [u32; 2], votes: i64) -> Option<Link> {
    let [(a, a_turned), (b, b_turned)] = items.map(|i| of_items[i as usize]);
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
