//! Markdown, for terminals and files.

use std::fmt::Write as _;

use super::{Block, Head, Section, Table};

/// All of a report.
pub(super) fn report(head: &Head, sections: &[Section]) -> String {
    let mut text = format!("# {}\n\n", head.title);
    for (name, value) in &head.facts {
        writeln!(text, "- {name}: {value}").expect("strings grow");
    }
    for part in sections {
        write!(text, "\n{}", section(part, true)).expect("strings grow");
    }
    text
}

/// One section, with or without its plots.
pub(crate) fn section(section: &Section, plots: bool) -> String {
    let mut text = format!("## {}\n", section.title);
    for block in &section.blocks {
        match block {
            Block::Text(words) => write!(text, "\n{words}\n"),
            Block::Table(rows) => write!(text, "\n{}", table(rows)),
            Block::Plot(plot) if plots => {
                write!(text, "\n![{}]({})\n", plot.caption, plot.file())
            }
            Block::Plot(_) => Ok(()),
        }
        .expect("strings grow");
    }
    text
}

fn table(table: &Table) -> String {
    let row = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let mut text =
        if table.caption.is_empty() { String::new() } else { format!("{}\n\n", table.caption) };
    text.push_str(&row(&table.head));
    text.push_str(&format!("|{}\n", "---|".repeat(table.head.len())));
    table.rows.iter().for_each(|cells| text.push_str(&row(cells)));
    text
}
