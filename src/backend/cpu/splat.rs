//! The splat pass on the CPU: a patch is a task. Its tile of depth|surfel keys lies in the innermost cache; a
//! key of 0 marks pixels of others, so that one comparison decides ownership and depth.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use fearless_simd::{Level, Simd, dispatch, f32x16};
use rayon::prelude::*;

use super::pool::Pool;
use crate::camera::three_ray::project::along;
use crate::camera::three_ray::{Image, project};
use crate::geometry::Surfels;
use crate::geometry::lanes::{Pair, Real, Vector, dot, simd_level};
use crate::geometry::surfel::PADDING;
use crate::plan::{Batch, CameraInstance, DepthKey, SplatPass, SplatShape};
use crate::visibility::{NONE_ID, Patch, Visibility};

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
const CHUNK: usize = 2048;
/// Of a surfel in a camera.
const MAX_IMAGES: usize = 3;
/// A camera with more surfels than this shares them with idle threads (untuned).
const SHARE: usize = 1 << 15;
/// One column and row around the tile takes what a 2 × 2 splat writes beyond it.
const BORDER: u32 = 1;

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

/// Memory of one task, reused.
#[derive(Default)]
pub(crate) struct Scratch {
    batches: Vec<Batch>,
    hits: Hits,
    tile: Vec<u64>,
}

/// Drawn images.
#[derive(Default)]
struct Hits {
    /// 16 · the tile slot of the splat's first pixel + for each of its 2 × 2 pixels a bit that says whether it
    /// only [`FILLS`] that.
    cell: Vec<u32>,
    depth: Vec<f32>,
    surfel: Vec<u32>,
    len: usize,
}

impl Hits {
    /// Empties it and makes room.
    fn clear(&mut self, room: usize) {
        self.len = 0;
        if self.cell.len() < room {
            self.cell.resize(room, 0);
            self.depth.resize(room, 0.0);
            self.surfel.resize(room, 0);
        }
    }
}

/// Runs the pass: the nearest key of every pixel of `visibility` on which something lands goes into `keys`, which are
/// [`EMPTY`] before.
pub(crate) fn splat(
    pass: &SplatPass<'_>,
    surfels: &Surfels,
    visibility: &Visibility,
    pool: &Pool<Scratch>,
    keys: &[AtomicU64],
) -> SplatCounters {
    let level = simd_level();
    (0..pass.patches.len())
        .into_par_iter()
        .map_init(
            || pool.take(),
            |scratch, index| {
                splat_patch(pass, surfels, visibility, index, level, pool, scratch, keys)
            },
        )
        .reduce(SplatCounters::default, SplatCounters::plus)
}

#[expect(clippy::too_many_arguments, reason = "one private call")]
fn splat_patch(
    pass: &SplatPass<'_>,
    surfels: &Surfels,
    visibility: &Visibility,
    index: usize,
    level: Level,
    pool: &Pool<Scratch>,
    scratch: &mut Scratch,
    keys: &[AtomicU64],
) -> SplatCounters {
    let mut counters = SplatCounters::default();
    let patch = &pass.patches[index];
    let stride = patch.rect.width() + 2 * BORDER;
    let Scratch { batches, hits, tile } = scratch;
    let cameras = pass.patch_cameras[index] as usize..pass.patch_cameras[index + 1] as usize;
    if cameras.is_empty() {
        return counters;
    }
    fill_tile(tile, patch, visibility);
    for camera in &pass.cameras[cameras] {
        let start = Instant::now();
        batches.clear();
        pass.batches.cull(camera, batches);
        counters.cull_ns += nanoseconds(start, Instant::now());
        counters.batches += batches.len() as u64;
        let work = Projection { pass, surfels, camera, patch, stride };
        let shared = Shared { work, visibility, level, pool };
        counters = counters.plus(shared.project(batches, hits, tile));
    }
    for y in 0..patch.rect.height() {
        let row = ((y + BORDER) * stride + BORDER) as usize;
        let to = ((patch.rect.min[1] + y) * visibility.size.width + patch.rect.min[0]) as usize;
        let n = patch.rect.width() as usize;
        for (key, out) in tile[row..row + n].iter().zip(&keys[to..to + n]) {
            if *key != FOREIGN {
                out.store(*key, Ordering::Relaxed);
            }
        }
    }
    counters
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
    fn project(&self, batches: &[Batch], hits: &mut Hits, tile: &mut Vec<u64>) -> SplatCounters {
        let surfels: usize = batches.iter().map(|b| b.count as usize).sum();
        if surfels <= SHARE || batches.len() < 2 {
            return self.project_in_turn(batches, hits, tile);
        }
        let (left, right) = batches.split_at(batches.len() / 2);
        let mut other = self.pool.take();
        let Scratch { hits: other_hits, tile: other_tile, .. } = &mut *other;
        let (a, b) = rayon::join(
            || self.project(left, hits, tile),
            || {
                fill_tile(other_tile, self.work.patch, self.visibility);
                self.project(right, other_hits, other_tile)
            },
        );
        for (key, found) in tile.iter_mut().zip(other_tile) {
            *key = (*key).min(*found);
        }
        a.plus(b)
    }

    fn project_in_turn(
        &self,
        mut batches: &[Batch],
        hits: &mut Hits,
        tile: &mut [u64],
    ) -> SplatCounters {
        let mut counters = SplatCounters::default();
        let mut last = Instant::now();
        while !batches.is_empty() {
            let taken = chunk(batches);
            hits.clear(
                MAX_IMAGES * taken.iter().map(|b| b.count as usize).sum::<usize>() + PADDING,
            );
            let (projections, valid) = dispatch!(self.level, simd => self.work.run::<_, Pair<f32x16<_>>>(simd, taken, hits));
            let projected = Instant::now();
            splat_hits(hits, self.work.pass.shape, self.work.stride as usize, tile);
            let done = Instant::now();
            counters.projections += projections;
            counters.valid += valid;
            counters.project_ns += nanoseconds(last, projected);
            counters.splat_ns += nanoseconds(projected, done);
            last = done;
            batches = &batches[taken.len()..];
        }
        counters
    }
}

/// The first batches whose surfels make up at most a chunk; at least one.
fn chunk(batches: &[Batch]) -> &[Batch] {
    let mut sum = 0;
    let fits = |b: &&Batch| {
        sum += b.count as usize;
        sum <= CHUNK
    };
    let n = batches.iter().take_while(fits).count();
    &batches[..n.max(1)]
}

fn fill_tile(tile: &mut Vec<u64>, patch: &Patch, visibility: &Visibility) {
    let stride = (patch.rect.width() + 2 * BORDER) as usize;
    tile.clear();
    tile.resize(stride * (patch.rect.height() + 2 * BORDER) as usize, FOREIGN);
    for y in patch.rect.min[1]..patch.rect.max[1] {
        let from = (y * visibility.size.width + patch.rect.min[0]) as usize;
        let ids = &visibility.mirror_ids[from..from + patch.rect.width() as usize];
        let at = (y - patch.rect.min[1] + BORDER) as usize * stride + BORDER as usize;
        for (x, (key, &id)) in (patch.rect.min[0]..).zip(tile[at..].iter_mut().zip(ids)) {
            debug_assert!(id != NONE_ID || patch.triangle.0 != NONE_ID);
            let own = id == patch.triangle.0 && patch.cell.is_none_or(|c| c.contains(x, y));
            *key = if own { EMPTY } else { FOREIGN };
        }
    }
}

fn splat_hits(hits: &Hits, shape: SplatShape, stride: usize, tile: &mut [u64]) {
    let n = hits.len;
    let hits = hits.cell[..n].iter().zip(&hits.depth[..n]).zip(&hits.surfel[..n]);
    for ((&cell, &depth), &surfel) in hits {
        let key = u64::from(depth.to_bits()) << 32 | u64::from(surfel);
        let slot = (cell >> 4) as usize;
        let fills = u64::from(cell) << 60;
        match shape {
            SplatShape::Square1 => tile[slot] = tile[slot].min(key | (fills << 3 & FILLS)),
            SplatShape::Square2 => {
                let block = &mut tile[slot..slot + stride + 2];
                for (corner, i) in [0, 1, stride, stride + 1].into_iter().enumerate() {
                    block[i] = block[i].min(key | (fills << (3 - corner) & FILLS));
                }
            }
        }
    }
}

/// The projection of batches by one camera.
#[derive(Clone, Copy)]
pub(crate) struct Projection<'a> {
    pub(crate) pass: &'a SplatPass<'a>,
    pub(crate) surfels: &'a Surfels,
    pub(crate) camera: &'a CameraInstance,
    pub(crate) patch: &'a Patch,
    pub(crate) stride: u32,
}

impl Projection<'_> {
    /// Projects the batches; appends what lands in the tile; returns the pairs projected and those with an image.
    #[inline(always)]
    fn run<S: Simd, V: Vector<S>>(
        &self,
        simd: S,
        batches: &[Batch],
        hits: &mut Hits,
    ) -> (u64, u64) {
        let (mut projections, mut valid) = (0, 0);
        let offset = match self.pass.shape {
            SplatShape::Square1 => BORDER as f32,
            SplatShape::Square2 => BORDER as f32 - 0.5,
        };
        let zero = V::broadcast(simd, 0.0);
        let width = V::broadcast(simd, (self.stride - BORDER) as f32);
        let height = V::broadcast(simd, (self.patch.rect.height() + BORDER) as f32);
        let mut len = 0;
        for batch in batches {
            let lo = V::broadcast(simd, batch.lambda[0]);
            let hi = V::broadcast(simd, batch.lambda[1]);
            let end = batch.first + batch.count;
            let mut at = batch.first;
            projections += u64::from(batch.count);
            while at < end {
                let i = at as usize;
                let lanes = (end - at).min(V::LANES);
                let active = V::mask(simd, (1u64 << lanes) - 1);
                let v1 = &self.camera.camera.v1;
                let q = [
                    V::load(simd, &self.surfels.x[i..]) - v1[0],
                    V::load(simd, &self.surfels.y[i..]) - v1[1],
                    V::load(simd, &self.surfels.z[i..]) - v1[2],
                ];
                let mut seen = 0u64;
                let mut taken = !active;
                for image in project(&self.camera.camera, q, lo, hi).as_slice() {
                    let front = zero.lt(image.linear(self.camera.front)) & active;
                    let inside = image.within([EDGE_TOLERANCE; 3]) & front;
                    seen |= V::bits(inside);
                    let mut drawn = image.within(self.camera.guard) & front;
                    if self.pass.first_root_only {
                        drawn = drawn & !taken;
                        taken = taken | drawn;
                    }
                    if !V::any(drawn) {
                        continue;
                    }
                    let [x, y, lands] = self.place(image, offset);
                    let lands =
                        zero.lt(lands) & zero.le(x) & x.lt(width) & zero.le(y) & y.lt(height);
                    let lands = drawn & lands;
                    let cell = [x.floor(), y.floor()];
                    let d = self.direction(image);
                    let fills = self.fills(image, d, [cell[0] - x, cell[1] - y]);
                    V::compress_cells(cell, self.stride, fills, lands, &mut hits.cell[len..]);
                    self.depth(image, d).compress(lands, &mut hits.depth[len..]);
                    V::compress_numbers(simd, at, lands, &mut hits.surfel[len..]);
                    len += V::bits(lands).count_ones() as usize;
                }
                valid += u64::from(seen.count_ones());
                at += lanes;
            }
        }
        hits.len = len;
        (projections, valid)
    }

    /// The low bits of [`Hits::cell`], as a number; `from` leads from the image to where the splat's first pixel
    /// begins.
    #[inline(always)]
    fn fills<R: Real<Scalar = f32>>(&self, image: &Image<R>, d: [R; 3], from: [R; 2]) -> R {
        let [base, per_lambda] = self.camera.per_px;
        let right = along(base[0], per_lambda[0], image.lambda);
        let down = along(base[1], per_lambda[1], image.lambda);
        // Squared distance from the surfel of the ray through a point (x, y) pixels away: a x² + 2 b x y + c y².
        let (one, zero) = (image.lambda.splat(1.0), image.lambda.splat(0.0));
        let per_length = one / dot(d, d);
        let (right_d, down_d) = (dot(right, d), dot(down, d));
        let a = dot(right, right) - right_d * right_d * per_length;
        let b = dot(right, down) - right_d * down_d * per_length;
        let c = dot(down, down) - down_d * down_d * per_length;
        // A disk of that distance holds a surfel. Where it is seen so long that it leaves the splat's reach, it has
        // to be as much wider to hold one within it.
        let reach = self.pass.shape.reach_px();
        let least = (a * c - b * b) / (a + c) * (reach * reach);
        let mut fills = zero;
        let pixels: &[_] = match self.pass.shape {
            SplatShape::Square1 => &[(0.5, 0.5, 1.0)],
            SplatShape::Square2 => {
                &[(0.0, 0.0, 1.0), (1.0, 0.0, 2.0), (0.0, 1.0, 4.0), (1.0, 1.0, 8.0)]
            }
        };
        for &(i, j, bit) in pixels {
            let (x, y) = (from[0] + i, from[1] + j);
            let distance = x * x * a + (x * y * b) * 2.0 + y * y * c;
            let far = one.lt(distance) & one.lt(distance * least);
            fills = fills + R::select(far, zero.splat(bit), zero);
        }
        fills
    }

    /// Position in the tile, in pixels plus `offset`, and the homogeneous w.
    #[inline(always)]
    pub(crate) fn place<R: Real<Scalar = f32>>(&self, image: &Image<R>, offset: f32) -> [R; 3] {
        let w = image.linear(self.camera.screen[2]);
        let usable = w.splat(0.0).lt(w);
        let inverse = w.splat(1.0) / R::select(usable, w, w.splat(1.0));
        let x = image.linear(self.camera.screen[0]) * inverse + offset;
        let y = image.linear(self.camera.screen[1]) * inverse + offset;
        [x, y, w]
    }

    /// The direction d(w) of the ray.
    #[inline(always)]
    pub(crate) fn direction<R: Real<Scalar = f32>>(&self, image: &Image<R>) -> [R; 3] {
        let camera = &self.camera.camera;
        [
            image.linear([camera.d1[0], camera.f1[0], camera.f2[0]]),
            image.linear([camera.d1[1], camera.f1[1], camera.f2[1]]),
            image.linear([camera.d1[2], camera.f1[2], camera.f2[2]]),
        ]
    }

    /// The depth key: not negative. `d`: the ray's direction.
    #[inline(always)]
    pub(crate) fn depth<R: Real<Scalar = f32>>(&self, image: &Image<R>, d: [R; 3]) -> R {
        let mut depth = image.lambda * dot(d, d).sqrt();
        if self.pass.depth == DepthKey::PushBack {
            let [x, y, z] = self.camera.from_eye;
            let v = [image.linear(x), image.linear(y), image.linear(z)];
            depth = depth + dot(v, v).sqrt();
        }
        (depth * self.camera.scale).max(image.lambda.splat(0.0))
    }
}
