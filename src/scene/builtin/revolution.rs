//! Surfaces of revolution about the y axis with triangles of even size.
//!
//! A grid of meridians and parallels has slivers at its poles. Here each parallel gets as many vertices
//! as its length asks for, and neighbouring parallels are stitched.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::builder::{Builder, Vertex};

/// A piece of a profile, (distance from the axis, height); its left side is the surface's front.
#[derive(Clone, Copy, Debug)]
pub(super) enum Piece {
    /// From one point to another.
    Line(DVec2, DVec2),
    /// About a centre with a radius, from one angle to another.
    Arc(DVec2, f64, [f64; 2]),
    /// Cubic Bézier curve.
    Bezier([DVec2; 4]),
}

impl Piece {
    /// Point and derivative at `t` in 0 to 1.
    fn at(&self, t: f64) -> [DVec2; 2] {
        let s = 1.0 - t;
        match *self {
            Self::Line(a, b) => [a * s + b * t, b - a],
            Self::Arc(center, radius, [from, to]) => {
                let direction = DVec2::from_angle(from * s + to * t);
                [center + radius * direction, direction.perp() * (radius * (to - from))]
            }
            Self::Bezier([a, b, c, d]) => [
                a * (s * s * s) + b * (3.0 * s * s * t) + c * (3.0 * s * t * t) + d * (t * t * t),
                ((b - a) * (s * s) + (c - b) * (2.0 * s * t) + (d - c) * (t * t)) * 3.0,
            ],
        }
    }
}

/// What turns about the axis.
pub(super) struct Profile<'a> {
    /// Smooth curves, one behind the other; between them the surface has a crease.
    pub(super) curves: &'a [&'a [Piece]],
    /// The end is the beginning (a torus).
    pub(super) closed: bool,
    /// Radius of curvature below which rows come closer together than edges are long, so that a lip stays round.
    pub(super) finest_radius: f64,
}

/// A parallel: profile point, profile normal.
type Ring = [DVec2; 2];

/// A point this near to the axis is on it.
const AXIS: f64 = 1e-9;
/// Places a piece at which its length is measured.
const STEPS: u32 = 256;
/// Fewest vertices of a parallel that is no pole.
const FEWEST: usize = 5;

/// The surface with about `wanted` triangles.
pub(super) fn revolution(profile: &Profile, wanted: usize) -> Builder {
    let curves: Vec<Measured> =
        profile.curves.iter().map(|c| Measured::new(c, profile.finest_radius)).collect();
    let rings = |edge: f64| -> Vec<Vec<Ring>> { curves.iter().map(|c| c.rings(edge)).collect() };
    let count = |edge: f64| -> usize {
        let pairs = |rings: &Vec<Ring>| -> usize {
            rings.windows(2).map(|r| stitches(r[0], r[1], edge)).sum()
        };
        rings(edge).iter().map(pairs).sum()
    };
    let total: f64 = curves.iter().map(Measured::length).sum();
    let (mut fine, mut coarse) = (total / (wanted as f64 * 4.0 + 16.0), total);
    let mut best = (usize::MAX, coarse);
    // The count falls with the edge, but in steps: the best edge met while bisecting is taken.
    for _ in 0..48 {
        let edge = 0.5 * (fine + coarse);
        let triangles = count(edge);
        if triangles.abs_diff(wanted) < best.0 {
            best = (triangles.abs_diff(wanted), edge);
        }
        if triangles > wanted { fine = edge } else { coarse = edge }
    }
    build(&rings(best.1), best.1, profile.closed)
}

fn build(curves: &[Vec<Ring>], edge: f64, closed: bool) -> Builder {
    let mut builder = Builder::default();
    for rings in curves {
        let mut add = |ring: &Ring| -> Vec<u32> {
            let n = around(*ring, edge);
            (0..n).map(|k| builder.vertex(turned(*ring, k as f64 / n as f64))).collect()
        };
        let kept = if closed { rings.len() - 1 } else { rings.len() };
        let mut parallels: Vec<Vec<u32>> = rings[..kept].iter().map(&mut add).collect();
        if closed {
            parallels.push(parallels[0].clone());
        }
        for pair in parallels.windows(2) {
            stitch(&mut builder, &pair[0], &pair[1]);
        }
    }
    builder
}

/// A ring's vertex, `turn` (0 to 1) of a full turn about +y.
fn turned([point, normal]: Ring, turn: f64) -> Vertex {
    let (sin, cos) = (turn * TAU).sin_cos();
    let about = |p: DVec2| DVec3::new(p.x * cos, p.y, -p.x * sin);
    Vertex { point: about(point), normal: about(normal) }
}

/// How many vertices a ring has.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small counts")]
fn around([point, _]: Ring, edge: f64) -> usize {
    if point.x < AXIS { 1 } else { ((TAU * point.x / edge).round() as usize).max(FEWEST) }
}

/// How many triangles two rings have between them.
fn stitches(a: Ring, b: Ring, edge: f64) -> usize {
    [a, b].map(|r| around(r, edge)).into_iter().filter(|&n| n > 1).sum()
}

/// Triangles between two closed rings of vertices that begin at the same angle.
fn stitch(builder: &mut Builder, a: &[u32], b: &[u32]) {
    let (mut i, mut j) = (0, 0);
    let steps = |n: usize| if n > 1 { n } else { 0 };
    let (last_i, last_j) = (steps(a.len()), steps(b.len()));
    while i < last_i || j < last_j {
        let (here, there) = (a[i % a.len()], b[j % b.len()]);
        // The edge whose middle comes first: the shorter diagonal.
        let a_first = (2 * i + 1) * b.len() < (2 * j + 1) * a.len();
        if j == last_j || (i < last_i && a_first) {
            i += 1;
            builder.triangle([here, there, a[i % a.len()]]);
        } else {
            j += 1;
            builder.triangle([here, there, b[j % b.len()]]);
        }
    }
}

/// A smooth curve and how far along it one is.
struct Measured<'a> {
    pieces: &'a [Piece],
    /// Length up to each of [`STEPS`] places a piece, from 0; where the curve is narrow, more than its length.
    up_to: Vec<f64>,
}

impl<'a> Measured<'a> {
    fn new(pieces: &'a [Piece], finest_radius: f64) -> Self {
        let mut up_to = vec![0.0];
        let mut length: f64 = 0.0;
        for piece in pieces {
            for k in 0..STEPS {
                let [a, b] = [k, k + 1].map(|k| piece.at(f64::from(k) / f64::from(STEPS)));
                let turn = a[1].angle_to(b[1]).abs();
                length += a[0].distance(b[0]).hypot(finest_radius * turn);
                up_to.push(length);
            }
        }
        Self { pieces, up_to }
    }

    fn length(&self) -> f64 {
        self.up_to.last().copied().unwrap_or(0.0)
    }

    /// Rings about `edge` apart, the curve's ends included.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small counts")]
    fn rings(&self, edge: f64) -> Vec<Ring> {
        let rows = ((self.length() / edge).round() as usize).max(2);
        (0..=rows).map(|i| self.ring(i as f64 / rows as f64)).collect()
    }

    /// The ring at a part (0 to 1) of the length.
    fn ring(&self, part: f64) -> Ring {
        let wanted = part * self.length();
        let steps = STEPS as usize;
        let step = self.up_to.partition_point(|&l| l <= wanted).clamp(1, self.up_to.len() - 1);
        let (low, high) = (self.up_to[step - 1], self.up_to[step]);
        let within = ((wanted - low) / (high - low)).clamp(0.0, 1.0);
        let piece = (step - 1) / steps;
        let t = ((step - 1 - piece * steps) as f64 + within) / steps as f64;
        let [mut point, derivative] = self.pieces[piece].at(t);
        if point.x < AXIS {
            point.x = 0.0;
        }
        [point, derivative.perp().normalize_or(DVec2::Y)]
    }
}
