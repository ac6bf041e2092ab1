//! The splat pass on the CPU: a patch is a task. Its tile of depth|surfel keys lies in the innermost cache; a
//! key of 0 marks samples of others, so that one comparison decides ownership and depth. The task ends with its
//! pixels' colours, so that no picture of keys is ever written.

use std::time::Instant;

use glam::Vec3;

use fearless_simd::{Level, Simd, dispatch, f32x16};
use rayon::prelude::*;

use super::pool::Pool;
use crate::camera::three_ray::project::along;
use crate::camera::three_ray::{Image, project};
use crate::geometry::Surfels;
use crate::geometry::lanes::{Pair, Real, Vector, dot, simd_level};
use crate::geometry::surfel::PADDING;
use crate::plan::{Batch, CameraInstance, DepthKey, LARGEST_ELLIPSE, SplatPass, SplatShape};
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
const CHUNK: usize = 1024;
/// How much deeper than the middle of a disk its rim counts, in radii: more than the slope of most surfaces lets the
/// rim of a neighbour come nearer (untuned).
const RISE: f32 = 2.0;
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

/// A pixel that something landed on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Landed {
    /// Which, by row.
    pub(crate) pixel: u32,
    /// Share of its samples that are covered.
    pub(crate) coverage: f32,
    /// Sum over those of the surfels' radiance, over all samples.
    pub(crate) radiance: Vec3,
    /// The nearest key of its samples.
    pub(crate) key: u64,
}

/// Memory of one task, reused.
#[derive(Default)]
pub(crate) struct Scratch {
    batches: Vec<Batch>,
    packed: Packed,
    hits: Hits,
    tile: Vec<u64>,
}

/// Surfels to be projected, side by side, whatever batches they come from.
#[derive(Default)]
struct Packed {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    /// Squared share of the surfel's radius in that of the object's surfels, inverse.
    size: Vec<f32>,
    lo: Vec<f32>,
    hi: Vec<f32>,
    surfel: Vec<u32>,
}

impl Packed {
    fn clear(&mut self) {
        for list in
            [&mut self.x, &mut self.y, &mut self.z, &mut self.size, &mut self.lo, &mut self.hi]
        {
            list.clear();
        }
        self.surfel.clear();
    }

    fn len(&self) -> usize {
        self.surfel.len()
    }

    /// Adds as much of `batch` as there is room for, from its surfel `from` on; returns how much.
    fn add(&mut self, surfels: &Surfels, camera: &CameraInstance, batch: &Batch, from: u32) -> u32 {
        let room = u32::try_from(CHUNK - self.len()).unwrap_or(0);
        let count = (batch.count - from).min(room);
        let first = batch.first + from * batch.stride;
        let end = self.len() + count as usize;
        if batch.stride == 1 {
            let range = first as usize..(first + count) as usize;
            self.x.extend_from_slice(&surfels.x[range.clone()]);
            self.y.extend_from_slice(&surfels.y[range.clone()]);
            self.z.extend_from_slice(&surfels.z[range.clone()]);
            self.surfel.extend(first..first + count);
            if first >= camera.representatives && camera.extent.is_finite() {
                for extent in &surfels.extent[range] {
                    let share = camera.extent / extent;
                    self.size.push(share * share);
                }
            }
        } else {
            for surfel in (first..).step_by(batch.stride as usize).take(count as usize) {
                let i = surfel as usize;
                self.x.push(surfels.x[i]);
                self.y.push(surfels.y[i]);
                self.z.push(surfels.z[i]);
                self.surfel.push(surfel);
            }
        }
        self.size.resize(end, 1.0 / batch.stride as f32);
        self.lo.resize(end, batch.lambda[0]);
        self.hi.resize(end, batch.lambda[1]);
        count
    }

    /// Makes vector loads beyond the end possible.
    fn pad(&mut self) {
        for list in
            [&mut self.x, &mut self.y, &mut self.z, &mut self.size, &mut self.lo, &mut self.hi]
        {
            list.resize(list.len() + PADDING, 0.0);
        }
        self.surfel.resize(self.surfel.len() + PADDING, 0);
    }
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
    /// Of ellipses instead of `cell`: the middle, the form a x² + 2 b x y + c y² that is 1 at the rim, half the
    /// width and height, what the depth grows by towards the rim.
    ellipse: [Vec<f32>; 8],
}

impl Hits {
    /// Empties it and makes room.
    fn clear(&mut self, room: usize) {
        self.len = 0;
        if self.cell.len() < room {
            self.cell.resize(room, 0);
            self.depth.resize(room, 0.0);
            self.surfel.resize(room, 0);
            for list in &mut self.ellipse {
                list.resize(room, 0.0);
            }
        }
    }
}

/// Runs the pass. Every pixel of a mirror belongs to one patch, so no pixel is in the lists twice.
pub(crate) fn splat(
    pass: &SplatPass<'_>,
    surfels: &Surfels,
    visibility: &Visibility,
    pool: &Pool<Scratch>,
) -> (SplatCounters, Vec<Vec<Landed>>) {
    let level = simd_level();
    let start = || (pool.take(), SplatCounters::default(), Vec::new());
    let done: Vec<_> = (0..pass.patches.len())
        .into_par_iter()
        .fold(start, |(mut scratch, counters, mut landed), index| {
            let work = PatchWork { pass, surfels, visibility, index, level, pool };
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
}

impl PatchWork<'_> {
    fn run(&self, scratch: &mut Scratch, landed: &mut Vec<Landed>) -> SplatCounters {
        let Self { pass, surfels, visibility, index, level, pool } = *self;
        let mut counters = SplatCounters::default();
        let patch = &pass.patches[index];
        let stride = patch.rect.width() * pass.samples + 2 * BORDER;
        let cameras = pass.patch_cameras[index] as usize..pass.patch_cameras[index + 1] as usize;
        if cameras.is_empty() {
            return counters;
        }
        let Scratch { batches, packed, hits, tile } = scratch;
        fill_tile(tile, patch, visibility, pass.samples);
        for camera in &pass.cameras[cameras] {
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
        self.resolve(tile, stride as usize, landed);
        counters.splat_ns += nanoseconds(start, Instant::now());
        counters
    }

    /// From the samples of the tile to the patch's pixels.
    fn resolve(&self, tile: &[u64], stride: usize, landed: &mut Vec<Landed>) {
        let rect = self.pass.patches[self.index].rect;
        let side = self.pass.samples as usize;
        let share = 1.0 / (side * side) as f32;
        for y in rect.min[1]..rect.max[1] {
            let row = (y - rect.min[1]) as usize * side + BORDER as usize;
            for x in rect.min[0]..rect.max[0] {
                let column = (x - rect.min[0]) as usize * side + BORDER as usize;
                let (mut key, mut count, mut radiance) = (EMPTY, 0.0, Vec3::ZERO);
                for j in 0..side {
                    let at = (row + j) * stride + column;
                    for &sample in &tile[at..at + side] {
                        if sample == EMPTY || sample == FOREIGN {
                            continue;
                        }
                        key = key.min(sample);
                        count += 1.0;
                        // The low half of a key is its surfel.
                        #[expect(clippy::cast_possible_truncation, reason = "takes the low half")]
                        let surfel = sample as u32 as usize;
                        radiance += self.surfels.radiance[surfel];
                    }
                }
                if key != EMPTY {
                    landed.push(Landed {
                        pixel: y * self.visibility.size.width + x,
                        coverage: count * share,
                        radiance: radiance * share,
                        key,
                    });
                }
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
                fill_tile(other_tile, self.work.patch, self.visibility, self.work.pass.samples);
                self.project(right, other_packed, other_hits, other_tile)
            },
        );
        for (key, found) in tile.iter_mut().zip(other_tile) {
            *key = (*key).min(*found);
        }
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
        let mut batches = batches.iter();
        let (mut batch, mut from) = (batches.next(), 0);
        while batch.is_some() {
            packed.clear();
            while let Some(open) = batch
                && packed.len() < CHUNK
            {
                from += packed.add(self.work.surfels, self.work.camera, open, from);
                if from == open.count {
                    (batch, from) = (batches.next(), 0);
                }
            }
            let count = packed.len();
            packed.pad();
            hits.clear(MAX_IMAGES * count + PADDING);
            let valid = dispatch!(self.level, simd => self.work.run::<_, Pair<f32x16<_>>>(simd, packed, count, hits));
            let projected = Instant::now();
            match self.work.pass.shape {
                SplatShape::Ellipse => self.work.splat_ellipses(hits, tile),
                shape => splat_hits(hits, shape, self.work.stride as usize, tile),
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

fn fill_tile(tile: &mut Vec<u64>, patch: &Patch, visibility: &Visibility, samples: u32) {
    let side = samples as usize;
    let stride = (patch.rect.width() * samples + 2 * BORDER) as usize;
    tile.clear();
    tile.resize(stride * (patch.rect.height() * samples + 2 * BORDER) as usize, FOREIGN);
    for y in patch.rect.min[1]..patch.rect.max[1] {
        let from = (y * visibility.size.width + patch.rect.min[0]) as usize;
        let ids = &visibility.mirror_ids[from..from + patch.rect.width() as usize];
        let at =
            ((y - patch.rect.min[1]) as usize * side + BORDER as usize) * stride + BORDER as usize;
        for (i, (x, &id)) in (patch.rect.min[0]..).zip(ids).enumerate() {
            debug_assert!(id != NONE_ID || patch.triangle.0 != NONE_ID);
            if id == patch.triangle.0 && patch.cell.is_none_or(|c| c.contains(x, y)) {
                for j in 0..side {
                    let at = at + j * stride + i * side;
                    tile[at..at + side].fill(EMPTY);
                }
            }
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
            SplatShape::Ellipse => unreachable!("drawn by splat_ellipses"),
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

/// An ellipse's form (see [`Projection::form`]) that ends at [`LARGEST_ELLIPSE`], and half its width and height.
#[inline(always)]
fn capped<R: Real<Scalar = f32>>([a, b, c]: [R; 3]) -> ([R; 3], [R; 2]) {
    let least = 1.0 / (LARGEST_ELLIPSE * LARGEST_ELLIPSE);
    let (a, c) = (a.max(a.splat(0.0)) + least, c.max(c.splat(0.0)) + least);
    let inverse = a.splat(1.0) / (a * c - b * b).max(a.splat(least * least));
    let most = a.splat(LARGEST_ELLIPSE);
    ([a, b, c], [(c * inverse).sqrt().min(most), (a * inverse).sqrt().min(most)])
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
    /// Projects what is packed; appends what lands in the tile; returns how many have an image.
    #[inline(always)]
    fn run<S: Simd, V: Vector<S>>(
        &self,
        simd: S,
        packed: &Packed,
        count: usize,
        hits: &mut Hits,
    ) -> u64 {
        let mut valid = 0;
        let offset = match self.pass.shape {
            SplatShape::Ellipse | SplatShape::Square1 => BORDER as f32,
            SplatShape::Square2 => BORDER as f32 - 0.5,
        };
        let (zero, one) = (V::broadcast(simd, 0.0), V::broadcast(simd, 1.0));
        // An ellipse may reach the tile from outside.
        let beyond = match self.pass.shape {
            SplatShape::Ellipse => LARGEST_ELLIPSE,
            _ => 0.0,
        };
        let before = V::broadcast(simd, -beyond);
        let width = V::broadcast(simd, (self.stride - BORDER) as f32 + beyond);
        let rows = self.patch.rect.height() * self.pass.samples;
        let height = V::broadcast(simd, (rows + BORDER) as f32 + beyond);
        let mut len = 0;
        let mut i = 0;
        while i < count {
            let lanes = (count - i).min(V::LANES as usize);
            let active = V::mask(simd, (1u64 << lanes) - 1);
            let v1 = &self.camera.camera.v1;
            let q = [
                V::load(simd, &packed.x[i..]) - v1[0],
                V::load(simd, &packed.y[i..]) - v1[1],
                V::load(simd, &packed.z[i..]) - v1[2],
            ];
            let lo = V::load(simd, &packed.lo[i..]);
            let hi = V::load(simd, &packed.hi[i..]);
            let size = V::load(simd, &packed.size[i..]);
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
                let [x, y, w] = self.place(image, offset);
                let mut lands =
                    drawn & zero.lt(w) & before.le(x) & x.lt(width) & before.le(y) & y.lt(height);
                if !V::any(lands) {
                    continue;
                }
                let d = self.direction(image);
                let depth = self.depth(image, d);
                let form = self.form(image, d, size);
                if self.pass.shape == SplatShape::Ellipse {
                    let (form, [wide, high]) = capped(form);
                    lands = lands
                        & zero.le(x + wide)
                        & (x - wide).lt(width)
                        & zero.le(y + high)
                        & (y - high).lt(height);
                    if !V::any(lands) {
                        continue;
                    }
                    let rise =
                        (one / size).sqrt() * (self.camera.radius * self.camera.scale * RISE);
                    let values = [x, y, form[0], form[1], form[2], wide, high, rise];
                    for (value, list) in values.into_iter().zip(&mut hits.ellipse) {
                        value.compress(lands, &mut list[len..]);
                    }
                } else {
                    let cell = [x.floor(), y.floor()];
                    let fills = self.fills(form, [cell[0] - x, cell[1] - y]);
                    V::compress_cells(cell, self.stride, fills, lands, &mut hits.cell[len..]);
                }
                depth.compress(lands, &mut hits.depth[len..]);
                V::compress_numbers(simd, &packed.surfel[i..], lands, &mut hits.surfel[len..]);
                len += V::bits(lands).count_ones() as usize;
            }
            valid += u64::from(seen.count_ones());
            i += lanes;
        }
        hits.len = len;
        valid
    }

    /// a, b, c: the squared distance a x² + 2 b x y + c y² from the surfel of the ray through a place (x, y) samples
    /// away, in the surfel's radius. `d`: the ray's direction.
    #[inline(always)]
    fn form<R: Real<Scalar = f32>>(&self, image: &Image<R>, d: [R; 3], size: R) -> [R; 3] {
        let [base, per_lambda] = self.camera.per_sample;
        let right = along(base[0], per_lambda[0], image.lambda);
        let down = along(base[1], per_lambda[1], image.lambda);
        let per_length = size.splat(1.0) / dot(d, d);
        let (right_d, down_d) = (dot(right, d), dot(down, d));
        [
            (dot(right, right) - right_d * right_d * per_length) * size,
            (dot(right, down) - right_d * down_d * per_length) * size,
            (dot(down, down) - down_d * down_d * per_length) * size,
        ]
    }

    /// The low bits of [`Hits::cell`], as a number; `from` leads from the image to where the splat's first sample
    /// begins.
    #[inline(always)]
    fn fills<R: Real<Scalar = f32>>(&self, [a, b, c]: [R; 3], from: [R; 2]) -> R {
        let (one, zero) = (a.splat(1.0), a.splat(0.0));
        // A disk of that distance holds a surfel. Where it is seen so long that it leaves the splat's reach, it has
        // to be as much wider to hold one within it.
        let reach = self.pass.shape.reach();
        let least = (a * c - b * b) / (a + c) * (reach * reach);
        let mut fills = zero;
        let pixels: &[_] = match self.pass.shape {
            SplatShape::Ellipse => &[],
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

    /// Draws ellipses: every sample of the tile within one gets its key, deeper towards the rim, so that of the
    /// overlapping disks of one surface the nearest middle wins.
    fn splat_ellipses(&self, hits: &Hits, tile: &mut [u64]) {
        let stride = self.stride as usize;
        let inner = [self.patch.rect.width(), self.patch.rect.height()];
        let [right, bottom] = inner.map(|n| (n * self.pass.samples + BORDER - 1) as f32);
        let left = BORDER as f32;
        for i in 0..hits.len {
            let [x, y, a, b, c, wide, high, rise] =
                [0, 1, 2, 3, 4, 5, 6, 7].map(|k| hits.ellipse[k][i]);
            let surfel = u64::from(hits.surfel[i]);
            let depth = hits.depth[i];
            // Centres of samples lie half a sample behind their index. Not negative: casts truncate, which is floor.
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "see above"
            )]
            let range = |at: f32, reach: f32, end: f32| {
                let (from, to) = ((at - reach - 0.5).ceil().max(left), (at + reach - 0.5).min(end));
                if from <= to { from as usize..to as usize + 1 } else { 0..0 }
            };
            let columns = range(x, wide, right);
            for row in range(y, high, bottom) {
                let dy = row as f32 + 0.5 - y;
                let (slope, rest) = (2.0 * b * dy, c * dy * dy);
                let samples = &mut tile[row * stride + columns.start..row * stride + columns.end];
                for (column, sample) in columns.clone().zip(samples) {
                    let dx = column as f32 + 0.5 - x;
                    let distance = dx * (a * dx + slope) + rest;
                    if distance <= 1.0 {
                        let key = u64::from((depth + rise * distance).to_bits()) << 32 | surfel;
                        *sample = (*sample).min(key);
                    }
                }
            }
        }
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
