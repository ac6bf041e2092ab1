//! Projection: from a point to its images in one camera (Mei et al. section 5.1).

use super::ThreeRay;
use super::solve::Cubic;
use crate::geometry::lanes::{Real, Scalar, cross, dot, dot_const};

/// One image of a point a lane.
#[derive(Clone, Copy, Debug)]
pub struct Image<R: Real> {
    /// Ray parameter: the point is v(w) + λ d(w).
    pub lambda: R,
    /// Weight of the second corner.
    pub b2: R,
    /// Weight of the third corner.
    pub b3: R,
    /// Lanes in which there is an image. The barycentrics may lie outside the triangle.
    pub found: R::Mask,
}

impl<R: Real> Image<R> {
    /// Weight of the first corner.
    #[inline(always)]
    pub fn b1(&self) -> R {
        self.b2.splat(R::Scalar::from_f64(1.0)) - self.b2 - self.b3
    }

    /// Lanes in which all three weights are at least -margin_i.
    #[inline(always)]
    pub fn within(&self, margin: [R::Scalar; 3]) -> R::Mask {
        let [m1, m2, m3] = margin;
        self.found
            & self.b2.splat(-m1).le(self.b1())
            & self.b2.splat(-m2).le(self.b2)
            & self.b2.splat(-m3).le(self.b3)
    }

    /// form_1 + b2 form_2 + b3 form_3: a quantity that is linear over the triangle.
    #[inline(always)]
    pub fn linear(&self, form: [R::Scalar; 3]) -> R {
        self.b2 * form[1] + self.b3 * form[2] + form[0]
    }
}

/// Roundings in the largest terms of F. Those of its constants alone are one each.
pub(crate) const NOISE_ROUNDINGS: f64 = 2.0;

impl<T: Scalar> ThreeRay<T> {
    /// The cubic F(λ) whose roots are the parameters at which T(λ)'s plane contains v1 + `q`.
    #[inline(always)]
    pub fn cubic<R: Real<Scalar = T>>(&self, q: [R; 3]) -> Cubic<R> {
        Cubic {
            c: [
                dot_const(q, self.n0),
                dot_const(q, self.n1) - self.nd[0],
                dot_const(q, self.n2) - self.nd[1],
                q[0].splat(-self.nd[2]),
            ],
        }
    }

    /// How far from zero F(λ) of `q` may turn round and still have a double root, which is on the caustic: what the rounding of
    /// the constants and of its evaluation may add to it, and what lies within the disk, as F is the distance from T(λ)'s plane
    /// times |N(λ)|.
    #[inline(always)]
    fn noise<R: Real<Scalar = T>>(&self, q: [R; 3], lambda: R) -> R {
        let size = |v: [T; 3]| {
            let v = v.map(|x| x.to_f64().abs());
            T::from_f64(v[0] + v[1] + v[2])
        };
        let normal = lambda * (lambda * size(self.n2) + size(self.n1)) + size(self.n0);
        let reach = q[0].abs() + q[1].abs() + q[2].abs() + lambda.abs() * size(self.d1);
        let n = [0, 1, 2].map(|k| lambda * (lambda * self.n2[k] + self.n1[k]) + self.n0[k]);
        normal * reach * T::from_f64(NOISE_ROUNDINGS * T::ROUNDING) + dot(n, n).sqrt() * self.disk
    }

    /// Narrows `lo..hi` to where v1 + `q` can have an image in the grown triangle.
    #[inline(always)]
    pub fn bracket<R: Real<Scalar = T>>(&self, q: [R; 3], lo: R, hi: R) -> (R, R) {
        if self.wide {
            return (lo, hi);
        }
        let along = dot_const(q, self.axis);
        let x = (along - self.start[0]) * self.per_axis[0];
        let y = (along - self.start[1]) * self.per_axis[1];
        let z = (along - self.start[2]) * self.per_axis[2];
        let w = (along - self.start[3]) * self.per_axis[3];
        // Outward by far more than the rounding of the bounds.
        let slack = (x.abs() + y.abs() + z.abs() + w.abs()) * T::from_f64(1e-5);
        let (least, most) = (x.min(y).min(z).min(w), x.max(y).max(z).max(w));
        ((least - slack).max(lo), (most + slack).min(hi))
    }

    /// The image at a root λ of the cubic of `q`.
    #[inline(always)]
    pub fn image_at<R: Real<Scalar = T>>(&self, q: [R; 3], lambda: R, found: R::Mask) -> Image<R> {
        let e1 = along(self.e1, self.f1, lambda);
        let e2 = along(self.e2, self.f2, lambda);
        let x =
            [q[0] - lambda * self.d1[0], q[1] - lambda * self.d1[1], q[2] - lambda * self.d1[2]];
        let n = cross(e1, e2);
        let nn = dot(n, n);
        let zero = lambda.splat(T::from_f64(0.0));
        let one = lambda.splat(T::from_f64(1.0));
        // At a point of the caustic's cusp T(λ) has no area: no image there.
        let solid = zero.lt(nn);
        let inverse = one / R::select(solid, nn, one);
        Image {
            lambda,
            b2: dot(cross(x, e2), n) * inverse,
            b3: dot(cross(e1, x), n) * inverse,
            found: found & solid,
        }
    }
}

/// a + λ b.
#[inline(always)]
pub fn along<R: Real>(a: [R::Scalar; 3], b: [R::Scalar; 3], lambda: R) -> [R; 3] {
    [lambda * b[0] + a[0], lambda * b[1] + a[1], lambda * b[2] + a[2]]
}

/// Up to three images a lane.
#[derive(Clone, Copy)]
pub struct Images<R: Real> {
    image: [Image<R>; 3],
    count: usize,
}

impl<R: Real> Images<R> {
    /// The images, with λ rising within a lane: one or three, of which a lane has those that are `found`.
    #[inline(always)]
    pub fn as_slice(&self) -> &[Image<R>] {
        &self.image[..self.count]
    }
}

/// All images of the points v1 + `q` with λ in `lo..=hi` that lie in the camera's grown triangle (others may
/// be reported too).
#[inline(always)]
pub fn project<R: Real>(camera: &ThreeRay<R::Scalar>, q: [R; 3], lo: R, hi: R) -> Images<R> {
    let (lo, hi) = camera.bracket(q, lo, hi);
    let roots = camera.cubic(q).roots_between(lo, hi, |lambda| camera.noise(q, lambda));
    let (lambda, found) = roots.root[0];
    let mut image = [camera.image_at(q, lambda, found); 3];
    if roots.count > 1 {
        let [_, (second, in_second), (third, in_third)] = roots.root;
        image[1] = camera.image_at(q, second, in_second);
        image[2] = camera.image_at(q, third, in_third);
    }
    Images { image, count: roots.count }
}
