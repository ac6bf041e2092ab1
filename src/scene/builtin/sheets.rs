//! Flat shapes and the wave.

use std::f64::consts::TAU;

use glam::DVec3;

use super::builder::{Builder, Joints, Vertex, best_grid};
use crate::geometry::Mesh;

/// The upright unit square in z = 0, facing +z, standing on y = 0, its middle above the origin.
pub(super) fn plane(wanted: usize) -> Mesh {
    square(wanted, DVec3::Y * 0.5, [DVec3::NEG_Y, DVec3::X])
}

/// The level unit square in y = 0, facing +y, about the origin.
pub(super) fn ground(wanted: usize) -> Mesh {
    square(wanted, DVec3::ZERO, [DVec3::Z, DVec3::X])
}

fn square(wanted: usize, middle: DVec3, axes: [DVec3; 2]) -> Mesh {
    let mut builder = Builder::default();
    let cuts = best_grid(wanted, 1.0, [1, 1], |rows, columns| 2 * rows * columns);
    face(&mut builder, cuts, middle, axes);
    builder.finish()
}

/// The unit cube standing on y = 0, its middle above the origin; each face has its own vertices.
pub(super) fn cube(wanted: usize) -> Mesh {
    // One number of cuts an axis, so that faces meet in the same points; n, n, n to n + 1, n + 1, n + 1.
    let cuts = |k: usize| [k, k + 1, k + 2].map(|n| n / 3);
    let count = |[x, y, z]: [usize; 3]| 4 * (x * y + y * z + z * x);
    let above = (3..).find(|&k| count(cuts(k)) >= wanted).unwrap_or(3);
    let best = [above - 1, above].into_iter().filter(|&k| k >= 3);
    let best = best.min_by_key(|&k| count(cuts(k)).abs_diff(wanted)).unwrap_or(3);
    let cuts = cuts(best);

    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let middle = DVec3::Y * 0.5;
    let mut builder = Builder::default();
    for k in 0..3 {
        let (a, b) = ((k + 1) % 3, (k + 2) % 3);
        let out = axes[k] * 0.5;
        face(&mut builder, [cuts[a], cuts[b]], middle + out, [axes[a], axes[b]]);
        face(&mut builder, [cuts[b], cuts[a]], middle - out, [axes[b], axes[a]]);
    }
    builder.finish()
}

/// A unit square about `middle`, its front where the first axis × the second points.
fn face(builder: &mut Builder, cuts: [usize; 2], middle: DVec3, axes: [DVec3; 2]) {
    let normal = axes[0].cross(axes[1]);
    // Symmetric in rounding, too: a cube's faces meet bit for bit.
    let part = |i: usize, n: usize| (2.0 * i as f64 - n as f64) / (2.0 * n as f64);
    builder.grid(cuts, Joints::default(), |i, j| {
        let point = middle + axes[0] * part(i, cuts[0]) + axes[1] * part(j, cuts[1]);
        Vertex { point, normal }
    });
}

/// Height and width of the wave's sheet, and how far it rises from z = 0: z = rise · cos τx · cos τy.
pub(super) const WAVE: ([f64; 2], f64) = ([1.5, 2.0], 0.08);

/// An upright sheet of hills, hollows and saddles: 2 wide, 1.5 high, standing on y = 0, facing +z.
pub(super) fn wave(wanted: usize) -> Mesh {
    let (size, height) = WAVE;
    let cuts = best_grid(wanted, size[0] / size[1], [2, 2], |rows, columns| 2 * rows * columns);
    let mut builder = Builder::default();
    builder.grid(cuts, Joints::default(), |i, j| {
        let x = size[1] * (j as f64 / cuts[1] as f64 - 0.5);
        let y = size[0] * (1.0 - i as f64 / cuts[0] as f64);
        let ((sin_x, cos_x), (sin_y, cos_y)) = ((TAU * x).sin_cos(), (TAU * y).sin_cos());
        let slope = DVec3::new(sin_x * cos_y, cos_x * sin_y, 0.0) * (height * TAU);
        Vertex {
            point: DVec3::new(x, y, height * cos_x * cos_y),
            normal: (slope + DVec3::Z).normalize_or(DVec3::Z),
        }
    });
    builder.finish()
}
