//! Culling: which surfels a camera has to project (Mei et al. section 5.2, with conservative tests).

use fearless_simd::{Level, Simd, dispatch, f32x8};

use crate::accel::kd_tree::{CHILDREN, WideNode};
use crate::camera::three_ray::{BoxTest, Boxes, ViewVolume};
use crate::geometry::lanes::{Vector, simd_level};
use crate::plan::{Batch, BatchSource, CameraInstance};
use crate::scene::prepared::PreparedScene;

/// Walks the objects' trees with one box test.
pub struct Culler<'a> {
    scene: &'a PreparedScene,
    test: BoxTest,
    level: Level,
}

impl<'a> Culler<'a> {
    /// Culls against `scene` with `test`.
    pub fn new(scene: &'a PreparedScene, test: BoxTest) -> Self {
        Self { scene, test, level: simd_level() }
    }
}

impl BatchSource for Culler<'_> {
    fn cull(&self, camera: &CameraInstance, out: &mut Vec<Batch>) {
        let object = &self.scene.objects[camera.object as usize];
        let walk = Walk {
            wide: object.tree.wide(),
            volume: &camera.volume,
            test: self.test,
            lambda: camera.lambda,
            first: object.surfels.start,
        };
        let from = out.len();
        if self.test == BoxTest::None {
            for first in object.surfels.clone().step_by(WHOLE_BATCH as usize) {
                let count = (object.surfels.end - first).min(WHOLE_BATCH);
                out.push(Batch { first, count, lambda: camera.lambda, roots: 1 });
            }
        } else {
            dispatch!(self.level, simd => walk.run(simd, out));
        }
        for batch in &mut out[from..] {
            let [lo, hi] = camera.several;
            let meets = batch.lambda[0] <= hi && lo <= batch.lambda[1] && lo <= hi;
            batch.roots = if meets { 3 } else { 1 };
        }
    }
}

/// Without a test, objects are cut into batches of so many surfels.
const WHOLE_BATCH: u32 = 1 << 12;

struct Walk<'a> {
    wide: &'a [WideNode],
    volume: &'a ViewVolume<f32>,
    test: BoxTest,
    lambda: [f32; 2],
    first: u32,
}

/// A subtree that may meet the volume; `child` = 0: to be taken whole.
#[derive(Clone, Copy, Default)]
struct Open {
    child: u32,
    first: u32,
    count: u32,
    lambda: [f32; 2],
}

/// A wide level at least halves the surfels, and each leaves at most seven siblings open.
const STACK: usize = 32 * (CHILDREN - 1) + 1;

impl Walk<'_> {
    #[inline(always)]
    fn run<S: Simd>(&self, simd: S, out: &mut Vec<Batch>) {
        let mut stack = [Open::default(); STACK];
        let mut top = 0;
        let mut node = &self.wide[0];
        let mut lambda = self.lambda;
        let from = out.len();
        loop {
            let tested = test_children(simd, node, self.volume, self.test, lambda);
            let mut bits = tested.meets & node.used;
            // The last child first, so that leaves come out in surfel order.
            while bits != 0 {
                let slot = 63 - bits.leading_zeros() as usize;
                bits ^= 1 << slot;
                let inside = tested.inside >> slot & 1 != 0;
                stack[top] = Open {
                    child: if inside { 0 } else { node.child[slot] },
                    first: self.first + node.first[slot],
                    count: node.count[slot],
                    lambda: [tested.lo[slot], tested.hi[slot]],
                };
                top += 1;
            }
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                let open = stack[top];
                if open.child != 0 {
                    node = &self.wide[open.child as usize];
                    lambda = open.lambda;
                    break;
                }
                match out[from..].last_mut() {
                    Some(last) if last.first + last.count == open.first => {
                        last.count += open.count;
                        last.lambda[0] = last.lambda[0].min(open.lambda[0]);
                        last.lambda[1] = last.lambda[1].max(open.lambda[1]);
                    }
                    _ => out.push(Batch {
                        first: open.first,
                        count: open.count,
                        lambda: open.lambda,
                        roots: 3,
                    }),
                }
            }
        }
    }
}

/// What a test says of the eight boxes of a node.
pub(crate) struct Tested {
    pub(crate) lo: [f32; CHILDREN],
    pub(crate) hi: [f32; CHILDREN],
    /// Bit i: box i may meet the volume.
    pub(crate) meets: u64,
    /// Bit i: box i lies inside it.
    pub(crate) inside: u64,
}

/// Tests the eight boxes of a node.
#[inline(always)]
pub(crate) fn test_children<S: Simd>(
    simd: S,
    node: &WideNode,
    volume: &ViewVolume<f32>,
    test: BoxTest,
    lambda: [f32; 2],
) -> Tested {
    type V<S> = f32x8<S>;
    let origin = volume.origin();
    let boxes = Boxes {
        center: [
            V::load(simd, &node.center[0]) - origin[0],
            V::load(simd, &node.center[1]) - origin[1],
            V::load(simd, &node.center[2]) - origin[2],
        ],
        half: [
            V::load(simd, &node.half[0]),
            V::load(simd, &node.half[1]),
            V::load(simd, &node.half[2]),
        ],
    };
    let (lo, hi) = (V::broadcast(simd, lambda[0]), V::broadcast(simd, lambda[1]));
    let verdict = volume.meets(test, &boxes, lo, hi);
    let mut tested = Tested {
        lo: [0.0; CHILDREN],
        hi: [0.0; CHILDREN],
        meets: V::<S>::bits(verdict.meets),
        inside: V::<S>::bits(verdict.inside),
    };
    verdict.lo.store(&mut tested.lo);
    verdict.hi.store(&mut tested.hi);
    tested
}
