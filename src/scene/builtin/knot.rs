//! The trefoil knot: as intricate as a scanned model, and made from nothing.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::builder::{Builder, Joints, Vertex, best_grid};
use crate::geometry::Mesh;

/// Radius of the torus that the knot's middle line lies on, and of that torus' tube.
const TORUS: [f64; 2] = [1.0, 0.45];
/// Mean radius of the knot's own tube.
const TUBE: f64 = 0.3;
/// Waves of the surface: [height, periods along the knot, periods around the tube].
const RELIEF: [[f64; 3]; 5] = [
    [0.030, 6.0, 0.0],
    [0.010, 48.0, 4.0],
    [0.008, -60.0, 6.0],
    [0.0025, 190.0, 14.0],
    [0.0020, -140.0, 25.0],
];
/// A wave with fewer cells of the grid a period than the first is left out, with more than the second it
/// is whole.
const CELLS_A_PERIOD: [f64; 2] = [4.0, 8.0];

/// An upright trefoil knot about the origin, facing ±z: a tube of varying thickness with a relief, of which a
/// coarse mesh has only what it can show.
pub(super) fn knot(wanted: usize) -> Mesh {
    let cuts = best_grid(wanted, 7.6, [24, 6], |rows, columns| 2 * rows * columns);
    let relief = relief_for(cuts);
    let point = |along: f64, around: f64| {
        let [tangent, out, middle] = frame(along);
        let side = out.cross(tangent);
        let height: f64 = relief.iter().map(|w| w[0] * (w[1] * along + w[2] * around).cos()).sum();
        let direction = DVec2::from_angle(around);
        middle + (out * direction.x + side * direction.y) * (TUBE + height)
    };
    // In f64 the central difference is good to about 1e-9, finer than a normal in f32.
    const STEP: f64 = 1e-5;
    let mut builder = Builder::default();
    let joints = Joints { rows: true, columns: true, pole: false };
    builder.grid(cuts, joints, |i, j| {
        let [s, a] = [i as f64 / cuts[0] as f64, j as f64 / cuts[1] as f64].map(|t| t * TAU);
        let along = point(s + STEP, a) - point(s - STEP, a);
        let around = point(s, a + STEP) - point(s, a - STEP);
        Vertex { point: point(s, a), normal: along.cross(around).normalize_or(DVec3::Y) }
    });
    builder.finish()
}

/// The waves with the heights at which a grid can show them.
fn relief_for([rows, columns]: [usize; 2]) -> [[f64; 3]; 5] {
    RELIEF.map(|[height, along, around]| {
        let cells = 1.0 / (along.abs() / rows as f64 + around.abs() / columns as f64);
        let [none, all] = CELLS_A_PERIOD;
        let part = ((cells - none) / (all - none)).clamp(0.0, 1.0);
        [height * part, along, around]
    })
}

/// At a parameter of 0 to τ: unit tangent, unit direction away from the torus' tube, point of the middle line.
fn frame(s: f64) -> [DVec3; 3] {
    let [large, small] = TORUS;
    // Evens out the speed, which is higher where the knot is far from its axis.
    const EVEN: f64 = 0.3;
    let t = s - EVEN / 3.0 * (3.0 * s).sin();
    let ((sin_2t, cos_2t), (sin_3t, cos_3t)) = ((2.0 * t).sin_cos(), (3.0 * t).sin_cos());
    let radial = DVec3::new(cos_2t, sin_2t, 0.0);
    let onward = DVec3::new(-sin_2t, cos_2t, 0.0);
    let distance = large + small * cos_3t;
    let middle = radial * distance + DVec3::Z * (small * sin_3t);
    let velocity = onward * (2.0 * distance) - radial * (3.0 * small * sin_3t)
        + DVec3::Z * (3.0 * small * cos_3t);
    // Already at right angles to the velocity: the torus' normal.
    let out = radial * cos_3t + DVec3::Z * sin_3t;
    [velocity.normalize_or(DVec3::X), out, middle]
}
