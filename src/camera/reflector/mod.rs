//! Star-shaped reflectors as maps of the direction from a centre, and the two searches for the point of a reflector
//! at which a given point is seen: Estalella et al. 2005 and Roger & Holzschuch 2006.
//!
//! All points are relative to the reflector's centre, in scene units and axes. `shaders/camera/reflector/` holds the
//! twins.

pub mod cube;
pub mod estalella;
#[cfg(test)]
pub(crate) mod exact;
pub mod roger;
#[cfg(test)]
pub(crate) mod tests;

use glam::Vec3;

use self::cube::CubeMap;

/// A reflector that every ray from a centre meets once, by direction.
#[derive(Clone, Debug)]
pub struct ReflectorMap {
    /// Point and unit normal (mirror side): what Estalella et al. read (section 4.1).
    pub surface: CubeMap<6>,
    /// The radius r and, before it, its gradient over the unit sphere: what Roger & Holzschuch read (section 3.3.1).
    pub radial: CubeMap<4>,
    /// The mirror side is the one towards the centre.
    pub inward: bool,
}

/// Where a point is seen in a reflector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The reflection point R, relative to the centre.
    pub point: Vec3,
    /// Unit normal there.
    pub normal: Vec3,
    /// Steps that the search took.
    pub steps: u32,
    /// The reflector hides the point that was searched for: see [`ReflectorMap::hides`].
    pub hidden: bool,
}

impl Found {
    /// How far before the reflector's tangent plane a point lies.
    pub fn height(&self, point: Vec3) -> f32 {
        (point - self.point).dot(self.normal)
    }

    /// A point mirrored in the tangent plane: the virtual vertex (Estalella et al. section 3).
    pub fn mirrored(&self, point: Vec3) -> Vec3 {
        point - self.normal * (2.0 * self.height(point))
    }
}

impl ReflectorMap {
    /// Of the radii and unit normals (mirror side) in [`cube::directions`].
    ///
    /// # Panics
    /// If their number is not that of a map with this side.
    pub fn new(side: u32, surface: &[(f32, Vec3)], inward: bool) -> Self {
        let directions = cube::directions(side);
        let points = directions.iter().zip(surface).map(|(&u, &(r, n))| {
            let p = u * r;
            [p.x, p.y, p.z, n.x, n.y, n.z]
        });
        let radii = directions.iter().zip(surface).map(|(&u, &(r, n))| {
            let g = radial_gradient(u, r, n);
            [g.x, g.y, g.z, r]
        });
        Self {
            surface: CubeMap::new(side, points.collect()),
            radial: CubeMap::new(side, radii.collect()),
            inward,
        }
    }

    /// Whether a point is in the hidden region (Estalella et al. section 6.1): the reflector is between it and the eye, or it is
    /// beyond the reflector's surface. Of a hollow mirror, whose opening the map does not know, only what is found tells:
    /// see [`Self::settled`].
    pub fn hides(&self, eye: Vec3, point: Vec3) -> bool {
        // How far outside the surface, as a share of the radius.
        let outside = |p: Vec3| p.length() / self.radius(p) - 1.0;
        if self.inward {
            return false;
        }
        let here = outside(point);
        let along = |t: f32| outside(eye + (point - eye) * t);
        let (mut least, mut at) = (here, 1.0);
        for k in 1..SIGHT_SAMPLES {
            let t = k as f32 / SIGHT_SAMPLES as f32;
            let now = along(t);
            (least, at) = if now < least { (now, t) } else { (least, at) };
        }
        // Around the lowest of them, where it may be lower still.
        let mut step = 0.5 / SIGHT_SAMPLES as f32;
        for _ in 0..SIGHT_HALVINGS {
            for side in [-1.0, 1.0] {
                let t = at + side * step;
                let now = along(t.clamp(0.0, 1.0));
                (least, at) = if now < least { (now, t) } else { (least, at) };
            }
            step *= 0.5;
        }
        least < 0.0
    }

    /// What was found for a point; a hollow mirror hides what is behind the tangent plane at its image.
    pub fn settled(&self, found: Found, point: Vec3) -> Found {
        let hidden = if self.inward { found.height(point) <= 0.0 } else { found.hidden };
        Found { hidden, ..found }
    }

    /// The radius in a direction of any length.
    pub fn radius(&self, direction: Vec3) -> f32 {
        self.radial.at(direction)[3]
    }

    /// The point and unit normal (mirror side) in a direction of any length.
    #[inline(always)]
    pub fn surface_at(&self, direction: Vec3) -> (Vec3, Vec3) {
        let [x, y, z, a, b, c] = self.surface.at(direction);
        (Vec3::new(x, y, z), Vec3::new(a, b, c).normalize_or(Vec3::Y))
    }

    /// Where a search begins for a point in this unit direction; in a hollow mirror the opposite direction, if the eye does not
    /// see the mirror side there.
    fn foot_direction(&self, eye: Vec3, direction: Vec3) -> Vec3 {
        let (point, normal) = self.surface_at(direction);
        let behind = self.inward && normal.dot(eye - point) < 0.0;
        if behind { -direction } else { direction }
    }
}

/// Places along a line of sight that are looked at first, and how often the step around the lowest is halved: together to a
/// thousandth of its length.
pub(crate) const SIGHT_SAMPLES: u32 = 8;
pub(crate) const SIGHT_HALVINGS: u32 = 6;

/// Normals further than this from the radius (its cosine) have no gradient that f32 could hold.
const LEAST_SLOPE: f32 = 0.02;

/// The gradient of r over the unit sphere at `u` where the surface has this normal: the surface r(u) u has the normal
/// r u - ∇r.
fn radial_gradient(u: Vec3, r: f32, normal: Vec3) -> Vec3 {
    let along = normal.dot(u);
    let along = if along < 0.0 { along.min(-LEAST_SLOPE) } else { along.max(LEAST_SLOPE) };
    let gradient = (u - normal / along) * r;
    gradient - u * gradient.dot(u)
}
