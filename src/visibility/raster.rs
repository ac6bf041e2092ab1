//! The rasteriser: triangles are sorted into tiles by chunks, then tiles are drawn by bands.
//!
//! Every sample keeps the nearest triangle and, among equals, the first; triangles reach every tile in the
//! order of their ids. So neither the threads nor the chunks nor the tiles can be seen in the result.

use fearless_simd::{
    Level, Select, Simd, SimdBase, SimdFrom, SimdMask, dispatch, f32x8, i32x8, u32x8,
};
use rayon::prelude::*;

use super::project::{Corner, Projection, SUBPIXEL_BITS};
use super::{NONE_ID, SAMPLE_EIGHTHS, SAMPLES, SurfaceMesh, Visibility};
use crate::camera::Eye;
use crate::camera::eye::ImageSize;
use crate::geometry::Aabb;

/// Tile sides in pixels; a tile's samples (64 KiB) stay in the second-level cache. Measured: 32x16, 64x8
/// and 64x32 are within the noise or slower.
const TILE_WIDTH: usize = 64;
const TILE_HEIGHT: usize = 16;

/// Triangles a chunk: what one thread sorts at a time. Untuned.
const CHUNK: usize = 8_192;

/// A triangle whose box meets more tiles than this is listed by rows of tiles and not copied, so that lists
/// stay proportional to the number of triangles.
const MAX_LISTED_TILES: usize = 4;

/// Samples of a pixel rounded up to vector lanes; the last lanes repeat the centre and are never read.
const LANES: usize = 8;

/// Eighths of a pixel are the unit of sample positions.
const EIGHTH_BITS: u32 = SUBPIXEL_BITS - 3;

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

/// Memory that frames reuse, and the instruction set to use.
#[derive(Debug)]
pub struct Scratch {
    level: Level,
    corners: Vec<Corner>,
    first_corners: Vec<usize>,
    chunks: Vec<Chunk>,
}

impl Scratch {
    /// Empty, for one instruction set. It changes the speed, not the result.
    pub fn new(level: Level) -> Self {
        Self { level, corners: Vec::new(), first_corners: Vec::new(), chunks: Vec::new() }
    }
}

impl Default for Scratch {
    fn default() -> Self {
        Self::new(Level::new())
    }
}

/// A triangle on the picture plane, counter-clockwise in (x, y): its edge functions are positive inside.
#[derive(Clone, Copy, Debug)]
struct ScreenTriangle {
    x: [i32; 3],
    y: [i32; 3],
    inverse_depth: [f32; 3],
    id: u32,
    /// The tiles that its box meets.
    tiles: Tiles,
}

/// The visible ones of a range of triangles, sorted by tiles; each tile has them in the order of their ids.
#[derive(Debug, Default)]
struct Chunk {
    triangles: Vec<ScreenTriangle>,
    /// Copies of the triangles that meet few tiles, tile after tile, so that a tile reads them in a row.
    listed: Vec<ScreenTriangle>,
    /// Where each tile's part of `listed` ends; it starts where the one before ends.
    ends: Vec<u32>,
    /// Indices of the other triangles, row of tiles after row of tiles.
    large: Vec<u32>,
    /// Where each row's part of `large` ends.
    large_ends: Vec<u32>,
}

/// Fills the planes of `out`, whose size and ids are set.
pub(super) fn draw(
    eye: &Eye,
    mirrors: &[SurfaceMesh],
    objects: &[SurfaceMesh],
    scratch: &mut Scratch,
    out: &mut Visibility,
) {
    let surfaces: Vec<SurfaceMesh> = mirrors.iter().chain(objects).copied().collect();
    let projection = Projection::new(eye, bounds(&surfaces).diagonal());
    project(&projection, &surfaces, scratch);

    let Scratch { level, corners, first_corners, chunks } = scratch;
    let grid = Grid::new(eye.size);
    let triangles: usize = surfaces.iter().map(|s| s.triangles.len()).sum();
    chunks.resize_with(triangles.div_ceil(CHUNK), Chunk::default);
    let source = Source { projection, surfaces: &surfaces, corners, first_corners };
    chunks.par_iter_mut().enumerate().for_each(|(i, chunk)| {
        let first = i * CHUNK;
        dispatch!(*level, _simd => {
            chunk.collect(&source, &grid, &out.first_ids, first..(first + CHUNK).min(triangles));
            chunk.sort(&grid);
        });
    });

    let mirror_triangles = out.mirror_triangles();
    let band = (eye.size.width as usize * TILE_HEIGHT).max(1);
    out.samples
        .par_chunks_mut(band)
        .zip(out.mirror_ids.par_chunks_mut(band))
        .zip(out.mirror_depth.par_chunks_mut(band))
        .enumerate()
        .for_each(|(row, ((samples, mirror_ids), mirror_depth))| {
            let mut planes = Band { samples, mirror_ids, mirror_depth, mirror_triangles };
            for column in 0..grid.columns {
                dispatch!(*level, simd => draw_tile(simd, chunks, &grid, column, row, &mut planes));
            }
        });
}

fn bounds(surfaces: &[SurfaceMesh]) -> Aabb {
    surfaces
        .par_iter()
        .flat_map(|surface| surface.positions.par_chunks(CHUNK))
        .map(|positions| Aabb::of(positions.iter().copied().filter(|p| p.is_finite())))
        .reduce(|| Aabb::EMPTY, Aabb::union)
}

/// Moves all corners to the picture plane.
fn project(projection: &Projection, surfaces: &[SurfaceMesh], scratch: &mut Scratch) {
    let Scratch { level, corners, first_corners, .. } = scratch;
    let level = *level;
    first_corners.clear();
    let mut total = 0;
    for surface in surfaces {
        first_corners.push(total);
        total += surface.positions.len();
    }
    corners.resize(total, Corner::default());
    let mut rest = corners.as_mut_slice();
    let mut jobs = Vec::new();
    for surface in surfaces {
        let (own, others) = std::mem::take(&mut rest).split_at_mut(surface.positions.len());
        rest = others;
        jobs.extend(surface.positions.chunks(CHUNK).zip(own.chunks_mut(CHUNK)));
    }
    jobs.into_par_iter().for_each(|(points, corners)| {
        dispatch!(level, _simd => for (corner, &point) in corners.iter_mut().zip(points) {
            *corner = projection.corner(point);
        });
    });
}

/// Where triangles come from.
struct Source<'a> {
    projection: Projection,
    surfaces: &'a [SurfaceMesh<'a>],
    corners: &'a [Corner],
    first_corners: &'a [usize],
}

/// The tiles of a picture.
struct Grid {
    size: ImageSize,
    columns: usize,
    rows: usize,
}

/// Inclusive ranges of pixels; empty where a first is above its last.
#[derive(Clone, Copy, Debug)]
struct Window {
    first: [i32; 2],
    last: [i32; 2],
}

impl Window {
    #[inline(always)]
    fn is_empty(&self) -> bool {
        self.first[0] > self.last[0] || self.first[1] > self.last[1]
    }
}

/// Inclusive ranges of tile columns and rows.
#[derive(Clone, Copy, Debug)]
struct Tiles {
    first: [u16; 2],
    last: [u16; 2],
}

impl Tiles {
    /// The tiles of a window that is not empty.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "tiles up to MAX_SIDE fit")]
    fn new(pixels: Window) -> Self {
        let tile = |[x, y]: [i32; 2]| {
            [x.unsigned_abs() / TILE_WIDTH as u32, y.unsigned_abs() / TILE_HEIGHT as u32]
                .map(|tile| tile as u16)
        };
        Self { first: tile(pixels.first), last: tile(pixels.last) }
    }

    #[inline(always)]
    fn are_many(self) -> bool {
        let side = |k: usize| usize::from(self.last[k] - self.first[k]) + 1;
        side(0) * side(1) > MAX_LISTED_TILES
    }

    #[inline(always)]
    fn has_column(self, column: usize) -> bool {
        (usize::from(self.first[0])..=usize::from(self.last[0])).contains(&column)
    }

    #[inline(always)]
    fn rows(self) -> std::ops::Range<usize> {
        usize::from(self.first[1])..usize::from(self.last[1]) + 1
    }

    /// Row by row, with that many columns in a row.
    #[inline(always)]
    fn indices(self, columns: usize) -> impl Iterator<Item = usize> {
        let own = usize::from(self.first[0])..usize::from(self.last[0]) + 1;
        self.rows().flat_map(move |row| own.clone().map(move |column| row * columns + column))
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "picture sizes fit: beyond MAX_SIDE there are no triangles"
)]
fn signed(pixels: usize) -> i32 {
    pixels.min(1 << 20) as i32
}

impl Grid {
    fn new(size: ImageSize) -> Self {
        Self {
            size,
            columns: (size.width as usize).div_ceil(TILE_WIDTH),
            rows: (size.height as usize).div_ceil(TILE_HEIGHT),
        }
    }

    /// The pixels of the picture of which a triangle's box may contain a sample.
    #[inline(always)]
    fn pixels(&self, [x, y]: Extremes) -> Window {
        // Samples lie between the first and the seventh eighth of their pixel.
        let first = |low: i32| ((low + (1 << EIGHTH_BITS) - 1) >> SUBPIXEL_BITS).max(0);
        let last = |high: i32, side: u32| {
            ((high - (1 << EIGHTH_BITS)) >> SUBPIXEL_BITS).min(signed(side as usize) - 1)
        };
        Window {
            first: [first(x[0]), first(y[0])],
            last: [last(x[1], self.size.width), last(y[1], self.size.height)],
        }
    }
}

/// Lowest and highest x, lowest and highest y of a triangle, sub-pixels.
type Extremes = [[i32; 2]; 2];

#[inline(always)]
fn extremes(x: [i32; 3], y: [i32; 3]) -> Extremes {
    [x, y].map(|[a, b, c]| [a.min(b).min(c), a.max(b).max(c)])
}

/// Whether a box contains a sample of the unbounded picture: few triangles much smaller than a pixel do,
/// and the others end here.
#[inline(always)]
fn may_show(extremes: Extremes) -> bool {
    let [(x, x_more), (y, y_more)] = extremes.map(|[low, high]| {
        let first = (low + (1 << EIGHTH_BITS) - 1) >> EIGHTH_BITS;
        (first, (high >> EIGHTH_BITS) - first)
    });
    if x_more < 0 || y_more < 0 {
        return false;
    }
    let hit = |table: &[[u8; 8]; 8], first: i32, more: i32| {
        table[(first & 7).unsigned_abs() as usize][more.min(7).unsigned_abs() as usize]
    };
    hit(&HIT_SAMPLES[0], x, x_more) & hit(&HIT_SAMPLES[1], y, y_more) != 0
}

impl ScreenTriangle {
    /// Turned counter-clockwise; `None` if it shows at no sample of the picture.
    #[inline(always)]
    fn new([a, b, c]: [Corner; 3], id: u32, grid: &Grid) -> Option<Self> {
        let extremes = extremes([a.x, b.x, c.x], [a.y, b.y, c.y]);
        if !may_show(extremes) {
            return None;
        }
        let pixels = grid.pixels(extremes);
        let (abx, aby) = (i64::from(b.x - a.x), i64::from(b.y - a.y));
        let (acx, acy) = (i64::from(c.x - a.x), i64::from(c.y - a.y));
        let area = abx * acy - acx * aby;
        if pixels.is_empty() || area == 0 {
            return None;
        }
        let (b, c) = if area < 0 { (c, b) } else { (b, c) };
        Some(Self {
            x: [a.x, b.x, c.x],
            y: [a.y, b.y, c.y],
            inverse_depth: [a.inverse_depth, b.inverse_depth, c.inverse_depth],
            id,
            tiles: Tiles::new(pixels),
        })
    }
}

/// The samples (one bit each) whose column (`[0]`) or row (`[1]`) is among the `more + 1` eighths from
/// `first` on, modulo whole pixels: `[first][more]`.
const HIT_SAMPLES: [[[u8; 8]; 8]; 2] = {
    let mut table = [[[0; 8]; 8]; 2];
    let mut i = 0;
    while i < 2 * 8 * 8 * SAMPLES {
        let (axis, first, more, sample) =
            (i / (64 * SAMPLES), i / (8 * SAMPLES) % 8, i / SAMPLES % 8, i % SAMPLES);
        let eighth = SAMPLE_EIGHTHS[sample][axis] as usize;
        if (eighth + 8 - first) % 8 <= more {
            table[axis][first][more] |= 1 << sample;
        }
        i += 1;
    }
    table
};

impl Chunk {
    /// Gathers the triangles with these ids that may show.
    #[inline(always)]
    fn collect(
        &mut self,
        source: &Source,
        grid: &Grid,
        first_ids: &[u32],
        ids: std::ops::Range<usize>,
    ) {
        self.triangles.clear();
        for (i, surface) in source.surfaces.iter().enumerate() {
            let surface_ids = first_ids[i] as usize..first_ids[i + 1] as usize;
            let start = ids.start.clamp(surface_ids.start, surface_ids.end);
            let end = ids.end.clamp(surface_ids.start, surface_ids.end);
            let corners = &source.corners[source.first_corners[i]..];
            let own = &surface.triangles[start - surface_ids.start..end - surface_ids.start];
            for (indices, id) in own.iter().zip(super::id(start)..) {
                let corners = indices.map(|i| corners[i as usize]);
                let outside = corners.map(|c| c.outside);
                if outside[0] | outside[1] | outside[2] == 0 {
                    self.triangles.extend(ScreenTriangle::new(corners, id, grid));
                } else if outside[0] & outside[1] & outside[2] == 0 {
                    let points = indices.map(|i| surface.positions[i as usize]);
                    source.projection.clipped(points, |corners| {
                        self.triangles.extend(ScreenTriangle::new(corners, id, grid));
                    });
                }
            }
        }
    }

    /// Sorts what was gathered by tiles: counts, sums up, fills.
    #[inline(always)]
    fn sort(&mut self, grid: &Grid) {
        let Self { triangles, listed, ends, large, large_ends } = self;
        ends.clear();
        ends.resize(grid.columns * grid.rows, 0);
        large_ends.clear();
        large_ends.resize(grid.rows, 0);
        for triangle in triangles.iter() {
            if triangle.tiles.are_many() {
                triangle.tiles.rows().for_each(|row| large_ends[row] += 1);
            } else {
                triangle.tiles.indices(grid.columns).for_each(|tile| ends[tile] += 1);
            }
        }
        if let Some(&any) = triangles.first() {
            listed.resize(counts_to_starts(ends), any);
        }
        large.resize(counts_to_starts(large_ends), 0);
        for (triangle, index) in triangles.iter().zip(0..) {
            if triangle.tiles.are_many() {
                for row in triangle.tiles.rows() {
                    large[large_ends[row] as usize] = index;
                    large_ends[row] += 1;
                }
            } else {
                for tile in triangle.tiles.indices(grid.columns) {
                    listed[ends[tile] as usize] = *triangle;
                    ends[tile] += 1;
                }
            }
        }
    }

    /// The triangles that may meet a tile, in ascending order of their ids.
    #[inline(always)]
    fn in_tile(
        &self,
        grid: &Grid,
        column: usize,
        row: usize,
    ) -> impl Iterator<Item = &ScreenTriangle> {
        let mut listed =
            self.listed[part(&self.ends, row * grid.columns + column)].iter().peekable();
        let mut large = self.large[part(&self.large_ends, row)]
            .iter()
            .map(|&index| &self.triangles[index as usize])
            .filter(move |triangle| triangle.tiles.has_column(column))
            .peekable();
        std::iter::from_fn(move || match (listed.peek(), large.peek()) {
            (Some(next), Some(earlier)) if earlier.id < next.id => large.next(),
            (Some(_), _) => listed.next(),
            (None, _) => large.next(),
        })
    }
}

/// Turns counts into where each part starts; returns the sum. Filling the parts turns them into ends.
fn counts_to_starts(counts: &mut [u32]) -> usize {
    let mut total = 0;
    for count in counts {
        (*count, total) = (total, total + *count);
    }
    total as usize
}

fn part(ends: &[u32], i: usize) -> std::ops::Range<usize> {
    i.checked_sub(1).map_or(0, |before| ends[before] as usize)..ends[i] as usize
}

/// The rows of the result that a row of tiles covers.
struct Band<'a> {
    samples: &'a mut [[u32; SAMPLES]],
    mirror_ids: &'a mut [u32],
    mirror_depth: &'a mut [f32],
    mirror_triangles: u32,
}

/// What is nearest so far at the samples of a pixel.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Pixel {
    inverse_depth: [f32; LANES],
    id: [u32; LANES],
}

#[inline(always)]
fn draw_tile<S: Simd>(
    simd: S,
    chunks: &[Chunk],
    grid: &Grid,
    column: usize,
    row: usize,
    planes: &mut Band,
) {
    let empty = Pixel { inverse_depth: [0.0; LANES], id: [NONE_ID; LANES] };
    let mut pixels = [empty; TILE_WIDTH * TILE_HEIGHT];
    let (left, top) = (column * TILE_WIDTH, row * TILE_HEIGHT);
    let width = TILE_WIDTH.min(grid.size.width as usize - left);
    let height = TILE_HEIGHT.min(grid.size.height as usize - top);
    let window = Window {
        first: [signed(left), signed(top)],
        last: [signed(left + width) - 1, signed(top + height) - 1],
    };
    for chunk in chunks {
        for triangle in chunk.in_tile(grid, column, row) {
            draw_triangle(simd, triangle, grid, window, &mut pixels);
        }
    }
    for y in 0..height {
        for (x, pixel) in pixels[y * TILE_WIDTH..][..width].iter().enumerate() {
            let out = y * grid.size.width as usize + left + x;
            planes.samples[out].copy_from_slice(&pixel.id[..SAMPLES]);
            let is_mirror = pixel.id[0] < planes.mirror_triangles;
            planes.mirror_ids[out] = if is_mirror { pixel.id[0] } else { NONE_ID };
            planes.mirror_depth[out] =
                if is_mirror { 1.0 / pixel.inverse_depth[0] } else { f32::INFINITY };
        }
    }
}

/// Draws the part of a triangle that lies in a tile.
///
/// Edge functions are kept in units of 2⁸ square sub-pixels, which is exact for the signs at samples: they
/// change by whole units from one eighth of a pixel to the next.
#[inline(always)]
fn draw_triangle<S: Simd>(
    simd: S,
    triangle: &ScreenTriangle,
    grid: &Grid,
    tile: Window,
    pixels: &mut [Pixel; TILE_WIDTH * TILE_HEIGHT],
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
    pixels: &'a mut [Pixel; TILE_WIDTH * TILE_HEIGHT],
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
        let index = (self.start[1] + y) * signed(TILE_WIDTH) + self.start[0] + x;
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
        const LIMIT: u32 = Edge::REACH.unsigned_abs() / 8 / (TILE_WIDTH + TILE_HEIGHT) as u32;
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
