//! A beam's splats to its pixels, from the nearest on; a lane is a pixel.

use fearless_simd::{Simd, f32x16};
use glam::Vec4;

use super::beam::{Beam, Rays};
use super::block::LANES;
use super::close::Layer;
use super::seen::{AT_ONCE, depth_of, index, of_group};
use super::splats::{
    FARTHER, FORM, PER_HALF, RADIANCE, S, SMALL, Splats, TILT, U, V, WEIGHT, WIDE,
};
use crate::geometry::lanes::{Real, Vector};
use crate::plan::kernel::{WHOLE, closed};

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

type F<T> = f32x16<T>;

#[inline(always)]
fn out<T: Simd>(v: F<T>) -> [f32; LANES] {
    let mut list = [0.0f32; LANES];
    Vector::<T>::store(v, &mut list);
    list
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
    let far = F::<T>::broadcast(simd, f32::INFINITY);
    let own = F::<T>::mask(simd, u64::from(beam.pixels[group]));
    let Rays { start, slope, begin } = &beam.rays[group];
    let (start_u, start_v) = (F::<T>::load(simd, &start[0]), F::<T>::load(simd, &start[1]));
    let (slope_u, slope_v) = (F::<T>::load(simd, &slope[0]), F::<T>::load(simd, &slope[1]));
    let begin = F::<T>::load(simd, begin);
    let mut full = F::<T>::select(own, zero, one);
    let mut color = [zero; 3];
    let (mut shown, mut near, mut first) = (zero, zero, zero);
    let mut front = one + one;
    // Where the front begins, until something farther comes.
    let mut edge = far;
    let (mut about_u, mut about_v) = (zero, zero);
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
            let mut part = kernel.min(one - full);
            let mine = zero.lt(part);
            if !F::<T>::any(mine) {
                continue;
            }
            let behind = mine & edge.lt(zero.splat(value[FARTHER][lane]));
            if F::<T>::any(behind) {
                let now = F::<T>::select(behind, closed(full, [about_u, about_v]), full);
                let scale = F::<T>::select(behind, now / full, one);
                color = [color[0] * scale, color[1] * scale, color[2] * scale];
                shown *= scale;
                full = now;
                front = F::<T>::select(behind, full, front);
                edge = F::<T>::select(behind, far, edge);
                part = kernel.min(one - full);
            }
            let fresh = mine & full.le(zero);
            near = F::<T>::select(fresh, zero.splat(depth), near);
            edge = F::<T>::select(fresh, zero.splat(depth), edge);
            full += part;
            let of_front = F::<T>::select(one.lt(front), part, zero);
            about_u += of_front * (du * value[PER_HALF][lane] + value[SMALL][lane]);
            about_v += of_front * (dv * value[PER_HALF + 1][lane]);
            if batch.shows {
                if describes {
                    let unseen = zero.lt(part) & shown.le(zero);
                    #[expect(clippy::cast_possible_truncation, reason = "the low half of a key")]
                    let number = zero.splat(f32::from_bits(i as u32));
                    first = F::<T>::select(unseen, number, first);
                }
                shown += part;
                color[0] += part * value[RADIANCE][lane];
                color[1] += part * value[RADIANCE + 1][lane];
                color[2] += part * value[RADIANCE + 2][lane];
            }
            if !F::<T>::any(full.lt(zero.splat(WHOLE))) {
                full_from = depth;
                break;
            }
        }
        if full_from < f32::INFINITY {
            break;
        }
    }
    let open = one.lt(front) & zero.lt(full) & full.lt(zero.splat(WHOLE)) & own;
    if F::<T>::any(open) {
        let now = F::<T>::select(open, closed(full, [about_u, about_v]), full);
        let scale = F::<T>::select(open, now / full, one);
        color = [color[0] * scale, color[1] * scale, color[2] * scale];
        shown *= scale;
        full = now;
    }
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
