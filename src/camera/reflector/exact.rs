//! Exact reflection points in f64: closed form on the sphere and the plane, minimisation on the other surfaces.

use glam::{DMat3, DVec3};

/// A smooth surface with a mirror side.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Surface {
    /// The plane z = 0, seen from above.
    Plane,
    /// Radius 1 about the origin, seen from outside, or from inside.
    Sphere { inside: bool },
    /// Radius 1 about the z axis, infinite, seen from outside.
    Cylinder,
    /// These semi-axes along x, y, z about the origin, seen from outside.
    Ellipsoid(DVec3),
    /// Radius 1 to the middle of the tube, this radius of the tube, about the z axis, seen from outside.
    Torus(f64),
    /// A star-shaped surface r(u) u with bumps of this height, seen from outside.
    Bumpy(f64),
}

impl Surface {
    /// Zero on the surface, positive on the mirror side.
    fn value(self, p: DVec3) -> f64 {
        match self {
            Self::Plane => p.z,
            Self::Sphere { inside: false } => p.length() - 1.0,
            Self::Sphere { inside: true } => 1.0 - p.length(),
            Self::Cylinder => p.truncate().length() - 1.0,
            Self::Ellipsoid(axes) => (p / axes).length() - 1.0,
            Self::Torus(tube) => {
                let ring = p.truncate().length() - 1.0;
                ring.hypot(p.z) - tube
            }
            Self::Bumpy(height) => p.length() - bumps(p / p.length(), height),
        }
    }

    /// The unit normal of the mirror side at a point of the surface.
    pub(crate) fn normal(self, p: DVec3) -> DVec3 {
        let step = 1e-6;
        let slope = |axis: DVec3| self.value(p + axis * step) - self.value(p - axis * step);
        DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).normalize_or(DVec3::Z)
    }

    /// The distance from the origin in a unit direction.
    pub(crate) fn radius(self, u: DVec3) -> f64 {
        match self {
            Self::Sphere { .. } => 1.0,
            Self::Ellipsoid(axes) => 1.0 / (u / axes).length(),
            Self::Bumpy(height) => bumps(u, height),
            Self::Plane | Self::Cylinder | Self::Torus(_) => panic!("{self:?} is not star-shaped"),
        }
    }

    /// The point of the surface below `p`: Newton's method along the normal.
    pub(crate) fn drop(self, mut p: DVec3) -> DVec3 {
        for _ in 0..60 {
            let normal = self.normal(p);
            let slope = (self.value(p + normal * 1e-6) - self.value(p - normal * 1e-6)) / 2e-6;
            p -= normal * (self.value(p) / slope);
        }
        p
    }

    /// How far the law of reflection is from holding at a point of the surface: the part of the sum of the unit vectors to
    /// eye and vertex that is not along the normal.
    pub(crate) fn residual(self, eye: DVec3, vertex: DVec3, p: DVec3) -> DVec3 {
        let unit = |to: DVec3| (to - p).normalize_or(DVec3::ZERO);
        let (sum, normal) = (unit(eye) + unit(vertex), self.normal(p));
        sum - normal * sum.dot(normal)
    }

    /// The reflection point nearest to `guess`, if there is one near it: damped Newton steps over the tangent plane.
    pub(crate) fn reflection_near(self, eye: DVec3, vertex: DVec3, guess: DVec3) -> Option<DVec3> {
        let mut p = self.drop(guess);
        for _ in 0..60 {
            let (normal, miss) = (self.normal(p), self.residual(eye, vertex, p));
            if miss.length() < 1e-12 {
                break;
            }
            let (a, b) = normal.any_orthonormal_pair();
            let step = 1e-6;
            let slope = |t: DVec3| {
                let ahead = self.residual(eye, vertex, self.drop(p + t * step));
                let behind = self.residual(eye, vertex, self.drop(p - t * step));
                (ahead - behind) / (2.0 * step)
            };
            let jacobian = DMat3::from_cols(slope(a), slope(b), normal);
            let change = jacobian.inverse() * miss;
            let change = a * change.x + b * change.y;
            let length = change.length();
            if !length.is_finite() {
                return None;
            }
            p = self.drop(p - change * (0.3 / length).min(1.0));
        }
        let normal = self.normal(p);
        let faces = normal.dot(eye - p) > 0.0 && normal.dot(vertex - p) > 0.0;
        (faces && self.residual(eye, vertex, p).length() < 1e-8).then_some(p)
    }
}

/// A radius that nowhere has two of its images of one point close together.
fn bumps(u: DVec3, height: f64) -> f64 {
    1.0 + height * ((3.0 * u.x).sin() + (4.0 * u.y + 1.0).sin() * (3.0 * u.z).cos())
}

/// The reflection point on the unit sphere seen from outside (Alhazen's problem): on the arc between the feet of eye and
/// vertex, where the angles to both are the same.
pub(crate) fn on_sphere(eye: DVec3, vertex: DVec3) -> DVec3 {
    let (from, to) = (eye.normalize_or(DVec3::Z), vertex.normalize_or(DVec3::Z));
    let across = (to - from * to.dot(from)).normalize_or(from.any_orthonormal_vector());
    let at = |angle: f64| from * angle.cos() + across * angle.sin();
    let (mut low, mut high) = (0.0, from.dot(to).clamp(-1.0, 1.0).acos());
    for _ in 0..200 {
        let angle = 0.5 * (low + high);
        let (p, along) = (at(angle), across * angle.cos() - from * angle.sin());
        let unit = |to: DVec3| (to - p).normalize_or(DVec3::ZERO);
        // Towards the vertex while the vertex's side of the bisector is ahead.
        if (unit(eye) + unit(vertex)).dot(along) > 0.0 { low = angle } else { high = angle }
    }
    at(0.5 * (low + high))
}

/// The reflection point on the plane z = 0.
pub(crate) fn on_plane(eye: DVec3, vertex: DVec3) -> DVec3 {
    eye + (vertex - eye) * DVec3::new(1.0, 1.0, 0.0) * (eye.z / (eye.z + vertex.z))
        - DVec3::Z * eye.z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minimisation_meets_the_closed_forms() {
        let mut numbers = crate::camera::three_ray::tests::Numbers(4);
        let sphere = Surface::Sphere { inside: false };
        let mut met = 0;
        for _ in 0..300 {
            let (eye, vertex) = (numbers.point() * 3.0, numbers.point() * 3.0);
            let exact = on_sphere(eye, vertex);
            let out = eye.length() > 1.1 && vertex.length() > 1.1;
            if out && exact.dot(eye - exact) > 0.05 && exact.dot(vertex - exact) > 0.05 {
                let found = sphere.reflection_near(eye, vertex, exact + numbers.point() * 0.1);
                assert!(found.is_some_and(|p| p.distance(exact) < 1e-7), "{found:?} {exact}");
                met += 1;
            }
            let up = |p: DVec3| DVec3::new(p.x, p.y, p.z.abs() + 0.1);
            let exact = on_plane(up(eye), up(vertex));
            let found = Surface::Plane.reflection_near(up(eye), up(vertex), exact + DVec3::X * 0.1);
            assert!(found.is_some_and(|p| p.distance(exact) < 1e-7), "{found:?} {exact}");
        }
        assert!(met > 50, "{met}");
    }

    #[test]
    fn every_surface_reflects_as_it_should() {
        let mut numbers = crate::camera::three_ray::tests::Numbers(5);
        for surface in [
            Surface::Cylinder,
            Surface::Ellipsoid(DVec3::new(1.0, 0.6, 1.5)),
            Surface::Torus(0.4),
            Surface::Bumpy(0.02),
            Surface::Sphere { inside: true },
        ] {
            let mut met = 0;
            for _ in 0..100 {
                let p = surface.drop(numbers.point() * 1.5);
                let normal = surface.normal(p);
                let eye = p + (normal + numbers.point() * 0.5) * 0.6;
                let ray = p - eye;
                let reflected = ray - normal * (2.0 * ray.dot(normal));
                let vertex = p + reflected * (0.2 + numbers.next());
                if let Some(found) = surface.reflection_near(eye, vertex, p) {
                    met += usize::from(found.distance(p) < 1e-6);
                }
            }
            assert!(met > 90, "{surface:?}: {met} of 100 found again");
        }
    }
}
