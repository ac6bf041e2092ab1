//! Linear functions of the picture that describe the rays of some of a tile's pixels.

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
    /// Over the pixels of `rows` (a bit a pixel) within some columns of the tile. `about`: subtracted from the values.
    #[inline(always)]
    pub(super) fn new(field: &[[f32; AREA]; 4], about: [f32; 4], mask: &Mask) -> Self {
        let mut s = Self::default();
        for y in mask.rows() {
            let row = mask.bits[y - mask.top];
            let cy = centre(y);
            let mut m = [0.0f32; BASE];
            let mut px = [0.0f32; BASE];
            for i in 0..BASE {
                m[i] = (row >> i & 1) as f32;
                px[i] = centre(mask.left + i) * m[i];
            }
            let count: f32 = m.iter().sum();
            let x: f32 = px.iter().sum();
            s.count += count;
            s.x += x;
            s.y += cy * count;
            for i in 0..BASE {
                s.xx += px[i] * px[i];
            }
            s.xy += cy * x;
            s.yy += cy * cy * count;
            let from = y * TILE + mask.left;
            for k in 0..4 {
                let values = &field[k][from..from + BASE];
                let (mut f, mut xf) = (0.0, 0.0);
                for i in 0..BASE {
                    let value = if m[i] > 0.0 { values[i] - about[k] } else { 0.0 };
                    f += value;
                    xf += value * px[i];
                }
                s.f[k] += f;
                s.xf[k] += xf;
                s.yf[k] += cy * f;
            }
        }
        s
    }

    pub(super) fn plus(&self, o: &Self) -> Self {
        let four = |a: [f32; 4], b: [f32; 4]| [0, 1, 2, 3].map(|k| a[k] + b[k]);
        Self {
            count: self.count + o.count,
            x: self.x + o.x,
            y: self.y + o.y,
            xx: self.xx + o.xx,
            xy: self.xy + o.xy,
            yy: self.yy + o.yy,
            f: four(self.f, o.f),
            xf: four(self.xf, o.xf),
            yf: four(self.yf, o.yf),
        }
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

/// Columns and rows of the smallest squares.
pub(super) const BASE: usize = 8;

/// Some pixels of a square of a tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mask {
    pub(super) left: usize,
    pub(super) top: usize,
    pub(super) bits: [u8; BASE],
}

impl Mask {
    #[inline(always)]
    fn rows(&self) -> std::ops::Range<usize> {
        self.top..self.top + BASE
    }

    pub(super) fn of(rows: &[u32; TILE], left: usize, top: usize) -> Self {
        let mut bits = [0; BASE];
        for (bits, row) in bits.iter_mut().zip(&rows[top..]) {
            *bits = row.to_le_bytes()[left / BASE];
        }
        Self { left, top, bits }
    }

    /// Middle of its square, in the tile.
    pub(super) fn middle(&self) -> [f32; 2] {
        [self.left, self.top].map(|v| centre(v) - 0.5 + 0.5 * BASE as f32)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.bits == [0; BASE]
    }

    pub(super) fn count(&self) -> u32 {
        u64::from_le_bytes(self.bits).count_ones()
    }

    pub(super) fn first(&self) -> [usize; 2] {
        let bit = u64::from_le_bytes(self.bits).trailing_zeros() as usize;
        [self.left + bit % BASE, self.top + bit / BASE]
    }

    pub(super) fn without(&self, o: &Self) -> Self {
        let mut left = *self;
        for (a, b) in left.bits.iter_mut().zip(o.bits) {
            *a &= !b;
        }
        left
    }

    pub(super) fn contains(&self, [x, y]: [usize; 2]) -> bool {
        self.bits[y - self.top] >> (x - self.left) & 1 != 0
    }
}

/// How far rays lie from those of a linear function, in pixels.
pub(super) struct Judge {
    linear: Linear<4>,
    /// From a difference of directions to the pixels between the rays.
    to_px: [[f32; 3]; 2],
    /// The squared distance that is accepted.
    accepted: f32,
    /// The relative difference of inverse depths that is accepted.
    depth: f32,
}

/// Where rays change much less across one direction of the picture than across the other, a difference in that
/// direction counts no more than this share says.
const FLATTEST: f32 = 0.02;

impl Judge {
    /// `focal_px`: of the eye. `tolerance`, `depth_tolerance`: in pixels, far away and at the mirror.
    pub(super) fn new(
        linear: &Linear<4>,
        [x, y]: [f32; 2],
        focal_px: f32,
        tolerance: f32,
        depth_tolerance: f32,
    ) -> Self {
        let d = [0, 1, 2].map(|k| linear.get(k, x, y));
        let dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let across = |v: [f32; 4]| {
            let s = (v[0] * d[0] + v[1] * d[1] + v[2] * d[2]) / dd;
            [0, 1, 2].map(|k| v[k] - s * d[k])
        };
        let (r, b) = (across(linear.right), across(linear.down));
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (mut rr, mut bb, rb) = (dot(r, r), dot(b, b), dot(r, b));
        let more = (rr + bb) * FLATTEST + f32::MIN_POSITIVE;
        rr += more;
        bb += more;
        let det = rr * bb - rb * rb;
        let to_px = [
            [0, 1, 2].map(|k| (r[k] * bb - b[k] * rb) / det),
            [0, 1, 2].map(|k| (b[k] * rr - r[k] * rb) / det),
        ];
        Self {
            linear: *linear,
            to_px,
            accepted: tolerance * tolerance,
            depth: depth_tolerance / focal_px,
        }
    }

    /// Those pixels of `mask` whose rays are near enough.
    #[inline(always)]
    pub(super) fn accepted(&self, field: &[[f32; AREA]; 4], mask: &Mask) -> Mask {
        let mut near = *mask;
        for y in mask.rows() {
            let cy = centre(y);
            let from = y * TILE + mask.left;
            let [a, b, c, q] = [0, 1, 2, 3].map(|k| &field[k][from..from + BASE]);
            let l = &self.linear;
            let mut bits = 0u8;
            for i in 0..BASE {
                let x = centre(mask.left + i);
                let e = [
                    a[i] - l.get(0, x, cy),
                    b[i] - l.get(1, x, cy),
                    c[i] - l.get(2, x, cy),
                ];
                let [u, v] = &self.to_px;
                let du = u[0] * e[0] + u[1] * e[1] + u[2] * e[2];
                let dv = v[0] * e[0] + v[1] * e[1] + v[2] * e[2];
                let inverse = l.get(3, x, cy);
                let same = (q[i] - inverse).abs() <= inverse * self.depth;
                let ok = (du * du + dv * dv <= self.accepted) & same;
                bits |= u8::from(ok) << i;
            }
            near.bits[y - mask.top] &= bits;
        }
        near
    }
}
