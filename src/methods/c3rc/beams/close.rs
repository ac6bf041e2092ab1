//! Gaps of a surface between pixels that show it are closed. Twin of `shaders/passes/close.wgsl`, over the whole picture.

use glam::{Vec3, Vec4};

use crate::plan::kernel::{CLOSING, CLOSING_TWO, SAME_SURFACE_SHARE, SLOPE, SURROUNDED, WHOLE};

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

/// A picture's pixels, before gaps are closed.
#[derive(Clone, Copy)]
pub(super) struct Pixels<'a> {
    pub(super) width: usize,
    pub(super) radiance: &'a [Vec3],
    pub(super) coverage: &'a [f32],
    pub(super) layers: &'a [Layer],
}

impl Pixels<'_> {
    fn layer(&self, at: Option<usize>) -> Layer {
        at.map_or(Layer::default(), |at| self.layers[at])
    }

    fn value(&self, at: Option<usize>) -> Vec4 {
        let Some(at) = at else { return Vec4::ZERO };
        // Where nothing landed the radiance is whatever it was.
        if self.coverage[at] > 0.0 {
            self.radiance[at].extend(self.coverage[at])
        } else {
            Vec4::ZERO
        }
    }

    /// The pixel so many columns or rows on.
    fn beside(&self, at: usize, steps: isize, along_row: bool) -> Option<usize> {
        if along_row {
            let x = (at % self.width).checked_add_signed(steps).filter(|x| *x < self.width)?;
            Some(at - at % self.width + x)
        } else {
            let to = at.checked_add_signed(steps * self.width.cast_signed())?;
            (to < self.layers.len()).then_some(to)
        }
    }

    /// The mean of what lies around a pixel, if that is one surface with what landed first there: a gap larger than a pixel
    /// between splats.
    fn surrounding(&self, at: usize) -> Option<Vec4> {
        let near = self.layers[at].near;
        let (mut sum, mut own) = (Vec4::ZERO, 0.0);
        for along_row in [true, false] {
            let (mut depths, mut count) = ([near; 2], 0.0);
            for (depth, steps) in depths.iter_mut().zip([-1, 1]) {
                let n = self.beside(at, steps, along_row);
                let layer = self.layer(n);
                if layer.covered() < SURROUNDED {
                    return None;
                }
                if layer.near > 0.0 {
                    let value = self.value(n);
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

    /// What a pixel shows once its gaps are closed; `None` where nothing is to be closed.
    pub(super) fn closed(&self, at: usize) -> Option<Vec4> {
        let layer = self.layers[at];
        if self.coverage[at] <= 0.0 || (layer.full() >= WHOLE && layer.front() >= WHOLE) {
            return None;
        }
        let mut own = self.value(Some(at));
        let (full, front, near) = (layer.full(), layer.front(), layer.near);
        if full.min(front) < CLOSING
            && let Some(mean) = self.surrounding(at)
        {
            own = mean;
        }
        let (mut whole, mut closed, mut mean) = (full, front, own);
        for along_row in [true, false] {
            // A gap a pixel wide, or two.
            for (a, b, between, share) in
                [(-1, 1, None, 0.5), (-1, 2, Some(1), 1.0 / 3.0), (-2, 1, Some(-1), 2.0 / 3.0)]
            {
                let [at_a, at_b] = [a, b].map(|steps| self.beside(at, steps, along_row));
                let (la, lb) = (self.layer(at_a), self.layer(at_b));
                let other = between.map(|steps| self.layer(self.beside(at, steps, along_row)));
                if other.is_none_or(|o| o.full().min(full) >= CLOSING_TWO) {
                    whole = whole.max(la.full().min(lb.full()));
                }
                let off = (la.near + (lb.near - la.near) * share - near).abs();
                let alike = off <= SAME_SURFACE_SHARE * near + SLOPE * (la.near - lb.near).abs();
                let both = la.covered().min(lb.covered());
                let narrow = other.is_none_or(|o| o.covered().min(front) >= CLOSING_TWO);
                if both > closed && alike && narrow {
                    closed = both;
                    mean = self.value(at_a).lerp(self.value(at_b), share);
                }
            }
        }
        if (CLOSING..WHOLE).contains(&full) {
            own *= whole / full;
        }
        if (CLOSING..WHOLE).contains(&front) {
            own = own.lerp(mean, (closed - front) / (1.0 - front));
        }
        Some(own)
    }
}
