//! Draws one triangle into one tile: eight lanes hold the samples of a pixel.

use fearless_simd::{Select, Simd, SimdBase, SimdFrom, SimdMask, f32x8, i32x8, u32x8};

use super::project::{EIGHTH_BITS, SUBPIXEL_BITS};
use super::tiles::{Grid, ScreenTriangle, TILE_HEIGHT, TILE_PIXELS, TILE_WIDTH, Window, extremes};
use super::{NONE_ID, SAMPLE_EIGHTHS, SAMPLES};

/// Samples of a pixel rounded up to vector lanes; the last lanes repeat the centre and are never read.
const LANES: usize = 8;

/// From the pixel's top left corner to its samples, in eighths and in pixels.
const OFFSETS: [[i32; LANES]; 2] = [eighths(0), eighths(1)];
const PIXEL_OFFSETS: [[f32; LANES]; 2] = [pixels(OFFSETS[0]), pixels(OFFSETS[1])];

const fn eighths(axis: usize) -> [i32; LANES] {
    let mut offsets = [SAMPLE_EIGHTHS[0][axis] as i32; LANES];
    let mut i = 0;
    while i < SAMPLES {
        offsets[i] = SAMPLE_EIGHTHS[i][axis] as i32;
        i += 1;
    }
    offsets
}

const fn pixels(eighths: [i32; LANES]) -> [f32; LANES] {
    let mut offsets = [0.0; LANES];
    let mut i = 0;
    while i < LANES {
        offsets[i] = eighths[i] as f32 / 8.0;
        i += 1;
    }
    offsets
}

/// What is nearest so far at the samples of a pixel.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(super) struct Pixel {
    pub(super) inverse_depth: [f32; LANES],
    pub(super) id: [u32; LANES],
}

impl Pixel {
    pub(super) const EMPTY: Self = Self { inverse_depth: [0.0; LANES], id: [NONE_ID; LANES] };
}

/// Draws the part of a triangle that lies in a tile.
///
/// Edge functions are kept in units of 2⁸ square sub-pixels, which is exact for the signs at samples: they
/// change by whole units from one eighth of a pixel to the next.
#[inline(always)]
pub(super) fn draw_triangle<S: Simd>(
    simd: S,
    triangle: &ScreenTriangle,
    grid: &Grid,
    tile: Window,
    pixels: &mut [Pixel; TILE_PIXELS],
) {
    let own = grid.pixels(extremes(triangle.x, triangle.y));
    let first = [own.first[0].max(tile.first[0]), own.first[1].max(tile.first[1])];
    let last = [own.last[0].min(tile.last[0]), own.last[1].min(tile.last[1])];
    let size = [last[0] - first[0] + 1, last[1] - first[1] + 1];
    if size[0] <= 0 || size[1] <= 0 {
        return;
    }
    let mut edges = [
        Edge::new(triangle, 0, first),
        Edge::new(triangle, 1, first),
        Edge::new(triangle, 2, first),
    ];
    if edges[0].is_long() || edges[1].is_long() || edges[2].is_long() {
        for edge in &mut edges {
            match edge.side(size) {
                Side::Outside => return,
                Side::Inside => *edge = Edge::EVERYWHERE,
                Side::Crosses => {}
            }
        }
    }
    let mut painter = Painter {
        simd,
        triangle,
        first,
        plane: None,
        start: [first[0] - tile.first[0], first[1] - tile.first[1]],
        pixels,
    };
    let ox = i32x8::simd_from(simd, OFFSETS[0]);
    let oy = i32x8::simd_from(simd, OFFSETS[1]);
    let [a, b, c] = edges;
    let offsets_a = ox * a.step[0] + oy * a.step[1];
    let offsets_b = ox * b.step[0] + oy * b.step[1];
    let offsets_c = ox * c.step[0] + oy * c.step[1];
    if a.is_long() || b.is_long() || c.is_long() {
        for y in 0..size[1] {
            for x in 0..size[0] {
                painter.paint(
                    [x, y],
                    (offsets_a + a.at(x, y)) | (offsets_b + b.at(x, y)) | (offsets_c + c.at(x, y)),
                );
            }
        }
    } else {
        let mut row_a = offsets_a + a.at(0, 0);
        let mut row_b = offsets_b + b.at(0, 0);
        let mut row_c = offsets_c + c.at(0, 0);
        for y in 0..size[1] {
            let (mut value_a, mut value_b, mut value_c) = (row_a, row_b, row_c);
            for x in 0..size[0] {
                painter.paint([x, y], value_a | value_b | value_c);
                value_a += a.step[0] << 3;
                value_b += b.step[0] << 3;
                value_c += c.step[0] << 3;
            }
            row_a += a.step[1] << 3;
            row_b += b.step[1] << 3;
            row_c += c.step[1] << 3;
        }
    }
}

/// Writes one triangle into a tile.
struct Painter<'a, S: Simd> {
    simd: S,
    triangle: &'a ScreenTriangle,
    /// The first pixel of the triangle in the tile, from the picture's top left.
    first: [i32; 2],
    /// The same from the tile's top left.
    start: [i32; 2],
    /// Made at the first sample that is hit: small triangles mostly have none.
    plane: Option<DepthPlane<S>>,
    pixels: &'a mut [Pixel; TILE_PIXELS],
}

impl<S: Simd> Painter<'_, S> {
    /// Paints the samples of the pixel `x`, `y` away from the first where `edges` is not negative.
    #[inline(always)]
    fn paint(&mut self, [x, y]: [i32; 2], edges: i32x8<S>) {
        let inside = edges.simd_ge(0);
        if inside.all_false() {
            return;
        }
        if self.plane.is_none() {
            self.plane = Some(DepthPlane::new(self.simd, self.triangle, self.first));
        }
        let Some(plane) = &self.plane else { return };
        let inverse_depth = plane.at(x, y);
        let index = (self.start[1] + y) * TILE_WIDTH.cast_signed() + self.start[0] + x;
        let pixel = &mut self.pixels[index.unsigned_abs() as usize];
        let best = f32x8::simd_from(self.simd, pixel.inverse_depth);
        let nearer = inside & inverse_depth.simd_gt(best);
        pixel.inverse_depth = nearer.select(inverse_depth, best).into();
        let id = u32x8::simd_from(self.simd, pixel.id);
        pixel.id = nearer.select(u32x8::splat(self.simd, self.triangle.id), id).into();
    }
}

/// The edge function between two corners of a triangle.
#[derive(Clone, Copy)]
struct Edge {
    /// At the top left corner of the first pixel, rounded down; negative outside.
    start: i64,
    /// Change per eighth of a pixel in x and y.
    step: [i32; 2],
}

/// Where a window of pixels lies.
enum Side {
    Inside,
    Outside,
    Crosses,
}

impl Edge {
    /// Has everything inside.
    const EVERYWHERE: Self = Self { start: 0, step: [0, 0] };

    /// Bound of what the function changes by within a tile, if the edge is not long.
    const REACH: i32 = 1 << 30;

    #[inline(always)]
    fn new(triangle: &ScreenTriangle, k: usize, first: [i32; 2]) -> Self {
        let next = (k + 1) % 3;
        let a = triangle.y[k] - triangle.y[next];
        let b = triangle.x[next] - triangle.x[k];
        // A sample on the edge counts as if it lay a hair to the right, and half a hair further down:
        // then it is in exactly one of the triangles about an edge or a corner.
        let beyond = i64::from(!(a > 0 || (a == 0 && b > 0)));
        let to_first = |c: i32, pixel: i32| i64::from((pixel << SUBPIXEL_BITS) - c);
        let value = i64::from(a) * to_first(triangle.x[k], first[0])
            + i64::from(b) * to_first(triangle.y[k], first[1]);
        Self { start: (value - beyond) >> EIGHTH_BITS, step: [a, b] }
    }

    /// Whether the function's changes within a tile may not fit 30 bits.
    #[inline(always)]
    fn is_long(&self) -> bool {
        const LIMIT: u32 = Edge::REACH.unsigned_abs() / 8 / (TILE_WIDTH + TILE_HEIGHT);
        self.step[0].unsigned_abs().max(self.step[1].unsigned_abs()) >= LIMIT
    }

    /// At the top left corner of the pixel `x`, `y` away from the first. Clamped so that adding what it
    /// changes by on the way to a sample (or, if the edge is not long, within the tile) keeps the sign and
    /// fits 32 bits.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "clamped")]
    fn at(&self, x: i32, y: i32) -> i32 {
        let change = |k: usize, pixels: i32| i64::from(self.step[k]) * i64::from(pixels << 3);
        let reach = i64::from(Self::REACH);
        (self.start + change(0, x) + change(1, y)).clamp(-reach, reach - 1) as i32
    }

    /// On which side of it the window of that many pixels from the first lies.
    #[inline(always)]
    fn side(&self, size: [i32; 2]) -> Side {
        let change = [0, 1].map(|k: usize| i64::from(self.step[k]) * i64::from(size[k] << 3));
        if self.start + change[0].max(0) + change[1].max(0) < 0 {
            Side::Outside
        } else if self.start + change[0].min(0) + change[1].min(0) >= 0 {
            Side::Inside
        } else {
            Side::Crosses
        }
    }
}

/// 1 / depth over the picture plane.
struct DepthPlane<S: Simd> {
    /// At the samples of the first pixel.
    start: f32x8<S>,
    /// Change per pixel in x and y.
    step: [f32; 2],
    /// Lowest and highest in the triangle: rounding must not take a sliver's samples out of it.
    range: [f32; 2],
}

impl<S: Simd> DepthPlane<S> {
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "depth is compared in f32")]
    fn new(simd: S, triangle: &ScreenTriangle, first: [i32; 2]) -> Self {
        let ScreenTriangle { x, y, inverse_depth: d, .. } = triangle;
        let (abx, acx) = (f64::from(x[1] - x[0]), f64::from(x[2] - x[0]));
        let (aby, acy) = (f64::from(y[1] - y[0]), f64::from(y[2] - y[0]));
        let (abd, acd) = (f64::from(d[1]) - f64::from(d[0]), f64::from(d[2]) - f64::from(d[0]));
        let per_area = 1.0 / (abx * acy - acx * aby);
        let slope = [(abd * acy - acd * aby) * per_area, (acd * abx - abd * acx) * per_area];
        let to_first = |c: i32, pixel: i32| f64::from((pixel << SUBPIXEL_BITS) - c);
        let corner = f64::from(d[0])
            + slope[0] * to_first(x[0], first[0])
            + slope[1] * to_first(y[0], first[1]);
        let pixel = f64::from(1 << SUBPIXEL_BITS);
        let step = [(slope[0] * pixel) as f32, (slope[1] * pixel) as f32];
        let ox = f32x8::simd_from(simd, PIXEL_OFFSETS[0]);
        let oy = f32x8::simd_from(simd, PIXEL_OFFSETS[1]);
        Self {
            start: ox * step[0] + oy * step[1] + corner as f32,
            step,
            range: [d[0].min(d[1]).min(d[2]), d[0].max(d[1]).max(d[2])],
        }
    }

    /// At the samples of the pixel `x`, `y` away from the first.
    #[inline(always)]
    fn at(&self, x: i32, y: i32) -> f32x8<S> {
        let change = self.step[0] * x as f32 + self.step[1] * y as f32;
        (self.start + change).max(self.range[0]).min(self.range[1])
    }
}
