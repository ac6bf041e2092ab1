//! Where a camera can see a point more than once (maths: the theorem that sharpens section 5.1 of Mei et al.).

use super::Rays;

/// The λ range outside of which every point has at most one image in this camera: the hull of the intervals
/// in which the quadratics g_i(λ) = N(λ)·d_i do not share one strict sign, within `lo..=hi`.
///
/// `None`: no point has two images.
pub fn mixed_sign_range(rays: &Rays, lo: f64, hi: f64) -> Option<(f64, f64)> {
    let g = quadratics(rays);
    let mut cuts = [lo, hi, lo, lo, lo, lo, lo, lo];
    let mut n = 2;
    for c in g {
        for x in quadratic_roots(c).into_iter().flatten() {
            if x > lo && x < hi {
                cuts[n] = x;
                n += 1;
            }
        }
    }
    let cuts = &mut cuts[..n];
    cuts.sort_by(f64::total_cmp);
    let mixed = |x: f64| {
        let s = g.map(|c| c[0] + x * (c[1] + x * c[2]));
        !(s.iter().all(|&v| v > 0.0) || s.iter().all(|&v| v < 0.0))
    };
    let mut range: Option<(f64, f64)> = None;
    for pair in cuts.windows(2) {
        if mixed(0.5 * (pair[0] + pair[1])) {
            range = Some((range.map_or(pair[0], |r| r.0), pair[1]));
        }
    }
    range
}

/// The coefficients, by power, of g_i(λ) = N(λ)·d_i.
pub fn quadratics(rays: &Rays) -> [[f64; 3]; 3] {
    let ([v1, v2, v3], [d1, d2, d3]) = (rays.origins, rays.directions);
    let (e1, e2, f1, f2) = (v2 - v1, v3 - v1, d2 - d1, d3 - d1);
    let n = [e1.cross(e2), e1.cross(f2) + f1.cross(e2), f1.cross(f2)];
    rays.directions.map(|d| n.map(|n| n.dot(d)))
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
