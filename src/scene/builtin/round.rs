//! Round shapes.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DMat3, DVec2, DVec3};

use super::builder::{Builder, Vertex};
use super::revolution::{Piece, Profile, revolution};
use crate::geometry::Mesh;

/// Radius 1 about the origin.
pub(super) fn sphere(wanted: usize) -> Mesh {
    ball(wanted).finish()
}

/// Semi-axes of the ellipsoid along x, y and z.
pub(super) const ELLIPSOID: DVec3 = DVec3::new(1.0, 0.65, 0.8);

/// About the origin.
pub(super) fn ellipsoid(wanted: usize) -> Mesh {
    let axes = ELLIPSOID;
    ball(wanted)
        .map(|v| Vertex { point: v.point * axes, normal: (v.normal / axes).normalize_or(DVec3::Y) })
        .finish()
}

fn ball(wanted: usize) -> Builder {
    let half = Piece::Arc(DVec2::ZERO, 1.0, [FRAC_PI_2, -FRAC_PI_2]);
    turn(&[&[half]], 0.0, wanted)
}

/// Radius of the torus to the middle of its tube, and of the tube.
pub(super) const TORUS: [f64; 2] = [1.0, 0.4];

/// About the y axis through the origin.
pub(super) fn torus(wanted: usize) -> Mesh {
    let tube = Piece::Arc(DVec2::X * TORUS[0], TORUS[1], [0.0, -TAU]);
    let curves: &[&[Piece]] = &[&[tube]];
    revolution(&Profile { curves, closed: true, finest_radius: 0.0 }, wanted).finish()
}

/// Radius of the cylinder.
pub(super) const CYLINDER_RADIUS: f64 = 0.5;

/// Height 1, standing on y = 0, closed.
pub(super) fn cylinder(wanted: usize) -> Mesh {
    let [top, edge] = [DVec2::new(0.0, 1.0), DVec2::new(CYLINDER_RADIUS, 1.0)];
    let [foot, bottom] = [DVec2::new(CYLINDER_RADIUS, 0.0), DVec2::ZERO];
    let line = Piece::Line;
    turn(&[&[line(top, edge)], &[line(edge, foot)], &[line(foot, bottom)]], 0.0, wanted).finish()
}

/// Base radius 0.5, height about 1 under a slightly rounded tip, standing on y = 0, closed.
pub(super) fn cone(wanted: usize) -> Mesh {
    /// Radius of the tip.
    const TIP: f64 = 0.04;
    let foot = DVec2::new(0.5, 0.0);
    // The side's normal; the side touches the tip's circle there.
    let angle = 0.5_f64.atan();
    let direction = DVec2::from_angle(angle);
    let center = DVec2::new(0.0, (foot.dot(direction) - TIP) / direction.y);
    let tip = Piece::Arc(center, TIP, [FRAC_PI_2, angle]);
    let side = Piece::Line(center + TIP * direction, foot);
    turn(&[&[tip, side], &[Piece::Line(foot, DVec2::ZERO)]], TIP, wanted).finish()
}

/// A wine glass of solid glass, 2 high, standing on y = 0: the bowl's inside, its lip and outside, stem and foot.
/// The shape of figure 3 of Mei, Popescu and Sacks 2007, by eye.
pub(super) fn goblet(wanted: usize) -> Mesh {
    let bezier = |points: [[f64; 2]; 4]| Piece::Bezier(points.map(DVec2::from));
    let profile = [
        bezier([[0.0, 0.92], [0.30, 0.92], [0.49, 1.10], [0.49, 1.38]]),
        bezier([[0.49, 1.38], [0.49, 1.62], [0.41, 1.80], [0.39, 1.97]]),
        bezier([[0.39, 1.97], [0.385, 2.0125], [0.445, 2.0125], [0.45, 1.97]]),
        bezier([[0.45, 1.97], [0.47, 1.80], [0.55, 1.62], [0.55, 1.38]]),
        bezier([[0.55, 1.38], [0.55, 1.05], [0.30, 0.86], [0.12, 0.80]]),
        bezier([[0.12, 0.80], [0.075, 0.785], [0.06, 0.70], [0.06, 0.60]]),
        bezier([[0.06, 0.60], [0.06, 0.45], [0.06, 0.30], [0.065, 0.20]]),
        bezier([[0.065, 0.20], [0.07, 0.10], [0.20, 0.07], [0.44, 0.05]]),
        bezier([[0.44, 0.05], [0.47, 0.0475], [0.47, 0.0], [0.43, 0.0]]),
        Piece::Line(DVec2::new(0.43, 0.0), DVec2::ZERO),
    ];
    turn(&[&profile], 0.05, wanted).finish()
}

/// The bowl's rim, and how far its opening is tilted towards +z, degrees.
const BOWL: [f64; 2] = [65.0, 65.0];

/// The inside of a bowl: a cap of a sphere of radius 1 out to 65° from its middle, tilted so that its opening
/// faces +z and a little up, lowest point on y = 0. There is no outside.
pub(super) fn bowl(wanted: usize) -> Mesh {
    let (tilted, lowest) = tilted_bowl(wanted);
    tilted.map(|v| Vertex { point: v.point - DVec3::Y * lowest, ..v }).finish()
}

/// Centre of the bowl's sphere (of radius 1), unit direction from there to the bowl's middle, and cosine from there to the rim.
pub(super) fn bowl_sphere(wanted: usize) -> (DVec3, DVec3, f64) {
    let (_, lowest) = tilted_bowl(wanted);
    let up = DMat3::from_rotation_x(BOWL[1].to_radians()) * DVec3::Y;
    (up - DVec3::Y * lowest, -up, BOWL[0].to_radians().cos())
}

/// The bowl about its lowest point before it was tilted, and where its lowest vertex is now.
fn tilted_bowl(wanted: usize) -> (Builder, f64) {
    let [rim, tilt] = BOWL.map(f64::to_radians);
    let cap = Piece::Arc(DVec2::Y, 1.0, [-FRAC_PI_2, rim - FRAC_PI_2]);
    let tilt = DMat3::from_rotation_x(tilt);
    let tilted = turn(&[&[cap]], 0.0, wanted)
        .map(|v| Vertex { point: tilt * v.point, normal: tilt * v.normal });
    let lowest = tilted.lowest();
    (tilted, lowest)
}

fn turn(curves: &[&[Piece]], finest_radius: f64, wanted: usize) -> Builder {
    revolution(&Profile { curves, closed: false, finest_radius }, wanted)
}
