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
        let least = |m: R::Scalar| self.b2.splat(-m);
        self.found
            & least(margin[0]).le(self.b1())
            & least(margin[1]).le(self.b2)
            & least(margin[2]).le(self.b3)
    }

    /// form_1 + b2 form_2 + b3 form_3: a quantity that is linear over the triangle.
    #[inline(always)]
    pub fn linear(&self, form: [R::Scalar; 3]) -> R {
        self.b2 * form[1] + self.b3 * form[2] + form[0]
    }
}

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

    /// Narrows `lo..hi` to where v1 + `q` can have an image in the grown triangle.
    #[inline(always)]
    pub fn bracket<R: Real<Scalar = T>>(&self, q: [R; 3], lo: R, hi: R) -> (R, R) {
        if self.wide {
            return (lo, hi);
        }
        let along = dot_const(q, self.axis);
        let bound = |i: usize| (along - self.start[i]) * self.per_axis[i];
        let (x, y, z) = (bound(0), bound(1), bound(2));
        // Outward by far more than the rounding of the bounds.
        let slack = (x.abs() + y.abs() + z.abs()) * T::from_f64(1e-5);
        ((x.min(y).min(z) - slack).max(lo), (x.max(y).max(z) + slack).min(hi))
    }

    /// The image at a root λ of the cubic of `q`.
    #[inline(always)]
    pub fn image_at<R: Real<Scalar = T>>(&self, q: [R; 3], lambda: R, found: R::Mask) -> Image<R> {
        let along = |a: [T; 3], b: [T; 3]| {
            [lambda * b[0] + a[0], lambda * b[1] + a[1], lambda * b[2] + a[2]]
        };
        let (e1, e2) = (along(self.e1, self.f1), along(self.e2, self.f2));
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

/// All images of the points v1 + `q` with λ in `lo..=hi` that lie in the camera's grown triangle (others may
/// be reported too): `found(image)` is called once or three times, with λ rising within a lane.
#[inline(always)]
pub fn project<R: Real>(
    camera: &ThreeRay<R::Scalar>,
    q: [R; 3],
    lo: R,
    hi: R,
    mut found: impl FnMut(Image<R>),
) {
    let (lo, hi) = camera.bracket(q, lo, hi);
    let cubic = camera.cubic(q);
    cubic.roots_between(lo, hi, |lambda, lanes| found(camera.image_at(q, lambda, lanes)));
}
