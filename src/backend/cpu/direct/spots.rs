//! Pieces of triangles as pixels show them, a lane for each.

use fearless_simd::Simd;
use glam::Vec3;

use super::Hit;
use super::painter::{Group, MIDDLES};
use crate::geometry::lanes::{Real, Vector};
use crate::visibility::{RayWeights, SAMPLE_EIGHTHS, SAMPLES, SurfaceMesh};

/// Lanes of a batch. A multiple of every vector's; small enough that all of it stays in the first cache.
pub const LANES: usize = 32;

/// Numbers that an [`super::Appearance`] has interpolated over triangles.
pub const VALUES: usize = 9;

/// The values at the corners of a triangle.
pub type CornerValues = [[f32; VALUES]; 3];

/// A list of `Spot`s, transposed: what some samples of a pixel show of one triangle.
///
/// The weights of a triangle's corners are proportional to functions that are linear in the picture. These are given in
/// f32 about a pixel near by, so that they keep the precision that the f64 of [`RayWeights`] gave them.
#[derive(Debug)]
pub struct Spots {
    /// How many lanes are in use. What the others hold is finite and of no interest.
    pub len: usize,
    /// Index of the triangle within the object.
    pub triangle: [u32; LANES],
    /// 1 for each sample that is meant, else 0.
    pub samples: [[f32; LANES]; SAMPLES],
    /// The sum of those.
    pub count: [f32; LANES],
    /// The mean of the samples: from the pixel's middle, px.
    middle: [[f32; LANES]; 2],
    shares: Shares,
    /// Pixels from that one.
    ahead: [f32; LANES],
    values: [[[f32; LANES]; VALUES]; 3],
    /// Index of the pixel in the band that is painted.
    pub(super) pixel: [u32; LANES],
}

/// The functions at the middle of the first pixel of a row of spots, and their changes per pixel in x and y.
type Shares = [[[f32; LANES]; 3]; 3];

impl Default for Spots {
    fn default() -> Self {
        Self {
            len: 0,
            triangle: [0; LANES],
            samples: [[0.0; LANES]; SAMPLES],
            count: [0.0; LANES],
            middle: [[0.0; LANES]; 2],
            shares: [[[0.0; LANES]; 3]; 3],
            ahead: [0.0; LANES],
            values: [[[0.0; LANES]; VALUES]; 3],
            pixel: [0; LANES],
        }
    }
}

/// A row of pixels of which the same samples show the same triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub(super) triangle: u32,
    /// Index of the first pixel in the band.
    pub(super) pixel: u32,
    pub(super) pixels: u32,
    pub(super) samples: Group,
}

/// A triangle of which something was seen.
pub(super) struct Met {
    pub(super) triangle: u32,
    pub(super) rays: RayWeights,
    pub(super) values: CornerValues,
}

impl Spots {
    /// Adds as many of a spot's pixels as there is room for, from the pixel that is `ahead` of its first one, and returns
    /// their number. `shares`: of the triangle, about the middle of the first pixel.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "parts of pixels")]
    pub(super) fn push(
        &mut self,
        spot: &Spot,
        shares: &[[f32; 3]; 3],
        values: &CornerValues,
        ahead: u32,
    ) -> u32 {
        let from = self.len;
        let room = u32::try_from(LANES - from).unwrap_or(0);
        let added = room.min(spot.pixels - ahead);
        let to = from + added as usize;
        for (lane, i) in (from..to).zip(ahead..) {
            self.pixel[lane] = spot.pixel + i;
            self.ahead[lane] = i as f32;
        }
        self.len = to;
        // A long row fills batch after batch with the same.
        if ahead as usize >= LANES && from == 0 {
            return added;
        }
        put(&mut self.triangle, from, to, spot.triangle);
        for (sample, lanes) in self.samples.iter_mut().enumerate() {
            put(lanes, from, to, (spot.samples.0 >> sample & 1) as f32);
        }
        put(&mut self.count, from, to, spot.samples.count());
        for k in 0..2 {
            put(&mut self.middle[k], from, to, MIDDLES[spot.samples.0].0[k] as f32 - 0.5);
        }
        for k in 0..3 {
            for (lanes, share) in self.shares[k].iter_mut().zip(shares[k]) {
                put(lanes, from, to, share);
            }
            for (lanes, value) in self.values[k].iter_mut().zip(values[k]) {
                put(lanes, from, to, value);
            }
        }
        added
    }

    /// The weights of the corners in the middle of the samples, in the lanes from `at` on.
    #[inline(always)]
    pub fn own_weights<S: Simd, V: Vector<S>>(&self, simd: S, at: usize) -> [V; 3] {
        self.weights(simd, at, self.own_place(simd, at), 0.0)
    }

    /// The same, and those a pixel to the right and a pixel below: how far the pixel reaches.
    #[inline(always)]
    pub fn pixel_weights<S: Simd, V: Vector<S>>(&self, simd: S, at: usize) -> [[V; 3]; 3] {
        let [x, y] = self.own_place(simd, at);
        [[x, y], [x + 1.0, y], [x, y + 1.0]].map(|place| self.weights(simd, at, place, 0.0))
    }

    #[inline(always)]
    fn own_place<S: Simd, V: Vector<S>>(&self, simd: S, at: usize) -> [V; 2] {
        [V::load(simd, &self.middle[0][at..]), V::load(simd, &self.middle[1][at..])]
    }

    /// The weights of the corners at one of the samples of a pixel, in the lanes from `at` on.
    #[inline(always)]
    pub fn sample_weights<S: Simd, V: Vector<S>>(
        &self,
        simd: S,
        at: usize,
        sample: usize,
    ) -> [V; 3] {
        let [x, y] = from_middle(sample);
        let place = [V::broadcast(simd, x), V::broadcast(simd, y)];
        self.weights(simd, at, place, -BEYOND)
    }

    /// At a place that is given from the pixels' middles (px); none less than `least`.
    #[inline(always)]
    fn weights<S: Simd, V: Vector<S>>(
        &self,
        simd: S,
        at: usize,
        [x, y]: [V; 2],
        least: f32,
    ) -> [V; 3] {
        let place = [x + V::load(simd, &self.ahead[at..]), y];
        let least = V::broadcast(simd, least);
        normalized([
            share(simd, at, &self.shares, 0, place).max(least),
            share(simd, at, &self.shares, 1, place).max(least),
            share(simd, at, &self.shares, 2, place).max(least),
        ])
    }

    /// Three of the values at points of the lanes from `at` on.
    #[inline(always)]
    pub fn values<S: Simd, V: Vector<S>>(
        &self,
        simd: S,
        at: usize,
        weights: [V; 3],
        first: usize,
    ) -> [V; 3] {
        [
            self.value(simd, at, weights, first),
            self.value(simd, at, weights, first + 1),
            self.value(simd, at, weights, first + 2),
        ]
    }

    #[inline(always)]
    fn value<S: Simd, V: Vector<S>>(&self, simd: S, at: usize, weights: [V; 3], i: usize) -> V {
        let [a, b, c] = &self.values;
        V::load(simd, &a[i][at..]) * weights[0]
            + V::load(simd, &b[i][at..]) * weights[1]
            + V::load(simd, &c[i][at..]) * weights[2]
    }

    /// The point in the middle of the samples of one lane.
    pub fn own_hit(&self, mesh: &SurfaceMesh, object: usize, lane: usize) -> Hit {
        self.hit(mesh, object, lane, [self.middle[0][lane], self.middle[1][lane]], 0.0)
    }

    /// The point at a sample of one lane.
    pub fn sample_hit(&self, mesh: &SurfaceMesh, object: usize, lane: usize, sample: usize) -> Hit {
        self.hit(mesh, object, lane, from_middle(sample), -BEYOND)
    }

    fn hit(
        &self,
        mesh: &SurfaceMesh,
        object: usize,
        lane: usize,
        [x, y]: [f32; 2],
        least: f32,
    ) -> Hit {
        let x = x + self.ahead[lane];
        let [start, by_x, by_y] = &self.shares;
        let share = |k: usize| (start[k][lane] + by_x[k][lane] * x + by_y[k][lane] * y).max(least);
        let weights = normalized([share(0), share(1), share(2)]);
        let triangle = self.triangle[lane] as usize;
        let [a, b, c] = mesh.corners(triangle);
        Hit { object, triangle, weights, point: a * weights[0] + b * weights[1] + c * weights[2] }
    }
}

/// Most rows of spots on fine meshes are of one pixel.
#[inline(always)]
fn put<T: Copy>(lanes: &mut [T; LANES], from: usize, to: usize, value: T) {
    if to - from == 1 {
        lanes[from] = value;
    } else {
        lanes[from..to].fill(value);
    }
}

/// One of the functions.
#[inline(always)]
fn share<S: Simd, V: Vector<S>>(
    simd: S,
    at: usize,
    shares: &Shares,
    k: usize,
    [x, y]: [V; 2],
) -> V {
    let start = V::load(simd, &shares[0][k][at..]);
    let by_x = V::load(simd, &shares[1][k][at..]);
    let by_y = V::load(simd, &shares[2][k][at..]);
    start + by_x * x + by_y * y
}

/// The same with the sum 1, whatever they are.
#[inline(always)]
fn normalized<R: Real<Scalar = f32>>(shares: [R; 3]) -> [R; 3] {
    let sum = shares[0] + shares[1] + shares[2];
    let (one, third) = (sum.splat(1.0), sum.splat(1.0 / 3.0));
    let some = sum.splat(0.0).lt(sum);
    let scale = one / R::select(some, sum, one);
    [
        R::select(some, shares[0] * scale, third),
        R::select(some, shares[1] * scale, third),
        R::select(some, shares[2] * scale, third),
    ]
}

/// From the pixel's middle to a sample, px.
fn from_middle(sample: usize) -> [f32; 2] {
    SAMPLE_EIGHTHS[sample].map(|eighths| f32::from(eighths) / 8.0 - 0.5)
}

/// A smooth surface goes on as its triangle for so many sizes of it, for samples that show a neighbour. Else, where the view
/// ray passes the triangle, which it does by less than a pixel, negative weights are taken for zero.
const BEYOND: f32 = 1.0;

/// Radiances, transposed.
pub type Colors = [[f32; LANES]; 3];

/// One of them.
pub(super) fn color(colors: &Colors, lane: usize) -> Vec3 {
    Vec3::new(colors[0][lane], colors[1][lane], colors[2][lane])
}

/// Pieces of sky, a lane for each.
#[derive(Debug)]
pub(super) struct SkySpots {
    pub(super) len: usize,
    /// Picture positions, from the picture's middle in focal lengths.
    pub(super) place: [[f32; LANES]; 2],
    pub(super) count: [f32; LANES],
    pub(super) pixel: [u32; LANES],
}

impl Default for SkySpots {
    fn default() -> Self {
        Self { len: 0, place: [[0.0; LANES]; 2], count: [0.0; LANES], pixel: [0; LANES] }
    }
}
