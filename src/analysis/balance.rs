//! The balance between culling and projection: what a sweep over leaf sizes says.

/// One leaf size of a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BalancePoint {
    /// Surfels a leaf holds at most.
    pub leaf: u32,
    /// Culling, milliseconds.
    pub cull_ms: f64,
    /// Projection, milliseconds.
    pub project_ms: f64,
    /// The whole layer, in any unit that all points share.
    pub total: f64,
    /// Share of the projected points that have an image, where that was counted.
    pub valid_share: Option<f64>,
}

/// What a sweep says. Indices are into its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance {
    /// The least total.
    pub least: usize,
    /// It is neither the first nor the last.
    pub interior: bool,
    /// The valid share never grows by more than [`SHARE_SLACK`] with the leaf; true where it was not counted.
    pub share_falls: bool,
}

/// A valid share may grow by so much with the leaf without being said to: one point.
pub const SHARE_SLACK: f64 = 0.01;

impl Balance {
    /// Of points in the order of their leaves; `None` if there are none.
    pub fn of(points: &[BalancePoint]) -> Option<Self> {
        let by_total = |&a: &usize, &b: &usize| points[a].total.total_cmp(&points[b].total);
        let least = (0..points.len()).min_by(by_total)?;
        let shares: Vec<f64> = points.iter().filter_map(|p| p.valid_share).collect();
        Some(Self {
            least,
            interior: least > 0 && least + 1 < points.len(),
            share_falls: shares.windows(2).all(|pair| pair[1] <= pair[0] + SHARE_SLACK),
        })
    }
}

/// The point whose valid share is nearest to this one; `None` if none was counted.
pub fn nearest_to_share(points: &[BalancePoint], share: f64) -> Option<usize> {
    let away = |i: usize| points[i].valid_share.map(|own| (own - share).abs());
    let known = (0..points.len()).filter_map(|i| Some((i, away(i)?)));
    known.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
}

impl BalancePoint {
    /// How many projections culling costs for each leaf's worth of points that is projected.
    pub fn culling_in_projections(&self) -> f64 {
        self.cull_ms / self.project_ms * f64::from(self.leaf)
    }
}

/// How y grows with x: the exponent of the power law that fits best (least squares of the logarithms). `None` for fewer
/// than two different x.
pub fn exponent(points: &[[f64; 2]]) -> Option<f64> {
    let logs: Vec<[f64; 2]> = points.iter().map(|p| p.map(f64::ln)).collect();
    let n = logs.len() as f64;
    let mean = |k: usize| logs.iter().map(|p| p[k]).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(1));
    let across: f64 = logs.iter().map(|p| (p[0] - x) * (p[1] - y)).sum();
    let along: f64 = logs.iter().map(|p| (p[0] - x).powi(2)).sum();
    (along > 1e-12).then_some(across / along)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(totals: &[f64], shares: &[f64]) -> Vec<BalancePoint> {
        let point = |(i, (&total, &share)): (u32, (&f64, &f64))| BalancePoint {
            leaf: 8 << i,
            cull_ms: 8.0 / f64::from(i + 1),
            project_ms: f64::from(i + 1),
            total,
            valid_share: Some(share),
        };
        (0..).zip(totals.iter().zip(shares)).map(point).collect()
    }

    #[test]
    fn the_least_total_and_where_it_lies() {
        let shares = [0.6, 0.5, 0.4, 0.2];
        let of = |totals: &[f64]| Balance::of(&sweep(totals, &shares)).unwrap();
        assert_eq!(
            (of(&[4.0, 2.0, 3.0, 9.0]).least, of(&[4.0, 2.0, 3.0, 9.0]).interior),
            (1, true)
        );
        assert!(!of(&[1.0, 2.0, 3.0, 9.0]).interior);
        assert!(!of(&[9.0, 8.0, 7.0, 6.0]).interior);
        assert_eq!(Balance::of(&[]), None);
    }

    #[test]
    fn shares_fall_but_for_a_point() {
        let of = |shares: &[f64]| Balance::of(&sweep(&[1.0; 4], shares)).unwrap().share_falls;
        assert!(of(&[0.6, 0.5, 0.505, 0.2]));
        assert!(!of(&[0.6, 0.5, 0.52, 0.2]));
        let points = sweep(&[1.0; 4], &[0.6, 0.5, 0.3, 0.12]);
        assert_eq!(nearest_to_share(&points, 0.2), Some(3));
        assert_eq!(nearest_to_share(&points, 0.21), Some(2));
    }

    #[test]
    fn exponents_are_those_of_power_laws() {
        let law = |p: f64| [1.0, 2.0, 5.0, 30.0].map(|x: f64| [x, 3.0 * x.powf(p)]);
        for p in [0.0, 0.5, 1.0, 2.0] {
            assert!((exponent(&law(p)).unwrap() - p).abs() < 1e-12);
        }
        assert_eq!(exponent(&[[2.0, 1.0], [2.0, 3.0]]), None);
        // Half of the time is culling where leaves of 122 cost 122 projections.
        let half = BalancePoint {
            leaf: 122,
            cull_ms: 3.0,
            project_ms: 3.0,
            total: 6.0,
            valid_share: None,
        };
        assert_eq!(half.culling_in_projections(), 122.0);
    }
}
