//! What is to be projected: surfels side by side, whatever batches they come from, so that vectors are full.

use fearless_simd::{Simd, f32x16};

use super::CHUNK;
use crate::geometry::Surfels;
use crate::geometry::lanes::{Real, Vector};
use crate::geometry::surfel::PADDING;
use crate::plan::{Batch, CameraInstance};

/// Surfels are copied so many at a time: most batches are shorter.
const COPIED: u32 = 16;
/// What is copied and loaded too much lies behind the last one.
const ROOM: usize = CHUNK + PADDING;

/// What is left of a list of batches.
pub(super) struct Rest<'a> {
    pub(super) batches: &'a [Batch],
    /// Surfels of the first one that were taken.
    pub(super) done: u32,
}

/// Surfels to be projected, side by side, whatever batches they come from.
pub(super) struct Packed {
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
    pub(super) z: Vec<f32>,
    /// Squared share of the surfel's radius in that of the object's surfels, inverse.
    pub(super) size: Vec<f32>,
    pub(super) lo: Vec<f32>,
    pub(super) hi: Vec<f32>,
    pub(super) surfel: Vec<u32>,
    len: usize,
}

impl Default for Packed {
    fn default() -> Self {
        let numbers = || vec![0.0; ROOM];
        Self {
            x: numbers(),
            y: numbers(),
            z: numbers(),
            size: numbers(),
            lo: numbers(),
            hi: numbers(),
            surfel: vec![0; ROOM],
            len: 0,
        }
    }
}

impl Packed {
    /// Takes as many surfels as there is room for.
    #[inline(always)]
    pub(super) fn fill<S: Simd>(
        &mut self,
        simd: S,
        surfels: &Surfels,
        camera: &CameraInstance,
        rest: &mut Rest<'_>,
    ) {
        self.len = 0;
        while let [first, others @ ..] = rest.batches
            && self.len < CHUNK
        {
            rest.done += self.add(simd, surfels, camera, first, rest.done);
            if rest.done == first.count {
                *rest = Rest { batches: others, done: 0 };
            }
        }
        // Vectors reach beyond the last one: the numbers there are to be those of some surfel.
        self.surfel[self.len..].fill(0);
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Adds as much of `batch` as there is room for, from its surfel `from` on; returns how much.
    #[inline(always)]
    fn add<S: Simd>(
        &mut self,
        simd: S,
        surfels: &Surfels,
        camera: &CameraInstance,
        batch: &Batch,
        from: u32,
    ) -> u32 {
        let room = u32::try_from(CHUNK - self.len).unwrap_or(0);
        let count = (batch.count - from).min(room);
        let first = batch.first + from * batch.stride;
        let mut done = 0;
        while done < count {
            let some = (count - done).min(COPIED);
            let at = self.len;
            let one: f32x16<S> = Vector::broadcast(simd, 1.0);
            Vector::store(one * batch.lambda[0], &mut self.lo[at..]);
            Vector::store(one * batch.lambda[1], &mut self.hi[at..]);
            if batch.stride == 1 {
                let next = (first + done) as usize;
                for (to, from) in [
                    (&mut self.x, &surfels.x),
                    (&mut self.y, &surfels.y),
                    (&mut self.z, &surfels.z),
                ] {
                    let values: f32x16<S> = Vector::load(simd, &from[next..]);
                    Vector::store(values, &mut to[at..]);
                }
                let extent: f32x16<S> = Vector::load(simd, &surfels.extent[next..]);
                let share = Real::splat(one, camera.extent) / extent;
                Vector::store(share * share, &mut self.size[at..]);
                for (to, surfel) in
                    self.surfel[at..at + COPIED as usize].iter_mut().zip(first + done..)
                {
                    *to = surfel;
                }
            } else {
                let each = 1.0 / batch.stride as f32;
                // The lanes beyond are to hold some size, too.
                Vector::store(one * each, &mut self.size[at..]);
                for k in 0..some {
                    let surfel = first + (done + k) * batch.stride;
                    let (to, i) = (at + k as usize, surfel as usize);
                    self.x[to] = surfels.x[i];
                    self.y[to] = surfels.y[i];
                    self.z[to] = surfels.z[i];
                    let share = camera.extent / surfels.extent[i];
                    self.size[to] = share * share * each;
                    self.surfel[to] = surfel;
                }
            }
            self.len += some as usize;
            done += some;
        }
        count
    }
}
