//! `catoptric bench all`: every bench in one report, which is written anew after each.

use std::path::{Path, PathBuf};

use catoptric::{Context, Error};

use super::super::{check_folder, say, write_json};
use super::report::{self, Section, tally};
use super::run::{Bench, RunArgs, begin, head, watched};
use super::{balance, crossover, growth, layer, methods, tables};

/// A bench, its name, and about how much of the time it takes.
type Part = (&'static str, f64, fn(Bench<'_>) -> anyhow::Result<Section>);

const PARTS: [Part; 6] = [
    ("layer", 0.08, layer::section),
    ("tables", 0.08, tables::section),
    ("balance", 0.30, balance::section),
    ("growth", 0.22, growth::section),
    ("crossover", 0.22, crossover::section),
    ("methods", 0.10, methods::section),
];

/// What is left where `bench all` was cancelled.
#[derive(Debug)]
pub(crate) struct Kept {
    folder: PathBuf,
    done: usize,
}

impl std::fmt::Display for Kept {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let report = self.folder.join("report.html");
        write!(f, "cancelled: {} has {} of {} sections", report.display(), self.done, PARTS.len())
    }
}

pub(super) fn run(args: &RunArgs, cx: &Context) -> anyhow::Result<()> {
    let folder = args.output.clone().unwrap_or_else(|| "catoptric-bench".into());
    check_folder(&folder)?;
    begin(args, cx)?;
    let bench = Bench::new(args, cx);
    let (mut sections, mut from) = (Vec::new(), 0.0);
    for (name, share, section) in PARTS {
        let part = bench.part(from, from + share);
        from += share;
        let made = part.step(0.0).map_err(Into::into).and_then(|()| watched(|| section(part)));
        match made {
            Ok(section) => sections.push(section),
            Err(error) if sections.is_empty() => return Err(error),
            Err(error) if matches!(error.downcast_ref(), Some(Error::Cancelled)) => {
                return Err(error.context(Kept { folder, done: sections.len() }));
            }
            Err(error) => return Err(error.context(format!("bench {name}"))),
        }
        write(args, &folder, &sections)?;
    }
    for section in &sections {
        let [all, noisy] = tally(&section.figures);
        say!("{}: {} ({all} ratios, {noisy} noisy)", section.id, section.title);
    }
    say!("The report is {}", folder.join("report.html").display());
    Ok(())
}

fn write(args: &RunArgs, folder: &Path, sections: &[Section]) -> anyhow::Result<()> {
    let mut head = head(args, "Catoptric: where each side wins");
    if sections.len() < PARTS.len() {
        head.facts.push(("Sections", format!("{} of {}", sections.len(), PARTS.len())));
    }
    head.figures["sections"] = sections.iter().map(|section| section.id).collect();
    report::write(folder, &head, sections)?;
    write_json(args.json.as_ref(), &report::figures(&head, sections))
}
