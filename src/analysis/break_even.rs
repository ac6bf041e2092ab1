//! Where two sides take the same time: a crossing of a power law with 1.

use super::balance::exponent;

/// Where the ratio of two times is 1, if it follows a power of x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BreakEven {
    /// There.
    pub x: f64,
    /// The ratio grows with this power of x.
    pub exponent: f64,
    /// Ratios on both sides of 1 were measured, and `x` lies between the x that were: else it is a guess.
    pub measured: bool,
}

impl BreakEven {
    /// Of pairs of x and ratio, all positive; `None` if the ratio does not depend on x (its exponent is smaller than
    /// [`LEAST_EXPONENT`]).
    pub fn of(points: &[[f64; 2]]) -> Option<Self> {
        let power = exponent(points)?;
        if power.abs() < LEAST_EXPONENT {
            return None;
        }
        let n = points.len() as f64;
        let mean = |k: usize| points.iter().map(|p| p[k].ln()).sum::<f64>() / n;
        let x = (mean(0) - mean(1) / power).exp();
        let ends = |k: usize| {
            let ends = (f64::INFINITY, 0.0_f64);
            points.iter().fold(ends, |(low, high), p| (low.min(p[k]), high.max(p[k])))
        };
        let ((from, to), (least, most)) = (ends(0), ends(1));
        let measured = (from..=to).contains(&x) && least <= 1.0 && most >= 1.0;
        Some(Self { x, exponent: power, measured })
    }
}

/// A ratio that grows by less than a tenth over three decades has no break-even worth the name.
pub const LEAST_EXPONENT: f64 = 0.0138;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_laws_cross_where_they_must() {
        let law = |p: f64, xs: &[f64]| -> Vec<[f64; 2]> {
            xs.iter().map(|&x| [x, (x / 50.0).powf(p)]).collect()
        };
        let near = |found: Option<BreakEven>, measured: bool| {
            let found = found.unwrap();
            (found.x - 50.0).abs() < 1e-9 && found.measured == measured
        };
        assert!(near(BreakEven::of(&law(-0.5, &[2.0, 10.0, 400.0])), true));
        assert!(near(BreakEven::of(&law(0.7, &[2.0, 10.0, 400.0])), true));
        assert!(near(BreakEven::of(&law(-0.5, &[2.0, 10.0, 40.0])), false), "all above 1");
        assert_eq!(BreakEven::of(&law(0.01, &[2.0, 10.0, 400.0])), None);
        assert_eq!(BreakEven::of(&[[1.0, 2.0]]), None);
    }
}
