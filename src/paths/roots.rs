//! All λ at which a point has an image in one camera, in f64, with double roots counted once.

use crate::camera::three_ray::ThreeRay;
use crate::camera::three_ray::solve::Cubic;

/// Up to three roots, rising.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Roots {
    lambda: [f64; 6],
    count: usize,
}

impl Roots {
    pub(super) fn as_slice(&self) -> &[f64] {
        &self.lambda[..self.count]
    }

    fn push(&mut self, lambda: f64) {
        self.lambda[self.count] = lambda;
        self.count += 1;
    }
}

/// Where |F| is below so many roundings of its largest terms its sign says nothing. Coefficients and value take
/// some twenty operations.
const NOISE: f64 = 32.0 * f64::EPSILON;

/// The roots λ > 0 of the cubic of v1 + `q` that may belong to images in the camera's triangle. Two roots that rounding
/// cannot tell apart (a point on the fold, or at its cusp) are one.
pub(super) fn roots(camera: &ThreeRay<f64>, q: [f64; 3]) -> Roots {
    let cubic = camera.cubic(q);
    let (lo, hi) = camera.bracket(q, 0.0, f64::INFINITY);
    let mut found = Roots::default();
    let noise = Noise::new(camera, q);
    if hi < f64::INFINITY {
        roots_between(&cubic, lo, hi, |x| noise.at(x), |x| found.push(x));
        return found;
    }
    // The rays open too wide for a bound: up to λ = 1, and from there on by μ = 1/λ.
    let reversed = Cubic { c: [cubic.c[3], cubic.c[2], cubic.c[1], cubic.c[0]] };
    roots_between(&cubic, lo, 1.0, |x| noise.at(x), |x| found.push(x));
    let mut far = Roots::default();
    let far_noise = |mu: f64| noise.reversed_at(mu);
    roots_between(&reversed, 0.0, 1.0, far_noise, |mu| far.push(1.0 / mu));
    for &lambda in far.as_slice().iter().rev() {
        if lambda > 1.0 && lambda < f64::INFINITY {
            found.push(lambda);
        }
    }
    found
}

/// Size of F's terms at λ.
struct Noise {
    n: [f64; 3],
    q: f64,
    d: f64,
}

impl Noise {
    fn new(camera: &ThreeRay<f64>, q: [f64; 3]) -> Self {
        let length = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        let n = [camera.n0, camera.n1, camera.n2].map(length);
        // The point itself was rounded, and so was the corner, relative to the scene's origin.
        Self { n, q: length(q) + length(camera.v1), d: length(camera.d1) }
    }

    fn at(&self, lambda: f64) -> f64 {
        let n = self.n[0] + lambda * (self.n[1] + lambda * self.n[2]);
        NOISE * n * (self.q + lambda * self.d)
    }

    /// For μ³ F(1/μ).
    fn reversed_at(&self, mu: f64) -> f64 {
        let n = self.n[2] + mu * (self.n[1] + mu * self.n[0]);
        NOISE * n * (self.d + mu * self.q)
    }
}

/// The roots in `lo..=hi`, rising.
fn roots_between(
    cubic: &Cubic<f64>,
    lo: f64,
    hi: f64,
    noise: impl Fn(f64) -> f64,
    mut push: impl FnMut(f64),
) {
    let piece = |from: f64, to: f64, closed: bool, push: &mut dyn FnMut(f64)| {
        let (root, exists) = cubic.monotone_root(from, to, closed);
        if exists {
            push(root);
        }
    };
    if !cubic.bends(lo, hi) {
        piece(lo, hi, true, &mut push);
        return;
    }
    let [p, q] = cubic.critical_points(lo, hi);
    let double = |x: f64| lo < x && x < hi && cubic.value(x).abs() <= noise(x);
    match (double(p), double(q)) {
        // No other root: F is monotone beside them.
        (true, true) => push(0.5 * (p + q)),
        (true, false) => {
            push(p);
            piece(q, hi, false, &mut push);
        }
        (false, true) => {
            piece(lo, p, true, &mut push);
            push(q);
        }
        (false, false) => {
            piece(lo, p, true, &mut push);
            piece(p, q, false, &mut push);
            piece(q, hi, false, &mut push);
        }
    }
}
