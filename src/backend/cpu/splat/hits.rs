//! What was projected: images to be drawn into a tile of keys.

use super::{BORDER, FILLS};
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
    /// Of ellipses instead of `cell`: the middle, the form a x² + 2 b x y + c y² that is 1 at the rim, half the
    /// width and height, what the depth grows by towards the rim.
    pub(super) ellipse: [Vec<f32>; 8],
}

impl Hits {
    /// Empties it and makes room.
    pub(super) fn clear(&mut self, room: usize) {
        self.len = 0;
        if self.cell.len() < room {
            self.cell.resize(room, 0);
            self.depth.resize(room, 0.0);
            self.surfel.resize(room, 0);
            for list in &mut self.ellipse {
                list.resize(room, 0.0);
            }
        }
    }

    /// Draws them into a tile with rows of `stride` samples.
    pub(super) fn draw(&self, shape: SplatShape, stride: usize, tile: &mut [u64]) {
        match shape {
            SplatShape::Ellipse => self.draw_ellipses(stride, tile),
            shape => self.draw_squares(shape, stride, tile),
        }
    }

    fn draw_squares(&self, shape: SplatShape, stride: usize, tile: &mut [u64]) {
        let n = self.len;
        let hits = self.cell[..n].iter().zip(&self.depth[..n]).zip(&self.surfel[..n]);
        for ((&cell, &depth), &surfel) in hits {
            let key = u64::from(depth.to_bits()) << 32 | u64::from(surfel);
            let slot = (cell >> 4) as usize;
            let fills = u64::from(cell) << 60;
            match shape {
                SplatShape::Ellipse => unreachable!("drawn by draw_ellipses"),
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

    /// Draws ellipses: every sample of the tile within one gets its key, deeper towards the rim, so that of the
    /// overlapping disks of one surface the nearest middle wins.
    fn draw_ellipses(&self, stride: usize, tile: &mut [u64]) {
        let border = BORDER as usize;
        // The last column and row within the border.
        let [right, bottom] = [stride, tile.len() / stride].map(|n| (n - border - 1) as f32);
        let left = BORDER as f32;
        for i in 0..self.len {
            let [x, y, a, b, c, wide, high, rise] =
                [0, 1, 2, 3, 4, 5, 6, 7].map(|k| self.ellipse[k][i]);
            let surfel = u64::from(self.surfel[i]);
            let depth = self.depth[i];
            // Centres of samples lie half a sample behind their index. Not negative: casts truncate, which is floor.
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "see above"
            )]
            let range = |at: f32, reach: f32, end: f32| {
                let (from, to) = ((at - reach - 0.5).ceil().max(left), (at + reach - 0.5).min(end));
                if from <= to { from as usize..to as usize + 1 } else { 0..0 }
            };
            let columns = range(x, wide, right);
            for row in range(y, high, bottom) {
                let dy = row as f32 + 0.5 - y;
                let (slope, rest) = (2.0 * b * dy, c * dy * dy);
                let samples = &mut tile[row * stride + columns.start..row * stride + columns.end];
                for (column, sample) in columns.clone().zip(samples) {
                    let dx = column as f32 + 0.5 - x;
                    let distance = dx * (a * dx + slope) + rest;
                    if distance <= 1.0 {
                        let key = u64::from((depth + rise * distance).to_bits()) << 32 | surfel;
                        *sample = (*sample).min(key);
                    }
                }
            }
        }
    }
}
