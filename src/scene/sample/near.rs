//! The points around one block, in a small grid that fits the processor's first cache.

use glam::{UVec3, Vec3};

use super::blocks::Blocks;
use super::candidates::{Candidate, index};

/// Points whose normals are further apart than 120° (a cosine of -0.5) lie on different sides of a thin
/// sheet and do not crowd each other; across the edges of a box or a roof they do.
const SAME_SIDE: f32 = -0.5;
/// No more cells than this along a block.
const MOST_CELLS: f32 = 24.0;
const NONE: u32 = u32::MAX;

/// A grid over one block and one cell beyond it on every side. Reused from block to block.
#[derive(Default)]
pub(super) struct Near {
    origin: Vec3,
    per_unit: f32,
    /// Cells along an edge.
    side: u32,
    /// The point last put into each cell.
    heads: Vec<u32>,
    points: Vec<Point>,
}

struct Point {
    position: Vec3,
    normal: Vec3,
    /// The next point in the same cell.
    next: u32,
}

impl Near {
    /// Empties it and moves it to `block`; the distances asked for will be less than `radius`.
    pub(super) fn reset(&mut self, blocks: &Blocks, block: usize, radius: f32) {
        let cell = radius.max(blocks.edge() / MOST_CELLS);
        #[expect(clippy::cast_possible_truncation, reason = "at most MOST_CELLS + 3")]
        let side = (blocks.edge() / cell).ceil() as u32 + 2;
        self.side = side;
        self.per_unit = cell.recip();
        self.origin = blocks.corner(block) - Vec3::splat(cell);
        self.heads.clear();
        self.heads.resize((side * side * side) as usize, NONE);
        self.points.clear();
    }

    /// Adds a point; one that is too far away to matter is left out.
    pub(super) fn insert(&mut self, point: &Candidate) {
        let at = (point.position - self.origin) * self.per_unit;
        if at.min_element() < 0.0 || at.max_element() >= self.side as f32 {
            return;
        }
        let at = at.as_uvec3();
        let head = &mut self.heads[((at.x * self.side + at.y) * self.side + at.z) as usize];
        self.points.push(Point { position: point.position, normal: point.normal, next: *head });
        *head = index(self.points.len() - 1);
    }

    /// Squared distance from a point in the block to the nearest one on the same side of the surface:
    /// exact if it lies between `enough` and the squared radius; below `enough`, any such distance;
    /// beyond the radius, any larger one.
    pub(super) fn distance_squared(&self, point: &Candidate, enough: f32) -> f32 {
        let at = ((point.position - self.origin) * self.per_unit).as_uvec3();
        let at = at.clamp(UVec3::ONE, UVec3::splat(self.side - 2));
        let mut least = f32::INFINITY;
        for x in at.x - 1..=at.x + 1 {
            for y in at.y - 1..=at.y + 1 {
                let first = ((x * self.side + y) * self.side + at.z - 1) as usize;
                for &head in &self.heads[first..first + 3] {
                    let mut next = head;
                    while next != NONE {
                        let other = &self.points[next as usize];
                        let distance = other.position.distance_squared(point.position);
                        if distance < least && other.normal.dot(point.normal) > SAME_SIDE {
                            least = distance;
                            if least < enough {
                                return least;
                            }
                        }
                        next = other.next;
                    }
                }
            }
        }
        least
    }
}

/// Whether two points are on the same side of the surface and closer than the root of `radius_squared`.
pub(super) fn crowds(a: &Candidate, b: &Candidate, radius_squared: f32) -> bool {
    a.position.distance_squared(b.position) < radius_squared && a.normal.dot(b.normal) > SAME_SIDE
}
