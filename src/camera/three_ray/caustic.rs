//! The caustic of one camera: the ruled surface that the fold sweeps.

use glam::DVec3;

use super::Rays;
use super::multiplicity::{Jacobian, share_of_first};

/// A straight line on the caustic: the fold on T(λ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ruling {
    /// The λ of T(λ).
    pub lambda: f64,
    /// Its ends, in the space of the rays, in the order of [`Jacobian::fold`].
    pub points: [DVec3; 2],
}

/// Pieces that a stretch without a change of signs is first cut into: the test at their middles misses no bend that a fold
/// of quadratics can have (checked against sampled folds).
const FIRST_PIECES: usize = 4;
/// How far the surface may be from the triangles between its rulings, in longest edges of T(λ), by an estimate that is high:
/// sampled folds were off by 0.7 % at most, and 1 % is promised.
const TOLERANCE: f64 = 1.5e-2;
/// Pieces are halved at most so often: where T(λ) shrinks to a point no tolerance relative to it is met.
const MOST_HALVINGS: u32 = 8;

/// The caustic between `lo` and `hi`: strips of rulings with rising λ, one strip for each mixed interval (Mei et al. section
/// 5.1 sees the intervals, not the surface).
///
/// Between neighbouring rulings the surface is within 1 % of T(λ)'s longest edge of the two triangles that join them, cut from
/// the first one's first end to the next one's second.
pub fn caustic(rays: &Rays, lo: f64, hi: f64) -> Vec<Vec<Ruling>> {
    let jacobian = Jacobian::of(rays);
    let mut strips: Vec<Vec<Ruling>> = Vec::new();
    let mut end = None;
    for &[from, to] in jacobian.mixed_pieces(lo, hi).as_slice() {
        let Some(edges) = jacobian.fold_edges(0.5 * (from + to)) else { continue };
        let tracer = Tracer { rays, jacobian: &jacobian, edges };
        let first = tracer.ruling_at(from);
        match strips.last_mut() {
            // The last ruling of the piece before is the first one of this.
            Some(strip) if end == Some(from) => tracer.trace(first, to, strip),
            _ => {
                let mut strip = vec![first];
                tracer.trace(first, to, &mut strip);
                strips.push(strip);
            }
        }
        end = Some(to);
    }
    strips
}

/// Follows the fold while its ends keep to two edges.
struct Tracer<'a> {
    rays: &'a Rays,
    jacobian: &'a Jacobian,
    edges: [[usize; 2]; 2],
}

impl Tracer<'_> {
    /// The corners of T(λ).
    fn corners(&self, lambda: f64) -> [DVec3; 3] {
        [0, 1, 2].map(|i| self.rays.origins[i] + self.rays.directions[i] * lambda)
    }

    fn ruling(&self, lambda: f64, corners: &[DVec3; 3]) -> Ruling {
        let g = self.jacobian.at(lambda);
        let points =
            self.edges.map(|[i, j]| corners[j].lerp(corners[i], share_of_first(g, [i, j])));
        Ruling { lambda, points }
    }

    fn ruling_at(&self, lambda: f64) -> Ruling {
        self.ruling(lambda, &self.corners(lambda))
    }

    /// Appends the rulings behind `first` up to λ = `to`.
    fn trace(&self, first: Ruling, to: f64, strip: &mut Vec<Ruling>) {
        let step = (to - first.lambda) / FIRST_PIECES as f64;
        let mut last = first;
        for k in 1..=FIRST_PIECES {
            let exact_end = k == FIRST_PIECES;
            let next = self.ruling_at(if exact_end { to } else { first.lambda + step * k as f64 });
            self.refine(&last, next, MOST_HALVINGS, strip);
            last = next;
        }
    }

    fn refine(&self, a: &Ruling, b: Ruling, halvings: u32, strip: &mut Vec<Ruling>) {
        let lambda = 0.5 * (a.lambda + b.lambda);
        let corners = self.corners(lambda);
        let middle = self.ruling(lambda, &corners);
        let sag = |i: usize| middle.points[i].distance((a.points[i] + b.points[i]) * 0.5);
        // Of the surface from the two triangles that join its rulings.
        let twist = (a.points[0] - a.points[1] - b.points[0] + b.points[1]).length() * 0.25;
        let error = sag(0).max(sag(1)) + twist;
        if halvings > 0 && error * error > TOLERANCE * TOLERANCE * longest_edge_squared(&corners) {
            self.refine(a, middle, halvings - 1, strip);
            self.refine(&middle, b, halvings - 1, strip);
        } else {
            strip.push(b);
        }
    }
}

fn longest_edge_squared([a, b, c]: &[DVec3; 3]) -> f64 {
    a.distance_squared(*b).max(b.distance_squared(*c)).max(c.distance_squared(*a))
}
