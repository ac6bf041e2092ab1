//! One camera's walk through one tree and the projection of what is left, as the culler and the backend do them, with
//! everything noted down.

use fearless_simd::{Simd, dispatch};
use glam::{DVec3, Vec3};

use crate::accel::kd_tree::WideNode;
use crate::backend::cpu::splat::Projection;
use crate::camera::three_ray::{ViewVolume, project};
use crate::cull::{Culler, Decision, Open, Walk};
use crate::geometry::lanes::simd_level;
use crate::plan::{Batch, CameraInstance, SplatPass, Volume};
use crate::scene::PreparedScene;
use crate::scene::prepared::Cloud;

/// A trace lists at most so many boxes, and so many surfels.
pub const MOST_TRACED: usize = 100_000;

/// What a camera visits of the surfels of one object, or of one mirror that may hide objects.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudTrace {
    /// Index into [`PreparedScene::clouds`]; from the number of objects on it is a mirror that hides.
    pub cloud: usize,
    /// The λ that were searched.
    pub lambda: [f32; 2],
    /// The boxes of the tree that were tested, parents first.
    pub boxes: Vec<VisitedBox>,
    /// The surfels and representatives that were projected, in the order of their batches.
    pub surfels: Vec<TracedSurfel>,
    /// The lists end before their end: there are more than [`MOST_TRACED`].
    pub truncated: bool,
}

/// A box that was tested against a camera's view volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisitedBox {
    /// Scene space: bit 0 of the index says which end of the tree's x, bit 1 y, bit 2 z.
    pub corners: [Vec3; 8],
    /// Levels of eight children below the root; the root, which is not tested, has 0.
    pub depth: u32,
    /// What became of it.
    pub outcome: Outcome,
}

/// What becomes of a tested box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Its children were tested.
    Opened,
    /// It does not meet the view volume.
    Refused,
    /// Its surfels all face away from the rays, on the far side of a closed object.
    TurnedAway,
    /// A leaf that may meet it: its surfels were projected.
    Leaf,
    /// It lies inside the view volume, so that all its surfels were projected.
    Inside,
    /// It is seen so small that a few representatives, or some of its surfels, were projected for all of them.
    Representatives,
}

/// A surfel or representative that was projected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracedSurfel {
    /// Index into [`PreparedScene::surfels`].
    pub surfel: u32,
    /// Scene space.
    pub position: Vec3,
    /// Whether the camera sees it: in its triangle, or in the rectangle of its cell's pixels.
    pub valid: bool,
    /// In how many places.
    pub images: u32,
}

/// One camera, to be replayed.
pub(super) struct Replay<'a> {
    pub(super) scene: &'a PreparedScene,
    pub(super) pass: &'a SplatPass<'a>,
    pub(super) culler: &'a Culler<'a>,
    pub(super) camera: &'a CameraInstance,
}

impl Replay<'_> {
    /// The trace, and the batches of which the surfels are.
    pub(super) fn run(&self) -> (CloudTrace, Vec<Batch>) {
        let cloud = &self.scene.clouds[self.camera.object as usize];
        let mut trace = CloudTrace {
            cloud: self.camera.object as usize,
            lambda: self.camera.lambda,
            boxes: Vec::new(),
            surfels: Vec::new(),
            truncated: false,
        };
        let mut batches = Vec::new();
        let walk = self.culler.walk(self.camera);
        if self.culler.tests() {
            let mut visit = Visit { walk, cloud, trace: &mut trace, batches: &mut batches };
            // Of the same width as the culling.
            match &self.camera.volume {
                Volume::Three(v) => dispatch!(simd_level(), simd => visit.run(simd, v)),
                Volume::Four(v) => dispatch!(simd_level(), simd => visit.run(simd, v)),
            }
        } else {
            let (first, count) = (cloud.surfels.start, cloud.surfels.end - cloud.surfels.start);
            batches.push(Batch { first, count, stride: 1, lambda: self.camera.lambda, roots: 3 });
        }
        for batch in &batches {
            for i in 0..batch.count {
                if trace.surfels.len() == MOST_TRACED {
                    trace.truncated = true;
                    return (trace, batches);
                }
                let surfel = batch.first + i * batch.stride;
                let images = self.images(surfel, batch.lambda);
                let local = self.scene.surfels.position(surfel as usize);
                let position = cloud.to_scene.point(local.as_dvec3()).as_vec3();
                let valid = images > 0;
                trace.surfels.push(TracedSurfel { surfel, position, valid, images });
            }
        }
        (trace, batches)
    }

    /// In how many places the camera sees a surfel: what the backend counts as valid, one by one.
    fn images(&self, surfel: u32, [lo, hi]: [f32; 2]) -> u32 {
        let Self { scene, pass, camera, .. } = *self;
        let patch = &pass.patches[camera.patch as usize];
        let work = Projection { pass, surfels: &scene.surfels, camera, patch, stride: 0 };
        let q = scene.surfels.position(surfel as usize) - Vec3::from_array(camera.camera.v1);
        let (mut images, mut taken) = (0, false);
        for image in project(&camera.camera, q.to_array(), lo, hi).as_slice() {
            let front = image.linear(camera.front) > 0.0;
            if !front {
                continue;
            }
            if patch.own.is_some() {
                if !image.within(camera.guard) || pass.first_root_only && taken {
                    continue;
                }
                taken = true;
            }
            images += u32::from(work.is_valid(image));
        }
        images
    }
}

/// A walk through a tree.
struct Visit<'a> {
    walk: Walk<'a>,
    cloud: &'a Cloud,
    trace: &'a mut CloudTrace,
    batches: &'a mut Vec<Batch>,
}

impl Visit<'_> {
    fn run<S: Simd, const N: usize>(&mut self, simd: S, volume: &ViewVolume<f32, N>) {
        let root = Open { lambda: self.trace.lambda, ..Open::default() };
        let mut stack = vec![(root, 0)];
        while let Some((open, depth)) = stack.pop() {
            // The root is wide node 0, which is nothing's child.
            if open.child == 0 && depth > 0 {
                self.take(open);
                continue;
            }
            let decisions = self.walk.decide(simd, volume, open.child, open.lambda);
            let node = &self.cloud.tree.wide()[open.child as usize];
            for (slot, decision) in decisions.iter().enumerate() {
                self.note(node, slot, depth + 1, *decision);
            }
            // The last child first, so that leaves come out in surfel order.
            stack.extend(decisions.iter().rev().filter_map(|decision| match decision {
                Decision::Open(open) => Some((*open, depth + 1)),
                Decision::Refused | Decision::TurnedAway => None,
            }));
        }
    }

    fn note(&mut self, node: &WideNode, slot: usize, depth: u32, decision: Decision) {
        if self.trace.boxes.len() == MOST_TRACED {
            self.trace.truncated = true;
            return;
        }
        let outcome = match decision {
            Decision::Refused => Outcome::Refused,
            Decision::TurnedAway => Outcome::TurnedAway,
            Decision::Open(Open { child, .. }) if child != 0 => Outcome::Opened,
            Decision::Open(Open { first, stride, .. })
                if stride > 1 || first >= self.cloud.representatives.start =>
            {
                Outcome::Representatives
            }
            Decision::Open(_) if node.child[slot] == 0 => Outcome::Leaf,
            Decision::Open(_) => Outcome::Inside,
        };
        let local = node.get_box(slot);
        let corners = std::array::from_fn(|i| {
            let end = |k: usize| if i >> k & 1 == 0 { local.min[k] } else { local.max[k] };
            let corner = DVec3::from_array([0, 1, 2].map(|k| end(k).into()));
            self.cloud.to_scene.point(corner).as_vec3()
        });
        self.trace.boxes.push(VisitedBox { corners, depth, outcome });
    }

    /// Adds surfels to the batches, to the last one where they follow it.
    fn take(&mut self, Open { first, count, stride, lambda, .. }: Open) {
        match self.batches.last_mut() {
            Some(last) if last.stride == stride && last.first + last.count * stride == first => {
                last.count += count;
                last.lambda = [last.lambda[0].min(lambda[0]), last.lambda[1].max(lambda[1])];
            }
            _ => self.batches.push(Batch { first, count, stride, lambda, roots: 3 }),
        }
    }
}
