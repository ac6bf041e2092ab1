//! Which boxes meet a view volume: several tests, written once over lanes (a lane is a box).
//!
//! All but [`BoxTest::Paper`] are conservative: a box that contains a point with an image is never refused.
//! Rounding goes outward.

use glam::DVec3;

use super::{Rays, array};
use crate::geometry::lanes::{Real, Scalar, cross, dot, dot_const};

/// How boxes are tested against a view volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BoxTest {
    /// Not at all: whole objects.
    None,
    /// Sweep separation along x, y, z.
    Interval,
    /// Sweep separation along x, y, z, the camera's axis and its three walls.
    Sweep,
    /// λ from the camera's axis, then the hull of T(λlo) and T(λhi): its box and three walls fitted to it.
    #[default]
    Slab,
    /// The two conditions of Mei et al. section 5.2, which miss boxes; for comparison only.
    Paper,
}

/// Boxes by middle and half edge lengths, one a lane, in the camera's space.
#[derive(Clone, Copy, Debug)]
pub struct Boxes<R> {
    /// Middles.
    pub center: [R; 3],
    /// Half edge lengths, rounded up.
    pub half: [R; 3],
}

/// A fixed direction along which the sweep is compared with boxes.
#[derive(Clone, Copy, Debug)]
struct Direction<T, const N: usize> {
    n: [T; 3],
    /// n·(v_i - v1).
    start: [T; N],
    /// n·d_i.
    speed: [T; N],
    /// 1 / speed where that is not zero.
    per_speed: [T; N],
    /// Largest |start|.
    reach: T,
}

/// A view volume: the union of T(λ) over a λ range, where T(λ) is a triangle or, with more corners, a plane convex
/// polygon.
#[derive(Clone, Copy, Debug)]
pub struct ViewVolume<T, const N: usize = 3> {
    v1: [T; 3],
    v: [[T; 3]; N],
    d: [[T; 3]; N],
    axes: [Direction<T, N>; 3],
    axis: Direction<T, N>,
    walls: [Direction<T, N>; N],
}

/// What a test says of boxes.
#[derive(Clone, Copy)]
pub struct Verdict<R: Real> {
    /// Start of the λ range in which the box may meet the volume.
    pub lo: R,
    /// End of it.
    pub hi: R,
    /// Lanes whose box may meet the volume.
    pub meets: R::Mask,
    /// Lanes whose box lies inside it but for rounding and for λ: testing its parts refuses none. A test may find
    /// no such box.
    pub inside: R::Mask,
}

impl<R: Real> Verdict<R> {
    #[inline(always)]
    pub(super) fn not_inside(lo: R, hi: R, meets: R::Mask) -> Self {
        Self { lo, hi, meets, inside: meets & !meets }
    }
}

/// Margin for the rounding of an inequality, as a share of its largest term: eight roundings of f32.
const ROUNDING: f64 = 1e-6;
/// Where the fixed walls of the sweep test touch the volume, as λ (untuned).
const WALL_LAMBDA: f64 = 1.0;

impl<T: Scalar, const N: usize> Direction<T, N> {
    fn new(n: DVec3, rays: &Rays<N>) -> Self {
        // The rounded direction is the one that is compared with, so its products are made from it.
        let n: [T; 3] = array(n);
        let exact = DVec3::from_array(n.map(T::to_f64));
        let start = rays.origins.map(|v| exact.dot(v - rays.origins[0]));
        let speed = rays.directions.map(|d| exact.dot(d));
        let reach = start.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
        Self {
            n,
            start: start.map(T::from_f64),
            speed: speed.map(T::from_f64),
            per_speed: speed.map(|s| T::from_f64(if s == 0.0 { 0.0 } else { 1.0 / s })),
            reach: T::from_f64(reach),
        }
    }

    /// Takes from `lo..hi` the λ at an end of it at which all of T(λ) lies beyond the box along ±n.
    #[inline(always)]
    fn trim<R: Real<Scalar = T>>(&self, boxes: &Boxes<R>, lo: R, hi: R) -> (R, R) {
        let zero = T::from_f64(0.0);
        let share = T::from_f64(ROUNDING);
        let [nx, ny, nz] = self.n;
        let middle = dot_const(boxes.center, self.n);
        let half = boxes.half[0] * abs(nx) + boxes.half[1] * abs(ny) + boxes.half[2] * abs(nz);
        let sizes = boxes.center[0].abs() * abs(nx)
            + boxes.center[1].abs() * abs(ny)
            + boxes.center[2].abs() * abs(nz);
        let half = half + (sizes + half + self.reach) * share;
        let far = lo.splat(T::from_f64(f64::from(f32::MAX)));
        let (mut lo, mut hi) = (lo, hi);
        for above in [true, false] {
            // T(λ) is beyond the box where ±(start_i + λ speed_i) > ±edge for all i: an interval of λ.
            let edge = if above { middle + half } else { middle - half };
            let (mut from, mut to) = (-far, far);
            for i in 0..N {
                let speed = if above { self.speed[i] } else { -self.speed[i] };
                let at = (edge - self.start[i]) * self.per_speed[i];
                if speed > zero {
                    from = from.max(at + at.abs() * share);
                } else if speed < zero {
                    to = to.min(at - at.abs() * share);
                } else {
                    let gap = if above { -edge + self.start[i] } else { edge - self.start[i] };
                    from = R::select(lo.splat(zero).lt(gap), from, far);
                }
            }
            let (at_start, at_end) = (from.lt(lo), hi.lt(to));
            let (next_lo, next_hi) = (lo.max(to), hi.min(from));
            // An interval that covers both ends leaves nothing: lo > hi.
            let open = from.lt(to);
            lo = R::select(at_start & open, next_lo, lo);
            hi = R::select(at_end & open, next_hi, hi);
        }
        (lo, hi)
    }
}

#[inline(always)]
fn abs<T: Scalar>(x: T) -> T {
    if x < T::from_f64(0.0) { -x } else { x }
}

impl<T: Scalar, const N: usize> ViewVolume<T, N> {
    /// The volume of the grown camera `rays`. Boxes are given relative to [`ViewVolume::origin`].
    pub fn new(rays: &Rays<N>) -> Self {
        let v1 = rays.origins[0];
        let axis = rays.axis().unwrap_or(DVec3::ZERO);
        let wall = |i: usize, j: usize| {
            let at = |k: usize| rays.origins[k] + rays.directions[k] * WALL_LAMBDA;
            let n = (at(j) - at(i)).cross(rays.directions[i] + rays.directions[j]);
            n.try_normalize().unwrap_or(DVec3::ZERO)
        };
        Self {
            v1: array(v1),
            v: rays.origins.map(|v| array(v - v1)),
            d: rays.directions.map(array),
            axes: [DVec3::X, DVec3::Y, DVec3::Z].map(|n| Direction::new(n, rays)),
            axis: Direction::new(axis, rays),
            walls: std::array::from_fn(|i| Direction::new(wall(i, (i + 1) % N), rays)),
        }
    }

    /// The camera's first origin; box middles are given relative to it.
    pub fn origin(&self) -> [T; 3] {
        self.v1
    }

    /// The part of λ `lo..=hi` that is left for boxes that may meet the volume, and the lanes where some is.
    #[inline(always)]
    pub fn meets<R: Real<Scalar = T>>(
        &self,
        test: BoxTest,
        boxes: &Boxes<R>,
        lo: R,
        hi: R,
    ) -> Verdict<R> {
        match test {
            BoxTest::None => Verdict::not_inside(lo, hi, lo.le(hi)),
            BoxTest::Interval => self.sweep(boxes, lo, hi, false),
            BoxTest::Sweep => self.sweep(boxes, lo, hi, true),
            BoxTest::Slab => self.slab(boxes, lo, hi),
            BoxTest::Paper => {
                // Stated for triangles: others are not tested.
                let (Some(v), Some(d)) = (self.v.first_chunk::<3>(), self.d.first_chunk::<3>())
                else {
                    return Verdict::not_inside(lo, hi, lo.le(hi));
                };
                if N > 3 {
                    return Verdict::not_inside(lo, hi, lo.le(hi));
                }
                let (lo, hi, meets) = super::paper_test::meets(v, d, boxes, lo, hi);
                Verdict::not_inside(lo, hi, meets)
            }
        }
    }

    #[inline(always)]
    fn sweep<R: Real<Scalar = T>>(
        &self,
        boxes: &Boxes<R>,
        lo: R,
        hi: R,
        walls: bool,
    ) -> Verdict<R> {
        let (mut lo, mut hi) = (lo, hi);
        if walls {
            (lo, hi) = self.axis.trim(boxes, lo, hi);
        }
        for direction in &self.axes {
            (lo, hi) = direction.trim(boxes, lo, hi);
        }
        if walls && R::any(lo.le(hi)) {
            for direction in &self.walls {
                (lo, hi) = direction.trim(boxes, lo, hi);
            }
        }
        Verdict::not_inside(lo, hi, lo.le(hi))
    }

    #[expect(clippy::needless_range_loop, reason = "compilers see through indices best")]
    #[inline(always)]
    fn slab<R: Real<Scalar = T>>(&self, boxes: &Boxes<R>, lo: R, hi: R) -> Verdict<R> {
        let (lo, hi) = self.axis.trim(boxes, lo, hi);
        let share = T::from_f64(ROUNDING);
        let mut alive = lo.le(hi);
        let (mut near, mut far) = ([[lo; 3]; N], [[hi; 3]; N]);
        for i in 0..N {
            near[i] = self.corner(i, lo);
            far[i] = self.corner(i, hi);
        }
        let mut size = lo.splat(T::from_f64(0.0));
        for k in 0..3 {
            let (mut low, mut high) = (near[0][k].min(far[0][k]), near[0][k].max(far[0][k]));
            for i in 1..N {
                low = low.min(near[i][k]).min(far[i][k]);
                high = high.max(near[i][k]).max(far[i][k]);
            }
            let (c, h) = (boxes.center[k], boxes.half[k]);
            let margin = (c.abs() + h + low.abs().max(high.abs())) * share;
            size = size + margin;
            alive = alive & (c - h).le(high + margin) & low.le(c + h + margin);
        }
        if !R::any(alive) {
            return Verdict::not_inside(lo, hi, alive);
        }
        let mut inside = alive;
        let mid = (lo + hi) * T::from_f64(0.5);
        let mut at_mid = [[mid; 3]; N];
        for i in 0..N {
            at_mid[i] = self.corner(i, mid);
        }
        for i in 0..N {
            let j = (i + 1) % N;
            let along = [
                mid.splat(self.d[i][0] + self.d[j][0]),
                mid.splat(self.d[i][1] + self.d[j][1]),
                mid.splat(self.d[i][2] + self.d[j][2]),
            ];
            let edge = [
                at_mid[j][0] - at_mid[i][0],
                at_mid[j][1] - at_mid[i][1],
                at_mid[j][2] - at_mid[i][2],
            ];
            let n = cross(edge, along);
            let (mut p, mut q) = ([lo; N], [hi; N]);
            for k in 0..N {
                p[k] = dot(near[k], n);
                q[k] = dot(far[k], n);
            }
            let wall_high = p[i].max(p[j]).max(q[i]).max(q[j]);
            let wall_low = p[i].min(p[j]).min(q[i]).min(q[j]);
            let (mut high, mut low) = (wall_high, wall_low);
            for other in 2..N {
                let k = (i + other) % N;
                high = high.max(p[k]).max(q[k]);
                low = low.min(p[k]).min(q[k]);
            }
            let sizes = [n[0].abs(), n[1].abs(), n[2].abs()];
            let half = dot(boxes.half, sizes);
            // Every term is at most `size / share` times the normal's largest component.
            let margin = size * (sizes[0] + sizes[1] + sizes[2]) * T::from_f64(4.0);
            let middle = dot(boxes.center, n);
            // Refused only where the comparison holds: a NaN from an overflow refuses nothing.
            let outside = (high + margin).lt(middle - half) | (middle + half).lt(low - margin);
            alive = alive & !outside;
            // The last corner before the wall is on the inner side.
            let k = (i + N - 1) % N;
            let upward = (p[i] + q[i]).lt(p[k] + q[k]);
            let above = upward & wall_high.le(middle - half);
            inside = inside & (above | (!upward & (middle + half).le(wall_low)));
        }
        Verdict { lo, hi, meets: alive, inside }
    }

    /// v_i + λ d_i.
    #[inline(always)]
    fn corner<R: Real<Scalar = T>>(&self, i: usize, lambda: R) -> [R; 3] {
        let (v, d) = (self.v[i], self.d[i]);
        [lambda * d[0] + v[0], lambda * d[1] + v[1], lambda * d[2] + v[2]]
    }
}
