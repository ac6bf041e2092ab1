//! The search of Roger & Holzschuch 2006 (section 3): a zero of the gradient of the optical path's length, by the secant
//! method over a triangle of samples.

use glam::Vec3;

use super::{Found, ReflectorMap};

/// When the search ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    /// Steps at most; each reads the map once.
    pub iterations: u32,
    /// It ends when a step moves the image by less than this angle seen from the eye, radians; 0: never before
    /// `iterations`.
    pub angle: f32,
}

/// One of the three samples.
#[derive(Clone, Copy)]
struct Sample {
    direction: Vec3,
    point: Vec3,
    /// ∇r.
    slope: Vec3,
    /// Of the path's length over the unit sphere.
    gradient: Vec3,
    /// Length of the path.
    length: f32,
}

/// Longest step over the unit sphere, and where it starts.
pub(crate) const TRUST: [f32; 2] = [0.7, 0.5];
/// Below this share of the largest value that it can have, the determinant δ says nothing; likewise the triangle's area.
pub(crate) const LEAST_DETERMINANT: f32 = 1e-5;
pub(crate) const LEAST_AREA: f32 = 1e-4;
/// Sides of a triangle that is made anew.
pub(crate) const NEW_SIDE: [f32; 2] = [1e-3, 0.3];
/// A search has not ended while the gradient is larger than this multiple of the angle that it is to end at.
pub(crate) const GRADIENT_ENDS: f32 = 20.0;
/// Path lengths that differ by less than this share of the radius say nothing: the radius has the facets of the mesh that
/// it was made from (edges of a tenth of it), the gradient is smooth.
pub(crate) const LENGTH_NOISE: f32 = 3e-3;

/// A first triangle with a shorter side would say nothing.
pub(crate) const LEAST_SIDE: f32 = 0.05;
/// Height of an equilateral triangle of side 1.
pub(crate) const HEIGHT: f32 = 0.866;

/// What all samples of a search share.
struct Path<'a> {
    map: &'a ReflectorMap,
    eye: Vec3,
    vertex: Vec3,
    /// The path is shortest at the reflection point, as in a convex mirror. In a concave one it may be longest.
    shortest: bool,
}

impl Path<'_> {
    /// With e the sum of the unit vectors from eye and vertex to P(u) = r(u) u, the gradient is (e·u) ∇r + r (e - (e·u) u).
    /// The paper prints e with the wrong sign, and in equation 1 the transpose of the derivative: (∇r·e) u.
    #[inline(always)]
    fn sample(&self, direction: Vec3) -> Sample {
        let u = direction.normalize_or(Vec3::Y);
        let [x, y, z, r] = self.map.radial.at(u);
        let point = u * r;
        let (from_eye, from_vertex) = (point - self.eye, point - self.vertex);
        let (eye_length, vertex_length) = (from_eye.length(), from_vertex.length());
        let e = from_eye / eye_length.max(f32::MIN_POSITIVE)
            + from_vertex / vertex_length.max(f32::MIN_POSITIVE);
        let along = e.dot(u);
        let slope = Vec3::new(x, y, z);
        let gradient = slope * along + (e - u * along) * r;
        Sample { direction: u, point, slope, gradient, length: eye_length + vertex_length }
    }

    /// Whether `a` is nearer to the reflection point than `b`: by its path where that is clearly shorter, else by its
    /// gradient.
    #[inline(always)]
    fn nearer(&self, a: &Sample, b: &Sample) -> bool {
        let shorter = b.length - a.length;
        if self.shortest && shorter.abs() > LENGTH_NOISE * a.point.length() {
            return shorter > 0.0;
        }
        a.gradient.length_squared() < b.gradient.length_squared()
    }

    /// Indices of the samples, the nearest first.
    fn order(&self, samples: &[Sample; 3]) -> [usize; 3] {
        let mut list = [0, 1, 2];
        for (i, j) in [(0, 1), (1, 2), (0, 1)] {
            if self.nearer(&samples[list[j]], &samples[list[i]]) {
                list.swap(i, j);
            }
        }
        list
    }
}

/// The point at which `vertex` is seen from `eye`.
///
/// The samples begin as the paper's: the feet of vertex and eye, and what makes an equilateral triangle of them. Where
/// δ ≈ 0 the sample discarded last comes back (section 3.3.3), or a new triangle is opened if it has been back already. Two
/// safeguards are ours: where the path is shortest at the reflection point, steps lead to shorter paths, and a step
/// that did not halves the length of the next.
pub fn search(map: &ReflectorMap, eye: Vec3, vertex: Vec3, ends: Ends) -> Found {
    let shortest = !map.inward;
    let path = Path { map, eye, vertex, shortest };
    let mut samples = first_samples(&path);
    let mut newest = usize::MAX;
    let mut discarded: Option<Sample> = None;
    let mut trust = TRUST[1];
    for steps in 1..=ends.iterations {
        let [best, middle, worst] = path.order(&samples);
        let nearest = samples[best];
        let old = if worst == newest { middle } else { worst };
        let Some(secant) = secant(&samples, [best, middle, worst]) else {
            let side = samples[middle].direction - nearest.direction;
            samples[old] = discarded.take().unwrap_or_else(|| {
                newest = old;
                let any = nearest.direction.any_orthonormal_vector();
                let across = nearest.direction.cross(side).normalize_or(any);
                let length = side.length().clamp(NEW_SIDE[0], NEW_SIDE[1]);
                path.sample(nearest.direction + across * length)
            });
            continue;
        };
        let step = limited(secant, &nearest, shortest, trust);
        let length = step.length();
        let new = path.sample(nearest.direction + step);
        let distance = (nearest.point - eye).length().max(f32::MIN_POSITIVE);
        let moved = length * nearest.point.length() / distance;
        trust = if path.nearer(&new, &nearest) {
            (1.5 * trust).min(TRUST[0])
        } else {
            (0.5 * length).max(NEW_SIDE[0])
        };
        discarded = Some(samples[worst]);
        samples[worst] = new;
        newest = worst;
        if moved < ends.angle && new.gradient.length() < GRADIENT_ENDS * ends.angle * distance {
            return found(map, &new, steps);
        }
    }
    found(map, &samples[path.order(&samples)[0]], ends.iterations)
}

/// Feet of vertex and eye, and the third corner of an equilateral triangle (section 3.3.4).
fn first_samples(path: &Path<'_>) -> [Sample; 3] {
    let foot = |to: Vec3| path.sample(path.map.foot_direction(path.eye, to.normalize_or(Vec3::Y)));
    let (a, b) = (foot(path.vertex), foot(path.eye));
    let across = a.direction.cross(b.direction);
    let any = a.direction.any_orthonormal_vector();
    let side = (a.direction - b.direction).length();
    let across = if across.length() < 1e-4 { any } else { across.normalize_or(any) };
    let middle = (a.direction + b.direction) * 0.5;
    [a, b, path.sample(middle + across * (HEIGHT * side.max(LEAST_SIDE)))]
}

/// Where the gradient would be least if it were linear over the samples (section 3.3.3), as a direction; `None` if it
/// says nothing about that.
#[inline(always)]
fn secant(samples: &[Sample; 3], [best, middle, worst]: [usize; 3]) -> Option<Vec3> {
    let [sa, sb, sc] = samples;
    let (a, b, c) = (sa.gradient - sc.gradient, sb.gradient - sc.gradient, sc.gradient);
    let (aa, ab, bb) = (a.dot(a), a.dot(b), b.dot(b));
    let determinant = aa * bb - ab * ab;
    let side = |i: usize| samples[i].direction - samples[best].direction;
    let (first, second) = (side(middle), side(worst));
    let (area, most) =
        (first.cross(second).length_squared(), first.length_squared() * second.length_squared());
    if determinant <= LEAST_DETERMINANT * aa * bb || area <= LEAST_AREA * most {
        return None;
    }
    let (ac, bc) = (a.dot(c), b.dot(c));
    let (alpha, beta) = ((ab * bc - bb * ac) / determinant, (ab * ac - aa * bc) / determinant);
    Some(sa.direction * alpha + sb.direction * beta + sc.direction * (1.0 - alpha - beta))
}

/// The step from the nearest sample to `target`; down the gradient where that would make the path longer.
#[inline(always)]
fn limited(target: Vec3, nearest: &Sample, shortest: bool, trust: f32) -> Vec3 {
    let step = target - nearest.direction;
    let slope = nearest.gradient.length();
    if shortest && nearest.gradient.dot(step) > 0.0 {
        return nearest.gradient * (-trust.min(slope) / slope.max(f32::MIN_POSITIVE));
    }
    step * (trust / step.length().max(f32::MIN_POSITIVE)).min(1.0)
}

fn found(map: &ReflectorMap, sample: &Sample, steps: u32) -> Found {
    let outward = sample.point - sample.slope;
    let normal = if map.inward { -outward } else { outward };
    Found {
        point: sample.point,
        normal: normal.normalize_or(sample.direction),
        steps,
        hidden: false,
    }
}
