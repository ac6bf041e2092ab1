//! Linear functions of the picture that describe the rays of some of a tile's pixels.

#![expect(clippy::needless_range_loop, reason = "compilers see through indices best")]

use fearless_simd::{Simd, f32x16};
use glam::Vec3;

use crate::geometry::lanes::{Real, Vector};
use crate::visibility::mirror_rays::{AREA, Linear, TILE, centre};

/// Sums over pixels from which the best linear function follows. They can be added.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub(super) count: f32,
    x: f32,
    y: f32,
    xx: f32,
    xy: f32,
    yy: f32,
    f: [f32; 4],
    xf: [f32; 4],
    yf: [f32; 4],
}

/// The least variance of positions from which a slope is derived, in squared pixels.
const LEAST_VARIANCE: f64 = 0.3;

#[inline(always)]
fn total(mut columns: [f32; TILE]) -> f32 {
    let mut half = TILE / 2;
    while half > 0 {
        for i in 0..half {
            columns[i] += columns[i + half];
        }
        half /= 2;
    }
    columns[0]
}

/// The total of the columns' values times a power of their positions.
#[inline(always)]
fn along(columns: &[f32; TILE], power: u32) -> f32 {
    let mut moved = *columns;
    for _ in 0..power {
        for i in 0..TILE {
            moved[i] *= centre(i);
        }
    }
    total(moved)
}

impl Sums {
    /// Over the pixels of `mask`. `about`: subtracted from the values.
    #[inline(always)]
    pub(super) fn new(field: &[[f32; AREA]; 4], about: [f32; 4], mask: &Mask) -> Self {
        // By column; no sum runs along a row, so that the compiler can take all columns at once.
        let (mut n, mut ny, mut nyy) = ([0.0f32; TILE], [0.0f32; TILE], [0.0f32; TILE]);
        let (mut f, mut fy) = ([[0.0f32; TILE]; 4], [[0.0f32; TILE]; 4]);
        for y in 0..TILE {
            let bits = mask[y];
            if bits == 0 {
                continue;
            }
            let cy = centre(y);
            let mut own = [0.0f32; TILE];
            for i in 0..TILE {
                own[i] = if bits >> i & 1 != 0 { 1.0 } else { 0.0 };
                n[i] += own[i];
                ny[i] += own[i] * cy;
                nyy[i] += own[i] * (cy * cy);
            }
            for k in 0..4 {
                let values = &field[k][y * TILE..(y + 1) * TILE];
                for i in 0..TILE {
                    let value = if own[i] > 0.0 { values[i] - about[k] } else { 0.0 };
                    f[k][i] += value;
                    fy[k][i] += cy * value;
                }
            }
        }
        let mut s = Self {
            count: total(n),
            x: along(&n, 1),
            y: total(ny),
            xx: along(&n, 2),
            xy: along(&ny, 1),
            yy: total(nyy),
            ..Self::default()
        };
        for k in 0..4 {
            s.f[k] = total(f[k]);
            s.xf[k] = along(&f[k], 1);
            s.yf[k] = total(fy[k]);
        }
        s
    }

    /// Mean position.
    pub(super) fn middle(&self) -> [f32; 2] {
        [self.x / self.count, self.y / self.count]
    }

    /// The best linear function; `None` where the pixels lie (nearly) in a line.
    #[expect(clippy::cast_possible_truncation, reason = "rounded once")]
    pub(super) fn fit(&self, about: [f32; 4]) -> Option<Linear<4>> {
        let n = f64::from(self.count);
        let [x, y] = [self.x, self.y].map(|v| f64::from(v) / n);
        let xx = f64::from(self.xx) / n - x * x;
        let yy = f64::from(self.yy) / n - y * y;
        let xy = f64::from(self.xy) / n - x * y;
        let det = xx * yy - xy * xy;
        let least = det / (xx + yy);
        if !(n >= 3.0 && least >= LEAST_VARIANCE) {
            return None;
        }
        let mut linear = Linear::default();
        for k in 0..4 {
            let f = f64::from(self.f[k]) / n;
            let xf = f64::from(self.xf[k]) / n - x * f;
            let yf = f64::from(self.yf[k]) / n - y * f;
            let right = (xf * yy - yf * xy) / det;
            let down = (yf * xx - xf * xy) / det;
            linear.right[k] = right as f32;
            linear.down[k] = down as f32;
            linear.at[k] = (f - right * x - down * y) as f32 + about[k];
        }
        Some(linear)
    }
}

/// Some pixels of a tile: a bit each, by row.
pub(super) type Mask = [u32; TILE];

/// How far rays lie from those of a linear function, in pixels.
pub(super) struct Judge {
    linear: Linear<4>,
    /// From a difference of directions to the pixels between the rays.
    to_px: [[f32; 3]; 2],
    /// The squared distance that is accepted.
    accepted: f32,
    /// The relative difference of inverse depths that is accepted.
    depth: f32,
    /// A direction and its least component along which rays are accepted.
    ahead: [f32; 3],
    least: f32,
}

/// The cosine of the largest angle between rays of a cell, twice.
const AHEAD: f32 = 0.75;

/// Where rays change much less across one direction of the picture than across the other, a difference in that
/// direction counts no more than this share says.
const FLATTEST: f32 = 3e-4;

/// Bit i: value i is at most `limit`. Compilers do not see that comparisons make a word.
#[inline(always)]
fn at_most<S: Simd>(simd: S, values: &[f32; TILE], limit: f32) -> u32 {
    let limit: f32x16<S> = Vector::broadcast(simd, limit);
    let mut word = 0u64;
    for (half, values) in values.chunks_exact(16).enumerate() {
        let values: f32x16<S> = Vector::load(simd, values);
        word |= f32x16::<S>::bits(values.le(limit)) << (16 * half);
    }
    #[expect(clippy::cast_possible_truncation, reason = "a bit a column")]
    let word = word as u32;
    word
}

impl Judge {
    /// About a position in the tile. `focal_px`: of the eye. `tolerance`: in pixels; `surface_tolerance`: the same for
    /// the mirror's points.
    pub(super) fn new(
        linear: &Linear<4>,
        [x, y]: [f32; 2],
        focal_px: f32,
        tolerance: f32,
        surface_tolerance: f32,
    ) -> Self {
        let d = Vec3::new(linear.get(0, x, y), linear.get(1, x, y), linear.get(2, x, y));
        let [r0, r1, r2, _] = linear.right;
        let [b0, b1, b2, _] = linear.down;
        let (r, b) = (Vec3::new(r0, r1, r2).reject_from(d), Vec3::new(b0, b1, b2).reject_from(d));
        let (rr, bb, rb) = (r.length_squared(), b.length_squared(), r.dot(b));
        let more = (rr + bb) * FLATTEST + (0.1 / focal_px).powi(2);
        let (rr, bb) = (rr + more, bb + more);
        let det = rr * bb - rb * rb;
        Self {
            linear: *linear,
            to_px: [((r * bb - b * rb) / det).to_array(), ((b * rr - r * rb) / det).to_array()],
            accepted: tolerance * tolerance,
            depth: surface_tolerance / focal_px,
            ahead: d.to_array(),
            least: AHEAD * d.length_squared(),
        }
    }

    /// Those pixels of `mask` whose rays are near enough.
    #[inline(always)]
    pub(super) fn accepted<S: Simd>(&self, simd: S, field: &[[f32; AREA]; 4], mask: &Mask) -> Mask {
        let mut near = *mask;
        for y in 0..TILE {
            if near[y] == 0 {
                continue;
            }
            let far = self.row(field, y);
            near[y] &= at_most(simd, &far, self.accepted);
        }
        near
    }

    /// The largest distance of a ray of `mask`, in pixels; infinite if one is turned away or starts elsewhere.
    #[inline(always)]
    pub(super) fn farthest(&self, field: &[[f32; AREA]; 4], mask: &Mask) -> f32 {
        let mut most = [0.0f32; TILE];
        for y in 0..TILE {
            if mask[y] == 0 {
                continue;
            }
            let far = self.row(field, y);
            for i in 0..TILE {
                let own = if mask[y] >> i & 1 != 0 { far[i] } else { 0.0 };
                most[i] = if own > most[i] { own } else { most[i] };
            }
        }
        most.iter().fold(0.0f32, |a, &b| a.max(b)).sqrt()
    }

    /// Squared distances of a row's rays, in pixels; infinite where one is turned away or starts elsewhere.
    #[inline(always)]
    fn row(&self, field: &[[f32; AREA]; 4], y: usize) -> [f32; TILE] {
        let l = &self.linear;
        let [u, v] = &self.to_px;
        let cy = centre(y);
        let row = y * TILE..(y + 1) * TILE;
        let (a, b) = (&field[0][row.clone()], &field[1][row.clone()]);
        let (c, q) = (&field[2][row.clone()], &field[3][row]);
        let mut far = [0.0f32; TILE];
        for i in 0..TILE {
            let x = centre(i);
            let e = [a[i] - l.get(0, x, cy), b[i] - l.get(1, x, cy), c[i] - l.get(2, x, cy)];
            let du = u[0] * e[0] + u[1] * e[1] + u[2] * e[2];
            let dv = v[0] * e[0] + v[1] * e[1] + v[2] * e[2];
            let inverse = l.get(3, x, cy);
            let apart = (q[i] - inverse).abs() - inverse * self.depth;
            let h = &self.ahead;
            let turned = self.least - (a[i] * h[0] + b[i] * h[1] + c[i] * h[2]);
            far[i] = if apart.max(turned) > 0.0 { f32::INFINITY } else { du * du + dv * dv };
        }
        far
    }

    /// Whether the mirror's points at all pixels of `mask` are near enough. `depth`: of the tile's rows, along the eye's
    /// `forward`.
    #[inline(always)]
    pub(super) fn accepts_depths<S: Simd>(
        &self,
        simd: S,
        depth: &[[f32; TILE]; TILE],
        mask: &Mask,
    ) -> bool {
        let l = &self.linear;
        for y in 0..TILE {
            let cy = centre(y);
            let mut apart = [0.0f32; TILE];
            for i in 0..TILE {
                apart[i] = (depth[y][i] * l.get(3, centre(i), cy) - 1.0).abs();
            }
            if mask[y] & !at_most(simd, &apart, self.depth) != 0 {
                return false;
            }
        }
        true
    }
}
