//! From scene space to a fixed-point picture plane.
//!
//! Edge functions of integer corners are exact, so neighbours agree about every sample on their common
//! edge, and a fan about every sample at its hub. Where a triangle leaves the plane's range it is clipped;
//! both neighbours then compute the same new corner, so the edge stays common.

use glam::{DVec3, Vec3};

use crate::camera::Eye;

/// Fractional bits of picture coordinates: a corner moves by at most 2.5e-4 px in x and in y.
pub(super) const SUBPIXEL_BITS: u32 = 11;

/// Fractional bits of an eighth of a pixel, the unit of sample positions.
pub(super) const EIGHTH_BITS: u32 = SUBPIXEL_BITS - 3;

/// Picture sides up to this many pixels are covered.
pub const MAX_SIDE: u32 = 1 << 15;

/// Half the side of the square, about the picture's middle, in which corners are kept: edges span at most
/// 2²⁶ sub-pixels, on which the 32-bit lanes of the rasteriser rely.
const GUARD_PX: f64 = MAX_SIDE as f64 * 0.5;

/// Part of the scene's diagonal within which nothing is seen. Untuned: far above the rounding of f32
/// positions, far below what one could want to see.
const NEAR: f64 = 1e-6;

/// A corner on the picture plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Corner {
    /// Sub-pixels from the picture's top left; 0 if `outside`.
    pub x: i32,
    /// See `x`.
    pub y: i32,
    /// 1 / depth along the eye's `forward`, which is linear on the picture plane.
    pub inverse_depth: f32,
    /// One bit for each clip plane that it is beyond.
    pub outside: u32,
}

/// The near plane and the four sides of the guard square.
const PLANES: usize = 5;

/// Maps scene space to the picture plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection {
    position: DVec3,
    /// Rows of the map to (x·w, y·w, w) in pixels from the picture's middle.
    rows: [DVec3; 3],
    near: f64,
    middle: [f64; 2],
}

impl Projection {
    /// For a scene whose bounding box has this diagonal.
    pub(super) fn new(eye: &Eye, diagonal: f32) -> Self {
        let focal = f64::from(eye.focal_px);
        let half = |pixels: u32| f64::from(pixels) * 0.5;
        Self {
            position: eye.position.as_dvec3(),
            rows: [
                eye.right.as_dvec3() * focal,
                eye.up.as_dvec3() * -focal,
                eye.forward.as_dvec3(),
            ],
            near: (NEAR * f64::from(diagonal)).max(f64::from(f32::MIN_POSITIVE)),
            middle: [half(eye.size.width), half(eye.size.height)],
        }
    }

    /// A scene point on the picture plane.
    #[inline(always)]
    pub(super) fn corner(&self, point: Vec3) -> Corner {
        let h = self.homogeneous(point);
        // Not "below zero": what is not a number is outside as well.
        let outside = (0..PLANES).fold((1 << PLANES) - 1, |bits, plane| {
            bits ^ u32::from(self.inside_by(plane, h) >= 0.0) << plane
        });
        if outside == 0 { self.snapped(h) } else { Corner { outside, ..Corner::default() } }
    }

    /// Clips a triangle, some of whose corners are outside, and hands on the triangles of what is left.
    #[cold]
    pub(super) fn clipped(&self, points: [Vec3; 3], mut emit: impl FnMut([Corner; 3])) {
        if !points.iter().all(|p| p.is_finite()) {
            return;
        }
        // Each plane adds at most one corner.
        let mut polygon = [DVec3::ZERO; 3 + PLANES];
        let mut count = 3;
        for (h, point) in polygon.iter_mut().zip(points) {
            *h = self.homogeneous(point);
        }
        for plane in 0..PLANES {
            let before = polygon;
            let corners = &before[..count];
            count = 0;
            let mut keep = |h| {
                polygon[count] = h;
                count += 1;
            };
            for (i, &from) in corners.iter().enumerate() {
                let to = corners[(i + 1) % corners.len()];
                let (a, b) = (self.inside_by(plane, from), self.inside_by(plane, to));
                if a >= 0.0 {
                    keep(from);
                }
                // Always from the inner end, whichever way round: neighbours must get the same point.
                if a >= 0.0 && b < 0.0 {
                    keep(from + (to - from) * (a / (a - b)));
                } else if a < 0.0 && b >= 0.0 {
                    keep(to + (from - to) * (b / (b - a)));
                }
            }
            if count < 3 {
                return;
            }
        }
        let corner = |i: usize| self.snapped(polygon[i]);
        for i in 2..count {
            emit([corner(0), corner(i - 1), corner(i)]);
        }
    }

    #[inline(always)]
    fn homogeneous(&self, point: Vec3) -> DVec3 {
        let p = point.as_dvec3() - self.position;
        DVec3::new(self.rows[0].dot(p), self.rows[1].dot(p), self.rows[2].dot(p))
    }

    /// Not negative on the inner side of a clip plane.
    #[inline(always)]
    fn inside_by(&self, plane: usize, h: DVec3) -> f64 {
        match plane {
            0 => h.z - self.near,
            1 => GUARD_PX * h.z + h.x,
            2 => GUARD_PX * h.z - h.x,
            3 => GUARD_PX * h.z + h.y,
            _ => GUARD_PX * h.z - h.y,
        }
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "within the guard square")]
    fn snapped(&self, h: DVec3) -> Corner {
        let inverse_depth = 1.0 / h.z;
        let [x, y] = [h.x, h.y].map(|c| c * inverse_depth);
        Corner {
            x: to_subpixels(x + self.middle[0]),
            y: to_subpixels(y + self.middle[1]),
            inverse_depth: inverse_depth as f32,
            outside: 0,
        }
    }
}

/// Rounds to the nearest sub-pixel: adding 1.5·2⁵² leaves the integer in the low bits, which costs one
/// addition on every instruction set. |px| must be below 2²⁰.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "takes the low bits")]
fn to_subpixels(px: f64) -> i32 {
    const SHIFT: f64 = (3_u64 << 51) as f64;
    (px * f64::from(1 << SUBPIXEL_BITS) + SHIFT).to_bits() as i32
}
