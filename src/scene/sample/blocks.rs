//! Cubic blocks of space and the candidates in each of them.

use glam::{UVec3, Vec3};
use rayon::prelude::*;

use super::candidates::{Candidates, index};
use crate::geometry::Aabb;

/// Bits a coordinate of a block: three of them fill a key.
const BITS: u32 = 21;
/// Candidates that one task sorts into blocks.
const CHUNK: u32 = 1 << 14;

/// Consecutive candidates in one block.
#[derive(Clone, Copy)]
pub(super) struct Span {
    block: u64,
    /// Number of the first candidate.
    pub(super) first: u32,
    /// How many candidates.
    pub(super) count: u32,
    /// Triangle of the first one.
    pub(super) triangle: u32,
}

/// The occupied blocks in ascending order of their keys (x, then y, then z).
pub(super) struct Blocks {
    origin: Vec3,
    edge: f32,
    keys: Vec<u64>,
    spans: Vec<Span>,
    /// First span of each block, and the end.
    starts: Vec<u32>,
}

impl Blocks {
    /// Sorts the candidates into blocks that are `edge` wide, or wider if there would be too many.
    pub(super) fn new(candidates: &Candidates, bounds: Aabb, edge: f32) -> Self {
        let widest = bounds.extent().max_element();
        let edge = edge.max(widest / (1_u32 << (BITS - 2)) as f32).max(f32::MIN_POSITIVE);
        // Off the corner, so that a flat face of the box does not lie between two layers of blocks.
        let origin = bounds.min - Vec3::splat(0.382 * edge);
        let mut blocks = Self { origin, edge, keys: vec![], spans: vec![], starts: vec![] };
        let mut spans: Vec<Span> = (0..candidates.count().div_ceil(CHUNK))
            .into_par_iter()
            .flat_map_iter(|chunk| blocks.spans_of_chunk(candidates, chunk))
            .collect();
        spans.par_sort_unstable_by_key(|span| (span.block, span.first));
        for (i, span) in spans.iter().enumerate() {
            if blocks.keys.last() != Some(&span.block) {
                blocks.keys.push(span.block);
                blocks.starts.push(index(i));
            }
        }
        blocks.starts.push(index(spans.len()));
        blocks.spans = spans;
        blocks
    }

    fn spans_of_chunk(&self, candidates: &Candidates, chunk: u32) -> Vec<Span> {
        let first = chunk * CHUNK;
        let count = CHUNK.min(candidates.count() - first);
        let mut spans: Vec<Span> = Vec::new();
        for candidate in candidates.run(first, count, candidates.triangle(first)) {
            let block = key(self.cell(candidate.position));
            match spans.last_mut() {
                Some(last) if last.block == block => last.count += 1,
                _ => spans.push(Span {
                    block,
                    first: candidate.id,
                    count: 1,
                    triangle: candidate.triangle,
                }),
            }
        }
        spans
    }

    /// How many blocks there are.
    pub(super) fn len(&self) -> usize {
        self.keys.len()
    }

    /// Width of a block.
    pub(super) fn edge(&self) -> f32 {
        self.edge
    }

    /// Candidates of a block in ascending order.
    pub(super) fn spans(&self, block: usize) -> &[Span] {
        &self.spans[self.starts[block] as usize..self.starts[block + 1] as usize]
    }

    /// How many candidates a block has.
    pub(super) fn candidates(&self, block: usize) -> u32 {
        self.spans(block).iter().map(|span| span.count).sum()
    }

    /// Lowest corner of a block.
    pub(super) fn corner(&self, block: usize) -> Vec3 {
        self.origin + (cell_of(self.keys[block]) - UVec3::ONE).as_vec3() * self.edge
    }

    /// One of eight colours: blocks of the same colour do not touch.
    pub(super) fn color(&self, block: usize) -> usize {
        let odd = cell_of(self.keys[block]) & UVec3::ONE;
        (odd.x << 2 | odd.y << 1 | odd.z) as usize
    }

    /// The occupied blocks that touch a block, and itself, in ascending order.
    pub(super) fn neighborhood(&self, block: usize) -> impl Iterator<Item = usize> {
        let cell = cell_of(self.keys[block]);
        (0..9).flat_map(move |i| {
            let column = cell + UVec3::new(i / 3, i % 3, 0) - UVec3::ONE;
            let first = self.keys.partition_point(|&k| k < key(column));
            let count = self.keys[first..].iter().take_while(|&&k| k <= key(column) + 2).count();
            first..first + count
        })
    }

    /// The block at a position, counted from 1, so that each has one before it.
    fn cell(&self, position: Vec3) -> UVec3 {
        ((position - self.origin) / self.edge).as_uvec3() + UVec3::ONE
    }
}

fn key(cell: UVec3) -> u64 {
    u64::from(cell.x) << (2 * BITS) | u64::from(cell.y) << BITS | u64::from(cell.z)
}

fn cell_of(key: u64) -> UVec3 {
    let part = |shift: u32| {
        u32::try_from(key >> shift & ((1 << BITS) - 1)).expect("as many bits as were masked")
    };
    UVec3::new(part(2 * BITS), part(BITS), part(0))
}
