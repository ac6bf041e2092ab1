//! The guard band: how far beyond its triangle a camera must look, so that every splat that covers one of its
//! pixels is projected (a surfel just across an edge is the neighbour's, but its splat covers this pixel too).

use glam::{DVec2, DVec3};

use super::footprint::Footprint;
use crate::visibility::{Patch, Visibility};

/// Furthest guard as a weight. Rays are not extrapolated further than this: a triangle much thinner than a
/// pixel sees many surfels a pixel anyway (untuned).
pub(super) const MAX_GUARD: f64 = 0.5;
/// Added for the rounding of weights to f32.
const SLACK: f64 = 1e-3;

/// Shares of the splat's reach at which margins are computed; between them a chord is taken.
const STEPS: [f64; 7] = [0.0, 0.03, 0.0625, 0.125, 0.25, 0.5, 1.0];

/// The margins of one patch, by how far surfels lie apart on the screen.
pub(super) struct Guard {
    /// By [`STEPS`].
    margins: [DVec3; STEPS.len()],
    reach: f64,
}

impl Guard {
    /// `corners`: the patch's corners in homogeneous pixel coordinates (x·w, y·w, w).
    pub(super) fn new(
        corners: &[DVec3; 3],
        visibility: &Visibility,
        patch: &Patch,
        reach: f64,
    ) -> Self {
        Self { margins: margins(corners, visibility, patch, reach), reach }
    }

    /// The margins for splats that lie at most so many pixels from a sample that they cover.
    pub(super) fn margins(&self, splat_px: f64) -> DVec3 {
        let share = splat_px / self.reach;
        // The least weight over points that move apart is a concave function of how far they do: the chord is on
        // the safe side. Nothing is found for what is not a number.
        match STEPS.iter().position(|step| share <= *step) {
            Some(0) => self.margins[0],
            Some(i) => {
                let t = (share - STEPS[i - 1]) / (STEPS[i] - STEPS[i - 1]);
                self.margins[i - 1].lerp(self.margins[i], t)
            }
            None => self.margins[STEPS.len() - 1],
        }
    }
}

/// How far a surfel may be seen from a pixel's sample that it covers, in pixels: a disk of this radius (by λ) about any
/// point of a surface holds a surfel, seen at λ within `range`.
pub(super) fn splat_px(
    radius: impl Fn(f64) -> f64,
    footprint: &Footprint,
    [lo, hi]: [f64; 2],
) -> f64 {
    [lo, 0.5 * (lo + hi), hi]
        .into_iter()
        .map(|lambda| radius(lambda) * footprint.px_per_unit(lambda))
        .fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a })
}

/// A rectangle of the picture, in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    pub(super) center: DVec2,
    /// Unit, along the first sides.
    pub(super) along: DVec2,
    /// Half the lengths of the sides.
    pub(super) half: DVec2,
}

impl Outline {
    /// Corners of the rectangle that is larger by so many pixels at its ends and its sides, in order.
    pub(super) fn grown(&self, px: DVec2) -> [DVec2; 4] {
        let along = self.along * (self.half.x + px.x);
        let across = self.along.perp() * (self.half.y + px.y);
        let Self { center, .. } = *self;
        [
            center - along - across,
            center + along - across,
            center + along + across,
            center - along + across,
        ]
    }
}

/// The weights of picture positions in a triangle with these corners.
pub(super) fn weights_of(corners: &[DVec3; 3], px: [DVec2; 4]) -> [DVec3; 4] {
    let weights = Weights::new(corners);
    px.map(|px| weights.at(px.x, px.y))
}

/// tan 22.5°.
const OCTAGON: f64 = std::f64::consts::SQRT_2 - 1.0;

/// The margins m such that what lies at most a share of the splat's reach from the samples of a pixel of the
/// patch has weights of at least -m_i. Negative where the patch's pixels stay away from an edge (what lies there may
/// be hidden).
fn margins(
    corners: &[DVec3; 3],
    visibility: &Visibility,
    patch: &Patch,
    reach: f64,
) -> [DVec3; STEPS.len()] {
    let weights = Weights::new(corners);
    let mut least = [DVec3::INFINITY; STEPS.len()];
    for y in patch.rect.min[1]..patch.rect.max[1] {
        let Some((first, last)) = run(visibility, patch, y) else { continue };
        for (least, step) in least.iter_mut().zip(STEPS) {
            // Half of the octagon about the disk of that radius, about the first pixel and, mirrored, the last.
            let r = step * reach;
            let s = r * OCTAGON;
            for (dx, dy) in [(r, s), (r, -s), (s, r), (s, -r)] {
                let y = f64::from(y) + 0.5 + dy;
                *least = least.min(weights.at(f64::from(first) + 0.5 - dx, y));
                *least = least.min(weights.at(f64::from(last) + 0.5 + dx, y));
            }
        }
    }
    least.map(margin)
}

fn margin(least: DVec3) -> DVec3 {
    (DVec3::splat(SLACK) - least).min(DVec3::splat(MAX_GUARD))
}

/// Margins that are never less than those of any [`Guard`] of the patch, at once: for what need not be exact.
pub(super) fn around(corners: &[DVec3; 3], patch: &Patch, reach: f64) -> DVec3 {
    let weights = Weights::new(corners);
    let reach = reach - 0.5;
    let [left, top] = patch.rect.min.map(|v| f64::from(v) - reach);
    let [right, bottom] = patch.rect.max.map(|v| f64::from(v) + reach);
    let corners = [(left, top), (right, top), (left, bottom), (right, bottom)];
    margin(corners.into_iter().fold(DVec3::INFINITY, |m, (x, y)| m.min(weights.at(x, y))))
}

/// Barycentrics of picture positions.
struct Weights {
    /// The weights at p = (x, y, 1) are proportional to rows·p.
    rows: [DVec3; 3],
    volume: f64,
}

impl Weights {
    fn new(corners: &[DVec3; 3]) -> Self {
        let [a, b, c] = *corners;
        let rows = [b.cross(c), c.cross(a), a.cross(b)];
        Self { rows, volume: rows[0].dot(a) }
    }

    /// Beyond the triangle's horizon, where everything may be needed, less than any number.
    fn at(&self, x: f64, y: f64) -> DVec3 {
        let p = DVec3::new(x, y, 1.0);
        let shares = DVec3::from_array(self.rows.map(|row| row.dot(p)));
        let sum = shares.x + shares.y + shares.z;
        if sum * self.volume > 0.0 { shares / sum } else { DVec3::NEG_INFINITY }
    }
}

/// The first and last pixel of the patch in a row: weights are extreme there.
fn run(visibility: &Visibility, patch: &Patch, y: u32) -> Option<(u32, u32)> {
    let row = y as usize * visibility.size.width as usize;
    let own = |x: &u32| {
        visibility.mirror_ids[row + *x as usize] == patch.triangle.0
            && patch.cell.is_none_or(|cell| cell.contains(*x, y))
    };
    let first = (patch.rect.min[0]..patch.rect.max[0]).find(own)?;
    let last = (first..patch.rect.max[0]).rev().find(own)?;
    Some((first, last))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::eye::ImageSize;
    use crate::camera::three_ray::Rays;
    use crate::visibility::{MirrorTriangleIndex, NONE_ID, PixelRect};

    /// A patch of all pixels of a 40 × 30 picture whose centres lie in a triangle of the screen.
    fn setting(px: [DVec2; 3]) -> ([DVec3; 3], Visibility, Patch) {
        let mut visibility = Visibility::default();
        visibility.size = ImageSize { width: 40, height: 30 };
        // Perspective: the corners have different distances.
        let corners = [0, 1, 2].map(|i| px[i].extend(1.0) * [1.0, 1.2, 0.9][i]);
        let weights = Weights::new(&corners);
        let mut rect = PixelRect { min: [u32::MAX; 2], max: [0; 2] };
        let mut pixels = 0;
        for y in 0..30 {
            for x in 0..40 {
                let own = weights.at(f64::from(x) + 0.5, f64::from(y) + 0.5).min_element() >= 0.0;
                visibility.mirror_ids.push(if own { 3 } else { NONE_ID });
                if own {
                    pixels += 1;
                    rect = PixelRect {
                        min: [rect.min[0].min(x), rect.min[1].min(y)],
                        max: [rect.max[0].max(x + 1), rect.max[1].max(y + 1)],
                    };
                }
            }
        }
        let corners_of = [DVec3::X, DVec3::Y, DVec3::Z];
        let patch = Patch {
            triangle: MirrorTriangleIndex(3),
            corners: corners_of,
            rect,
            pixels,
            cell: None,
            own: None,
        };
        (corners, visibility, patch)
    }

    #[test]
    fn what_lies_within_reach_of_a_pixel_lies_within_the_margins() {
        let px = [DVec2::new(5.3, 4.1), DVec2::new(33.0, 9.7), DVec2::new(14.2, 24.6)];
        let (corners, visibility, patch) = setting(px);
        let weights = Weights::new(&corners);
        for reach in [0.5, 1.0, 2.0] {
            let guard = Guard::new(&corners, &visibility, &patch, reach);
            let around = around(&corners, &patch, reach);
            for (step, margins) in STEPS.into_iter().zip(guard.margins) {
                assert!(margins.cmple(around).all(), "{margins} is more than {around}");
                let reach = step * reach;
                let mut tight = DVec3::NEG_INFINITY;
                for (i, _) in visibility.mirror_ids.iter().enumerate().filter(|(_, id)| **id == 3) {
                    for turn in 0..16 {
                        let at = DVec2::new((i % 40) as f64 + 0.5, (i / 40) as f64 + 0.5)
                            + DVec2::from_angle(f64::from(turn) * 0.4) * reach;
                        let outside = -weights.at(at.x, at.y);
                        assert!(outside.cmple(margins).all(), "{outside} is beyond {margins}");
                        tight = tight.max(outside);
                    }
                }
                // Not much more than what is needed.
                assert!((margins - tight).max_element() < 0.02, "{margins} for {tight}");
            }
        }
    }

    #[test]
    fn margins_grow_with_the_distance_of_surfels_and_end_at_the_splat() {
        let px = [DVec2::new(5.3, 4.1), DVec2::new(33.0, 9.7), DVec2::new(14.2, 24.6)];
        let (corners, visibility, patch) = setting(px);
        let guard = Guard::new(&corners, &visibility, &patch, 1.0);
        let origins = px.map(|p| (p * 0.01).extend(0.0));
        let rays = Rays { origins, directions: origins.map(|v| v + DVec3::Z) };
        let footprint = Footprint::new(&px, &rays);
        let at = |radius: f64| guard.margins(splat_px(|_| radius, &footprint, [0.5, 1.0]));
        assert_eq!(at(0.0), guard.margins[0]);
        let radii = [0.001, 0.003, 0.007, 0.012];
        for pair in radii.windows(2) {
            assert!(at(pair[0]).cmplt(at(pair[1])).all(), "{} {}", at(pair[0]), at(pair[1]));
        }
        assert_eq!(at(1.0), guard.margins[STEPS.len() - 1]);
        assert_eq!(at(f64::INFINITY), guard.margins[STEPS.len() - 1]);
        let flat = Footprint::new(&[DVec2::ZERO; 3], &rays);
        assert_eq!(
            guard.margins(splat_px(|_| 0.001, &flat, [0.5, 1.0])),
            guard.margins[STEPS.len() - 1]
        );
    }
}
