//! Error against time.

use catoptric::analysis::methods::{Entry, Measured};

use super::own_ms;
use crate::commands::plots::{Axis, Dot, LinePlot, Series, lines};

/// FLIP over the time of a frame's reflections: a line for each knob of each candidate, named with the knob's values in
/// their order.
fn series(entries: &[Entry]) -> Vec<Series> {
    let mut list = Vec::new();
    let dot = |m: &Measured| own_ms(m).map(|ms| Dot::exact(ms.max(1e-2), m.errors.flip));
    for entry in entries {
        let Ok(drawn) = &entry.result else { continue };
        let label = &entry.candidate.label;
        let mut knobs: Vec<&str> = drawn.settings.iter().map(|s| s.knob).collect();
        knobs.dedup();
        for &knob in &knobs {
            let own = || drawn.settings.iter().filter(move |s| s.knob == knob);
            let values: Vec<&str> = own().map(|s| s.value.as_str()).collect();
            let name = match &values[..] {
                [first, .., last] => format!("{label}, {knob} {first} to {last}"),
                _ => format!("{label}, {knob}"),
            };
            let dots = own().filter_map(|s| dot(&s.measured)).collect();
            list.push(Series { name, dots, joined: true });
        }
        if knobs.is_empty() {
            let dots = dot(&drawn.measured).into_iter().collect();
            list.push(Series { name: label.clone(), dots, joined: false });
        }
    }
    list
}

/// See the module.
pub(super) fn errors(scene: &str, entries: &[Entry]) -> anyhow::Result<String> {
    lines(&LinePlot {
        title: &format!("Error against time, {scene}"),
        x: Axis { label: "reflections of a frame, ms", log: true },
        y: Axis { label: "FLIP", log: false },
        series: &series(entries),
        level: None,
    })
}
