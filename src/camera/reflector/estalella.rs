//! The search of Estalella et al. 2005 (section 4): at a point of the reflector, the bisector of the directions to eye
//! and vertex says where the reflection point lies.

use glam::Vec3;

use super::{Found, ReflectorMap};

/// When the search ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    /// Steps at most; each reads the maps twice.
    pub iterations: u32,
    /// It ends where the error (1 - B·N)/2 (equation 1) is not more than this.
    pub epsilon: f32,
}

/// No step is longer than this share of the radius: in the region around a silhouette the bisector says nothing about
/// the distance. Measured: without it one point in a hundred is lost on a sphere.
pub(crate) const MOST_STEP: f32 = 0.5;
/// A full step is between these multiples of the half step that measured it.
pub(crate) const STEP_SHARE: [f32; 2] = [0.5, 4.0];
/// A full step follows the bisector in the middle if that has not turned by more than this (a cosine).
pub(crate) const TURN: f32 = 0.3;
/// Step sizes in units of radius and bisector.
pub(crate) const STEP_RANGE: [f32; 2] = [0.05, 2.0];

/// The bisector at a point, less its normal: what the search follows.
#[derive(Clone, Copy)]
struct Bisector {
    point: Vec3,
    normal: Vec3,
    /// B' within the tangent plane.
    toward: Vec3,
    /// Equation 1.
    error: f32,
}

/// Directions to eye and vertex, `mirrored` if the vertex is looked for on the reflector's other side.
#[inline(always)]
fn bisector(
    map: &ReflectorMap,
    eye: Vec3,
    vertex: Vec3,
    hidden: bool,
    direction: Vec3,
) -> Bisector {
    let (point, normal) = map.surface_at(direction);
    let found = Found { point, normal, steps: 0, hidden };
    let vertex = if hidden { found.mirrored(vertex) } else { vertex };
    let (to_eye, to_vertex) = (unit(eye - point), unit(vertex - point));
    let b = (to_eye + to_vertex).normalize_or(normal);
    let toward = b - normal;
    Bisector {
        point,
        normal,
        toward: toward - normal * toward.dot(normal),
        error: 0.5 * (1.0 - b.dot(normal)),
    }
}

#[inline(always)]
fn unit(v: Vec3) -> Vec3 {
    v.normalize_or(Vec3::ZERO)
}

/// The point at which `vertex` is seen from `eye`; for a vertex that the reflector hides (`hidden`), the point whose
/// tangent plane mirrors it to one that is seen there (section 6.1).
///
/// The midpoint rule with two reads a step: half a step along the bisector, then from where it began a full one along the
/// bisector found there. How much the bisector shrank over the half step says how long the full one is.
pub fn search(map: &ReflectorMap, eye: Vec3, vertex: Vec3, hidden: bool, ends: Ends) -> Found {
    let mut at = bisector(map, eye, vertex, hidden, first_direction(map, eye, vertex, hidden));
    let mut best = at;
    let mut size = first_size(at.point, eye, vertex);
    let mut steps = 0;
    while steps < ends.iterations && best.error > ends.epsilon {
        steps += 1;
        let (radius, length) = (at.point.length(), at.toward.length());
        let ahead = at.toward / length.max(f32::MIN_POSITIVE);
        let most = MOST_STEP * radius;
        let half = (0.5 * size * radius * length).min(0.5 * most);
        let middle = bisector(map, eye, vertex, hidden, at.point + ahead * half);
        let shrunk = (length - middle.toward.dot(ahead)) / half.max(f32::MIN_POSITIVE);
        // Where it grew, the reflection point is still far ahead; or, of a far vertex in a hollow mirror, behind.
        let back = shrunk < 0.0 && map.inward;
        let measured = shrunk > 0.0 || back;
        let full = if measured { length / shrunk.abs() } else { STEP_SHARE[1] * half };
        let full = full.clamp(STEP_SHARE[0] * half, STEP_SHARE[1] * half).min(most);
        size = if measured { 1.0 / (shrunk.abs() * radius) } else { 2.0 * size };
        size = size.clamp(STEP_RANGE[0], STEP_RANGE[1]);
        let turned = middle.toward.normalize_or(ahead);
        let along = if turned.dot(ahead) > TURN { turned } else { ahead };
        let full = if back { -full } else { full };
        at = bisector(map, eye, vertex, hidden, at.point + along * full);
        if at.error < best.error {
            best = at;
        }
    }
    Found { point: best.point, normal: best.normal, steps, hidden }
}

/// Between the feet of eye and vertex on the reflector, nearer to that of the nearer one: as in a plane mirror close by,
/// halfway far away.
fn first_direction(map: &ReflectorMap, eye: Vec3, vertex: Vec3, hidden: bool) -> Vec3 {
    let foot = |point: Vec3| {
        let direction = map.foot_direction(eye, point.normalize_or(Vec3::Y));
        let radius = map.radius(direction);
        let height = (point.length() - radius).abs();
        (direction, height / (height + radius))
    };
    let ((to_eye, eye_height), (to_vertex, vertex_height)) = (foot(eye), foot(vertex));
    if hidden {
        return entry(eye, vertex, map.radius(to_eye));
    }
    (to_eye * vertex_height + to_vertex * eye_height).normalize_or(to_eye)
}

/// Where the line of sight to a hidden vertex enters the sphere of this radius, or comes nearest to the centre.
fn entry(eye: Vec3, vertex: Vec3, radius: f32) -> Vec3 {
    let ahead = unit(vertex - eye);
    let nearest = eye - ahead * eye.dot(ahead);
    let depth = (radius * radius - nearest.length_squared()).max(0.0).sqrt();
    nearest - ahead * depth
}

/// On a sphere the bisector turns by 1/radius + 1/(2 |OP|) + 1/(2 |PV|) a length.
fn first_size(point: Vec3, eye: Vec3, vertex: Vec3) -> f32 {
    let radius = point.length();
    let turns = |to: Vec3| 0.5 * radius / (to - point).length().max(f32::MIN_POSITIVE);
    1.0 / (1.0 + turns(eye) + turns(vertex))
}
