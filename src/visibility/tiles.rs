//! Which triangles meet which tile of the picture.

use super::project::{Corner, EIGHTH_BITS, MAX_SIDE, Projection, SUBPIXEL_BITS};
use super::{SAMPLE_EIGHTHS, SAMPLES, SurfaceMesh};
use crate::camera::eye::ImageSize;

/// Tile sides in pixels: a tile's samples (64 KiB) stay in the second-level cache. Untuned.
pub(super) const TILE_WIDTH: u32 = 64;
pub(super) const TILE_HEIGHT: u32 = 16;
pub(super) const TILE_PIXELS: usize = (TILE_WIDTH * TILE_HEIGHT) as usize;

/// A triangle whose box meets more tiles than this is listed by rows of tiles and not copied, so that lists
/// stay proportional to the number of triangles.
const MAX_LISTED_TILES: usize = 4;

/// A triangle on the picture plane, counter-clockwise in (x, y): its edge functions are positive inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScreenTriangle {
    pub(super) x: [i32; 3],
    pub(super) y: [i32; 3],
    pub(super) inverse_depth: [f32; 3],
    pub(super) id: u32,
    /// The tiles that its box meets.
    tiles: Tiles,
}

/// Where triangles come from.
pub(super) struct Source<'a> {
    pub(super) projection: Projection,
    pub(super) surfaces: &'a [SurfaceMesh<'a>],
    pub(super) corners: &'a [Corner],
    pub(super) first_corners: &'a [usize],
    /// By surface: whether what is seen from behind is hidden anyway.
    pub(super) fronts_only: Vec<bool>,
}

/// The tiles of a picture.
pub(super) struct Grid {
    pub(super) size: ImageSize,
    pub(super) columns: usize,
    pub(super) rows: usize,
}

/// Inclusive ranges of pixels; empty where a first is above its last.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub(super) first: [i32; 2],
    pub(super) last: [i32; 2],
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
            [x.unsigned_abs() / TILE_WIDTH, y.unsigned_abs() / TILE_HEIGHT].map(|tile| tile as u16)
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

impl Grid {
    pub(super) fn new(size: ImageSize) -> Self {
        Self {
            size,
            columns: size.width.div_ceil(TILE_WIDTH) as usize,
            rows: size.height.div_ceil(TILE_HEIGHT) as usize,
        }
    }

    /// The pixels of a tile.
    #[expect(clippy::cast_possible_truncation, reason = "tiles of a picture, whose sides are u32")]
    pub(super) fn window(&self, column: usize, row: usize) -> Window {
        let (left, top) = (column as u32 * TILE_WIDTH, row as u32 * TILE_HEIGHT);
        let last = |first: u32, tile: u32, side: u32| ((first + tile).min(side) - 1).cast_signed();
        Window {
            first: [left.cast_signed(), top.cast_signed()],
            last: [
                last(left, TILE_WIDTH, self.size.width),
                last(top, TILE_HEIGHT, self.size.height),
            ],
        }
    }

    /// The pixels of the picture of which a triangle's box may contain a sample.
    #[inline(always)]
    pub(super) fn pixels(&self, [x, y]: Extremes) -> Window {
        // Samples lie between the first and the seventh eighth of their pixel.
        let first = |low: i32| ((low + (1 << EIGHTH_BITS) - 1) >> SUBPIXEL_BITS).max(0);
        let last = |high: i32, side: u32| {
            ((high - (1 << EIGHTH_BITS)) >> SUBPIXEL_BITS).min(side.min(MAX_SIDE).cast_signed() - 1)
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
pub(super) fn extremes(x: [i32; 3], y: [i32; 3]) -> Extremes {
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
    /// Turned counter-clockwise; `None` if it shows at no sample of the picture, or only its back while `fronts_only`.
    #[inline(always)]
    fn new([a, b, c]: [Corner; 3], id: u32, grid: &Grid, fronts_only: bool) -> Option<Self> {
        let extremes = extremes([a.x, b.x, c.x], [a.y, b.y, c.y]);
        if !may_show(extremes) {
            return None;
        }
        let pixels = grid.pixels(extremes);
        let (abx, aby) = (i64::from(b.x - a.x), i64::from(b.y - a.y));
        let (acx, acy) = (i64::from(c.x - a.x), i64::from(c.y - a.y));
        let area = abx * acy - acx * aby;
        // Fronts are counter-clockwise, where y points up.
        if pixels.is_empty() || area == 0 || (fronts_only && area > 0) {
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

/// The visible ones of a range of triangles, sorted by tiles; each tile has them in the order of their ids.
#[derive(Debug, Default)]
pub(super) struct Chunk {
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

impl Chunk {
    /// Gathers the triangles with these ids that may show.
    #[inline(always)]
    pub(super) fn collect(
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
            let fronts = source.fronts_only[i];
            let own = &surface.triangles[start - surface_ids.start..end - surface_ids.start];
            for (indices, id) in own.iter().zip(super::id(start)..) {
                let corners = indices.map(|i| corners[i as usize]);
                let outside = corners.map(|c| c.outside);
                if outside[0] | outside[1] | outside[2] == 0 {
                    self.triangles.extend(ScreenTriangle::new(corners, id, grid, fronts));
                } else if outside[0] & outside[1] & outside[2] == 0 {
                    let points = indices.map(|i| surface.positions[i as usize]);
                    source.projection.clipped(points, |corners| {
                        self.triangles.extend(ScreenTriangle::new(corners, id, grid, fronts));
                    });
                }
            }
        }
    }

    /// Sorts what was gathered by tiles: counts, sums up, fills.
    #[inline(always)]
    pub(super) fn sort(&mut self, grid: &Grid) {
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
    pub(super) fn in_tile(
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
