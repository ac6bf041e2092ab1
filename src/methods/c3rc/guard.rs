//! The guard band: how far beyond its triangle a camera must look, so that every splat that covers one of its
//! pixels is projected (a surfel just across an edge is the neighbour's, but its splat covers this pixel too).

use glam::DVec3;

use super::footprint::Footprint;
use crate::plan::SplatShape;
use crate::visibility::{Patch, Visibility};

/// Furthest guard as a weight. Rays are not extrapolated further than this: a triangle much thinner than a
/// pixel sees many surfels a pixel anyway (untuned).
const MAX_GUARD: f64 = 0.5;
/// Added for the rounding of weights to f32.
const SLACK: f64 = 1e-3;

/// The margins of one patch, by how far surfels lie apart on the screen.
pub(super) struct Guard {
    none: DVec3,
    most: DVec3,
    most_px: f64,
}

impl Guard {
    /// `corners`: the patch's corners in homogeneous pixel coordinates (x·w, y·w, w).
    pub(super) fn new(
        corners: &[DVec3; 3],
        visibility: &Visibility,
        patch: &Patch,
        shape: SplatShape,
    ) -> Self {
        let most_px = match shape {
            SplatShape::Square1 => 0.5,
            SplatShape::Square2 => 1.0,
        };
        Self {
            none: margins(corners, visibility, patch, 0.0),
            most: margins(corners, visibility, patch, most_px),
            most_px,
        }
    }

    /// The margins for any surfels.
    pub(super) fn most(&self) -> DVec3 {
        self.most
    }

    /// The margins for surfels of which a disk of this radius about any point of a surface holds one, seen at λ
    /// within `range`: nothing is needed from farther outside than one of them must lie from a pixel's centre.
    pub(super) fn holding(&self, radius: f64, footprint: &Footprint, range: [f64; 2]) -> DVec3 {
        let [lo, hi] = range;
        let reach_px = [lo, 0.5 * (lo + hi), hi]
            .into_iter()
            .map(|lambda| radius * footprint.px_per_unit(lambda))
            .fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a });
        if reach_px < self.most_px {
            // The least weight over points that move apart is a concave function of how far they do: the chord
            // is on the safe side.
            self.none.lerp(self.most, reach_px / self.most_px)
        } else {
            self.most
        }
    }
}

/// The margins m such that what lies at most `reach_px` (along x and y) from the centre of a pixel of the patch has
/// weights of at least -m_i. Negative where the patch's pixels stay away from an edge (what lies there may be
/// hidden).
fn margins(
    corners: &[DVec3; 3],
    visibility: &Visibility,
    patch: &Patch,
    reach_px: f64,
) -> DVec3 {
    // The weights at picture position p = (x, y, 1) are proportional to rows·p.
    let [a, b, c] = *corners;
    let rows = [b.cross(c), c.cross(a), a.cross(b)];
    let volume = rows[0].dot(a);
    let mut least = DVec3::INFINITY;
    for y in patch.rect.min[1]..patch.rect.max[1] {
        let Some((first, last)) = run(visibility, patch, y) else { continue };
        let middle = f64::from(y) + 0.5;
        for x in [f64::from(first) + 0.5 - reach_px, f64::from(last) + 0.5 + reach_px] {
            for y in [middle - reach_px, middle + reach_px] {
                let p = DVec3::new(x, y, 1.0);
                let shares = DVec3::new(rows[0].dot(p), rows[1].dot(p), rows[2].dot(p));
                let sum = shares.x + shares.y + shares.z;
                if sum * volume <= 0.0 {
                    // Beyond the triangle's horizon.
                    return DVec3::splat(MAX_GUARD);
                }
                least = least.min(shares / sum);
            }
        }
    }
    (DVec3::splat(SLACK) - least).min(DVec3::splat(MAX_GUARD))
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
