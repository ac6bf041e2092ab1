//! What is to be projected: surfels side by side, whatever batches they come from, so that vectors are full.

use super::CHUNK;
use crate::geometry::Surfels;
use crate::geometry::surfel::PADDING;
use crate::plan::{Batch, CameraInstance};

/// Surfels to be projected, side by side, whatever batches they come from.
#[derive(Default)]
pub(super) struct Packed {
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
    pub(super) z: Vec<f32>,
    /// Squared share of the surfel's radius in that of the object's surfels, inverse.
    pub(super) size: Vec<f32>,
    pub(super) lo: Vec<f32>,
    pub(super) hi: Vec<f32>,
    pub(super) surfel: Vec<u32>,
}

impl Packed {
    pub(super) fn clear(&mut self) {
        for list in
            [&mut self.x, &mut self.y, &mut self.z, &mut self.size, &mut self.lo, &mut self.hi]
        {
            list.clear();
        }
        self.surfel.clear();
    }

    pub(super) fn len(&self) -> usize {
        self.surfel.len()
    }

    /// Adds as much of `batch` as there is room for, from its surfel `from` on; returns how much.
    pub(super) fn add(
        &mut self,
        surfels: &Surfels,
        camera: &CameraInstance,
        batch: &Batch,
        from: u32,
    ) -> u32 {
        let room = u32::try_from(CHUNK - self.len()).unwrap_or(0);
        let count = (batch.count - from).min(room);
        let first = batch.first + from * batch.stride;
        let end = self.len() + count as usize;
        if batch.stride == 1 {
            let range = first as usize..(first + count) as usize;
            self.x.extend_from_slice(&surfels.x[range.clone()]);
            self.y.extend_from_slice(&surfels.y[range.clone()]);
            self.z.extend_from_slice(&surfels.z[range.clone()]);
            self.surfel.extend(first..first + count);
            if first >= camera.representatives {
                for extent in &surfels.extent[range] {
                    let share = camera.extent / extent;
                    self.size.push(share * share);
                }
            }
        } else {
            for surfel in (first..).step_by(batch.stride as usize).take(count as usize) {
                let i = surfel as usize;
                self.x.push(surfels.x[i]);
                self.y.push(surfels.y[i]);
                self.z.push(surfels.z[i]);
                self.surfel.push(surfel);
            }
        }
        self.size.resize(end, 1.0 / batch.stride as f32);
        self.lo.resize(end, batch.lambda[0]);
        self.hi.resize(end, batch.lambda[1]);
        count
    }

    /// Makes vector loads beyond the end possible.
    pub(super) fn pad(&mut self) {
        for list in
            [&mut self.x, &mut self.y, &mut self.z, &mut self.size, &mut self.lo, &mut self.hi]
        {
            list.resize(list.len() + PADDING, 0.0);
        }
        self.surfel.resize(self.surfel.len() + PADDING, 0);
    }
}
