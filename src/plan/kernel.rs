//! What a splat covers and how pixels take it: constants that every way to draw ellipses shares, shaders included.

use super::EVENNESS;
use crate::geometry::lanes::Real;

/// The kernel of a disk is so many times as wide as the disk that holds a surfel (untuned).
pub(crate) const SPREAD: f32 = 1.3;
/// Radius of the kernel of a point, in pixels: what a pixel sees of it (untuned).
pub(crate) const PIXEL: f32 = 0.7;
/// A surfel's own disk has this share of the area of the one that holds a surfel.
pub(crate) const PER_DISK: f32 = 1.0 / (EVENNESS * EVENNESS);
/// Surfels are not taken for thinner than this share of their width (untuned).
pub(crate) const LEAST_FACING: f32 = 0.2;
/// Surfels within so many of their radii in depth show one surface, also where it is steep: with 3, what is behind showed through
/// things close to a mirror.
pub(crate) const SAME_SURFACE_RADII: f32 = 6.0;
/// How much of a pixel splats cover for each part that their areas say: they are not spread so evenly that the areas
/// add up everywhere (untuned).
pub(crate) const GAIN: f32 = 1.3;
/// From this coverage on a gap between covered pixels is closed (untuned).
pub(crate) const CLOSING: f32 = 0.4;
/// The same of gaps two pixels wide, for both: what is less may be an edge (untuned).
pub(crate) const CLOSING_TWO: f32 = 0.75;
/// Where less of a surface landed between four pixels that show so much of it, they say what is there (untuned).
pub(crate) const SURROUNDED: f32 = 0.9;
/// Of a pixel that is covered, but for rounding.
pub(crate) const WHOLE: f32 = 0.999_99;
/// Three pixels in a row show one surface if the depth in the middle is that between the others but for this share of it, and
/// for a part of what these differ by, [`SLOPE`], as the nearest splats do not lie in the pixels' middles (untuned).
pub(crate) const SAME_SURFACE_SHARE: f32 = 0.02;
/// See [`SAME_SURFACE_SHARE`] (untuned).
pub(crate) const SLOPE: f32 = 0.125;
/// Where the splats of a surface lie about a pixel, in the mean and in their own size: nearer than the first, all around it, which
/// is then in a gap between them; farther than the second, it is beyond the surface's edge (untuned).
pub(crate) const ALL_AROUND: [f32; 2] = [0.35, 0.6];
/// Splats of half this size, px, may show something that lies within a pixel; from the second on they do not (untuned).
pub(crate) const LARGE: [f32; 2] = [1.0, 2.0];
/// Gaps that splats cover less than the first of stay open, those with more than the second do not (untuned).
pub(crate) const GAP: [f32; 2] = [0.4, 0.5];

/// Representatives of a level are taken from here on, in shares of the area that they should have at most: each level's
/// are twice as large as the next one's, so that on average they have that area.
pub(crate) const BETWEEN: f32 = std::f32::consts::SQRT_2;
/// Normals within about this cosine of one say how large a node is seen (untuned).
pub(crate) const AGREEING: f32 = 0.7;
/// But not smaller than this share (untuned).
pub(crate) const LEAST_NODE_FACING: f32 = 0.25;

/// How full of its front a pixel counts, where that covers `full` of it: its splats may lie all around, but too far apart.
/// `about`: where they lie about it, in their own size, times what each covers.
#[inline(always)]
pub(crate) fn closed<R: Real<Scalar = f32>>(full: R, about: [R; 2]) -> R {
    let (one, zero) = (full.splat(1.0), full.splat(0.0));
    let far = (about[0] * about[0] + about[1] * about[1]) / (full * full);
    let [within, beyond] = [ALL_AROUND[0] * ALL_AROUND[0], ALL_AROUND[1] * ALL_AROUND[1]];
    let around = ((-far + beyond) * (1.0 / (beyond - within))).max(zero).min(one);
    let some = ((full - GAP[0]) * (1.0 / (GAP[1] - GAP[0]))).max(zero).min(one);
    full + (one - full) * (around * some)
}
