//! Adaptive tessellation: straight edges have curved images (Roger & Holzschuch fig. 12).

use std::collections::BTreeMap;

use glam::{Vec2, Vec3};

use super::Done;
use super::images::{Image, Reflecting};
use super::pieces::{Corner, Piece};
use crate::camera::Eye;
use crate::error::Result;

/// An edge is halved so many times at most.
const MOST_ROUNDS: usize = 8;
/// An object is divided into so many pieces at most, beside its own triangles.
const MOST_PIECES: usize = 1 << 20;

/// Pieces across the end of the reflected region are short with edges of so many times the goal.
const SHORT: f32 = 2.0;

/// Which edges are halved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal {
    /// Longer images, in pixels.
    pub(super) longest_px: f32,
    /// Where the part of the mirror is in the picture, pixels: edges that do not come near it do not matter.
    pub(super) window: [Vec2; 2],
}

impl Goal {
    /// Whether a piece is drawn: where it ends in the hidden region, only if it has become short. Images of points far within
    /// that region say nothing.
    pub(super) fn keeps(&self, piece: &Piece, eye: &Eye) -> bool {
        let [a, b, c] = piece.corners.map(|corner| corner.image);
        let short = |a: Image, b: Image| {
            let ends = eye.project_px(a.place).zip(eye.project_px(b.place));
            ends.is_some_and(|(a, b)| a.distance(b) <= SHORT * self.longest_px)
        };
        let reflected = [a, b, c].iter().all(|image| image.height > 0.0);
        reflected || (short(a, b) && short(b, c) && short(c, a))
    }

    /// Whether an edge with its ends there is halved.
    fn asks(&self, ends: [Option<Vec2>; 2]) -> bool {
        let [low, high] = self.window;
        let inside = |p: Vec2| p.cmpge(low).all() && p.cmple(high).all();
        match ends {
            [Some(a), Some(b)] => {
                let near = a.max(b).cmpge(low).all() && a.min(b).cmple(high).all();
                near && a.distance(b) > self.longest_px
            }
            [Some(p), None] | [None, Some(p)] => inside(p),
            [None, None] => false,
        }
    }
}

/// A corner by what it is the middle of, so that neighbours share it.
type Key = [u32; 2];

/// A piece under way: its parent, and its corners' indices and weights.
#[derive(Clone, Copy)]
struct Part {
    parent: u32,
    corners: [u32; 3],
    weights: [[f32; 3]; 3],
}

/// The triangles of an object, divided until the images of their edges are short enough. `first` is the
/// object's first triangle over all; `positions` are its vertices in scene space, with their images.
///
/// Whether an edge is halved depends on its two ends only, so that neighbours agree about their common edge.
pub(super) fn tessellate(
    reflecting: &Reflecting<'_>,
    first: u32,
    triangles: &[[u32; 3]],
    (positions, images): (&[Vec3], Vec<Image>),
    goal: Goal,
    done: &mut Done,
) -> Result<Vec<Piece>> {
    let eye = reflecting.pass.eye;
    let (mut positions, mut images) = (positions.to_vec(), images);
    let mut px: Vec<Option<Vec2>> = images.iter().map(|i| eye.project_px(i.place)).collect();
    let corner = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let part =
        |(k, &corners): (u32, &[u32; 3])| Part { parent: first + k, corners, weights: corner };
    let mut parts: Vec<Part> = (0..).zip(triangles).map(part).collect();
    for _ in 0..MOST_ROUNDS {
        let long = |a: u32, b: u32| {
            let (i, j) = (a as usize, b as usize);
            let seen = images[i].height > 0.0 || images[j].height > 0.0;
            seen && goal.asks([px[i], px[j]])
        };
        let mut middles: BTreeMap<Key, u32> = BTreeMap::new();
        let mut added = Vec::new();
        let mut next = Vec::with_capacity(parts.len());
        for part in &parts {
            let [a, b, c] = part.corners;
            let mut middle = |i: u32, j: u32| {
                let key = [i.min(j), i.max(j)];
                long(i, j).then(|| {
                    *middles.entry(key).or_insert_with(|| {
                        added.push((positions[i as usize] + positions[j as usize]) * 0.5);
                        u32::try_from(positions.len() + added.len() - 1).expect("few pieces")
                    })
                })
            };
            split(part, [middle(a, b), middle(b, c), middle(c, a)], &mut next);
        }
        if added.is_empty() || next.len() > triangles.len() + MOST_PIECES {
            break;
        }
        let new = reflecting.images(&added, done)?;
        px.extend(new.iter().map(|i| eye.project_px(i.place)));
        images.extend(new);
        positions.extend(added);
        parts = next;
    }
    let corner = |part: &Part, k: usize| Corner {
        image: images[part.corners[k] as usize],
        weights: part.weights[k],
    };
    let piece = |part: &Part| Piece {
        parent: part.parent,
        corners: [corner(part, 0), corner(part, 1), corner(part, 2)],
    };
    Ok(parts.iter().map(piece).collect())
}

/// Divides a part at the middles of its edges (ab, bc, ca) that have one.
fn split(part: &Part, middles: [Option<u32>; 3], out: &mut Vec<Part>) {
    // From the corner after which as many middles as possible follow.
    let turn = (0..3)
        .find(|&k| match middles.iter().flatten().count() {
            1 => middles[k].is_some(),
            2 => middles[k].is_some() && middles[(k + 1) % 3].is_some(),
            _ => true,
        })
        .unwrap_or(0);
    let at = |k: usize| (turn + k) % 3;
    let ends = [0, 1, 2].map(|k| (part.corners[at(k)], part.weights[at(k)]));
    let halfway = |k: usize| {
        let (p, q) = (part.weights[at(k)], part.weights[at(k + 1)]);
        middles[at(k)].map(|index| (index, [0, 1, 2].map(|i| 0.5 * (p[i] + q[i]))))
    };
    let [a, b, c] = ends;
    let mut add = |corners: [(u32, [f32; 3]); 3]| {
        let (indices, weights) = (corners.map(|c| c.0), corners.map(|c| c.1));
        out.push(Part { parent: part.parent, corners: indices, weights });
    };
    match (halfway(0), halfway(1), halfway(2)) {
        (Some(ab), Some(bc), Some(ca)) => {
            for corners in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                add(corners);
            }
        }
        (Some(ab), Some(bc), None) => {
            for corners in [[a, ab, c], [ab, bc, c], [ab, b, bc]] {
                add(corners);
            }
        }
        (Some(ab), None, None) => {
            for corners in [[a, ab, c], [ab, b, c]] {
                add(corners);
            }
        }
        _ => add([a, b, c]),
    }
}
