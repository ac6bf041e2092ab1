//! The splat pass on the CPU: a patch is a task. Its tile of depth|surfel keys lies in the innermost cache; a
//! key of 0 marks pixels of others, so that one comparison decides ownership and depth. The task ends with its
//! pixels' colours, so that no picture of keys is ever written.

pub(crate) mod blend;
mod hits;
mod packed;
pub(crate) mod projection;

use std::time::Instant;

use fearless_simd::{Level, dispatch, f32x16};
use glam::Vec3;
use rayon::prelude::*;

use self::blend::{Blended, Layers};
use self::hits::Hits;
use self::packed::{Packed, Rest};
pub(crate) use self::projection::Projection;
use crate::context::Context;
use crate::geometry::Surfels;
use crate::geometry::lanes::{Pair, simd_level};
use crate::geometry::surfel::PADDING;
use crate::plan::pool::Pool;
use crate::plan::{Batch, SplatPass, SplatShape};
use crate::visibility::{Patch, Visibility};

/// Nothing landed here.
pub(crate) const EMPTY: u64 = u64::MAX;
/// Not a pixel of the patch: nothing is nearer.
const FOREIGN: u64 = 0;
/// Set in the keys of images that only fill what no other covers: those too far from the pixel's centre for the ray
/// through it to see their surfel. Depths are not negative: their sign bit is free.
pub(crate) const FILLS: u64 = 1 << 63;
/// The paper counts an image as valid if no weight is below minus this (maths: tolerance over shared edges).
pub(crate) const EDGE_TOLERANCE: f32 = 1e-3;
/// Surfels projected at a time before they are splatted.
const CHUNK: usize = 1024;
/// Of a surfel in a camera.
const MAX_IMAGES: usize = 3;
/// A camera with more surfels than this shares them with idle threads (untuned).
const SHARE: usize = 1 << 15;
/// Patches that a thread takes at a time at most: neighbours cost much or little together (untuned).
const PATCHES: usize = 16;
/// One column and row around the tile takes what a 2 × 2 splat writes beyond it.
pub(crate) const BORDER: u32 = 1;

/// What the splat pass did, summed over threads.
#[derive(Clone, Copy, Debug, Default)]
pub struct SplatCounters {
    /// Batches.
    pub batches: u64,
    /// Camera–surfel pairs projected.
    pub projections: u64,
    /// Pairs that have an image in the camera.
    pub valid: u64,
    /// Culling, thread nanoseconds.
    pub cull_ns: u64,
    /// Projection, thread nanoseconds.
    pub project_ns: u64,
    /// Splatting, thread nanoseconds.
    pub splat_ns: u64,
}

impl SplatCounters {
    fn plus(self, o: Self) -> Self {
        Self {
            batches: self.batches + o.batches,
            projections: self.projections + o.projections,
            valid: self.valid + o.valid,
            cull_ns: self.cull_ns + o.cull_ns,
            project_ns: self.project_ns + o.project_ns,
            splat_ns: self.splat_ns + o.splat_ns,
        }
    }
}

/// A pixel that something landed on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Landed {
    /// Which, by row.
    pub(crate) pixel: u32,
    /// Share of it that is covered.
    pub(crate) coverage: f32,
    /// Of the surfels, times the coverage.
    pub(crate) radiance: Vec3,
    /// The nearest key.
    pub(crate) key: u64,
}

/// Memory of one task, reused.
#[derive(Default)]
pub(crate) struct Scratch {
    batches: Vec<Batch>,
    packed: Packed,
    hits: Hits,
    tile: Vec<u64>,
    layers: Layers,
}

/// Runs the pass. Every pixel of a mirror belongs to one patch, so no pixel is in the lists twice. Once it is cancelled,
/// what it returns is of no use.
pub(crate) fn splat(
    pass: &SplatPass<'_>,
    surfels: &Surfels,
    visibility: &Visibility,
    pool: &Pool<Scratch>,
    cx: &Context,
) -> (SplatCounters, Vec<Vec<Landed>>) {
    let level = simd_level();
    let start = || (pool.take(), SplatCounters::default(), Vec::new());
    let done: Vec<_> = (0..pass.patches.len())
        .into_par_iter()
        .with_max_len(PATCHES)
        .fold(start, |(mut scratch, counters, mut landed), index| {
            let work = PatchWork { pass, surfels, visibility, index, level, pool, cx };
            let more = work.run(&mut scratch, &mut landed);
            (scratch, counters.plus(more), landed)
        })
        .map(|(_, counters, landed)| (counters, landed))
        .collect();
    let counters = done.iter().fold(SplatCounters::default(), |sum, (more, _)| sum.plus(*more));
    (counters, done.into_iter().map(|(_, landed)| landed).collect())
}

struct PatchWork<'a> {
    pass: &'a SplatPass<'a>,
    surfels: &'a Surfels,
    visibility: &'a Visibility,
    index: usize,
    level: Level,
    pool: &'a Pool<Scratch>,
    cx: &'a Context,
}

impl PatchWork<'_> {
    fn run(&self, scratch: &mut Scratch, landed: &mut Vec<Landed>) -> SplatCounters {
        let Self { pass, surfels, visibility, index, level, pool, cx } = *self;
        let mut counters = SplatCounters::default();
        let patch = &pass.patches[index];
        let stride = patch.rect.width() + 2 * BORDER;
        let cameras = pass.patch_cameras[index] as usize..pass.patch_cameras[index + 1] as usize;
        if cameras.is_empty() {
            return counters;
        }
        let Scratch { batches, packed, hits, tile, layers } = scratch;
        hits.len = 0;
        fill_tile(tile, pass, patch, visibility);
        for camera in &pass.cameras[cameras] {
            // One that sees millions takes a second.
            if cx.check().is_err() {
                return counters;
            }
            let start = Instant::now();
            batches.clear();
            pass.batches.cull(camera, batches);
            counters.cull_ns += nanoseconds(start, Instant::now());
            counters.batches += batches.len() as u64;
            let work = Projection { pass, surfels, camera, patch, stride };
            let shared = Shared { work, visibility, level, pool };
            counters = counters.plus(shared.project(batches, packed, hits, tile));
        }
        let start = Instant::now();
        if pass.shape == SplatShape::Ellipse {
            let (list, hider, stride) = (&surfels.radiance, pass.first_hider, stride as usize);
            dispatch!(level, simd => layers.draw(simd, hits, list, hider, stride, tile));
        }
        self.resolve(tile, hits, layers, stride as usize, landed);
        counters.splat_ns += nanoseconds(start, Instant::now());
        counters
    }

    /// From the tile to the patch's pixels.
    fn resolve(
        &self,
        tile: &[u64],
        hits: &Hits,
        layers: &Layers,
        stride: usize,
        landed: &mut Vec<Landed>,
    ) {
        let rect = self.pass.patches[self.index].rect;
        for y in rect.min[1]..rect.max[1] {
            let row = (y - rect.min[1] + BORDER) as usize * stride + BORDER as usize;
            for x in rect.min[0]..rect.max[0] {
                let slot = row + (x - rect.min[0]) as usize;
                let mut key = tile[slot];
                if key == FOREIGN {
                    continue;
                }
                let value = if self.pass.shape == SplatShape::Ellipse {
                    let Some(Blended { value, first }) = layers.at(slot) else { continue };
                    let depth = u64::from(hits.depth[first].to_bits());
                    key = depth << 32 | u64::from(hits.surfel[first]);
                    value
                } else {
                    // The low half of a key is its surfel.
                    #[expect(clippy::cast_possible_truncation, reason = "takes the low half")]
                    let surfel = key as u32;
                    if key == EMPTY || surfel >= self.pass.first_hider {
                        continue;
                    }
                    self.surfels.radiance[surfel as usize].extend(1.0)
                };
                landed.push(Landed {
                    pixel: y * self.visibility.size.width + x,
                    coverage: value.w,
                    radiance: value.truncate(),
                    key,
                });
            }
        }
    }
}

fn nanoseconds(from: Instant, to: Instant) -> u64 {
    u64::try_from((to - from).as_nanos()).unwrap_or(u64::MAX)
}

/// One camera's work on one patch, which threads may share.
#[derive(Clone, Copy)]
struct Shared<'a> {
    work: Projection<'a>,
    visibility: &'a Visibility,
    level: Level,
    pool: &'a Pool<Scratch>,
}

impl Shared<'_> {
    /// Projects and splats batches into `tile`. A wide camera sees nearly everything in a few pixels: its work is
    /// halved between threads, each with a tile of its own; the nearest key wins, whoever found it.
    fn project(
        &self,
        batches: &[Batch],
        packed: &mut Packed,
        hits: &mut Hits,
        tile: &mut Vec<u64>,
    ) -> SplatCounters {
        let surfels: usize = batches.iter().map(|b| b.count as usize).sum();
        if surfels <= SHARE || batches.len() < 2 {
            return self.project_in_turn(batches, packed, hits, tile);
        }
        let (left, right) = batches.split_at(batches.len() / 2);
        let mut other = self.pool.take();
        let Scratch { packed: other_packed, hits: other_hits, tile: other_tile, .. } = &mut *other;
        let (a, b) = rayon::join(
            || self.project(left, packed, hits, tile),
            || {
                other_hits.len = 0;
                fill_tile(other_tile, self.work.pass, self.work.patch, self.visibility);
                self.project(right, other_packed, other_hits, other_tile)
            },
        );
        for (key, found) in tile.iter_mut().zip(other_tile) {
            *key = (*key).min(*found);
        }
        hits.append(other_hits);
        a.plus(b)
    }

    fn project_in_turn(
        &self,
        batches: &[Batch],
        packed: &mut Packed,
        hits: &mut Hits,
        tile: &mut [u64],
    ) -> SplatCounters {
        let mut counters = SplatCounters::default();
        let mut last = Instant::now();
        let mut rest = Rest { batches, done: 0 };
        while !rest.batches.is_empty() {
            let Projection { surfels, camera, .. } = self.work;
            dispatch!(self.level, simd => packed.fill(simd, surfels, camera, &mut rest));
            let count = packed.len();
            if self.work.pass.shape != SplatShape::Ellipse {
                hits.len = 0;
            }
            hits.reserve(MAX_IMAGES * count + PADDING);
            let valid = dispatch!(self.level, simd => self.work.run::<_, Pair<f32x16<_>>>(simd, packed, count, hits));
            let projected = Instant::now();
            if self.work.pass.shape != SplatShape::Ellipse {
                hits.draw_squares(self.work.pass.shape, self.work.stride as usize, tile);
            }
            let done = Instant::now();
            counters.projections += count as u64;
            counters.valid += valid;
            counters.project_ns += nanoseconds(last, projected);
            counters.splat_ns += nanoseconds(projected, done);
            last = done;
        }
        counters
    }
}

fn fill_tile(tile: &mut Vec<u64>, pass: &SplatPass<'_>, patch: &Patch, visibility: &Visibility) {
    let stride = (patch.rect.width() + 2 * BORDER) as usize;
    tile.clear();
    tile.resize(stride * (patch.rect.height() + 2 * BORDER) as usize, FOREIGN);
    for y in patch.rect.min[1]..patch.rect.max[1] {
        let row = (y - patch.rect.min[1] + BORDER) as usize * stride + BORDER as usize;
        for x in patch.rect.min[0]..patch.rect.max[0] {
            if patch.owns(visibility, &pass.pixels.rows, x, y) {
                tile[row + (x - patch.rect.min[0]) as usize] = EMPTY;
            }
        }
    }
}
