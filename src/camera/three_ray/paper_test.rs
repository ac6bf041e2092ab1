//! The box test as the paper states it (Mei et al. section 5.2), for comparison: it misses boxes that lie
//! wholly inside a wall's curve or straddle the camera's base.

use super::volume::Boxes;
use crate::geometry::lanes::{Real, Scalar};

/// Lanes whose box meets the volume by the two conditions: it may be inside (its middle is on the inner side of
/// the three walls) or a wall's curve in one of its face planes crosses that face's frame.
#[inline(always)]
pub(super) fn meets<R: Real>(
    v: &[[R::Scalar; 3]; 3],
    d: &[[R::Scalar; 3]; 3],
    boxes: &Boxes<R>,
    lo: R,
    hi: R,
) -> (R, R, R::Mask) {
    let number = |x: f64| lo.splat(R::Scalar::from_f64(x));
    let (zero, one, far) = (number(0.0), number(1.0), number(1e30));
    let corner = [0, 1, 2].map(|k| boxes.center[k] - boxes.half[k]);
    let mut alive = corner_has_image::<R>(v, d, corner);
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        for k in 0..3 {
            let others = [(k + 1) % 3, (k + 2) % 3];
            for face in [boxes.center[k] - boxes.half[k], boxes.center[k] + boxes.half[k]] {
                // λ(α) = top/bottom puts the wall's point into the face's plane.
                let (v_k, e_k) = (v[i][k], v[j][k] - v[i][k]);
                let (d_k, f_k) = (d[i][k], d[j][k] - d[i][k]);
                for (a, other) in [(others[0], others[1]), (others[1], others[0])] {
                    let (v_a, e_a) = (v[i][a], v[j][a] - v[i][a]);
                    let (d_a, f_a) = (d[i][a], d[j][a] - d[i][a]);
                    for frame in [boxes.center[a] - boxes.half[a], boxes.center[a] + boxes.half[a]]
                    {
                        // (frame - v_a - α e_a)(d_k + α f_k) = (face - v_k - α e_k)(d_a + α f_a)
                        let (p, q) = (frame - v_a, face - v_k);
                        let c0 = p * d_k - q * d_a;
                        let c1 = p * f_k - q * f_a - zero.splat(e_a * d_k - e_k * d_a);
                        let c2 = zero.splat(e_k * f_a - e_a * f_k);
                        for alpha in quadratic(c0, c1, c2, far) {
                            let bottom = alpha * f_k + d_k;
                            let usable = zero.lt(bottom.abs());
                            let lambda =
                                (face - alpha * e_k - v_k) / R::select(usable, bottom, one);
                            let (v_o, e_o) = (v[i][other], v[j][other] - v[i][other]);
                            let (d_o, f_o) = (d[i][other], d[j][other] - d[i][other]);
                            let x = alpha * e_o + v_o + lambda * (alpha * f_o + d_o);
                            let inside = (x - boxes.center[other]).abs().le(boxes.half[other]);
                            alive = alive
                                | (usable
                                    & zero.le(alpha)
                                    & alpha.le(one)
                                    & lo.le(lambda)
                                    & lambda.le(hi)
                                    & inside);
                        }
                    }
                }
            }
        }
    }
    (lo, hi, alive)
}

/// Lanes where v1 + `q` has an image inside the triangle.
#[inline(always)]
fn corner_has_image<R: Real>(
    v: &[[R::Scalar; 3]; 3],
    d: &[[R::Scalar; 3]; 3],
    q: [R; 3],
) -> R::Mask {
    let zero = q[0].splat(R::Scalar::from_f64(0.0));
    let far = q[0].splat(R::Scalar::from_f64(1e6));
    let exact = |a: &[R::Scalar; 3]| glam::DVec3::from_array(a.map(Scalar::to_f64));
    let rays = super::Rays {
        origins: [exact(&v[0]), exact(&v[1]), exact(&v[2])],
        directions: [exact(&d[0]), exact(&d[1]), exact(&d[2])],
    };
    let camera = super::ThreeRay::<R::Scalar>::new(&rays, &rays);
    let mut inside = far.lt(zero);
    let none = R::Scalar::from_f64(0.0);
    for image in super::project(&camera, q, zero, far).as_slice() {
        inside = inside | image.within([none; 3]);
    }
    inside
}

#[inline(always)]
fn quadratic<R: Real>(c0: R, c1: R, c2: R, none: R) -> [R; 2] {
    let zero = c0.splat(R::Scalar::from_f64(0.0));
    let one = c0.splat(R::Scalar::from_f64(1.0));
    let four = R::Scalar::from_f64(4.0);
    let disc = c1 * c1 - c0 * c2 * four;
    let root = disc.max(zero).sqrt();
    let t = R::select(c1.lt(zero), root - c1, -(c1 + root)) * R::Scalar::from_f64(0.5);
    let real = zero.le(disc);
    let divide = |a: R, b: R| {
        let usable = zero.lt(b.abs()) & real;
        R::select(usable, a / R::select(usable, b, one), none)
    };
    [divide(t, c2), divide(c0, t)]
}
