//! A beam's splats to its pixels, from the nearest on; a lane is a pixel.

use fearless_simd::{Simd, f32x16};
use glam::Vec4;

use super::beam::{Beam, Rays};
use super::block::LANES;
use super::close::Layer;
use super::seen::{AT_ONCE, depth_of, index, of_group};
use super::splats::{FARTHER, FORM, PER_HALF, RADIANCE, S, SIZE, Splats, TILT, U, V, WEIGHT, WIDE};
use crate::geometry::lanes::{Real, Vector};
use crate::plan::kernel::WHOLE;

/// What is known of a group's pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blended {
    /// Radiance times coverage.
    pub(super) color: [[f32; LANES]; 3],
    pub(super) shown: [f32; LANES],
    pub(super) full: [f32; LANES],
    /// From where its ray starts to its nearest splat; 0 if there is none.
    pub(super) near: [f32; LANES],
    pub(super) front: [f32; LANES],
    /// Index of the nearest that shows an object; bits.
    pub(super) first: [f32; LANES],
    /// The splats up to this depth fill all pixels.
    pub(super) full_from: f32,
}

impl Blended {
    /// Of a pixel: radiance times coverage, coverage.
    pub(super) fn value(&self, lane: usize) -> Vec4 {
        let [r, g, b] = &self.color;
        Vec4::new(r[lane], g[lane], b[lane], self.shown[lane])
    }

    pub(super) fn layer(&self, lane: usize) -> Layer {
        Layer { open: 1.0 - self.full[lane], near: self.near[lane], behind: 2.0 - self.front[lane] }
    }
}

/// At an edge that runs through a pixel's middle splats lie so far to one side of it in the mean, in their own size. This and what
/// follows are fitted to pictures of 256 rays a pixel of four scenes.
const EDGE: f32 = 0.27;
/// How far the edge lies off, in splats' sizes, by how far splats lie off.
const PER_OFF: f32 = 1.8;
/// The same, by what they cover less or more than half a pixel.
const PER_TOTAL: f32 = 0.2;
/// Splats, px, are taken for no smaller, so that a surface's inside is whole.
const LEAST_SIZE: f32 = 1.5;
/// Larger splats are few and lie less evenly: for each pixel more, edges are taken to lie that much farther out, and so much at most.
/// It takes this to hide what is behind surfels that lie two to four pixels apart.
const FEW: f32 = 2.0;
const BEYOND: [f32; 2] = [0.15, 0.12];
/// What covers less than the first is too little to tell from, what covers more than the second tells.
const SOME: [f32; 2] = [0.15, 0.45];

type F<T> = f32x16<T>;

#[inline(always)]
fn out<T: Simd>(v: F<T>) -> [f32; LANES] {
    let mut list = [0.0f32; LANES];
    Vector::<T>::store(v, &mut list);
    list
}

/// What splats that are seen from one side tell of pixels: sums of what each covers, as its area says, and of that times where it
/// lies about the pixel, in its own size, and times that size, in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side<R> {
    pub(super) total: R,
    pub(super) about: [R; 2],
    pub(super) size: R,
}

/// Pixels of a group, a lane a pixel, while splats come.
struct Pixels<T: Simd> {
    /// Those that something farther may still show in.
    open: <F<T> as Real>::Mask,
    /// From in front, from behind: at an outline one lies behind the other, and they cover the same part.
    sides: [Side<F<T>>; 2],
    /// Whether anything is seen from behind.
    some_back: bool,
    /// Coverage, radiance times coverage and what part of the coverage shows, of the surfaces that have ended.
    full: F<T>,
    color: [F<T>; 3],
    shown: F<T>,
    /// Coverage of the first surface; 2 while that goes on.
    front: F<T>,
    /// The surface that comes now: depth of its nearest splat (infinite: none yet), 1 if it is seen from behind, weights of its
    /// splats and of those that show something, and these times radiance.
    edge: F<T>,
    is_back: F<T>,
    weight: F<T>,
    shows: F<T>,
    sum: [F<T>; 3],
}

impl<T: Simd> Pixels<T> {
    /// Nothing yet of the pixels in `own`; the others are closed.
    #[inline(always)]
    fn new(simd: T, own: <F<T> as Real>::Mask) -> Self {
        let zero = F::<T>::broadcast(simd, 0.0);
        let one = zero.splat(1.0);
        Self {
            open: own,
            sides: [Side { total: zero, about: [zero; 2], size: zero }; 2],
            some_back: false,
            full: F::<T>::select(own, zero, one),
            color: [zero; 3],
            shown: zero,
            front: one + one,
            edge: zero.splat(f32::INFINITY),
            is_back: zero,
            weight: zero,
            shows: zero,
            sum: [zero; 3],
        }
    }

    /// Of some pixels the present surface is whole: adds what it covers more than those before it.
    #[inline(always)]
    fn end_surface(&mut self, ended: <F<T> as Real>::Mask) {
        let zero = self.full.splat(0.0);
        let one = zero.splat(1.0);
        let [front, back] = &self.sides;
        let mut covered = front.covered().max(self.full);
        if self.some_back {
            covered = covered.max(back.covered());
        }
        let now = F::<T>::select(ended, covered, self.full);
        let each = (now - self.full) / self.weight.max(zero.splat(f32::MIN_POSITIVE));
        let each = F::<T>::select(ended, each, zero);
        self.shown += self.shows * each;
        for (color, sum) in self.color.iter_mut().zip(&mut self.sum) {
            *color += *sum * each;
            *sum = F::<T>::select(ended, zero, *sum);
        }
        self.full = now;
        self.front = F::<T>::select(ended & one.lt(self.front), now, self.front);
        self.edge = F::<T>::select(ended, zero.splat(f32::INFINITY), self.edge);
        self.weight = F::<T>::select(ended, zero, self.weight);
        self.shows = F::<T>::select(ended, zero, self.shows);
        self.open &= now.lt(zero.splat(WHOLE));
    }
}

impl<R: Real<Scalar = f32>> Side<R> {
    /// The part of a pixel that is covered. An edge lies in the pixel about where what splats cover and how far to one side they lie
    /// say. The former alone would blur edges over splats, and show gaps where splats are not spread evenly.
    #[inline(always)]
    pub(super) fn covered(&self) -> R {
        let (one, zero) = (self.total.splat(1.0), self.total.splat(0.0));
        let per_total = one / self.total.max(zero.splat(f32::MIN_POSITIVE));
        let [u, v] = self.about;
        let off = (u * u + v * v).sqrt() * per_total;
        let size = (self.size * per_total).max(zero.splat(LEAST_SIZE));
        let total = self.total.min(one);
        let beyond = ((size - FEW) * BEYOND[0]).max(zero).min(zero.splat(BEYOND[1]));
        let inward = (total - 0.5) * PER_TOTAL + (beyond - off + EDGE) * PER_OFF;
        let edge = (inward * size + 0.5).max(zero).min(one);
        let many = total * size * size * (1.0 / (LEAST_SIZE * LEAST_SIZE));
        let some = ((many - SOME[0]) * (1.0 / (SOME[1] - SOME[0]))).max(zero).min(one);
        total + (edge - total) * some
    }
}

/// Blends what a group of a beam sees, in the given order. `describes`: whether [`Blended::first`] is wanted.
#[inline(always)]
pub(super) fn blend<T: Simd>(
    simd: T,
    beam: &Beam,
    group: usize,
    splats: &Splats,
    order: &[u64],
    groups: &[u16],
    describes: bool,
) -> Blended {
    let zero = F::<T>::broadcast(simd, 0.0);
    let one = F::<T>::broadcast(simd, 1.0);
    let own = F::<T>::mask(simd, u64::from(beam.pixels[group]));
    let Rays { start, slope, begin } = &beam.rays[group];
    let (start_u, start_v) = (F::<T>::load(simd, &start[0]), F::<T>::load(simd, &start[1]));
    let (slope_u, slope_v) = (F::<T>::load(simd, &slope[0]), F::<T>::load(simd, &slope[1]));
    let begin = F::<T>::load(simd, begin);
    let mut pixels = Pixels::new(simd, own);
    let (mut near, mut first) = (zero, zero);
    let mut last = 0.0f32;
    let mut full_from = f32::INFINITY;
    for (some, order) in groups.chunks_exact(AT_ONCE).zip(order.chunks(AT_ONCE)) {
        let mut bits = of_group(simd, some, group);
        while bits != 0 {
            let key = order[bits.trailing_zeros() as usize];
            bits &= bits - 1;
            let (i, depth) = (index(key), depth_of(key));
            let (batch, lane) = (&splats.batches[i / WIDE], i % WIDE);
            let value = &batch.value;
            let s = value[S][lane];
            let du = slope_u * s + start_u - value[U][lane];
            let dv = slope_v * s + start_v - value[V][lane];
            let off = du * (du * value[FORM][lane] + dv * value[FORM + 1][lane])
                + dv * dv * value[FORM + 2][lane];
            let inside = (one - off).max(zero);
            let mut kernel = inside * inside * value[WEIGHT][lane];
            if batch.early >> lane & 1 != 0 {
                // Nothing is seen behind where a ray starts; mirrors hide from a little beyond it.
                let hit = du * value[TILT][lane] + dv * value[TILT + 1][lane] + s;
                kernel = F::<T>::select((begin + batch.from).le(hit), kernel, zero);
            }
            let mut mine = zero.lt(kernel) & pixels.open;
            if !F::<T>::any(mine) {
                continue;
            }
            let back = batch.back >> lane & 1 != 0;
            let mut behind = mine & pixels.edge.lt(zero.splat(value[FARTHER][lane]));
            if back || pixels.some_back {
                // The other side of what comes now is a surface of its own.
                pixels.some_back = true;
                let front = pixels.is_back.le(zero);
                let other = if back { front } else { !front };
                behind |= mine & other & zero.lt(pixels.weight);
            }
            if F::<T>::any(behind) {
                pixels.end_surface(behind);
                if !F::<T>::any(pixels.open) {
                    full_from = depth;
                    break;
                }
                mine &= pixels.open;
                if !F::<T>::any(mine) {
                    continue;
                }
            }
            let kernel = F::<T>::select(mine, kernel, zero);
            let fresh = mine & pixels.weight.le(zero);
            near = F::<T>::select(fresh & near.le(zero), zero.splat(depth), near);
            pixels.edge = F::<T>::select(fresh, zero.splat(depth), pixels.edge);
            if pixels.some_back {
                let is_back = zero.splat(if back { 1.0 } else { 0.0 });
                pixels.is_back = F::<T>::select(fresh, is_back, pixels.is_back);
            }
            let side = &mut pixels.sides[usize::from(back)];
            side.total += kernel;
            side.about[0] += kernel * (du * value[PER_HALF][lane]);
            side.about[1] += kernel * (dv * value[PER_HALF + 1][lane]);
            side.size += kernel * value[SIZE][lane];
            pixels.weight += kernel;
            if batch.shows {
                if describes {
                    let unseen = mine & pixels.shows.le(zero) & pixels.shown.le(zero);
                    #[expect(clippy::cast_possible_truncation, reason = "the low half of a key")]
                    let number = zero.splat(f32::from_bits(i as u32));
                    first = F::<T>::select(unseen, number, first);
                }
                pixels.shows += kernel;
                pixels.sum[0] += kernel * value[RADIANCE][lane];
                pixels.sum[1] += kernel * value[RADIANCE + 1][lane];
                pixels.sum[2] += kernel * value[RADIANCE + 2][lane];
            }
            last = depth;
        }
        if full_from < f32::INFINITY {
            break;
        }
    }
    pixels.end_surface(zero.lt(pixels.weight));
    if !F::<T>::any(pixels.open) {
        full_from = full_from.min(last);
    }
    let Pixels { full, color, shown, front, .. } = pixels;
    // From where each pixel's ray starts; 0 where nothing is.
    let something = own & zero.lt(full);
    let near = F::<T>::select(something, (near - begin).max(zero.splat(f32::MIN_POSITIVE)), zero);
    Blended {
        color: [out(color[0]), out(color[1]), out(color[2])],
        shown: out(shown),
        full: out(full),
        near: out(near),
        front: out(front),
        first: out(first),
        full_from,
    }
}
