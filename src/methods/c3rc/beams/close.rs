//! Gaps of a surface between pixels that show it are closed. Twin of `shaders/passes/close.wgsl`, over the whole picture.

use glam::Vec4;

use crate::camera::eye::ImageSize;
use crate::plan::kernel::{CLOSING, CLOSING_TWO, SAME_SURFACE_SHARE, SLOPE, SURROUNDED, WHOLE};
use crate::visibility::mirror_rays::{AREA, TILE, TILE_PX};

/// What a pixel is filled with. All zero: it shows no mirror, counts as full and shows nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Layer {
    /// 1 less how full it is.
    pub(super) open: f32,
    /// Depth of the nearest splat.
    pub(super) near: f32,
    /// 2 less how full it was when a farther surface came.
    pub(super) behind: f32,
}

impl Layer {
    fn full(self) -> f32 {
        1.0 - self.open
    }

    fn front(self) -> f32 {
        2.0 - self.behind
    }

    /// Of its front.
    fn covered(self) -> f32 {
        self.full().min(self.front())
    }
}

/// The pixels of a tile that may show something, by row: radiance times coverage, coverage; and what they are filled with.
pub(super) struct Tile {
    pub(super) value: [Vec4; AREA],
    pub(super) layer: [Layer; AREA],
}

/// A picture, before gaps are closed: its tiles by row. In one that is not there nothing is seen.
#[derive(Clone, Copy)]
pub(super) struct Picture<'a> {
    pub(super) size: ImageSize,
    pub(super) tiles: &'a [Option<Box<Tile>>],
}

/// A pixel's column and row.
pub(super) type Place = [usize; 2];

impl Picture<'_> {
    /// Tiles in a row.
    pub(super) fn across(size: ImageSize) -> usize {
        size.width.div_ceil(TILE_PX) as usize
    }

    fn get(&self, place: Option<Place>) -> (Layer, Vec4) {
        let nothing = (Layer::default(), Vec4::ZERO);
        let Some([x, y]) = place else { return nothing };
        let Some(tile) = &self.tiles[y / TILE * Self::across(self.size) + x / TILE] else {
            return nothing;
        };
        let at = y % TILE * TILE + x % TILE;
        (tile.layer[at], tile.value[at])
    }

    /// The pixel so many columns or rows on.
    fn beside(&self, [x, y]: Place, steps: isize, along_row: bool) -> Option<Place> {
        let (width, height) = (self.size.width as usize, self.size.height as usize);
        if along_row {
            x.checked_add_signed(steps).filter(|x| *x < width).map(|x| [x, y])
        } else {
            y.checked_add_signed(steps).filter(|y| *y < height).map(|y| [x, y])
        }
    }

    /// The mean of what lies around a pixel, if that is one surface with what landed first there: a gap larger than a pixel
    /// between splats.
    fn surrounding(&self, place: Place, near: f32) -> Option<Vec4> {
        let (mut sum, mut own) = (Vec4::ZERO, 0.0);
        for along_row in [true, false] {
            let (mut depths, mut count) = ([near; 2], 0.0);
            for (depth, steps) in depths.iter_mut().zip([-1, 1]) {
                let (layer, value) = self.get(self.beside(place, steps, along_row));
                if layer.covered() < SURROUNDED {
                    return None;
                }
                if layer.near > 0.0 {
                    if value.w < SURROUNDED {
                        return None;
                    }
                    (*depth, count) = (layer.near, count + 1.0);
                    sum += value;
                }
            }
            let slope = if count == 2.0 { (depths[0] - depths[1]).abs() } else { 0.0 };
            let off = (0.5 * (depths[0] + depths[1]) - near).abs();
            if off > SAME_SURFACE_SHARE * near + SLOPE * slope {
                return None;
            }
            own += count;
        }
        (own >= 3.0).then(|| sum / own)
    }

    /// What a pixel shows once its gaps are closed.
    pub(super) fn closed(&self, place: Place) -> Vec4 {
        let (layer, mut own) = self.get(Some(place));
        if own.w <= 0.0 || (layer.full() >= WHOLE && layer.front() >= WHOLE) {
            return own;
        }
        let (full, front, near) = (layer.full(), layer.front(), layer.near);
        if full.min(front) < CLOSING
            && let Some(mean) = self.surrounding(place, near)
        {
            own = mean;
        }
        let (mut whole, mut closed, mut mean) = (full, front, own);
        for along_row in [true, false] {
            // A gap a pixel wide, or two.
            for (a, b, between, share) in
                [(-1, 1, None, 0.5), (-1, 2, Some(1), 1.0 / 3.0), (-2, 1, Some(-1), 2.0 / 3.0)]
            {
                let [(la, va), (lb, vb)] =
                    [a, b].map(|steps| self.get(self.beside(place, steps, along_row)));
                let other = between.map(|steps| self.get(self.beside(place, steps, along_row)).0);
                if other.is_none_or(|o| o.full().min(full) >= CLOSING_TWO) {
                    whole = whole.max(la.full().min(lb.full()));
                }
                let off = (la.near + (lb.near - la.near) * share - near).abs();
                let alike = off <= SAME_SURFACE_SHARE * near + SLOPE * (la.near - lb.near).abs();
                let both = la.covered().min(lb.covered());
                let narrow = other.is_none_or(|o| o.covered().min(front) >= CLOSING_TWO);
                if both > closed && alike && narrow {
                    closed = both;
                    mean = va.lerp(vb, share);
                }
            }
        }
        if (CLOSING..WHOLE).contains(&full) {
            own *= whole / full;
        }
        if (CLOSING..WHOLE).contains(&front) {
            own = own.lerp(mean, (closed - front) / (1.0 - front));
        }
        own
    }
}
