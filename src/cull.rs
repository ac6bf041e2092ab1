//! Culling: which surfels a camera has to project (Mei et al. section 5.2, with conservative tests).

use fearless_simd::{Level, Simd, dispatch, f32x8};

use crate::accel::kd_tree::representatives::{PAIRS, QUADS, REPRESENTATIVES};
use crate::accel::kd_tree::{CHILDREN, WideNode};
use crate::camera::three_ray::{BoxTest, Boxes, ViewVolume};
use crate::geometry::lanes::{Real, Vector, dot_const, simd_level};
use crate::plan::kernel::{AGREEING, BETWEEN, LEAST_NODE_FACING};
use crate::plan::{Batch, BatchSource, CameraInstance, Gaze, Volume};
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

impl Culler<'_> {
    /// Whether it walks at all: without a test objects are taken whole.
    pub(crate) fn tests(&self) -> bool {
        self.test != BoxTest::None
    }

    /// The walk for one camera.
    pub(crate) fn walk<'b>(&'b self, camera: &'b CameraInstance) -> Walk<'b> {
        let object = &self.scene.clouds[camera.object as usize];
        Walk {
            wide: object.tree.wide(),
            test: self.test,
            lambda: camera.lambda,
            first: object.surfels.start,
            representatives: object.representatives.start,
            footprint: &camera.footprint,
            gaze: camera.gaze.filter(|_| camera.detail > 0.0),
            axis: camera.camera.axis,
            per_pixel: camera.detail * std::f32::consts::FRAC_PI_2,
        }
    }
}

impl BatchSource for Culler<'_> {
    fn cull(&self, camera: &CameraInstance, out: &mut Vec<Batch>) {
        let object = &self.scene.clouds[camera.object as usize];
        let walk = self.walk(camera);
        let from = out.len();
        if !self.tests() {
            for first in object.surfels.clone().step_by(WHOLE_BATCH as usize) {
                let count = (object.surfels.end - first).min(WHOLE_BATCH);
                out.push(Batch { first, count, stride: 1, lambda: camera.lambda, roots: 1 });
            }
        } else {
            match &camera.volume {
                Volume::Three(volume) => dispatch!(self.level, simd => walk.run(simd, volume, out)),
                Volume::Four(volume) => dispatch!(self.level, simd => walk.run(simd, volume, out)),
            }
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

/// See [`Culler::walk`].
pub(crate) struct Walk<'a> {
    wide: &'a [WideNode],
    test: BoxTest,
    lambda: [f32; 2],
    first: u32,
    representatives: u32,
    footprint: &'a [[f32; 3]; 3],
    gaze: Option<Gaze>,
    axis: [f32; 3],
    /// π/2 representatives' radii squared are to be less than this many times the footprint; 0: see
    /// [`CameraInstance::detail`].
    per_pixel: f32,
}

/// A subtree that may meet the volume; `child` = 0: to be taken whole.
#[derive(Clone, Copy, Default)]
pub(crate) struct Open {
    pub(crate) child: u32,
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) stride: u32,
    pub(crate) lambda: [f32; 2],
}

/// What becomes of a child of a wide node.
#[derive(Clone, Copy)]
pub(crate) enum Decision {
    /// It does not meet the volume.
    Refused,
    /// It is hidden: all of it faces away from the rays.
    TurnedAway,
    /// It is walked, or taken.
    Open(Open),
}

/// A wide level at least halves the surfels, and each leaves at most seven siblings open.
const STACK: usize = 32 * (CHILDREN - 1) + 1;

impl Walk<'_> {
    #[inline(always)]
    fn run<S: Simd, const N: usize>(
        &self,
        simd: S,
        volume: &ViewVolume<f32, N>,
        out: &mut Vec<Batch>,
    ) {
        let mut stack = [Open::default(); STACK];
        let mut top = 0;
        let mut at = 0;
        let mut node = &self.wide[0];
        let mut lambda = self.lambda;
        let from = out.len();
        loop {
            let tested = test_children(simd, node, volume, self.test, lambda);
            let mut bits = tested.meets & node.used;
            if let Some(gaze) = &self.gaze {
                bits &= !turned_away(simd, node, gaze);
            }
            let small = if self.per_pixel > 0.0 { self.small(simd, node, &tested) } else { [0; 4] };
            // The last child first, so that leaves come out in surfel order.
            while bits != 0 {
                let slot = 63 - bits.leading_zeros();
                bits ^= 1 << slot;
                stack[top] = self.open(node, at, slot, small, &tested);
                top += 1;
            }
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                let open = stack[top];
                if open.child != 0 {
                    at = open.child;
                    node = &self.wide[at as usize];
                    lambda = open.lambda;
                    break;
                }
                match out[from..].last_mut() {
                    Some(last)
                        if last.first + last.count * last.stride == open.first
                            && last.stride == open.stride =>
                    {
                        last.count += open.count;
                        last.lambda[0] = last.lambda[0].min(open.lambda[0]);
                        last.lambda[1] = last.lambda[1].max(open.lambda[1]);
                    }
                    _ => out.push(Batch {
                        first: open.first,
                        count: open.count,
                        stride: open.stride,
                        lambda: open.lambda,
                        roots: 3,
                    }),
                }
            }
        }
    }
}

impl Walk<'_> {
    /// What is left to do for a child of the wide node `at`: its surfels, its representative, that of a few of its
    /// parts, or its own children.
    #[inline(always)]
    fn open(&self, node: &WideNode, at: u32, slot: u32, small: [u64; 4], tested: &Tested) -> Open {
        let i = slot as usize;
        let child = node.child[i];
        let all = Open {
            child,
            first: self.first + node.first[i],
            count: node.count[i],
            stride: 1,
            lambda: [tested.lo[i], tested.hi[i]],
        };
        let own = self.representatives + at * REPRESENTATIVES;
        let parts = self.representatives + child * REPRESENTATIVES;
        if small[0] >> slot & 1 != 0 {
            Open { child: 0, first: own + slot, count: 1, ..all }
        } else if (small[1] | small[2]) >> slot & 1 != 0 {
            let (each, offset) = if small[1] >> slot & 1 != 0 { (4, QUADS) } else { (2, PAIRS) };
            match child {
                // Of a leaf every fourth surfel, or every second, stands for its neighbours.
                0 => Open { count: all.count.div_ceil(each), stride: each, ..all },
                _ => {
                    let count = self.used(child).div_ceil(each);
                    Open { child: 0, first: parts + offset, count, ..all }
                }
            }
        } else if small[3] >> slot & 1 != 0 {
            // Its children's are projected untested: that costs less than the tests.
            match child {
                0 => Open { child: 0, ..all },
                _ => Open { child: 0, first: parts, count: self.used(child), ..all },
            }
        } else if tested.inside >> slot & 1 != 0 && self.per_pixel == 0.0 {
            Open { child: 0, ..all }
        } else {
            all
        }
    }

    /// Children of a wide node: they fill its first slots.
    #[inline(always)]
    fn used(&self, wide: u32) -> u32 {
        self.wide[wide as usize].used.count_ones()
    }

    /// Bit i: child i is seen as small enough for one, two, four, eight representatives.
    #[inline(always)]
    fn small<S: Simd>(&self, simd: S, node: &WideNode, tested: &Tested) -> [u64; 4] {
        type V<S> = f32x8<S>;
        let lambda = (V::load(simd, &tested.lo) + V::load(simd, &tested.hi)) * 0.5;
        let [a, b, c] = self.footprint;
        let a = lambda * (lambda * a[2] + a[1]) + a[0];
        let b = lambda * (lambda * b[2] + b[1]) + b[0];
        let c = lambda * (lambda * c[2] + c[1]) + c[0];
        let radius = V::load(simd, &node.extent);
        let needed = radius * radius * (self.per_pixel * 2.0);
        let zero = V::broadcast(simd, 0.0);
        let det = (a * c - b * b).max(zero);
        // Seen from the side a disk is as much smaller as its surfels' normals say, where they agree.
        let axis = [0, 1, 2].map(|k| V::load(simd, &node.cone_axis[k]));
        let one = V::broadcast(simd, 1.0);
        let facing = dot_const(axis, self.axis).abs().max(V::broadcast(simd, LEAST_NODE_FACING));
        let agree = V::broadcast(simd, AGREEING).lt(V::load(simd, &node.cone_cosine));
        let needed = needed * V::select(agree, facing, one);
        let seen = det.sqrt() * BETWEEN;
        let real = zero.lt(radius);
        [
            V::<S>::bits(needed.le(seen) & real),
            V::<S>::bits(needed.le(seen * 2.0) & real),
            V::<S>::bits(needed.le(seen * 4.0) & real),
            // Less than eight: parts are not of one size, and these are taken unseen.
            V::<S>::bits(needed.le(seen * 6.0) & real),
        ]
    }
}

impl Walk<'_> {
    /// What [`Walk::run`] makes of the children of a wide node, by slot, for those who want to look on.
    #[inline(always)]
    pub(crate) fn decide<S: Simd, const N: usize>(
        &self,
        simd: S,
        volume: &ViewVolume<f32, N>,
        at: u32,
        lambda: [f32; 2],
    ) -> Vec<Decision> {
        let node = &self.wide[at as usize];
        let tested = test_children(simd, node, volume, self.test, lambda);
        let away = self.gaze.map_or(0, |gaze| turned_away(simd, node, &gaze));
        let small = if self.per_pixel > 0.0 { self.small(simd, node, &tested) } else { [0; 4] };
        let decide = |slot| {
            if tested.meets >> slot & 1 == 0 {
                Decision::Refused
            } else if away >> slot & 1 != 0 {
                Decision::TurnedAway
            } else {
                Decision::Open(self.open(node, at, slot, small, &tested))
            }
        };
        (0..self.used(at)).map(decide).collect()
    }
}

/// Bit i: all surfels of child i face away from all rays.
#[inline(always)]
fn turned_away<S: Simd>(simd: S, node: &WideNode, gaze: &Gaze) -> u64 {
    type V<S> = f32x8<S>;
    let axis = [0, 1, 2].map(|k| V::load(simd, &node.cone_axis[k]));
    let (cosine, sine) = (V::load(simd, &node.cone_cosine), V::load(simd, &node.cone_sine));
    let between = dot_const(axis, gaze.axis);
    // The two cones' half angles together: less than the axes leave to a right angle.
    let sum_sine = sine * gaze.cosine + cosine * gaze.sine;
    let sum_cosine = cosine * gaze.cosine - sine * gaze.sine;
    let zero = V::broadcast(simd, 0.0);
    V::<S>::bits(zero.lt(cosine) & zero.lt(sum_cosine) & sum_sine.lt(between))
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
pub(crate) fn test_children<S: Simd, const N: usize>(
    simd: S,
    node: &WideNode,
    volume: &ViewVolume<f32, N>,
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
