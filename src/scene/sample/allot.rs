//! How many of the surfels each object gets.

/// No object gets fewer, so that it does not vanish.
const LEAST: usize = 16;

/// Splits `total` surfels over objects by area × density: the largest remainders are rounded up, and no
/// object gets fewer than 16.
///
/// `areas_world` and `densities` are one an object; what is negative or not finite counts as 0, a missing
/// density as 1. The shares sum to `total`, unless 16 an object is already more.
pub fn allot(areas_world: &[f64], densities: &[f64], total: usize) -> Vec<usize> {
    let weight = |i: usize| {
        let weight = areas_world[i] * densities.get(i).unwrap_or(&1.0);
        if weight.is_finite() { weight.max(0.0) } else { 0.0 }
    };
    let weights: Vec<f64> = (0..areas_world.len()).map(weight).collect();
    let mut shares = vec![LEAST; weights.len()];
    // Those whose part of what is left exceeds the least; taking one out lowers the others' part.
    let mut large: Vec<usize> = (0..weights.len()).collect();
    let (left, sum) = loop {
        let left = total.saturating_sub(LEAST * (weights.len() - large.len()));
        let sum: f64 = large.iter().map(|&i| weights[i]).sum();
        let before = large.len();
        large.retain(|&i| weights[i] * left as f64 > LEAST as f64 * sum);
        if large.len() == before {
            break (left, sum);
        }
    };
    let part = |i: usize| weights[i] / sum * left as f64;
    for &i in &large {
        #[expect(clippy::cast_possible_truncation, reason = "rounded down, at most `left`")]
        let whole = part(i) as usize;
        shares[i] = whole;
    }
    let given: usize = large.iter().map(|&i| shares[i]).sum();
    large.sort_by(|&a, &b| part(b).fract().total_cmp(&part(a).fract()).then(a.cmp(&b)));
    for &i in large.iter().take(left.saturating_sub(given)) {
        shares[i] += 1;
    }
    shares
}
