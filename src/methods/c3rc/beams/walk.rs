//! From a beam to its splats: which nodes of the clouds' trees it meets, how fine they need be taken, and where it sees their
//! surfels.

use fearless_simd::{Simd, f32x8, f32x16};

use super::beam::{Beam, Frame};
use super::seen::Seen;
use crate::accel::kd_tree::representatives::{PAIRS, QUADS, REPRESENTATIVES};
use crate::accel::kd_tree::{CHILDREN, WideNode};
use crate::geometry::Surfels;
use crate::geometry::lanes::{Real, Vector, dot_const};
use crate::plan::kernel::{
    AGREEING, BETWEEN, LARGE, LEAST_FACING, LEAST_NODE_FACING, PER_DISK, PIXEL, SAME_SURFACE_RADII,
    SPREAD,
};
use crate::plan::{EVENNESS, GatherCounts};
use crate::scene::prepared::Cloud;

/// Splats in a list, one value after the other.
#[derive(Default)]
pub(super) struct Splats {
    pub(super) len: usize,
    pub(super) value: [Vec<f32>; VALUES],
    pub(super) surfel: Vec<u32>,
    /// Surfels near the beam, to be looked at together.
    near: Near,
}

pub(super) const DEPTH: usize = 0;
/// Where the surfel lies in the plane (u, v), and how far along the axis.
pub(super) const U: usize = 1;
pub(super) const V: usize = 2;
pub(super) const S: usize = 3;
/// The form a u² + 2 b u v + c v², which is 1 at the rim; scene units.
pub(super) const FORM: usize = 4;
pub(super) const WEIGHT: usize = 7;
/// One by half the extent along u and v.
pub(super) const PER_HALF: usize = 8;
pub(super) const RANGE: usize = 10;
/// How small it is, 1 for what may show something that lies within a pixel.
pub(super) const SMALL: usize = 11;
/// How the place where a ray meets the disk's plane moves along the axis with the ray's distance along u and v.
pub(super) const TILT: usize = 12;
const VALUES: usize = 14;
/// Surfels looked at together.
const WIDE: usize = 16;

/// Surfels of one cloud in the beam's frame.
#[derive(Default)]
struct Near {
    len: usize,
    u: [f32; 2 * WIDE],
    v: [f32; 2 * WIDE],
    s: [f32; 2 * WIDE],
    /// Squared radius of the disk that holds a surfel.
    squared: [f32; 2 * WIDE],
    surfel: [u32; 2 * WIDE],
}

impl Splats {
    /// Where a splat lies: u, v, s.
    pub(super) fn place(&self, i: usize) -> [f32; 3] {
        [self.value[U][i], self.value[V][i], self.value[S][i]]
    }

    /// Adds one at u, v, s, as tests have them.
    #[cfg(test)]
    pub(super) fn push(
        &mut self,
        place: [f32; 3],
        surfel: u32,
        fill: impl FnOnce(&mut [f32; VALUES]),
    ) {
        self.reserve(1);
        let mut value = [0.0; VALUES];
        [value[U], value[V], value[S]] = place;
        fill(&mut value);
        for (list, value) in self.value.iter_mut().zip(value) {
            list[self.len] = value;
        }
        self.surfel[self.len] = surfel;
        self.len += 1;
    }

    fn reserve(&mut self, more: usize) {
        let room = self.len + more;
        if self.surfel.len() < room {
            let room = room.next_power_of_two();
            self.surfel.resize(room, 0);
            for list in &mut self.value {
                list.resize(room, 0.0);
            }
        }
    }
}

/// A pixel's area counts for no less than this share of its sides' squares: at a caustic it has none.
const LEAST_AREA: f32 = 0.02;
const WIDTH: u32 = 8;
const STACK: usize = 32 * (CHILDREN - 1) + 1;

/// One beam in one cloud's space.
pub(super) struct Walk<'a> {
    pub(super) beam: &'a Beam,
    pub(super) frame: Frame,
    pub(super) cloud: &'a Cloud,
    pub(super) surfels: &'a Surfels,
    pub(super) range: [f32; 2],
    pub(super) detail: f32,
    /// What faces away is hidden.
    pub(super) front_only: bool,
}

type F<T> = f32x8<T>;

/// What is the same for all nodes of a walk, in the cloud's units.
struct Bounds {
    starts: [[f32; 2]; 2],
    slopes: [[f32; 2]; 2],
    step: [[f32; 2]; 2],
    /// Lengths of the steps' rows times a pixel's radius.
    width: [f32; 2],
    width_per_s: [f32; 2],
    absolute: [[f32; 3]; 3],
    /// Slopes are taken at no smaller distance along the axis, and for no steeper (untuned).
    least: f32,
    steepest: f32,
    gaze: [f32; 2],
}

#[inline(always)]
fn three<T: Simd>(simd: T, lists: &[[f32; CHILDREN]; 3]) -> [F<T>; 3] {
    [F::<T>::load(simd, &lists[0]), F::<T>::load(simd, &lists[1]), F::<T>::load(simd, &lists[2])]
}

/// Products with three vectors.
#[inline(always)]
fn dots<R: Real<Scalar = f32>>(v: [R; 3], axes: &[[f32; 3]; 3]) -> [R; 3] {
    [dot_const(v, axes[0]), dot_const(v, axes[1]), dot_const(v, axes[2])]
}

/// b + s a.
#[inline(always)]
fn at<R: Real<Scalar = f32>>(s: R, a: f32, b: f32) -> R {
    s * a + b
}

impl Walk<'_> {
    fn bounds(&self) -> Bounds {
        let k = self.frame.per_scene;
        let b = self.beam;
        let row = |[x, y]: [f32; 2]| PIXEL * (x * x + y * y).sqrt();
        let cosine = 1.0 / (1.0 + b.spread * b.spread).sqrt();
        Bounds {
            starts: b.starts.map(|v| v.map(|x| x * k)),
            slopes: b.slopes,
            step: b.step.map(|v| v.map(|x| x * k)),
            width: b.step.map(|v| row(v) * k),
            width_per_s: b.step_per_s.map(row),
            absolute: self.frame.axes.map(|e| e.map(f32::abs)),
            least: 1e-3 * b.length * k,
            steepest: 1.2 * b.spread + 0.01,
            gaze: [cosine - 1e-5, (1.0 - cosine * cosine).max(0.0).sqrt() + 1e-5],
        }
    }

    /// Area of a pixel at s, by lanes.
    #[inline(always)]
    fn area<R: Real<Scalar = f32>>(&self, bounds: &Bounds, s: R) -> R {
        let (m, o) = (&self.beam.step_per_s, &bounds.step);
        let (a, b) = (at(s, m[0][0], o[0][0]), at(s, m[0][1], o[0][1]));
        let (c, d) = (at(s, m[1][0], o[1][0]), at(s, m[1][1], o[1][1]));
        let sides = a * a + b * b + c * c + d * d;
        (a * d - b * c).abs().max(sides * LEAST_AREA)
    }

    /// Walks the tree, near children first. Now and then it is asked whether the splats so far fill the beam.
    #[inline(always)]
    pub(super) fn run<T: Simd>(&mut self, simd: T, seen: &mut Seen<'_>, counts: &mut GatherCounts) {
        let bounds = self.bounds();
        let wide = self.cloud.tree.wide();
        let mut stack = [(0.0f32, 0u32); STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (near, at) = stack[top];
            if near > self.range[1] {
                continue;
            }
            let node = &wide[at as usize];
            let (mut bits, small, nearest) = self.test(simd, &bounds, node);
            bits &= node.used;
            let own = self.cloud.representatives.start + at * REPRESENTATIVES;
            let single = bits & small[0];
            if single != 0 {
                self.look(simd, &bounds, own, single, 1, seen, counts);
                bits &= !single;
            }
            let from = top;
            while bits != 0 {
                let slot = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let child = node.child[slot];
                let two = small[1] >> slot & 1 != 0;
                let four = small[2] >> slot & 1 != 0;
                let eight = small[3] >> slot & 1 != 0;
                if child == 0 {
                    let (each, every) = match (two, four) {
                        (true, _) => (4, 0x11),
                        (_, true) => (2, 0x55),
                        _ => (1, 0xff),
                    };
                    let first = self.cloud.surfels.start + node.first[slot];
                    let mut done = 0;
                    while done < node.count[slot] {
                        let some = (node.count[slot] - done).min(WIDTH);
                        let lanes = ((1u64 << some) - 1) & every;
                        self.look(simd, &bounds, first + done, lanes, each, seen, counts);
                        done += some;
                    }
                } else if two || four || eight {
                    let used = wide[child as usize].used.count_ones();
                    let parts = self.cloud.representatives.start + child * REPRESENTATIVES;
                    let (offset, count) = match (two, four) {
                        (true, _) => (QUADS, used.div_ceil(4)),
                        (_, true) => (PAIRS, used.div_ceil(2)),
                        _ => (0, used),
                    };
                    self.look(simd, &bounds, parts + offset, (1 << count) - 1, 1, seen, counts);
                } else {
                    // The nearest on top.
                    let mut to = top;
                    while to > from && stack[to - 1].0 < nearest[slot] {
                        stack[to] = stack[to - 1];
                        to -= 1;
                    }
                    stack[to] = (nearest[slot], child);
                    top += 1;
                }
            }
            if seen.splats.len >= seen.until {
                seen.settle(simd, self.beam);
                self.range[1] = self.range[1].min(seen.full_from * self.frame.per_scene);
            }
        }
        if seen.splats.near.len > 0 {
            self.take(simd, &bounds, seen.splats, counts);
        }
    }

    /// Looks at every surfel, as a test of the tree.
    #[cfg(test)]
    #[inline(always)]
    pub(super) fn look_at_all<T: Simd>(
        &mut self,
        simd: T,
        seen: &mut Seen<'_>,
        counts: &mut GatherCounts,
    ) {
        let bounds = self.bounds();
        let range = self.cloud.surfels.clone();
        for first in range.clone().step_by(CHILDREN) {
            let some = (range.end - first).min(WIDTH);
            self.look(simd, &bounds, first, (1 << some) - 1, 1, seen, counts);
        }
        if seen.splats.near.len > 0 {
            self.take(simd, &bounds, seen.splats, counts);
        }
    }

    /// Which children the beam meets, and which of them are seen as small enough for one, two, four, eight representatives.
    #[inline(always)]
    fn test<T: Simd>(
        &self,
        simd: T,
        b: &Bounds,
        node: &WideNode,
    ) -> (u64, [u64; 4], [f32; CHILDREN]) {
        let zero = F::<T>::broadcast(simd, 0.0);
        let o = self.frame.origin;
        let [x, y, z] = three(simd, &node.center);
        let middle = dots([x - o[0], y - o[1], z - o[2]], &self.frame.axes);
        let half = dots(three(simd, &node.half), &b.absolute);
        let first = F::<T>::broadcast(simd, self.range[0]);
        let last = F::<T>::broadcast(simd, self.range[1]);
        let near = (middle[2] - half[2]).max(first);
        let far = (middle[2] + half[2]).min(last);
        let mut nearest = [0.0f32; CHILDREN];
        Vector::<T>::store(near, &mut nearest);
        let area = self.area(b, (near + far) * 0.5);
        // Radius of the largest disk that is drawn here.
        let per_pixel = self.detail * std::f32::consts::FRAC_PI_2;
        let extent = F::<T>::load(simd, &node.extent);
        let coarse = if self.detail > 0.0 {
            (self.area(b, far) * (BETWEEN * 0.5 / per_pixel)).sqrt()
        } else {
            zero
        };
        let disk = extent.min(coarse.max(zero.splat(self.cloud.extent)));
        let disk = disk * (SPREAD * EVENNESS);
        // A disk reaches beyond its middle also along the axis.
        let mut meets = near.le(far + disk);
        for k in 0..2 {
            let [s0, s1] = b.starts[k];
            let [t0, t1] = b.slopes[k];
            let low = (near * t0).min(far * t0) + s0;
            let high = (near * t1).max(far * t1) + s1;
            let pixel = far * b.width_per_s[k] + b.width[k];
            let reach = half[k] + (disk * disk + pixel * pixel).sqrt();
            meets &= low.le(middle[k] + reach) & (middle[k] - reach).le(high);
        }
        let along = dot_const(three(simd, &node.cone_axis), self.frame.axes[2]);
        let cosine = F::<T>::load(simd, &node.cone_cosine);
        if self.front_only {
            let sine = F::<T>::load(simd, &node.cone_sine);
            let sum_sine = sine * b.gaze[0] + cosine * b.gaze[1];
            let sum_cosine = cosine * b.gaze[0] - sine * b.gaze[1];
            let away = zero.lt(cosine) & zero.lt(sum_cosine) & sum_sine.lt(along);
            meets &= !away;
        }
        if self.detail <= 0.0 {
            return (F::<T>::bits(meets), [0; 4], nearest);
        }
        let needed = extent * extent * (per_pixel * 2.0);
        let facing = along.abs().max(zero.splat(LEAST_NODE_FACING));
        let agree = zero.splat(AGREEING).lt(cosine);
        let needed = needed * F::<T>::select(agree, facing, zero.splat(1.0));
        let seen = area * BETWEEN;
        let real = zero.lt(extent);
        let small = [
            F::<T>::bits(needed.le(seen) & real),
            F::<T>::bits(needed.le(seen * 2.0) & real),
            F::<T>::bits(needed.le(seen * 4.0) & real),
            F::<T>::bits(needed.le(seen * 6.0) & real),
        ];
        (F::<T>::bits(meets), small, nearest)
    }

    /// Keeps those of eight surfels from `first` on that `lanes` names and that lie near the beam. Each stands for `each`.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "an inner loop: all of it in registers")]
    fn look<T: Simd>(
        &self,
        simd: T,
        b: &Bounds,
        first: u32,
        lanes: u64,
        each: u32,
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
        let squared = extent * extent * (EVENNESS * EVENNESS * each as f32);
        let disk = squared * (SPREAD * SPREAD);
        // No kernel is larger than this: seen aslant it is cut longer.
        let disk = disk * (1.0 + b.steepest * b.steepest);
        let pixel_u = s * b.width_per_s[0] + b.width[0];
        let pixel_v = s * b.width_per_s[1] + b.width[1];
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
            self.take(simd, b, seen.splats, counts);
        }
    }

    /// Makes splats of up to sixteen surfels that were kept.
    #[inline(always)]
    fn take<T: Simd>(&self, simd: T, b: &Bounds, splats: &mut Splats, counts: &mut GatherCounts) {
        type G<T> = f32x16<T>;
        splats.reserve(2 * WIDE);
        let Splats { len, value, surfel, near } = splats;
        let lanes = near.len.min(WIDE);
        let mut n = [[0.0f32; WIDE]; 3];
        for (lane, surfel) in near.surfel[..lanes].iter().enumerate() {
            let normal = self.surfels.normals[*surfel as usize];
            (n[0][lane], n[1][lane], n[2][lane]) = (normal.x, normal.y, normal.z);
        }
        let n = [G::<T>::load(simd, &n[0]), G::<T>::load(simd, &n[1]), G::<T>::load(simd, &n[2])];
        let [nu, nv, na] = dots(n, &self.frame.axes);
        let (u, v) = (G::<T>::load(simd, &near.u), G::<T>::load(simd, &near.v));
        let s = G::<T>::load(simd, &near.s);
        let squared = G::<T>::load(simd, &near.squared);
        let zero = G::<T>::broadcast(simd, 0.0);
        let one = zero.splat(1.0);
        let mut lands = G::<T>::mask(simd, (1 << lanes) - 1);
        // The slope of the ray that meets it, but for where that starts: as seen along it the disk is cut out of the plane.
        let per_s = one / s.abs().max(zero.splat(b.least));
        let most = zero.splat(b.steepest);
        let (pu, pv) = ((u * per_s).max(-most).min(most), (v * per_s).max(-most).min(most));
        let along = nu * pu + nv * pv + na;
        if self.front_only {
            lands &= along.lt(zero);
        }
        let (m, o) = (&self.beam.step_per_s, &b.step);
        let (gux, guy) = (at(s, m[0][0], o[0][0]), at(s, m[0][1], o[0][1]));
        let (gvx, gvy) = (at(s, m[1][0], o[1][0]), at(s, m[1][1], o[1][1]));
        let disk = squared * (SPREAD * SPREAD);
        let length = pu * pu + pv * pv + one;
        let cosine = along * along / length;
        // Not thinner than it may be.
        let shown = cosine.max(zero.splat(LEAST_FACING * LEAST_FACING));
        let cut = (one - shown) / (one - cosine).max(zero.splat(1e-6));
        let (mu, mv) = (nu - pu * na, nv - pv * na);
        let thin = (cosine / shown).sqrt();
        let seen = (shown * length).sqrt();
        let per_along = one / G::<T>::select(along.lt(zero), -seen, seen);
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
            let root = per_det.sqrt();
            let weight = root * squared * seen * thin * (3.0 * PER_DISK);
            // Its size in pixels.
            let area = (gux * gvy - guy * gvx).abs() * root;
            let size = (one / area.max(zero.splat(f32::MIN_POSITIVE))).sqrt();
            let small =
                ((zero.splat(LARGE[1]) - size) * (1.0 / (LARGE[1] - LARGE[0]))).max(zero).min(one);
            let k = 1.0 / self.frame.per_scene;
            let square = self.frame.per_scene * self.frame.per_scene;
            let per_det = per_det * square;
            let values = [
                s.max(zero) * k,
                u * k,
                v * k,
                s * k,
                yy * per_det,
                -(xy * per_det),
                xx * per_det,
                weight,
                zero.splat(self.frame.per_scene) / half[0],
                zero.splat(self.frame.per_scene) / half[1],
                squared.sqrt() * (SAME_SURFACE_RADII * k),
                small,
                tilt_u,
                tilt_v,
            ];
            for k in 0..VALUES {
                Vector::<T>::compress(values[k], lands, &mut value[k][*len..]);
            }
            <G<T> as Vector<T>>::compress_numbers(simd, &near.surfel, lands, &mut surfel[*len..]);
            *len += bits.count_ones() as usize;
            counts.valid += u64::from(bits.count_ones());
        }
        // What is left over.
        near.len -= lanes;
        for list in [&mut near.u, &mut near.v, &mut near.s, &mut near.squared] {
            list.copy_within(WIDE..WIDE + CHILDREN, 0);
        }
        near.surfel.copy_within(WIDE..WIDE + CHILDREN, 0);
    }
}

/// Tests eight clouds' boxes (scene space) against a beam: the lanes it may meet, and from where on along its axis.
#[inline(always)]
pub(super) fn clouds_met<T: Simd>(
    simd: T,
    beam: &Beam,
    group: &WideNode,
    reach: &[f32; CHILDREN],
    range: [f32; 2],
) -> (u64, [f32; CHILDREN]) {
    let o = beam.origin.to_array();
    let [x, y, z] = three(simd, &group.center);
    let axes = beam.axes.map(|e| e.to_array());
    let middle = dots([x - o[0], y - o[1], z - o[2]], &axes);
    let half = dots(three(simd, &group.half), &beam.axes.map(|e| e.abs().to_array()));
    let grow = F::<T>::load(simd, reach);
    let first = F::<T>::broadcast(simd, range[0]);
    let last = F::<T>::broadcast(simd, range[1]);
    let near = (middle[2] - half[2]).max(first);
    let far = (middle[2] + half[2]).min(last);
    let mut meets = near.le(far);
    for k in 0..2 {
        let [s0, s1] = beam.starts[k];
        let [t0, t1] = beam.slopes[k];
        let low = (near * t0).min(far * t0) + s0;
        let high = (near * t1).max(far * t1) + s1;
        let [x, y] = beam.step_per_s[k];
        let [x0, y0] = beam.step[k];
        // What a representative of a pixel's size may reach.
        let pixel = far * (2.0 * (x * x + y * y).sqrt()) + 2.0 * (x0 * x0 + y0 * y0).sqrt();
        let reach = half[k] + grow + pixel;
        meets &= low.le(middle[k] + reach) & (middle[k] - reach).le(high);
    }
    let mut nearest = [0.0; CHILDREN];
    Vector::<T>::store(near, &mut nearest);
    (F::<T>::bits(meets) & group.used, nearest)
}
