//! From the camera's path to that of the smooth surface: Newton's method on the law of reflection.
//!
//! A built-in shape that has a closed form g = 0 is that surface: the path is where |EP| + |PQ| is stationary on it
//! (Fermat). Other meshes are smooth by their interpolated normals: the path is where the normal halves the angle between the legs.

use glam::DVec3;

use super::TIE;
use super::cameras::{Camera, Image};
use super::surfaces::{MirrorSurface, NO_TRIANGLE};
use crate::scene::builtin::SmoothSurface;

/// A path point on the smooth surface and the unit normal there, relative to the scene's origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refined {
    pub(super) point: DVec3,
    pub(super) normal: DVec3,
}

/// Newton squares the error, so that few steps suffice unless a caustic is near.
const MOST_STEPS: usize = 24;
/// Steps shorter than this, as a share of the longest edge, are rounding.
const CONVERGED: f64 = 1e-13;
/// A path is not moved by more than so many longest edges: beyond, it is another path. Untuned.
const REACH: f64 = 2.0;
/// Where two triangles send a path to each other, it may be so far outside of one, as a weight. Untuned.
const BEYOND: f64 = 0.25;
/// Triangles that are left on the way over a mesh, at most.
const MOST_CROSSINGS: usize = 8;

/// Moves an image of `point` to the smooth surface of its mirror. `None` if no path is found nearby.
pub(super) fn refine(
    surface: &MirrorSurface,
    camera: &Camera,
    image: &Image,
    eye: DVec3,
    point: DVec3,
) -> Option<Refined> {
    let start = camera.mirror_point(image.weights);
    let normal = surface.normal(camera.triangle as usize, image.weights);
    let closed = surface.smooth.filter(|s| s.is_near(surface.to_scene.inverse_direction(normal)));
    let found = match closed {
        Some(smooth) => {
            let to_local = |p: DVec3| surface.to_scene.inverse_point(p);
            let ends = [to_local(eye), to_local(point)];
            let outward = surface.to_scene.inverse_direction(normal);
            let size = camera.size / surface.to_scene.scale;
            let local = on_surface(&smooth, to_local(start), outward, ends, size)?;
            Refined {
                point: surface.to_scene.point(local.point),
                normal: surface.to_scene.direction(local.normal),
            }
        }
        None => on_mesh(surface, camera, image, [eye, point])?,
    };
    let in_front = |end: DVec3| (end - found.point).dot(found.normal) > 0.0;
    let near = found.point.distance(start) <= REACH * camera.size;
    (near && in_front(eye) && in_front(point)).then_some(found)
}

/// The point of g = 0 near `start` where the way between the ends is stationary.
fn on_surface(
    smooth: &SmoothSurface,
    start: DVec3,
    outward: DVec3,
    ends: [DVec3; 2],
    size: f64,
) -> Option<Refined> {
    let mut p = start;
    for _ in 0..MOST_STEPS {
        let at = smooth.derivatives(p);
        let steepness = at.gradient.length();
        let n = at.gradient.try_normalize()?;
        let [u, v] = ends.map(|end| p - end);
        let (pull, bend) = (slope(u) + slope(v), |x: DVec3| curve(u, x) + curve(v, x));
        // The multiplier that balances the pull along the normal.
        let mu = -pull.dot(n) / steepness;
        let second = |x: DVec3| bend(x) + at.hessian * x * mu;
        let (s, t) = n.any_orthonormal_pair();
        let sink = n * (-at.value / steepness);
        let rest = pull + second(sink);
        let step = solve(
            [[second(s).dot(s), second(t).dot(s)], [second(s).dot(t), second(t).dot(t)]],
            [-rest.dot(s), -rest.dot(t)],
        )?;
        let step = s * step[0] + t * step[1] + sink;
        p += step;
        let near = p.distance(start) <= 2.0 * REACH * size;
        if !near {
            return None;
        }
        if step.length() <= CONVERGED * size {
            let n = n * n.dot(outward).signum();
            return smooth.contains(p).then_some(Refined { point: p, normal: n });
        }
    }
    None
}

/// Gradient of |x|.
fn slope(x: DVec3) -> DVec3 {
    x.normalize_or_zero()
}

/// Second derivative of |x|, times `along`.
fn curve(x: DVec3, along: DVec3) -> DVec3 {
    let u = x.normalize_or_zero();
    (along - u * u.dot(along)) / x.length()
}

/// The point of the mesh near an image where the interpolated normal halves the angle.
fn on_mesh(
    surface: &MirrorSurface,
    camera: &Camera,
    image: &Image,
    ends: [DVec3; 2],
) -> Option<Refined> {
    let mut triangle = camera.triangle;
    let mut w = image.weights;
    let mut before = NO_TRIANGLE;
    for _ in 0..=MOST_CROSSINGS {
        w = in_triangle(surface, triangle as usize, w, ends)?;
        let outside = (0..3).filter(|k| w[*k] < -TIE).min_by(|a, b| w[*a].total_cmp(&w[*b]));
        let Some(corner) = outside else {
            let point = surface.point(triangle as usize, w);
            return Some(Refined { point, normal: surface.normal(triangle as usize, w) });
        };
        let (next, weights) = surface.across(triangle as usize, corner, w)?;
        if next == before {
            // The edge between them bends away, and neither has the path: it is on the edge, or on what continues both.
            let point = surface.point(triangle as usize, w);
            let near = w[corner] >= -BEYOND;
            return near.then(|| Refined { point, normal: surface.normal(triangle as usize, w) });
        }
        (before, triangle, w) = (triangle, next, weights);
    }
    None
}

/// Weights, perhaps outside of the triangle, at which its interpolated normal halves the angle.
fn in_triangle(
    surface: &MirrorSurface,
    triangle: usize,
    start: [f64; 3],
    ends: [DVec3; 2],
) -> Option<[f64; 3]> {
    let [v, n] = [surface.corners(triangle), surface.corner_normals(triangle)];
    let mix = |a: [DVec3; 3], w: [f64; 3]| a[0] * w[0] + a[1] * w[1] + a[2] * w[2];
    let mut w = start;
    for _ in 0..MOST_STEPS {
        let (p, normal) = (mix(v, w), mix(n, w));
        let [to_eye, to_point] = ends.map(|end| p - end);
        let half = slope(to_eye) + slope(to_point);
        // normal × half = 0: three equations of rank two, solved by least squares.
        let error = normal.cross(half);
        let column = |k: usize| {
            let along = v[k] - v[0];
            let turn = curve(to_eye, along) + curve(to_point, along);
            (n[k] - n[0]).cross(half) + normal.cross(turn)
        };
        let (a, b) = (column(1), column(2));
        let step =
            solve([[a.dot(a), a.dot(b)], [a.dot(b), b.dot(b)]], [-a.dot(error), -b.dot(error)])?;
        w = [w[0] - step[0] - step[1], w[1] + step[0], w[2] + step[1]];
        if !w.iter().all(|w| w.abs() <= 2.0 * REACH) {
            return None;
        }
        if step[0].abs().max(step[1].abs()) <= CONVERGED {
            return Some(w);
        }
    }
    None
}

/// Solves two linear equations (rows); `None` if they are singular.
fn solve([[a, b], [c, d]]: [[f64; 2]; 2], [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let det = a * d - b * c;
    let solution = [(x * d - b * y) / det, (a * y - x * c) / det];
    solution.iter().all(|s| s.is_finite()).then_some(solution)
}
