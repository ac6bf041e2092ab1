//! Real roots of a cubic in a bracket, by safeguarded Newton on monotone pieces (no trigonometry, no
//! division by the leading coefficient unless it is there).

use crate::geometry::lanes::{Real, Scalar};

/// c0 + c1 λ + c2 λ² + c3 λ³, one polynomial a lane.
#[derive(Clone, Copy, Debug)]
pub struct Cubic<R> {
    /// Coefficients by power.
    pub c: [R; 4],
}

/// Steps to a root in f32; a smooth piece takes two or three.
#[cfg(feature = "gpu")]
pub(crate) const MAX_STEPS: usize = <f32 as Scalar>::ROOT_STEPS;

impl<R: Real> Cubic<R> {
    /// F(λ).
    #[inline(always)]
    pub fn value(&self, x: R) -> R {
        self.c[0] + x * (self.c[1] + x * (self.c[2] + x * self.c[3]))
    }

    /// F'(λ).
    #[inline(always)]
    pub fn slope(&self, x: R) -> R {
        let three = R::Scalar::from_f64(3.0);
        let two = R::Scalar::from_f64(2.0);
        self.c[1] + x * (self.c[2] * two + x * (self.c[3] * three))
    }

    /// Lanes in which F' changes sign somewhere in `lo..hi` (it may be said of a few others too).
    #[inline(always)]
    pub fn bends(&self, lo: R, hi: R) -> R::Mask {
        let zero = lo.splat(R::Scalar::from_f64(0.0));
        let three = R::Scalar::from_f64(3.0);
        let (s_lo, s_hi) = (self.slope(lo), self.slope(hi));
        let changes = !(zero.lt(s_lo * s_hi));
        let (t_lo, t_hi) = (self.c[2] + lo * self.c[3] * three, self.c[2] + hi * self.c[3] * three);
        // Both critical points inside: F' has its extremum there, beyond zero.
        let inside =
            (t_lo * t_hi).lt(zero) & zero.lt(self.c[2] * self.c[2] - self.c[1] * self.c[3] * three);
        changes | inside
    }

    /// The two critical points, clamped to `lo..hi` and in order; `lo` stands for one that is not there.
    #[inline(always)]
    pub fn critical_points(&self, lo: R, hi: R) -> [R; 2] {
        let zero = lo.splat(R::Scalar::from_f64(0.0));
        let a = self.c[3] * R::Scalar::from_f64(3.0);
        let disc = self.c[2] * self.c[2] - self.c[1] * a;
        let root = disc.max(zero).sqrt();
        let t = R::select(self.c[2].lt(zero), root - self.c[2], -(self.c[2] + root));
        let none = disc.lt(zero);
        let one = lo.splat(R::Scalar::from_f64(1.0));
        let (has_p, has_q) = (zero.lt(a.abs()), zero.lt(t.abs()));
        let p = R::select(has_p & !none, t / R::select(has_p, a, one), lo).max(lo).min(hi);
        let q = self.c[1] / R::select(has_q, t, one);
        let q = R::select(has_q & !none, q, lo).max(lo).min(hi);
        [p.min(q), p.max(q)]
    }

    /// The root in `lo..=hi`, where F must be monotone, and the lanes that have one. A root at `lo` counts
    /// only if `closed`.
    #[inline(always)]
    pub fn monotone_root(&self, lo: R, hi: R, closed: bool) -> (R, R::Mask) {
        let zero = lo.splat(R::Scalar::from_f64(0.0));
        let half = R::Scalar::from_f64(0.5);
        let share = R::Scalar::from_f64(R::Scalar::ROOT_EPSILON);
        let (f_lo, f_hi) = (self.value(lo), self.value(hi));
        let rising = f_lo.lt(zero) & zero.le(f_hi);
        let falling = zero.lt(f_lo) & f_hi.le(zero);
        let mut exists = rising | falling;
        if closed {
            exists = exists | (f_lo.le(zero) & zero.le(f_lo));
        }
        exists = exists & lo.le(hi);
        let (mut a, mut b) = (lo, hi);
        // Start where the chord crosses: second order in the width of the bracket.
        let mut x = lo - f_lo * ((hi - lo) / (f_hi - f_lo));
        x = R::select(lo.le(x) & x.le(hi), x, (lo + hi) * half);
        let mut active = exists;
        for _ in 0..R::Scalar::ROOT_STEPS {
            let f = self.value(x);
            let below = (rising & f.lt(zero)) | (falling & zero.lt(f));
            a = R::select(below, x, a);
            b = R::select(below, b, x);
            let newton = x - f / self.slope(x);
            let next = R::select(a.le(newton) & newton.le(b), newton, (a + b) * half);
            let small = (next - x).abs().le(next.abs() * share);
            // A lane that has ended keeps its bits, whatever its neighbours still do.
            x = R::select(active, next, x);
            active = active & !small;
            if !R::any(active) {
                break;
            }
        }
        (x, exists)
    }

    /// The real roots in `lo..=hi`, in rising order within a lane: one if F is monotone there in all lanes,
    /// else three. A lane has those that its mask says.
    ///
    /// `noise` says what rounding may add to F(λ): where F turns round nearer to zero than that without reaching it, it has a
    /// double root, since the true one may well have two.
    #[inline(always)]
    pub fn roots_between(&self, lo: R, hi: R, noise: impl Fn(R) -> R) -> Roots<R> {
        if !R::any(self.bends(lo, hi)) {
            let root = self.monotone_root(lo, hi, true);
            return Roots { root: [root; 3], count: 1 };
        }
        let [p, q] = self.critical_points(lo, hi);
        let mut root = [
            self.monotone_root(lo, p, true),
            self.monotone_root(p, q, false),
            self.monotone_root(q, hi, false),
        ];
        let zero = lo.splat(R::Scalar::from_f64(0.0));
        for (k, turn) in [p, q].into_iter().enumerate() {
            let inside = lo.lt(turn) & turn.lt(hi) & !root[k + 1].1;
            if R::any(inside) {
                let value = self.value(turn).abs();
                let touches = inside & !root[k].1 & value.le(noise(turn));
                // On zero itself it is the end of one piece, and has to be the beginning of the other.
                let both = touches | (inside & value.le(zero));
                root[k] = (R::select(touches, turn, root[k].0), root[k].1 | touches);
                root[k + 1] = (R::select(both, turn, root[k + 1].0), root[k + 1].1 | both);
            }
        }
        Roots { root, count: 3 }
    }
}

/// Up to three roots a lane.
#[derive(Clone, Copy)]
pub struct Roots<R: Real> {
    /// Roots and the lanes that have them.
    pub root: [(R, R::Mask); 3],
    /// How many of them there can be.
    pub count: usize,
}
