//! What a beam has seen so far, and from which depth on it sees no more.

use fearless_simd::Simd;
use glam::Vec3;

use super::beam::Beam;
use super::blend::{Blended, blend};
use super::walk::{DEPTH, Splats};
use crate::scene::prepared::PreparedScene;

/// Splats before it is asked whether they fill the beam (untuned).
const FIRST_LOOK: usize = 48;

/// See the module.
pub(super) struct Seen<'a> {
    pub(super) splats: &'a mut Splats,
    /// Those of them that may be seen, from the nearest on: depth and index.
    order: &'a mut Vec<u64>,
    /// How many splats have been entered there.
    entered: usize,
    /// With so many splats, [`Seen::settle`] is due.
    pub(super) until: usize,
    /// Nothing that lies farther is seen.
    pub(super) full_from: f32,
    radiance: &'a [Vec3],
    first_hider: u32,
    /// Mirrors hide from that far on along a ray.
    pub(super) clear: f32,
}

impl<'a> Seen<'a> {
    pub(super) fn new(
        splats: &'a mut Splats,
        order: &'a mut Vec<u64>,
        scene: &'a PreparedScene,
        clear: f32,
    ) -> Self {
        splats.len = 0;
        order.clear();
        Self {
            splats,
            order,
            entered: 0,
            until: FIRST_LOOK,
            full_from: f32::INFINITY,
            radiance: &scene.surfels.radiance,
            first_hider: scene.first_mirror_surfel(),
            clear,
        }
    }

    /// Where the farthest splat lies.
    pub(super) fn farthest(&self) -> f32 {
        let depths = &self.splats.value[DEPTH][..self.splats.len];
        depths.iter().fold(0.0f32, |most, depth| most.max(*depth)).min(self.full_from)
    }

    /// Whether the splats so far fill all pixels, and up to where.
    #[inline(always)]
    pub(super) fn settle<S: Simd>(&mut self, simd: S, beam: &Beam) {
        let done = self.blend(simd, beam);
        if done.used < self.order.len() {
            self.order.truncate(done.used);
            self.full_from = done.full_from;
        }
        self.until = self.splats.len + self.order.len().max(FIRST_LOOK);
    }

    /// What the splats so far show.
    #[inline(always)]
    pub(super) fn blend<S: Simd>(&mut self, simd: S, beam: &Beam) -> Blended {
        let new = &self.splats.value[DEPTH][self.entered..self.splats.len];
        for (depth, i) in new.iter().zip(self.entered as u64..) {
            if *depth <= self.full_from {
                self.order.push(u64::from(depth.to_bits()) << 32 | i);
            }
        }
        self.entered = self.splats.len;
        self.order.sort_unstable();
        blend(simd, beam, self.splats, self.order, self.radiance, self.first_hider, self.clear)
    }
}
