//! Built-in shapes in closed form: g = 0, with first and second derivatives.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

use super::round::{CYLINDER_RADIUS, ELLIPSOID, TORUS, bowl_sphere};
use super::sheets::WAVE;

/// A surface g(p) = 0 in the shape's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SmoothSurface {
    /// (p / axes)² = 1.
    Ellipsoid(DVec3),
    /// About the y axis.
    Torus,
    /// Part of a unit sphere: centre, direction to its middle, cosine of its rim from there.
    Cap(DVec3, DVec3, f64),
    /// The sheet over x and y.
    Wave,
    /// The side of the cylinder, without its ends.
    Tube,
}

/// g and its derivatives at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Derivatives {
    pub(crate) value: f64,
    pub(crate) gradient: DVec3,
    pub(crate) hessian: DMat3,
}

impl SmoothSurface {
    pub(super) fn of(name: &str, wanted: usize) -> Option<Self> {
        Some(match name {
            "sphere" => Self::Ellipsoid(DVec3::ONE),
            "ellipsoid" => Self::Ellipsoid(ELLIPSOID),
            "torus" => Self::Torus,
            "bowl" => {
                let (center, middle, rim) = bowl_sphere(wanted);
                Self::Cap(center, middle, rim)
            }
            "wave" => Self::Wave,
            "cylinder" => Self::Tube,
            _ => return None,
        })
    }

    /// Whether the part of the mesh with this unit normal (own space) approximates the surface: a cylinder has flat ends, too.
    pub(crate) fn is_near(&self, normal: DVec3) -> bool {
        *self != Self::Tube || normal.y.abs() < 0.5
    }

    /// Whether a point of the surface is on the shape's part of it.
    pub(crate) fn contains(&self, p: DVec3) -> bool {
        match *self {
            Self::Ellipsoid(_) | Self::Torus => true,
            Self::Cap(center, middle, rim) => (p - center).dot(middle) >= rim,
            Self::Wave => {
                let ([height, width], _) = WAVE;
                (0.0..=height).contains(&p.y) && p.x.abs() <= 0.5 * width
            }
            Self::Tube => (0.0..=1.0).contains(&p.y),
        }
    }

    /// g at any point near the surface.
    pub(crate) fn derivatives(&self, p: DVec3) -> Derivatives {
        match *self {
            Self::Ellipsoid(axes) => quadric(p, 1.0 / (axes * axes), 1.0),
            Self::Cap(center, ..) => quadric(p - center, DVec3::ONE, 1.0),
            Self::Tube => quadric(p, DVec3::new(1.0, 0.0, 1.0), CYLINDER_RADIUS.powi(2)),
            Self::Torus => torus(p),
            Self::Wave => wave(p),
        }
    }
}

/// ½ (Σ a p² - level).
fn quadric(p: DVec3, a: DVec3, level: f64) -> Derivatives {
    Derivatives {
        value: 0.5 * ((a * p).dot(p) - level),
        gradient: a * p,
        hessian: DMat3::from_diagonal(a),
    }
}

/// ½ ((ρ - R)² + y² - r²), ρ the distance from the axis.
fn torus(p: DVec3) -> Derivatives {
    let [large, small] = TORUS;
    let rho = p.x.hypot(p.z);
    let out = DVec3::new(p.x, 0.0, p.z) / rho;
    let off = rho - large;
    let around = DVec3::new(-out.z, 0.0, out.x);
    let dyad = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
    Derivatives {
        value: 0.5 * (off * off + p.y * p.y - small * small),
        gradient: out * off + DVec3::Y * p.y,
        hessian: dyad(out) + dyad(DVec3::Y) + dyad(around) * (off / rho),
    }
}

/// z - h cos τx cos τy.
fn wave(p: DVec3) -> Derivatives {
    let (_, height) = WAVE;
    let ((sin_x, cos_x), (sin_y, cos_y)) = ((TAU * p.x).sin_cos(), (TAU * p.y).sin_cos());
    let slope = DVec3::new(sin_x * cos_y, cos_x * sin_y, 0.0) * (height * TAU);
    let [same, mixed] = [cos_x * cos_y, -sin_x * sin_y].map(|v| v * height * TAU * TAU);
    Derivatives {
        value: p.z - height * cos_x * cos_y,
        gradient: slope + DVec3::Z,
        hessian: DMat3::from_cols(
            DVec3::new(same, mixed, 0.0),
            DVec3::new(mixed, same, 0.0),
            DVec3::ZERO,
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{SHAPES, shape, smooth};
    use super::*;

    #[test]
    fn meshes_lie_on_their_surfaces_with_their_normals() {
        let mut found = Vec::new();
        for name in SHAPES {
            let Some(surface) = smooth(name, Some(3_000)) else { continue };
            found.push(*name);
            let mesh = shape(name, Some(3_000)).unwrap();
            let mut near = 0;
            for (p, n) in mesh.positions().iter().zip(mesh.normals()) {
                let (p, n) = (p.as_dvec3(), n.as_dvec3());
                if !surface.is_near(n) {
                    continue;
                }
                near += 1;
                let at = surface.derivatives(p);
                assert!(at.value.abs() < 1e-6, "{name}: {p} is {} off", at.value);
                let cosine = at.gradient.normalize_or_zero().dot(n).abs();
                assert!(cosine > 1.0 - 1e-6, "{name}: {p} has {n}");
                // Rims are rounded, too.
                let inner = mesh.bounds().center().as_dvec3();
                assert!(surface.contains(p + (inner - p) * 1e-5), "{name}: {p}");
            }
            assert!(near > 1_000, "{name}: {near}");
        }
        assert_eq!(found, ["sphere", "ellipsoid", "torus", "bowl", "wave", "cylinder"]);
    }

    #[test]
    fn derivatives_are_those_of_the_value() {
        const STEP: f64 = 1e-5;
        for name in ["sphere", "ellipsoid", "torus", "bowl", "wave", "cylinder"] {
            let surface = smooth(name, None).unwrap();
            let p = DVec3::new(0.43, 0.31, 0.57);
            let at = surface.derivatives(p);
            for (k, axis) in DVec3::AXES.into_iter().enumerate() {
                let [high, low] = [1.0, -1.0].map(|s| surface.derivatives(p + axis * (s * STEP)));
                let slope = (high.value - low.value) / (2.0 * STEP);
                assert!((slope - at.gradient[k]).abs() < 1e-7, "{name} {k}");
                let bend = (high.gradient - low.gradient) / (2.0 * STEP);
                assert!((bend - at.hessian.col(k)).length() < 1e-7, "{name} {k}");
            }
        }
    }
}
