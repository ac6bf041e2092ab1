//! `catoptric bench agree`: whether two runs say the same.

use std::path::{Path, PathBuf};

use catoptric::Error;
use catoptric::analysis::measure::Ratio;
use clap::Args;
use serde_json::{Value, json};

use super::super::{check_json, say, write_json};
use super::report::{number, ratios, tally};

/// See [`super::What::Agree`].
#[derive(Args, Clone, Debug)]
pub(crate) struct AgreeArgs {
    /// The figures of a run (report.json, or what --json wrote)
    #[arg(value_name = "A")]
    a: PathBuf,
    /// Those of another
    #[arg(value_name = "B")]
    b: PathBuf,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Ratios of two runs that lie within these of each other.
const WITHIN: [f64; 2] = [0.1, 0.25];

pub(super) fn run(args: &AgreeArgs) -> anyhow::Result<()> {
    check_json(args.json.as_ref())?;
    let [a, b] = [&args.a, &args.b].map(|path| read(path));
    let (a, b) = (a?, b?);
    let found = compare(&a, &b);
    if found.pairs.is_empty() {
        let remedy = "give two runs of the same bench";
        let name = args.b.display().to_string();
        return Err(Error::input(name, "", "shares no ratio with the other file", remedy).into());
    }
    let shares = WITHIN.map(|limit| found.share(limit));
    say!(
        "{} ratios in both: {:.1} % within 10 %, {:.1} % within 25 %; noisy: {} and {}",
        found.pairs.len(),
        100.0 * shares[0],
        100.0 * shares[1],
        found.noisy[0],
        found.noisy[1]
    );
    for (path, own, other) in found.worst() {
        say!("  {path}: {} and {}", number(own), number(other));
    }
    let value = json!({
        "ratios": found.pairs.len(),
        "within_10_percent": shares[0],
        "within_25_percent": shares[1],
        "noisy": found.noisy,
    });
    write_json(args.json.as_ref(), &value)
}

fn read(path: &Path) -> anyhow::Result<Value> {
    let bytes = std::fs::read(path).map_err(|error| {
        Error::file(path, "", format!("cannot be read: {error}"), "check the name")
    })?;
    serde_json::from_slice(&bytes).map_err(|error| {
        let remedy = "give what bench wrote by --json or -o";
        Error::file(path, "", format!("is not JSON: {error}"), remedy).into()
    })
}

/// The ratios that two runs share.
struct Agreement {
    /// Where, and both medians.
    pairs: Vec<(String, f64, f64)>,
    /// How many in each run are noisy.
    noisy: [usize; 2],
}

fn compare(a: &Value, b: &Value) -> Agreement {
    let others = ratios(b);
    let pair = |(path, own): (String, Ratio)| {
        let (_, other) = others.iter().find(|(place, _)| *place == path)?;
        Some((path, own.of.median, other.of.median))
    };
    let pairs = ratios(a).into_iter().filter_map(pair).collect();
    Agreement { pairs, noisy: [a, b].map(|value| tally(value)[1]) }
}

/// By how much the larger of two exceeds the smaller.
fn apart(a: f64, b: f64) -> f64 {
    a.max(b) / a.min(b) - 1.0
}

impl Agreement {
    fn share(&self, limit: f64) -> f64 {
        let within = self.pairs.iter().filter(|(_, a, b)| apart(*a, *b) <= limit).count();
        within as f64 / self.pairs.len() as f64
    }

    /// Those that are farthest apart, and not within the first limit.
    fn worst(&self) -> Vec<(&str, f64, f64)> {
        let mut list: Vec<(&str, f64, f64)> =
            self.pairs.iter().map(|(path, a, b)| (path.as_str(), *a, *b)).collect();
        list.retain(|(_, a, b)| apart(*a, *b) > WITHIN[0]);
        list.sort_by(|x, y| apart(y.1, y.2).total_cmp(&apart(x.1, x.2)));
        list.truncate(10);
        list
    }
}

#[cfg(test)]
mod tests {
    use super::super::report::ratio;
    use super::*;

    #[test]
    fn ratios_are_paired_by_their_place() {
        let run = |values: &[f64]| {
            let list: Vec<Value> = values
                .iter()
                .map(|&v| json!({ "r": ratio(Ratio::of(&[v, v, v], &[1.0; 3])) }))
                .collect();
            json!({ "rows": list, "ms": 3 })
        };
        let found = compare(&run(&[1.0, 2.0, 3.0, 4.0]), &run(&[1.05, 2.4, 9.0]));
        assert_eq!(found.pairs.len(), 3);
        assert_eq!(
            (found.share(0.1), found.share(0.25), found.noisy),
            (1.0 / 3.0, 2.0 / 3.0, [0, 0])
        );
        assert_eq!(found.worst()[0].0, "/rows/2/r");
        assert_eq!(found.worst().len(), 2);
        assert!((apart(2.0, 1.0) - apart(1.0, 2.0)).abs() < 1e-12, "either order");
    }
}
