//! From the surfels that a beam's walk comes by to splats: where it sees them, and of which shape.

use fearless_simd::{Simd, f32x8, f32x16};

use super::CONTACT;
use super::bounds::{Bounds, at, dots};
use super::seen::{Seen, key};
use super::splats::{
    FARTHER, FORM, PER_HALF, RADIANCE, S, SIZE, SPREAD, Splats, TILT, U, V, WEIGHT, WIDE, next,
};
use super::walk::Walk;
use crate::accel::kd_tree::CHILDREN;
use crate::geometry::lanes::{Real, Vector};
use crate::geometry::look::{Look, unpacked_normals};
use crate::plan::kernel::{LEAST_FACING, PER_DISK, PIXEL, SAME_SURFACE_RADII};
use crate::plan::{EVENNESS, GatherCounts};

type F<T> = f32x8<T>;

impl Walk<'_> {
    /// Keeps those of eight surfels from `first` on that `lanes` names and that lie near the beam.
    #[inline(always)]
    pub(super) fn look<T: Simd>(
        &self,
        simd: T,
        b: &Bounds,
        first: u32,
        lanes: u64,
        seen: &mut Seen<'_>,
        counts: &mut GatherCounts,
    ) {
        counts.batches += 1;
        counts.projections += u64::from(lanes.count_ones());
        let i = first as usize;
        let o = self.frame.origin;
        let q = [
            F::<T>::load(simd, &self.surfels.x[i..]) - o[0],
            F::<T>::load(simd, &self.surfels.y[i..]) - o[1],
            F::<T>::load(simd, &self.surfels.z[i..]) - o[2],
        ];
        let [u, v, s] = dots(q, &self.frame.axes);
        let zero = F::<T>::broadcast(simd, 0.0);
        let extent = F::<T>::load(simd, &self.surfels.extent[i..]);
        let squared = extent * extent * (EVENNESS * EVENNESS);
        let disk = squared * (SPREAD * SPREAD);
        // No kernel is larger than this: seen aslant it is cut longer.
        let disk = disk * b.longer;
        let along = s.abs();
        let pixel_u = along * b.width_per_s[0] + b.width[0];
        let pixel_v = along * b.width_per_s[1] + b.width[1];
        let low_u = at(s, b.slopes[0][0], b.starts[0][0]) - u;
        let high_u = u - at(s, b.slopes[0][1], b.starts[0][1]);
        let low_v = at(s, b.slopes[1][0], b.starts[1][0]) - v;
        let high_v = v - at(s, b.slopes[1][1], b.starts[1][1]);
        let beyond_u = low_u.max(high_u).max(zero);
        let beyond_v = low_v.max(high_v).max(zero);
        let lands = F::<T>::mask(simd, lanes)
            & zero.splat(self.range[0]).le(s + (squared * (SPREAD * SPREAD)).sqrt())
            & s.le(zero.splat(self.range[1]))
            & (beyond_u * beyond_u).le(pixel_u * pixel_u + disk)
            & (beyond_v * beyond_v).le(pixel_v * pixel_v + disk);
        let bits = F::<T>::bits(lands);
        if bits == 0 {
            return;
        }
        let near = &mut seen.splats.near;
        let end = near.len;
        Vector::<T>::compress(u, lands, &mut near.u[end..]);
        Vector::<T>::compress(v, lands, &mut near.v[end..]);
        Vector::<T>::compress(s, lands, &mut near.s[end..]);
        Vector::<T>::compress(squared, lands, &mut near.squared[end..]);
        let mut numbers = [0u32; CHILDREN];
        for (number, surfel) in numbers.iter_mut().zip(first..) {
            *number = surfel;
        }
        <F<T> as Vector<T>>::compress_numbers(simd, &numbers, lands, &mut near.surfel[end..]);
        near.len += bits.count_ones() as usize;
        if near.len >= WIDE {
            self.take(simd, b, seen, counts);
        }
    }

    /// Makes splats of up to sixteen surfels that were kept.
    #[inline(always)]
    pub(super) fn take<T: Simd>(
        &self,
        simd: T,
        b: &Bounds,
        seen: &mut Seen<'_>,
        counts: &mut GatherCounts,
    ) {
        type G<T> = f32x16<T>;
        let splats = &mut *seen.splats;
        let near = &splats.near;
        let lanes = near.len.min(WIDE);
        let mut looks = [Look::default(); WIDE];
        let mut normals = [0u32; WIDE];
        for lane in 0..lanes {
            looks[lane] = self.looks[near.surfel[lane] as usize];
            normals[lane] = looks[lane].normal;
        }
        let normals: [G<T>; 3] = unpacked_normals(simd, &normals);
        let [nu, nv, na] = dots(normals, &self.frame.axes);
        let (u, v) = (G::<T>::load(simd, &near.u), G::<T>::load(simd, &near.v));
        let s = G::<T>::load(simd, &near.s);
        let squared = G::<T>::load(simd, &near.squared);
        let zero = G::<T>::broadcast(simd, 0.0);
        let one = zero.splat(1.0);
        let mut lands = G::<T>::mask(simd, (1 << lanes) - 1);
        // The slope of the ray that meets it, but for where that starts: as seen along it the disk is cut out of the plane.
        let ([[gux, guy], [gvx, gvy]], [pu, pv]) = b.steps(u, v, s);
        let t = &b.slopes;
        let pu = pu.max(zero.splat(t[0][0])).min(zero.splat(t[0][1]));
        let pv = pv.max(zero.splat(t[1][0])).min(zero.splat(t[1][1]));
        let along = nu * pu + nv * pv + na;
        if self.front_only {
            lands &= along.lt(zero);
        }
        let disk = squared * (SPREAD * SPREAD);
        let length = pu * pu + pv * pv + one;
        let cosine = along * along / length;
        // Not thinner than it may be.
        let shown = cosine.max(zero.splat(LEAST_FACING * LEAST_FACING));
        let cut = (one - shown) / (one - cosine).max(zero.splat(1e-6));
        let (mu, mv) = (nu - pu * na, nv - pv * na);
        let thin = (cosine / shown).sqrt();
        let aslant = (shown * length).sqrt();
        let per_along = one / G::<T>::select(along.lt(zero), -aslant, aslant);
        let (tilt_u, tilt_v) = (-(nu * per_along), -(nv * per_along));
        let pixel = PIXEL * PIXEL;
        let xx = (pu * pu + one - mu * mu * cut) * disk + (gux * gux + guy * guy) * pixel;
        let xy = (pu * pv - mu * mv * cut) * disk + (gux * gvx + guy * gvy) * pixel;
        let yy = (pv * pv + one - mv * mv * cut) * disk + (gvx * gvx + gvy * gvy) * pixel;
        let det = (xx * yy - xy * xy).max(zero.splat(f32::MIN_POSITIVE));
        let per_det = one / det;
        let half = [xx.sqrt(), yy.sqrt()];
        let low_u = at(s, b.slopes[0][0], b.starts[0][0]);
        let high_u = at(s, b.slopes[0][1], b.starts[0][1]);
        let low_v = at(s, b.slopes[1][0], b.starts[1][0]);
        let high_v = at(s, b.slopes[1][1], b.starts[1][1]);
        lands &= low_u.le(u + half[0]) & (u - half[0]).le(high_u);
        lands &= low_v.le(v + half[1]) & (v - half[1]).le(high_v);
        let bits = G::<T>::bits(lands);
        if bits != 0 {
            counts.valid += u64::from(bits.count_ones());
            let root = per_det.sqrt();
            // Its size in pixels.
            let area = (gux * gvy - guy * gvx).abs() * root;
            let size = (one / area.max(zero.splat(f32::MIN_POSITIVE))).sqrt();
            let k = 1.0 / self.frame.per_scene;
            let square = self.frame.per_scene * self.frame.per_scene;
            let per_det = per_det * square;
            let depth = s.max(zero) * k;
            let reach = [half[0] * k, half[1] * k];
            let from = if self.hides { seen.clear } else { -CONTACT * self.beam.length };
            let nearest = s * k - tilt_u.abs() * reach[0] - tilt_v.abs() * reach[1];
            let number = splats.len * WIDE;
            let Splats { batches, len, near } = &mut *splats;
            let batch = next(batches, len);
            batch.shows = !self.hides;
            batch.from = from;
            #[expect(clippy::cast_possible_truncation, reason = "sixteen bits")]
            let early = G::<T>::bits(nearest.lt(zero.splat(self.beam.last + from))) as u32;
            batch.early = early;
            #[expect(clippy::cast_possible_truncation, reason = "sixteen bits")]
            let back = G::<T>::bits(zero.lt(along)) as u32;
            batch.back = back;
            batch.surfel.copy_from_slice(&near.surfel[..WIDE]);
            let value = &mut batch.value;
            let mut values = [zero; RADIANCE];
            (values[U], values[V], values[S]) = (u * k, v * k, s * k);
            values[FORM] = yy * per_det;
            values[FORM + 1] = xy * per_det * -2.0;
            values[FORM + 2] = xx * per_det;
            values[WEIGHT] = root * squared * aslant * thin * (3.0 * PER_DISK);
            (values[PER_HALF], values[PER_HALF + 1]) = (one / reach[0], one / reach[1]);
            values[FARTHER] = depth - squared.sqrt() * (SAME_SURFACE_RADII * k);
            values[SIZE] = size;
            (values[TILT], values[TILT + 1]) = (tilt_u, tilt_v);
            for (list, values) in value.iter_mut().zip(values) {
                Vector::<T>::store(values, list);
            }
            let (mut depths, mut reaches) = ([0.0f32; WIDE], [[0.0f32; WIDE]; 2]);
            Vector::<T>::store(depth, &mut depths);
            Vector::<T>::store(reach[0], &mut reaches[0]);
            Vector::<T>::store(reach[1], &mut reaches[1]);
            // Which groups: now a lane is a group.
            let (starts, slopes) = (&seen.ranges.starts, &seen.ranges.slopes);
            let [s0, s1] = [G::<T>::load(simd, &starts[0][0]), G::<T>::load(simd, &starts[0][1])];
            let [t0, t1] = [G::<T>::load(simd, &slopes[0][0]), G::<T>::load(simd, &slopes[0][1])];
            let [s2, s3] = [G::<T>::load(simd, &starts[1][0]), G::<T>::load(simd, &starts[1][1])];
            let [t2, t3] = [G::<T>::load(simd, &slopes[1][0]), G::<T>::load(simd, &slopes[1][1])];
            let full = G::<T>::load(simd, &seen.full);
            let mut left = bits;
            while left != 0 {
                let lane = left.trailing_zeros() as usize % WIDE;
                left &= left - 1;
                let (u, v, s) = (value[U][lane], value[V][lane], value[S][lane]);
                let lands = (t0 * s + s0).le(zero.splat(u + reaches[0][lane]))
                    & zero.splat(u - reaches[0][lane]).le(t1 * s + s1)
                    & (t2 * s + s2).le(zero.splat(v + reaches[1][lane]))
                    & zero.splat(v - reaches[1][lane]).le(t3 * s + s3)
                    & zero.splat(depths[lane]).le(full);
                #[expect(clippy::cast_possible_truncation, reason = "sixteen bits")]
                let groups = G::<T>::bits(lands) as u16;
                if groups != 0 {
                    let [r, g, b] = looks[lane].radiance();
                    value[RADIANCE][lane] = r;
                    value[RADIANCE + 1][lane] = g;
                    value[RADIANCE + 2][lane] = b;
                    batch.groups[lane] = groups;
                    seen.order.push(key(depths[lane], number + lane));
                }
            }
        }
        let near = &mut seen.splats.near;
        // What is left over.
        near.len -= lanes;
        for list in [&mut near.u, &mut near.v, &mut near.s, &mut near.squared] {
            list.copy_within(WIDE..WIDE + CHILDREN, 0);
        }
        near.surfel.copy_within(WIDE..WIDE + CHILDREN, 0);
    }
}
