//! Ellipses to pixels. Every splat covers parts of pixels; from the nearest on, each pixel takes them until it is full.
//! So a surface that covers it in part lets through what lies behind it, be it another surface or the environment.

use glam::{Vec3, Vec4};

use super::EMPTY;
use super::hits::Hits;

/// How much of a pixel splats cover for each part that their areas say: they are not spread so evenly that the areas
/// add up everywhere (untuned).
const GAIN: f32 = 1.3;

/// From this coverage on a gap between covered pixels is closed (untuned).
const CLOSING: f32 = 0.4;

/// One patch's pixels, by slot of its tile.
#[derive(Default)]
pub(super) struct Layers {
    /// Splats from the nearest on: depth and index.
    order: Vec<u64>,
    /// Radiance times coverage, and how full the pixel is.
    sum: Vec<Vec4>,
    /// The part of that which shows nothing.
    hidden: Vec<f32>,
    /// First and last column to be drawn, by row; reversed where there is none.
    spans: Vec<[f32; 2]>,
}

impl Layers {
    /// Draws what was hit into a tile with rows of `stride` slots. Those that are `EMPTY` in `tile` are taken; they
    /// get the key of their nearest splat. Surfels from `first_hider` on show nothing.
    pub(super) fn draw(
        &mut self,
        hits: &Hits,
        radiance: &[Vec3],
        first_hider: u32,
        stride: usize,
        tile: &mut [u64],
    ) {
        self.sum.clear();
        self.sum.extend(tile.iter().map(|&key| if key == EMPTY { Vec4::ZERO } else { Vec4::W }));
        self.hidden.clear();
        self.hidden.resize(tile.len(), 0.0);
        self.spans.clear();
        self.spans.extend(tile.chunks_exact(stride).map(|row| {
            let own = |key: &u64| *key == EMPTY;
            let first = row.iter().position(own).unwrap_or(stride);
            let last = row.iter().rposition(own).unwrap_or(0);
            [first as f32, last as f32]
        }));
        self.order.clear();
        let depths = hits.depth[..hits.len].iter().zip(0u32..);
        self.order.extend(depths.map(|(d, i)| u64::from(d.to_bits()) << 32 | u64::from(i)));
        self.order.sort_unstable();
        for &next in &self.order {
            #[expect(clippy::cast_possible_truncation, reason = "the low half")]
            let i = next as u32 as usize;
            let surfel = hits.surfel[i];
            let color = radiance[surfel as usize].extend(1.0);
            let key = next & !u64::from(u32::MAX) | u64::from(surfel);
            let weight = hits.ellipse[WEIGHT][i] * GAIN;
            if surfel >= first_hider {
                each(hits, i, stride, &self.spans, |slot, kernel| {
                    let sum = &mut self.sum[slot];
                    let part = (kernel * weight).min(1.0 - sum.w).max(0.0);
                    sum.w += part;
                    self.hidden[slot] += part;
                });
                continue;
            }
            each(hits, i, stride, &self.spans, |slot, kernel| {
                let sum = &mut self.sum[slot];
                if sum.w < 1.0 {
                    if tile[slot] == EMPTY {
                        tile[slot] = key;
                    }
                    *sum += color * (kernel * weight).min(1.0 - sum.w);
                }
            });
        }
    }

    /// Radiance, weighted by coverage, and coverage of a slot. Where splats leave a part open between two pixels that
    /// are covered, they lie too far apart there: it is closed. Edges stay.
    pub(super) fn at(&self, slot: usize, stride: usize) -> Vec4 {
        let own = self.sum[slot];
        let shown = own - Vec4::W * self.hidden[slot];
        if own.w >= 1.0 || own.w < CLOSING {
            return shown;
        }
        let [left, right, above, below] =
            [slot - 1, slot + 1, slot - stride, slot + stride].map(|i| self.sum[i].w);
        let covered = left.min(right).max(above.min(below)).max(own.w);
        shown * (covered / own.w)
    }
}

/// Index of a splat's weight in [`Hits::ellipse`].
const WEIGHT: usize = 7;

/// Calls `touch` with every slot within `spans` (by row) that a splat reaches, and its kernel there.
#[inline(always)]
fn each(
    hits: &Hits,
    i: usize,
    stride: usize,
    spans: &[[f32; 2]],
    mut touch: impl FnMut(usize, f32),
) {
    let e = &hits.ellipse;
    let (x, y, a, b, c) = (e[0][i], e[1][i], e[2][i], e[3][i], e[4][i]);
    let high = e[6][i];
    // Centres of pixels lie half a pixel behind their index. Not negative: casts truncate, which is floor.
    let first = (y - high - 0.5).ceil().max(0.0);
    let last = (y + high - 0.5).min(spans.len() as f32 - 1.0);
    let inverse = 1.0 / a;
    let mut row = first;
    while row <= last {
        let dy = row + 0.5 - y;
        let (slope, rest) = (2.0 * b * dy, c * dy * dy);
        // Between the roots of 1 = a dx² + slope dx + rest.
        let middle = -0.5 * slope * inverse;
        let half = ((1.0 - rest) * inverse + middle * middle).max(0.0).sqrt();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "see above")]
        let [left, right] = spans[row as usize];
        let mut column = (x + middle - half - 0.5).ceil().max(left);
        let end = (x + middle + half - 0.5).min(right);
        while column <= end {
            let dx = column + 0.5 - x;
            let inside = (1.0 - (dx * (a * dx + slope) + rest)).max(0.0);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "see above"
            )]
            touch(row as usize * stride + column as usize, inside * inside);
            column += 1.0;
        }
        row += 1.0;
    }
}

#[cfg(test)]
mod tests {
    use super::super::FOREIGN;
    use super::*;

    /// A round splat: its middle, radius, weight in the middle and depth; its surfel is its number.
    fn hits(list: &[[f32; 5]]) -> Hits {
        let mut hits = Hits::default();
        hits.reserve(list.len());
        for (i, &[x, y, radius, weight, depth]) in list.iter().enumerate() {
            let form = 1.0 / (radius * radius);
            let values = [x, y, form, 0.0, form, radius, radius, weight];
            for (list, value) in hits.ellipse.iter_mut().zip(values) {
                list[i] = value;
            }
            hits.depth[i] = depth;
            hits.surfel[i] = u32::try_from(i).unwrap();
            hits.len += 1;
        }
        hits
    }

    /// Five columns and rows, of which the middle three are the patch's.
    fn tile() -> Vec<u64> {
        let own = |i: usize| (1..4).contains(&(i % 5)) && (1..4).contains(&(i / 5));
        (0..25).map(|i| if own(i) { EMPTY } else { FOREIGN }).collect()
    }

    const MIDDLE: usize = 12;

    #[test]
    fn the_nearest_fill_a_pixel_and_the_rest_shows_through() {
        let radiance = [Vec3::X, Vec3::Y, Vec3::Z];
        let mut layers = Layers::default();
        let draw = |layers: &mut Layers, list: &[[f32; 5]]| {
            let mut tile = tile();
            layers.draw(&hits(list), &radiance, u32::MAX, 5, &mut tile);
            tile[MIDDLE]
        };
        // A quarter in front, whatever the order; behind it half of one; a third behind both fills the rest.
        let parts = [
            [2.5, 2.5, 0.4, 9.0, 3.0],
            [2.5, 2.5, 0.4, 0.25 / GAIN, 1.0],
            [2.5, 2.5, 0.4, 0.5 / GAIN, 2.0],
        ];
        let key = draw(&mut layers, &parts);
        assert!(layers.at(MIDDLE, 5).abs_diff_eq(Vec4::new(0.25, 0.25, 0.5, 1.0), 1e-6));
        assert_eq!((key & 0xffff_ffff, (key >> 32) as u32), (1, 1f32.to_bits()), "the nearest");
        // Alone the front leaves the rest to the environment.
        draw(&mut layers, &parts[1..2]);
        assert!(layers.at(MIDDLE, 5).abs_diff_eq(Vec4::new(0.25, 0.0, 0.0, 0.25), 1e-6));
        // A full front hides all.
        draw(&mut layers, &[[2.5, 2.5, 0.4, 2.0, 1.0], [2.5, 2.5, 0.4, 2.0, 2.0]]);
        assert!(layers.at(MIDDLE, 5).abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-6));
    }

    #[test]
    fn a_splat_covers_what_its_form_says_within_the_patch() {
        let (x, y, radius) = (2.2f32, 2.7f32, 1.9f32);
        let mut layers = Layers::default();
        let mut tile = tile();
        layers.draw(&hits(&[[x, y, radius, 0.1, 1.0]]), &[Vec3::ONE], u32::MAX, 5, &mut tile);
        for row in 0..5 {
            for column in 0..5 {
                let slot = row * 5 + column;
                let (dx, dy) = (column as f32 + 0.5 - x, row as f32 + 0.5 - y);
                let kernel = (1.0 - (dx * dx + dy * dy) / (radius * radius)).max(0.0).powi(2);
                let own = (1..4).contains(&row) && (1..4).contains(&column);
                let expected = if own { 0.1 * GAIN * kernel } else { 1.0 };
                assert!((layers.sum[slot].w - expected).abs() < 1e-6, "{row} {column}");
            }
        }
    }

    #[test]
    fn gaps_between_covered_pixels_are_closed_and_edges_stay() {
        let mut layers = Layers { sum: vec![Vec4::W; 25], ..Layers::default() };
        layers.sum[MIDDLE] = Vec4::new(0.3, 0.15, 0.0, 0.6);
        assert!(layers.at(MIDDLE, 5).abs_diff_eq(Vec4::new(0.5, 0.25, 0.0, 1.0), 1e-6));
        // The right and lower neighbours are open: an edge.
        layers.sum[MIDDLE + 1] = Vec4::ZERO;
        layers.sum[MIDDLE + 5] = Vec4::ZERO;
        assert_eq!(layers.at(MIDDLE, 5).w, 0.6);
        // What is nearly open stays so.
        layers.sum = vec![Vec4::W; 25];
        layers.sum[MIDDLE] = Vec4::splat(0.1);
        assert_eq!(layers.at(MIDDLE, 5).w, 0.1);
    }
}
