//! Where a camera can see a point more than once.
//!
//! The determinant of (w, λ) ↦ v(w) + λ d(w) is N(λ)·d(w) = Σ w_i g_i(λ) with three quadratics g_i(λ) = N(λ)·d_i. If they
//! share one strict sign at λ, T(λ) meets no other T(λ'): N(λ)·(p_i(λ') - p_i(λ)) = (λ' - λ) g_i(λ), so that all of T(λ')
//! lies on one side of it. A point with a root there has one image. This sharpens section 5.1 of Mei et al., which looks at
//! the sides of the construction rays; its λ intervals are those of [`Jacobian::mixed_intervals`].

use glam::DVec3;

use super::Rays;

/// How a camera's rays run, over a range of λ (Mei et al. section 5.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// The beam only widens: no point has two images.
    Divergent,
    /// The beam narrows somewhere, but nowhere folds over: no point has two images.
    ConvergentThenDivergent,
    /// In an interval of λ the construction rays lie on both sides of T(λ): points there may have several images.
    Mixed,
}

/// The quadratics g_i, which decide on which side of T(λ) each construction ray runs on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jacobian {
    /// The coefficients of g_i, by power of λ.
    pub g: [[f64; 3]; 3],
}

/// Six roots cut a range into seven pieces at most.
const MOST_PIECES: usize = 7;

/// Mixed intervals of less than this share of the range do not make a camera mixed: rays through one point have a double
/// root there, which rounding splits by about the root of the precision.
const TOUCH: f64 = 1e-7;

/// Intervals of λ, rising and disjoint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Intervals {
    list: [[f64; 2]; MOST_PIECES],
    count: usize,
}

impl Intervals {
    /// The intervals, from low to high.
    pub fn as_slice(&self) -> &[[f64; 2]] {
        &self.list[..self.count]
    }

    /// The shortest interval that holds all of them.
    pub fn hull(&self) -> Option<[f64; 2]> {
        let all = self.as_slice();
        Some([all.first()?[0], all.last()?[1]])
    }

    fn push(&mut self, interval: [f64; 2]) {
        self.list[self.count] = interval;
        self.count += 1;
    }
}

impl Jacobian {
    /// Of a camera.
    pub fn of(rays: &Rays) -> Self {
        let ([v1, v2, v3], [d1, d2, d3]) = (rays.origins, rays.directions);
        let (e1, e2, f1, f2) = (v2 - v1, v3 - v1, d2 - d1, d3 - d1);
        let n = [e1.cross(e2), e1.cross(f2) + f1.cross(e2), f1.cross(f2)];
        Self { g: rays.directions.map(|d| n.map(|n| n.dot(d))) }
    }

    /// (g_1, g_2, g_3) at λ; its product with weights is the determinant there.
    pub fn at(&self, lambda: f64) -> DVec3 {
        DVec3::from_array(self.g.map(|c| c[0] + lambda * (c[1] + lambda * c[2])))
    }

    /// The pieces of `lo..=hi` between the roots of the g_i, with signs that do not change within: where they are mixed.
    ///
    /// Outside of them no point has two images. The fold of [`Jacobian::fold`] changes its edges from one piece to the
    /// next.
    pub fn mixed_pieces(&self, lo: f64, hi: f64) -> Intervals {
        let mut cuts = [lo; MOST_PIECES + 1];
        cuts[1] = hi;
        let mut n = 2;
        for root in self.g.into_iter().flat_map(quadratic_roots).flatten() {
            if root > lo && root < hi {
                cuts[n] = root;
                n += 1;
            }
        }
        cuts[..n].sort_by(f64::total_cmp);
        let mut pieces = Intervals::default();
        for pair in cuts[..n].windows(2) {
            let empty = pair[0] == pair[1] && lo < hi;
            if !empty && is_mixed(self.at(0.5 * (pair[0] + pair[1]))) {
                pieces.push([pair[0], pair[1]]);
            }
        }
        pieces
    }

    /// [`Jacobian::mixed_pieces`], joined where they touch: the intervals of Mei et al.'s section 5.1.
    pub fn mixed_intervals(&self, lo: f64, hi: f64) -> Intervals {
        let mut joined = Intervals::default();
        for &[from, to] in self.mixed_pieces(lo, hi).as_slice() {
            match joined.list[..joined.count].last_mut() {
                Some(last) if last[1] == from => last[1] = to,
                _ => joined.push([from, to]),
            }
        }
        joined
    }

    /// The fold on T(λ), where the determinant is 0: the weights of the ends of a segment, `None` if the signs are not
    /// mixed.
    ///
    /// The first end lies on the edge along which, counter-clockwise, g falls below 0, the second on that where it rises;
    /// so each end moves steadily with λ while the signs are mixed. On the edge ij it is at w_i = g_j / (g_j - g_i).
    pub fn fold(&self, lambda: f64) -> Option<[DVec3; 2]> {
        let g = self.at(lambda);
        let end = |edge: [usize; 2]| {
            let mut w = DVec3::ZERO;
            w[edge[0]] = share_of_first(g, edge);
            w[edge[1]] = 1.0 - w[edge[0]];
            w
        };
        Some(self.fold_edges(lambda)?.map(end))
    }

    /// The edges that the fold's ends lie on, as for [`Jacobian::fold`].
    pub(super) fn fold_edges(&self, lambda: f64) -> Option<[[usize; 2]; 2]> {
        let below = self.at(lambda).cmplt(DVec3::ZERO);
        let is = |from: bool, to: bool| {
            let edges = [[0, 1], [1, 2], [2, 0]];
            edges.into_iter().find(|&[i, j]| below.test(i) == from && below.test(j) == to)
        };
        Some([is(false, true)?, is(true, false)?])
    }

    /// The λ at which the ray `w` meets the fold: the roots of Σ w_i g_i, as far as they are real and finite.
    pub fn folds_on_ray(&self, w: DVec3) -> [Option<f64>; 2] {
        quadratic_roots([0, 1, 2].map(|k| DVec3::from_array(self.g.map(|c| c[k])).dot(w)))
    }

    /// How the rays run between `lo` and `hi`.
    ///
    /// A beam narrows where a |g_i| falls: g_i / |d_i| is the cross-section of a thin beam about the ray i.
    pub fn class(&self, lo: f64, hi: f64) -> Class {
        let wide = |&[from, to]: &[f64; 2]| to - from > TOUCH * (hi - lo);
        if self.mixed_intervals(lo, hi).as_slice().iter().any(wide) {
            return Class::Mixed;
        }
        let side = self.at(0.5 * (lo + hi)).x.signum();
        // A slope is linear in λ: it is negative somewhere iff it is so at an end.
        let falls = |c: [f64; 3]| [lo, hi].iter().any(|x| side * (c[1] + 2.0 * x * c[2]) < 0.0);
        if self.g.into_iter().any(falls) {
            Class::ConvergentThenDivergent
        } else {
            Class::Divergent
        }
    }
}

/// The weight of the edge ij's first end where the fold meets it, g being (g_1, g_2, g_3) there; that of an end of the edge if
/// rounding puts it beyond.
pub(super) fn share_of_first(g: DVec3, [i, j]: [usize; 2]) -> f64 {
    let share = g[j] / (g[j] - g[i]);
    if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.5 }
}

fn is_mixed(g: DVec3) -> bool {
    !(g.cmpgt(DVec3::ZERO).all() || g.cmplt(DVec3::ZERO).all())
}

/// The λ range outside of which every point has at most one image in this camera, within `lo..=hi`: the hull of the mixed
/// intervals. `None`: no point has two images.
pub fn mixed_sign_range(rays: &Rays, lo: f64, hi: f64) -> Option<(f64, f64)> {
    Jacobian::of(rays).mixed_pieces(lo, hi).hull().map(|[from, to]| (from, to))
}

fn quadratic_roots([c, b, a]: [f64; 3]) -> [Option<f64>; 2] {
    let disc = b * b - 4.0 * a * c;
    if disc < 0.0 {
        return [None, None];
    }
    let t = -0.5 * (b + disc.sqrt().copysign(b));
    let finite = |x: f64| x.is_finite().then_some(x);
    [finite(t / a), finite(c / t)]
}
