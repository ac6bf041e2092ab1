//! Bicubic Bézier patches.

use glam::DVec3;

/// A bicubic Bézier patch: control point `[i][j]` belongs to the i-th power of u and the j-th of v.
///
/// After G. Farin, *Curves and Surfaces for CAGD*, chapter on tensor product patches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BicubicPatch(pub [[DVec3; 4]; 4]);

/// A point of a patch and its first derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchPoint {
    /// The surface point.
    pub point: DVec3,
    /// Derivative along u.
    pub du: DVec3,
    /// Derivative along v.
    pub dv: DVec3,
}

/// Cross products shorter than this part of the control net's squared size count as vanished.
const VANISHED: f64 = 1e-10;

impl BicubicPatch {
    /// Point and first derivatives at (u, v) in the unit square. At its border the result depends on the
    /// border's control points alone, bit for bit, so that neighbouring patches do not gape.
    pub fn at(&self, u: f64, v: f64) -> PatchPoint {
        let ([b, db, _], [c, dc, _]) = (bernstein(u), bernstein(v));
        PatchPoint {
            point: self.weighted(b, c),
            du: self.weighted(db, c),
            dv: self.weighted(b, dc),
        }
    }

    /// Unit normal along du × dv at (u, v).
    ///
    /// Where that vanishes (an edge drawn together into a point), its limit on the way to the patch's
    /// middle, by the first derivative of du × dv. `None` where that vanishes, too.
    pub fn normal(&self, u: f64, v: f64) -> Option<DVec3> {
        let ([b, db, ddb], [c, dc, ddc]) = (bernstein(u), bernstein(v));
        let (du, dv) = (self.weighted(db, c), self.weighted(b, dc));
        let size = self.size();
        let unit = |n: DVec3| (n.length() > VANISHED * size * size).then(|| n.try_normalize());
        unit(du.cross(dv)).flatten().or_else(|| {
            let (duu, dvv) = (self.weighted(ddb, c), self.weighted(b, ddc));
            let duv = self.weighted(db, dc);
            let along_u = duu.cross(dv) + du.cross(duv);
            let along_v = duv.cross(dv) + du.cross(dvv);
            unit(along_u * (0.5 - u) + along_v * (0.5 - v)).flatten()
        })
    }

    /// Diagonal of the control net's box.
    fn size(&self) -> f64 {
        let points = self.0.as_flattened();
        let low = points.iter().copied().reduce(DVec3::min).unwrap_or_default();
        let high = points.iter().copied().reduce(DVec3::max).unwrap_or_default();
        (high - low).length()
    }

    fn weighted(&self, along_u: [f64; 4], along_v: [f64; 4]) -> DVec3 {
        let row = |row: &[DVec3; 4]| row.iter().zip(along_v).map(|(&p, w)| p * w).sum::<DVec3>();
        self.0.iter().zip(along_u).map(|(points, w)| row(points) * w).sum()
    }
}

/// The cubic Bernstein polynomials at `t`, their first and their second derivatives.
fn bernstein(t: f64) -> [[f64; 4]; 3] {
    let s = 1.0 - t;
    [
        [s * s * s, 3.0 * t * s * s, 3.0 * t * t * s, t * t * t],
        [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t],
        [6.0 * s, 6.0 * (t - 2.0 * s), 6.0 * (s - 2.0 * t), 6.0 * t],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The graph of z = x² y + 2 x y³ - x over the unit square as a patch.
    fn graph() -> BicubicPatch {
        // Bézier ordinates of 1, t, t², t³.
        let powers = [
            [1.0; 4],
            [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0],
            [0.0, 0.0, 1.0 / 3.0, 1.0],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let third = |i: usize| i as f64 / 3.0;
        BicubicPatch(std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let z =
                    powers[2][i] * powers[1][j] + 2.0 * powers[1][i] * powers[3][j] - powers[1][i];
                DVec3::new(third(i), third(j), z)
            })
        }))
    }

    #[test]
    fn a_cubic_graph_is_reproduced_with_its_derivatives() {
        for (x, y) in [(0.0, 0.0), (1.0, 1.0), (0.3, 0.8), (0.9, 0.1), (0.0, 0.7)] {
            let got = graph().at(x, y);
            let want = DVec3::new(x, y, x * x * y + 2.0 * x * y.powi(3) - x);
            let dx = DVec3::new(1.0, 0.0, 2.0 * x * y + 2.0 * y.powi(3) - 1.0);
            let dy = DVec3::new(0.0, 1.0, x * x + 6.0 * x * y * y);
            assert!(got.point.distance(want) < 1e-14, "{got:?}");
            assert!(got.du.distance(dx) < 1e-13 && got.dv.distance(dy) < 1e-13, "{got:?}");
            let normal = graph().normal(x, y).unwrap();
            assert!(normal.distance(dx.cross(dy) / dx.cross(dy).length()) < 1e-13);
        }
    }

    /// The cap z = 1 - ρ² with the edge u = 0 (or v = 0, u = 1) drawn together at the top.
    fn cap() -> BicubicPatch {
        let quarter = [(1.0, 0.0), (1.0, 0.56), (0.56, 1.0), (0.0, 1.0)];
        let profile = [(0.0, 1.0), (1.0 / 3.0, 1.0), (2.0 / 3.0, 2.0 / 3.0), (1.0, 0.0)];
        BicubicPatch(profile.map(|(r, z)| quarter.map(|(x, y)| DVec3::new(r * x, r * y, z))))
    }

    #[test]
    fn where_an_edge_is_one_point_the_normal_is_the_limit() {
        let transposed =
            BicubicPatch(std::array::from_fn(|i| std::array::from_fn(|j| cap().0[j][i])));
        let mut turned = cap();
        turned.0.reverse();
        for t in [0.0, 0.25, 0.5, 1.0] {
            for (patch, u, v, up) in
                [(cap(), 0.0, t, 1.0), (transposed, t, 0.0, -1.0), (turned, 1.0, t, -1.0)]
            {
                let normal = patch.normal(u, v).unwrap();
                assert!(normal.distance(DVec3::Z * up) < 1e-12, "{u} {v}: {normal}");
                let inward = |x: f64| x + (0.5 - x) * 1e-5;
                let near = patch.normal(inward(u), inward(v)).unwrap();
                assert!(normal.distance(near) < 1e-4, "{normal} {near}");
            }
        }
    }

    #[test]
    fn a_patch_without_area_has_no_normal() {
        let line = BicubicPatch([0.0, 1.0, 2.0, 3.0].map(|x| [DVec3::X * x; 4]));
        assert_eq!(line.normal(0.5, 0.5), None);
        assert_eq!(BicubicPatch([[DVec3::ONE; 4]; 4]).normal(0.0, 0.0), None);
    }
}
