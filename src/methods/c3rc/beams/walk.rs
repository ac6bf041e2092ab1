//! From a beam to surfels: which nodes of the clouds' trees it meets, and how fine they need be taken.

use fearless_simd::{Simd, f32x8, f32x16};

use super::beam::{Beam, Frame};
use super::bounds::{Bounds, dots};
use super::seen::Seen;
use super::splats::SPREAD;
use crate::accel::kd_tree::representatives::{PAIRS, QUADS, REPRESENTATIVES};
use crate::accel::kd_tree::{CHILDREN, WideNode};
use crate::geometry::Surfels;
use crate::geometry::lanes::{Real, Vector, dot_const};
use crate::geometry::look::Look;
use crate::plan::kernel::{AGREEING, BETWEEN, LEAST_NODE_FACING};
use crate::plan::{EVENNESS, GatherCounts};
use crate::scene::prepared::Cloud;

const WIDTH: u32 = 8;
const STACK: usize = 32 * (CHILDREN - 1) + 1;

/// One beam in one cloud's space.
pub(super) struct Walk<'a> {
    pub(super) beam: &'a Beam,
    pub(super) frame: Frame,
    pub(super) cloud: &'a Cloud,
    pub(super) surfels: &'a Surfels,
    pub(super) looks: &'a [Look],
    pub(super) range: [f32; 2],
    pub(super) detail: f32,
    /// What faces away is hidden.
    pub(super) front_only: bool,
    /// It is a mirror, which hides.
    pub(super) hides: bool,
}

type F<T> = f32x8<T>;

/// Of a node's children.
struct Tested {
    /// Those that the beam meets.
    bits: u64,
    /// Those seen as small enough for one, two, four, eight representatives.
    small: [u64; 4],
    /// Nearest and farthest, and what may be seen of them along u and v: least and most.
    boxes: [[f32; CHILDREN]; 6],
}

#[inline(always)]
fn three<T: Simd>(simd: T, lists: &[[f32; CHILDREN]; 3]) -> [F<T>; 3] {
    [F::<T>::load(simd, &lists[0]), F::<T>::load(simd, &lists[1]), F::<T>::load(simd, &lists[2])]
}

impl Walk<'_> {
    /// Walks the tree, near children first. Now and then it is asked whether the splats so far fill the beam.
    #[inline(always)]
    pub(super) fn run<T: Simd>(&mut self, simd: T, seen: &mut Seen<'_>, counts: &mut GatherCounts) {
        let bounds = Bounds::new(self.beam, &self.frame, &seen.bend);
        let wide = self.cloud.tree.wide();
        let mut stack = [(0.0f32, 0u32, u32::MAX); STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (near, at, groups) = stack[top];
            if near > self.range[1]
                || (seen.some_full && groups & seen.open_at(simd, near / self.frame.per_scene) == 0)
            {
                continue;
            }
            let node = &wide[at as usize];
            let Tested { mut bits, small, boxes } = self.test(simd, &bounds, node);
            bits &= node.used;
            let own = self.cloud.representatives.start + at * REPRESENTATIVES;
            let mut reached = [0u32; CHILDREN];
            let mut met = 0;
            while bits != 0 {
                let slot = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                reached[slot] = self.groups(simd, seen, &boxes, slot);
                met |= u64::from(reached[slot] != 0) << slot;
            }
            let mut bits = met;
            let nearest = boxes[0];
            let single = bits & small[0];
            if single != 0 {
                self.look(simd, &bounds, own, single, seen, counts);
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
                    // All: some of them would leave gaps.
                    let first = self.cloud.surfels.start + node.first[slot];
                    let mut done = 0;
                    while done < node.count[slot] {
                        let some = (node.count[slot] - done).min(WIDTH);
                        let lanes = (1u64 << some) - 1;
                        self.look(simd, &bounds, first + done, lanes, seen, counts);
                        done += some;
                    }
                } else if two || four || eight {
                    let used = u32::from(node.parts[slot]);
                    let parts = self.cloud.representatives.start + child * REPRESENTATIVES;
                    let (offset, count) = match (two, four) {
                        (true, _) => (QUADS, used.div_ceil(4)),
                        (_, true) => (PAIRS, used.div_ceil(2)),
                        _ => (0, used),
                    };
                    self.look(simd, &bounds, parts + offset, (1 << count) - 1, seen, counts);
                } else {
                    // The nearest on top.
                    let mut to = top;
                    while to > from && stack[to - 1].0 < nearest[slot] {
                        stack[to] = stack[to - 1];
                        to -= 1;
                    }
                    stack[to] = (nearest[slot], child, reached[slot]);
                    top += 1;
                }
            }
            if seen.order.len() >= seen.until {
                seen.settle(simd, self.beam);
                self.range[1] = self.range[1].min(seen.full_from * self.frame.per_scene);
            }
        }
        if seen.splats.near.len > 0 {
            self.take(simd, &bounds, seen, counts);
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
        let bounds = Bounds::new(self.beam, &self.frame, &seen.bend);
        let range = self.cloud.surfels.clone();
        for first in range.clone().step_by(CHILDREN) {
            let some = (range.end - first).min(WIDTH);
            self.look(simd, &bounds, first, (1 << some) - 1, seen, counts);
        }
        if seen.splats.near.len > 0 {
            self.take(simd, &bounds, seen, counts);
        }
    }

    /// Which children the beam meets, and which of them are seen as small enough for one, two, four, eight representatives.
    #[inline(always)]
    fn test<T: Simd>(&self, simd: T, b: &Bounds, node: &WideNode) -> Tested {
        let zero = F::<T>::broadcast(simd, 0.0);
        let o = self.frame.origin;
        let [x, y, z] = three(simd, &node.center);
        let middle = dots([x - o[0], y - o[1], z - o[2]], &self.frame.axes);
        let half = dots(three(simd, &node.half), &b.absolute);
        let first = F::<T>::broadcast(simd, self.range[0]);
        let last = F::<T>::broadcast(simd, self.range[1]);
        let near = (middle[2] - half[2]).max(first);
        let far = (middle[2] + half[2]).min(last);
        let mut boxes = [[0.0f32; CHILDREN]; 6];
        Vector::<T>::store(near, &mut boxes[0]);
        Vector::<T>::store(far, &mut boxes[1]);
        let area = b.area(middle[0], middle[1], (near + far) * 0.5);
        // Radius of the largest disk that is drawn here.
        let per_pixel = self.detail * std::f32::consts::FRAC_PI_2;
        let extent = F::<T>::load(simd, &node.extent);
        let coarse = if self.detail > 0.0 {
            (b.area(middle[0], middle[1], far) * (BETWEEN * 0.5 / per_pixel)).sqrt()
        } else {
            zero
        };
        let disk = extent.min(coarse.max(zero.splat(self.cloud.extent)));
        let disk = disk * (SPREAD * EVENNESS);
        // Rays of a bent mirror also start before the first one does.
        let farthest = near.abs().max(far.abs());
        // A disk reaches beyond its middle also along the axis.
        let mut meets = near.le(far + disk);
        for k in 0..2 {
            let [s0, s1] = b.starts[k];
            let [t0, t1] = b.slopes[k];
            let low = (near * t0).min(far * t0) + s0;
            let high = (near * t1).max(far * t1) + s1;
            let pixel = farthest * b.width_per_s[k] + b.width[k];
            // Seen aslant a disk is cut longer.
            let reach = half[k] + (disk * disk * b.longer + pixel * pixel).sqrt();
            let (least, most) = (middle[k] - reach, middle[k] + reach);
            Vector::<T>::store(least, &mut boxes[2 + 2 * k]);
            Vector::<T>::store(most, &mut boxes[3 + 2 * k]);
            meets &= low.le(most) & least.le(high);
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
            return Tested { bits: F::<T>::bits(meets), small: [0; 4], boxes };
        }
        let needed = extent * extent * (per_pixel * 2.0);
        let facing = along.abs().max(zero.splat(LEAST_NODE_FACING));
        let agree = zero.splat(AGREEING).lt(cosine);
        let needed = needed * F::<T>::select(agree, facing, zero.splat(1.0));
        let seen = area * BETWEEN;
        let real = zero.lt(extent);
        // One stands for a leaf a little earlier, as instead of it there are all eight: a twentieth less time, errors as before.
        let small = [
            F::<T>::bits(needed.le(seen * 1.2) & real),
            F::<T>::bits(needed.le(seen * 2.0) & real),
            F::<T>::bits(needed.le(seen * 4.0) & real),
            F::<T>::bits(needed.le(seen * 6.0) & real),
        ];
        Tested { bits: F::<T>::bits(meets), small, boxes }
    }

    /// Which groups the box in a slot may reach, where they are not full before it.
    #[inline(always)]
    fn groups<T: Simd>(
        &self,
        simd: T,
        seen: &Seen<'_>,
        boxes: &[[f32; CHILDREN]; 6],
        slot: usize,
    ) -> u32 {
        type G<T> = f32x16<T>;
        let k = 1.0 / self.frame.per_scene;
        let [near, far, low_u, high_u, low_v, high_v] =
            [0, 1, 2, 3, 4, 5].map(|i| boxes[i][slot] * k);
        let zero = G::<T>::broadcast(simd, 0.0);
        let (starts, slopes) = (&seen.ranges.starts, &seen.ranges.slopes);
        let mut open = zero.splat(near).le(G::<T>::load(simd, &seen.full));
        for (k, least, most) in [(0, low_u, high_u), (1, low_v, high_v)] {
            let [s0, s1] = [G::<T>::load(simd, &starts[k][0]), G::<T>::load(simd, &starts[k][1])];
            let [t0, t1] = [G::<T>::load(simd, &slopes[k][0]), G::<T>::load(simd, &slopes[k][1])];
            let low = (t0 * near + s0).min(t0 * far + s0);
            let high = (t1 * near + s1).max(t1 * far + s1);
            open &= low.le(zero.splat(most)) & zero.splat(least).le(high);
        }
        #[expect(clippy::cast_possible_truncation, reason = "sixteen bits")]
        let bits = G::<T>::bits(open) as u32;
        bits
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
        // What a representative of a pixel's size may reach, where steps are up to twice as long as the first one's.
        let pixel = far * (4.0 * (x * x + y * y).sqrt()) + 4.0 * (x0 * x0 + y0 * y0).sqrt();
        let reach = half[k] + grow + pixel;
        meets &= low.le(middle[k] + reach) & (middle[k] - reach).le(high);
    }
    let mut nearest = [0.0; CHILDREN];
    Vector::<T>::store(near, &mut nearest);
    (F::<T>::bits(meets) & group.used, nearest)
}
