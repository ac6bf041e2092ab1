//! Linear functions of the picture that describe the rays of some of a tile's pixels.

use glam::Vec3;

use super::TILE;
use super::field::{AREA, Linear, centre};

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

impl Sums {
    /// Over the pixels of `mask`. `about`: subtracted from the values.
    #[inline(always)]
    pub(super) fn new(field: &[[f32; AREA]; 4], about: [f32; 4], mask: &Mask) -> Self {
        let mut s = Self::default();
        let mut lanes = [[0.0f32; TILE]; 8];
        for y in 0..TILE {
            let bits = mask[y];
            if bits == 0 {
                continue;
            }
            let cy = centre(y);
            let (mut count, mut fy) = ([0.0f32; TILE], [[0.0f32; TILE]; 4]);
            for i in 0..TILE {
                count[i] = if bits >> i & 1 != 0 { 1.0 } else { 0.0 };
            }
            for k in 0..4 {
                let values = &field[k][y * TILE..(y + 1) * TILE];
                for i in 0..TILE {
                    fy[k][i] = if count[i] > 0.0 { values[i] - about[k] } else { 0.0 };
                }
            }
            // Sums by column; the columns' positions come in at the end.
            for i in 0..TILE {
                lanes[0][i] += count[i];
                lanes[1][i] += count[i] * cy;
            }
            let n = bits.count_ones() as f32;
            s.yy += cy * cy * n;
            for k in 0..4 {
                let mut sum = 0.0;
                for i in 0..TILE {
                    lanes[2 + k][i] += fy[k][i];
                    sum += fy[k][i];
                }
                s.yf[k] += cy * sum;
            }
        }
        for i in 0..TILE {
            let cx = centre(i);
            s.count += lanes[0][i];
            s.x += cx * lanes[0][i];
            s.xx += cx * cx * lanes[0][i];
            s.y += lanes[1][i];
            s.xy += cx * lanes[1][i];
            for k in 0..4 {
                s.f[k] += lanes[2 + k][i];
                s.xf[k] += cx * lanes[2 + k][i];
            }
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


/// How far points of the mirror may lie from the linear function's, in pixels (untuned).
const SURFACE_TOLERANCE_PX: f32 = 2.0;
/// Where rays change much less across one direction of the picture than across the other, a difference in that
/// direction counts no more than this share says.
const FLATTEST: f32 = 3e-4;

impl Judge {
    /// About a position in the tile. `focal_px`: of the eye. `tolerance`: in pixels.
    pub(super) fn new(
        linear: &Linear<4>,
        [x, y]: [f32; 2],
        focal_px: f32,
        tolerance: f32,
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
            depth: SURFACE_TOLERANCE_PX / focal_px,
            ahead: d.to_array(),
            least: AHEAD * d.length_squared(),
        }
    }

    /// Those pixels of `mask` whose rays are near enough.
    #[inline(always)]
    pub(super) fn accepted(&self, field: &[[f32; AREA]; 4], mask: &Mask) -> Mask {
        let mut near = *mask;
        let l = &self.linear;
        let [u, v] = &self.to_px;
        for y in 0..TILE {
            if near[y] == 0 {
                continue;
            }
            let cy = centre(y);
            let row = y * TILE..(y + 1) * TILE;
            let (a, b) = (&field[0][row.clone()], &field[1][row.clone()]);
            let (c, q) = (&field[2][row.clone()], &field[3][row]);
            let mut far = [0.0f32; TILE];
            for i in 0..TILE {
                let x = centre(i);
                let e =
                    [a[i] - l.get(0, x, cy), b[i] - l.get(1, x, cy), c[i] - l.get(2, x, cy)];
                let du = u[0] * e[0] + u[1] * e[1] + u[2] * e[2];
                let dv = v[0] * e[0] + v[1] * e[1] + v[2] * e[2];
                let inverse = l.get(3, x, cy);
                let apart = (q[i] - inverse).abs() - inverse * self.depth;
                let h = &self.ahead;
                let turned = self.least - (a[i] * h[0] + b[i] * h[1] + c[i] * h[2]);
                far[i] = if apart.max(turned) > 0.0 { f32::MAX } else { du * du + dv * dv };
            }
            let mut bits = 0u32;
            for i in 0..TILE {
                bits |= u32::from(far[i] <= self.accepted) << i;
            }
            near[y] &= bits;
        }
        near
    }

    /// Whether the mirror's points at all pixels of `mask` are near enough. `depth`: of the tile's rows, along the eye's
    /// `forward`.
    #[inline(always)]
    pub(super) fn accepts_depths(&self, depth: &[[f32; TILE]; TILE], mask: &Mask) -> bool {
        let l = &self.linear;
        for y in 0..TILE {
            let cy = centre(y);
            let mut most = 0.0f32;
            for i in 0..TILE {
                let apart = (depth[y][i] * l.get(3, centre(i), cy) - 1.0).abs();
                most = most.max(if mask[y] >> i & 1 != 0 { apart } else { 0.0 });
            }
            if most > self.depth {
                return false;
            }
        }
        true
    }
}
