//! What bounds a beam's rays in a cloud's space, and how they move from pixel to pixel.

use super::beam::{Beam, Frame};
use super::fit::Bend;
use crate::geometry::lanes::{Real, dot_const};
use crate::plan::kernel::PIXEL;

/// A pixel's area counts for no less than this share of its sides' squares: at a caustic it has none.
const LEAST_AREA: f32 = 0.02;

/// What is the same for all nodes of a walk, in the cloud's units.
pub(super) struct Bounds {
    pub(super) starts: [[f32; 2]; 2],
    pub(super) slopes: [[f32; 2]; 2],
    step: [[f32; 2]; 2],
    step_per_s: [[f32; 2]; 2],
    bend: Bend,
    /// Lengths of the steps' rows times a pixel's radius.
    pub(super) width: [f32; 2],
    pub(super) width_per_s: [f32; 2],
    pub(super) absolute: [[f32; 3]; 3],
    /// No disk is seen by more than this, squared, longer than it is: slopes are taken for no steeper than that has it (untuned).
    pub(super) longer: f32,
    pub(super) gaze: [f32; 2],
}

/// Products with three vectors.
#[inline(always)]
pub(super) fn dots<R: Real<Scalar = f32>>(v: [R; 3], axes: &[[f32; 3]; 3]) -> [R; 3] {
    [dot_const(v, axes[0]), dot_const(v, axes[1]), dot_const(v, axes[2])]
}

/// b + s a.
#[inline(always)]
pub(super) fn at<R: Real<Scalar = f32>>(s: R, a: f32, b: f32) -> R {
    s * a + b
}

impl Bounds {
    pub(super) fn new(b: &Beam, frame: &Frame, bend: &Bend) -> Self {
        let k = frame.per_scene;
        // No pixel of the beam has longer steps.
        let [most_x, most_y] = bend.pixels.map(|[least, most]| most.max(-least));
        let row = |[x, y]: [f32; 2], [xx, xy, yy]: [f32; 3]| {
            let x = x.abs() + xx.abs() * most_x + xy.abs() * most_y;
            let y = y.abs() + xy.abs() * most_x + yy.abs() * most_y;
            PIXEL * (x * x + y * y).sqrt()
        };
        let cosine = 1.0 / (1.0 + b.spread * b.spread).sqrt();
        Self {
            starts: b.starts.map(|v| v.map(|x| x * k)),
            slopes: b.slopes,
            step: b.step.map(|v| v.map(|x| x * k)),
            step_per_s: b.step_per_s,
            bend: Bend { start: bend.start.map(|v| v.map(|x| x * k)), ..*bend },
            width: [0, 1].map(|axis| row(b.step[axis], bend.start[axis]) * k),
            width_per_s: [0, 1].map(|axis| row(b.step_per_s[axis], bend.slope[axis])),
            absolute: frame.axes.map(|e| e.map(f32::abs)),
            longer: 1.0 + (1.2 * b.spread + 0.01).powi(2),
            gaze: [cosine - 1e-5, (1.0 - cosine * cosine).max(0.0).sqrt() + 1e-5],
        }
    }

    /// How the rays move with the pixel, one to the right and one down, in the plane at s, near u and v: by axis. And the
    /// slopes of the ray that passes there.
    #[inline(always)]
    pub(super) fn steps<R: Real<Scalar = f32>>(&self, u: R, v: R, s: R) -> ([[R; 2]; 2], [R; 2]) {
        let (m, o) = (&self.step_per_s, &self.step);
        let (a, b) = (at(s, m[0][0], o[0][0]), at(s, m[0][1], o[0][1]));
        let (c, d) = (at(s, m[1][0], o[1][0]), at(s, m[1][1], o[1][1]));
        let det = a * d - b * c;
        let per_det = det / (det * det).max(s.splat(f32::MIN_POSITIVE));
        let [[x0, x1], [y0, y1]] = self.bend.pixels;
        let x = ((d * u - b * v) * per_det).max(s.splat(x0)).min(s.splat(x1));
        let y = ((a * v - c * u) * per_det).max(s.splat(y0)).min(s.splat(y1));
        let (p, q) = (&self.bend.slope, &self.bend.start);
        let (uxx, uxy) = (at(s, p[0][0], q[0][0]), at(s, p[0][1], q[0][1]));
        let (vxx, vxy) = (at(s, p[1][0], q[1][0]), at(s, p[1][1], q[1][1]));
        let (uyy, vyy) = (at(s, p[0][2], q[0][2]), at(s, p[1][2], q[1][2]));
        (
            [
                [a + x * uxx + y * uxy, b + x * uxy + y * uyy],
                [c + x * vxx + y * vxy, d + x * vxy + y * vyy],
            ],
            [x * m[0][0] + y * m[0][1], x * m[1][0] + y * m[1][1]],
        )
    }

    /// Area of a pixel at u, v, s, by lanes.
    #[inline(always)]
    pub(super) fn area<R: Real<Scalar = f32>>(&self, u: R, v: R, s: R) -> R {
        let ([[a, b], [c, d]], _) = self.steps(u, v, s);
        let sides = a * a + b * b + c * c + d * d;
        (a * d - b * c).abs().max(sides * LEAST_AREA)
    }
}
