//! A beam's splats to its pixels, from the nearest on; a lane is a pixel.

use fearless_simd::{Simd, f32x16};
use glam::{Vec3, Vec4};

use super::CONTACT;
use super::beam::{Beam, LANES};
use super::close::Layer;
use super::walk::{DEPTH, FORM, PER_HALF, RANGE, S, SMALL, Splats, TILT, U, V, WEIGHT};
use crate::geometry::lanes::{Real, Vector};
use crate::plan::kernel::{GAIN, WHOLE, closed};

/// What is known of a block's pixels.
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
    /// So many of the nearest splats fill all pixels, up to a depth.
    pub(super) used: usize,
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

/// Blends what a beam sees, in the given order.
#[inline(always)]
pub(super) fn blend<T: Simd>(
    simd: T,
    beam: &Beam,
    splats: &Splats,
    order: &[u64],
    radiance: &[Vec3],
    first_hider: u32,
    clear: f32,
) -> Blended {
    let zero = F::<T>::broadcast(simd, 0.0);
    let one = F::<T>::broadcast(simd, 1.0);
    let own = F::<T>::mask(simd, u64::from(beam.pixels));
    let (start_u, start_v) =
        (F::<T>::load(simd, &beam.start[0]), F::<T>::load(simd, &beam.start[1]));
    let (slope_u, slope_v) =
        (F::<T>::load(simd, &beam.slope[0]), F::<T>::load(simd, &beam.slope[1]));
    let begin = F::<T>::load(simd, &beam.begin);
    let mut full = F::<T>::select(own, zero, one);
    let mut color = [zero; 3];
    let (mut shown, mut near, mut first) = (zero, zero, zero);
    let mut front = one + one;
    let (mut about_u, mut about_v) = (zero, zero);
    let (mut used, mut full_from) = (order.len(), f32::INFINITY);
    for (n, &key) in order.iter().enumerate() {
        #[expect(clippy::cast_possible_truncation, reason = "the low half")]
        let i = key as u32 as usize;
        let s = splats.value[S][i];
        let du = slope_u * s + start_u - splats.value[U][i];
        let dv = slope_v * s + start_v - splats.value[V][i];
        let far = du * (du * splats.value[FORM][i] + dv * (2.0 * splats.value[FORM + 1][i]))
            + dv * dv * splats.value[FORM + 2][i];
        let inside = (one - far).max(zero);
        let kernel = inside * inside * (splats.value[WEIGHT][i] * GAIN);
        let mut part = kernel.min(one - full);
        let surfel = splats.surfel[i];
        let shows = surfel < first_hider;
        let hit = du * splats.value[TILT][i] + dv * splats.value[TILT + 1][i] + s;
        // Nothing is seen behind where a ray starts; mirrors hide from a little beyond it.
        let from = if shows { -CONTACT * beam.length } else { clear };
        let mut mine = zero.lt(part) & (begin + from).le(hit);
        if !F::<T>::any(mine) {
            continue;
        }
        let depth = splats.value[DEPTH][i];
        let farther = zero.splat(depth - splats.value[RANGE][i]);
        let behind = mine & near.lt(farther) & one.lt(front) & zero.lt(full);
        if F::<T>::any(behind) {
            let now = F::<T>::select(behind, closed(full, [about_u, about_v]), full);
            let scale = F::<T>::select(behind, now / full, one);
            color = [color[0] * scale, color[1] * scale, color[2] * scale];
            shown *= scale;
            full = now;
            front = F::<T>::select(behind, full, front);
            part = kernel.min(one - full);
            mine &= zero.lt(part);
        }
        part = F::<T>::select(mine, part, zero);
        let fresh = mine & full.le(zero);
        near = F::<T>::select(fresh, zero.splat(depth), near);
        full += part;
        let of_front = F::<T>::select(one.lt(front), part, zero);
        about_u += of_front * (du * splats.value[PER_HALF][i] + splats.value[SMALL][i]);
        about_v += of_front * (dv * splats.value[PER_HALF + 1][i]);
        if shows {
            let unseen = mine & shown.le(zero);
            #[expect(clippy::cast_possible_truncation, reason = "indices of a list of f32")]
            let index = zero.splat(f32::from_bits(i as u32));
            first = F::<T>::select(unseen, index, first);
            shown += part;
            let c = radiance[surfel as usize];
            color[0] += part * c.x;
            color[1] += part * c.y;
            color[2] += part * c.z;
        }
        if !F::<T>::any(full.lt(zero.splat(WHOLE))) {
            (used, full_from) = (n + 1, depth);
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
        used,
        full_from,
    }
}
