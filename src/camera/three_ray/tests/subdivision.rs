//! The images of a point, found another way: by halving λ under bounds for F and its slope, in f64, with the weights by
//! Cramer's rule. Nothing of the solver is used.

use glam::{DVec2, DVec3};

use crate::camera::three_ray::Rays;

/// |N·d| / (|N| |d|) below which a root counts as double.
pub(crate) const GRAZING: f64 = 1e-6;
/// How near to a bound of w, or (relative to the range) of λ, nothing is decided.
pub(crate) const EDGE: f64 = 1e-9;

/// Where a ray of the camera's plane meets the point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Root {
    pub(crate) lambda: f64,
    pub(crate) w: DVec3,
    /// N·d / (|N| |d|).
    pub(crate) sine: f64,
}

/// All of a point's roots in a range of λ, rising, in the triangle or not.
#[derive(Clone, Debug, Default)]
pub(crate) struct Found {
    pub(crate) roots: Vec<Root>,
    /// No root that may lie in the triangle is double or near a bound.
    pub(crate) decided: bool,
}

impl Found {
    pub(crate) fn images(&self) -> impl Iterator<Item = &Root> {
        self.roots.iter().filter(|root| root.w.min_element() >= 0.0)
    }

    pub(crate) fn count(&self) -> usize {
        self.images().count()
    }
}

struct Search<'a> {
    rays: &'a Rays,
    point: DVec3,
    lo: f64,
    hi: f64,
    found: Found,
}

/// Searches `lo..=hi`.
pub(crate) fn search(rays: &Rays, point: DVec3, lo: f64, hi: f64) -> Found {
    let found = Found { decided: true, ..Found::default() };
    let mut search = Search { rays, point, lo, hi, found };
    let beyond = EDGE * (hi - lo);
    search.halve(lo - beyond, hi + beyond, 0);
    search.found.roots.retain(|root| (lo..=hi).contains(&root.lambda));
    search.found
}

/// Intervals narrower than 2 to this power of the range are given up.
const DEEPEST: u32 = 44;

impl Search<'_> {
    /// T(λ): first corner and edges.
    fn triangle(&self, lambda: f64) -> [DVec3; 3] {
        let [a, b, c] = [0, 1, 2].map(|i| self.rays.origins[i] + self.rays.directions[i] * lambda);
        [a, b - a, c - a]
    }

    /// The volume between T(λ) and the point; 0 if it lies in T(λ)'s plane.
    fn volume(&self, lambda: f64) -> f64 {
        let [a, e1, e2] = self.triangle(lambda);
        e1.cross(e2).dot(self.point - a)
    }

    fn halve(&mut self, a: f64, b: f64, depth: u32) {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let [d1, d2, d3] = self.rays.directions;
        let [p, e1, e2] = self.triangle(middle);
        let (f1, f2, q) = (d2 - d1, d3 - d1, self.point - p);
        // The volume at middle + t, by powers of t.
        let (n0, n1, n2) = (e1.cross(e2), e1.cross(f2) + f1.cross(e2), f1.cross(f2));
        let c = [n0.dot(q), n1.dot(q) - n0.dot(d1), n2.dot(q) - n1.dot(d1), -n2.dot(d1)];
        let rounding = 1e-14 * e1.length() * e2.length() * q.length();
        let reach = ((c[3].abs() * half + c[2].abs()) * half + c[1].abs()) * half;
        if c[0].abs() > reach + rounding {
            return;
        }
        let bend = (3.0 * c[3].abs() * half + 2.0 * c[2].abs()) * half;
        if c[1].abs() > bend * (1.0 + 1e-12) {
            // Steep: one root or none.
            if (self.volume(a) < 0.0) != (self.volume(b) < 0.0) {
                let lambda = self.bisect(a, b);
                self.add(lambda);
            }
        } else if depth == DEEPEST {
            let w = self.weights(middle);
            if w.min_element() > -1e-3 || !w.is_finite() {
                self.found.decided = false;
            }
        } else {
            self.halve(a, middle, depth + 1);
            self.halve(middle, b, depth + 1);
        }
    }

    fn bisect(&self, mut a: f64, mut b: f64) -> f64 {
        let below = self.volume(a) < 0.0;
        loop {
            let middle = 0.5 * (a + b);
            if !(a < middle && middle < b) {
                return middle;
            }
            if (self.volume(middle) < 0.0) == below { a = middle } else { b = middle }
        }
    }

    fn weights(&self, lambda: f64) -> DVec3 {
        let [p, e1, e2] = self.triangle(lambda);
        // Seen along the axis that the triangle faces most.
        let size = e1.cross(e2).abs();
        let flat = |v: DVec3| match size.max_element() {
            m if m == size.x => DVec2::new(v.y, v.z),
            m if m == size.y => DVec2::new(v.z, v.x),
            _ => DVec2::new(v.x, v.y),
        };
        let (e1, e2, x) = (flat(e1), flat(e2), flat(self.point - p));
        let area = e1.perp_dot(e2);
        let (b2, b3) = (x.perp_dot(e2) / area, e1.perp_dot(x) / area);
        DVec3::new(1.0 - b2 - b3, b2, b3)
    }

    fn add(&mut self, lambda: f64) {
        let w = self.weights(lambda);
        let [_, e1, e2] = self.triangle(lambda);
        let (n, d) = (e1.cross(e2), self.rays.at(w).1);
        let sine = n.dot(d) / (n.length() * d.length());
        let beyond = EDGE * (self.hi - self.lo);
        let at_bound = (lambda - self.lo).abs() <= beyond || (lambda - self.hi).abs() <= beyond;
        let at_edge = w.abs().min_element() <= EDGE;
        // What is not a number is not decided.
        let (outside, steep) = (w.min_element() < -EDGE, sine.abs() >= GRAZING);
        if !outside && (at_bound || at_edge || !steep) {
            self.found.decided = false;
        }
        self.found.roots.push(Root { lambda, w, sine });
    }
}
