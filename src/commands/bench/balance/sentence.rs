//! Where this machine's optimum is and why, in words that are computed from the sweep.

use catoptric::analysis::balance::{Balance, BalancePoint, nearest_to_share};

use super::super::report::number;

/// What the paper's largest scene says of its own machine: culling and projection, milliseconds, at leaves of 122.
const PAPER: BalancePoint = BalancePoint {
    leaf: 122,
    cull_ms: 304.0,
    project_ms: 346.0,
    total: 650.0,
    valid_share: Some(0.21),
};
/// The valid share of the paper's scenes, nearly.
pub(super) const PAPER_SHARE: f64 = 0.2;

/// The best of all tests on one backend, and why it is there. `points` are of that test.
pub(super) fn optimum(
    place: &str,
    test: &str,
    balance: Balance,
    points: &[BalancePoint],
) -> String {
    let best = &points[balance.least];
    let mut text = format!(
        "On this machine ({place}) the total is least with the test {test} and leaves of {}: {} ms, of which culling takes {} and \
         projection {}.",
        best.leaf,
        number(best.total),
        number(best.cull_ms),
        number(best.project_ms)
    );
    let change = |other: &BalancePoint| {
        let signed = |x: f64| format!("{x:+.3}");
        format!(
            "culling changes by {} ms and projection by {} ms",
            signed(other.cull_ms - best.cull_ms),
            signed(other.project_ms - best.project_ms)
        )
    };
    let before = balance.least.checked_sub(1).and_then(|i| points.get(i));
    let after = points.get(balance.least + 1);
    match (before, after) {
        (Some(small), Some(large)) => {
            let both = |p: &BalancePoint| p.cull_ms + p.project_ms;
            let dearer = both(small) > both(best) && both(large) > both(best);
            text.push_str(&format!(
                " With leaves of {} {}, with leaves of {} {}: {}.",
                small.leaf,
                change(small),
                large.leaf,
                change(large),
                if dearer {
                    "on either side one costs more than the other saves"
                } else {
                    "the two alone would not be least there, so the rest of the layer or noise decides"
                }
            ));
        }
        (None, Some(large)) => text.push_str(&format!(
            " {}: with leaves of {} {}.",
            if best.leaf == 1 {
                "No leaf is smaller: projection is so dear that culling each point by itself pays"
            } else {
                "That is the smallest leaf of the sweep, so the optimum may lie below it"
            },
            large.leaf,
            change(large)
        )),
        (Some(small), None) => text.push_str(&format!(
            " That is the largest leaf of the sweep, so the optimum may lie above it: with leaves of {} {}.",
            small.leaf,
            change(small)
        )),
        (None, None) => {}
    }
    let near = points.iter().min_by_key(|p| p.leaf.abs_diff(PAPER.leaf));
    if let Some(near) = near.filter(|p| p.culling_in_projections().is_finite()) {
        let (here, there) = (near.culling_in_projections(), PAPER.culling_in_projections());
        let verdict = if here < 0.8 * there {
            "cheap culling pays for smaller leaves than there"
        } else if here > 1.25 * there {
            "dear culling asks for larger leaves than there"
        } else {
            "the balance is the paper's"
        };
        text.push_str(&format!(
            " For each leaf's worth of points that is projected, culling costs as much as {} projections here (leaves of {}) and {} \
             on the paper's machine: {verdict}.",
            number(here),
            near.leaf,
            number(there)
        ));
    }
    text
}

/// The setting nearest to the paper's valid share.
pub(super) fn nearest(test: &str, least: f64, points: &[BalancePoint]) -> Option<String> {
    let point = &points[nearest_to_share(points, PAPER_SHARE)?];
    Some(format!(
        "Nearest to the paper's {:.0} % of valid projections are leaves of {} with the test {test}: {:.1} %, at {:.2} times the least \
         total.",
        100.0 * PAPER_SHARE,
        point.leaf,
        100.0 * point.valid_share?,
        point.total / least
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Culling falls and projection grows with the leaf.
    fn sweep(cull: f64) -> Vec<BalancePoint> {
        let point = |i: i32| {
            let leaf = 8 << i;
            let (cull_ms, project_ms) = (cull / f64::from(leaf), 1.0 + 0.01 * f64::from(leaf));
            BalancePoint {
                leaf: u32::try_from(leaf).unwrap(),
                cull_ms,
                project_ms,
                total: cull_ms + project_ms,
                valid_share: Some(1.0 / project_ms),
            }
        };
        (0..10).map(point).collect()
    }

    fn said(cull: f64) -> String {
        let points = sweep(cull);
        optimum("cpu", "slab", Balance::of(&points).unwrap(), &points)
    }

    #[test]
    fn the_sentence_follows_the_data() {
        // Both terms are equal at the root of 100 times the culling of a leaf.
        let text = said(40.0);
        assert!(text.contains("test slab and leaves of 64: 2.27 ms"), "{text}");
        assert!(
            text.contains("leaves of 32 culling changes by +0.625 ms and projection by -0.320 ms")
        );
        assert!(
            text.contains("leaves of 128 culling changes by -0.312 ms and projection by +0.640")
        );
        assert!(text.contains("17.5 projections here (leaves of 128) and 107"), "{text}");
        assert!(text.contains("cheap culling pays for smaller leaves than there"));
        assert!(text.contains("on either side one costs more than the other saves"));
        let mut points = sweep(40.0);
        points[1].total = 0.1;
        let text = optimum("cpu", "slab", Balance::of(&points).unwrap(), &points);
        assert!(text.contains("leaves of 16") && text.contains("or noise decides"), "{text}");
        let text = said(1000.0);
        assert!(text.contains("leaves of 256") && text.contains("dear culling"), "{text}");
        assert!(said(0.1).contains("smallest leaf of the sweep"));
        let mut points = sweep(0.1);
        points[0].leaf = 1;
        let text = optimum("gpu", "slab", Balance::of(&points).unwrap(), &points);
        assert!(text.contains("leaves of 1") && text.contains("No leaf is smaller"), "{text}");
        assert!(said(1e9).contains("largest leaf of the sweep"));
    }

    #[test]
    fn the_papers_share_is_named_with_its_price() {
        let points = sweep(40.0);
        let text = nearest("slab", 2.265, &points).unwrap();
        // 1/6.12 at leaves of 512 is nearer to a fifth than 1/3.56 at 256.
        assert!(text.contains("leaves of 512 with the test slab: 16.3 %, at 2.74 times"), "{text}");
        assert_eq!(nearest("slab", 1.0, &[]), None);
    }
}
