//! What was projected: images to be drawn into a tile of keys.

use super::FILLS;
use crate::plan::SplatShape;

/// Drawn images.
#[derive(Default)]
pub(super) struct Hits {
    /// 16 · the tile slot of the splat's first pixel + for each of its 2 × 2 pixels a bit that says whether it
    /// only [`FILLS`] that.
    pub(super) cell: Vec<u32>,
    pub(super) depth: Vec<f32>,
    pub(super) surfel: Vec<u32>,
    pub(super) len: usize,
    /// Of ellipses instead of `cell`: see the constants.
    pub(super) ellipse: [Vec<f32>; ELLIPSE],
}

/// Where the middle, x and y, stands in [`Hits::ellipse`].
pub(super) const MIDDLE: usize = 0;
/// The form a x² + 2 b x y + c y², which is 1 at the rim.
pub(super) const FORM: usize = 2;
/// Half the width and height.
pub(super) const HALF: usize = 5;
/// The part of a pixel that it covers in the middle.
pub(super) const WEIGHT: usize = 7;
/// What lies farther in front of it than this is another surface.
pub(super) const DEPTH_RANGE: usize = 8;
/// Values of an ellipse.
pub(super) const ELLIPSE: usize = 9;

impl Hits {
    /// Makes room for so many more.
    pub(super) fn reserve(&mut self, more: usize) {
        let room = self.len + more;
        if self.cell.len() < room {
            self.cell.resize(room, 0);
            self.depth.resize(room, 0.0);
            self.surfel.resize(room, 0);
            for list in &mut self.ellipse {
                list.resize(room, 0.0);
            }
        }
    }

    /// Adds those of another list.
    pub(super) fn append(&mut self, other: &Self) {
        self.reserve(other.len);
        let to = self.len..self.len + other.len;
        self.depth[to.clone()].copy_from_slice(&other.depth[..other.len]);
        self.surfel[to.clone()].copy_from_slice(&other.surfel[..other.len]);
        for (own, more) in self.ellipse.iter_mut().zip(&other.ellipse) {
            own[to.clone()].copy_from_slice(&more[..other.len]);
        }
        self.len = to.end;
    }

    /// Draws squares into a tile with rows of `stride` pixels.
    pub(super) fn draw_squares(&self, shape: SplatShape, stride: usize, tile: &mut [u64]) {
        let n = self.len;
        let hits = self.cell[..n].iter().zip(&self.depth[..n]).zip(&self.surfel[..n]);
        for ((&cell, &depth), &surfel) in hits {
            let key = u64::from(depth.to_bits()) << 32 | u64::from(surfel);
            let slot = (cell >> 4) as usize;
            let fills = u64::from(cell) << 60;
            match shape {
                SplatShape::Ellipse => unreachable!("blended"),
                SplatShape::Square1 => tile[slot] = tile[slot].min(key | (fills << 3 & FILLS)),
                SplatShape::Square2 => {
                    let block = &mut tile[slot..slot + stride + 2];
                    for (corner, i) in [0, 1, stride, stride + 1].into_iter().enumerate() {
                        block[i] = block[i].min(key | (fills << (3 - corner) & FILLS));
                    }
                }
            }
        }
    }
}
