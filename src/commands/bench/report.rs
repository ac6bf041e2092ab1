//! What benches find out, as data: sections of text, tables and plots, which are written as Markdown, HTML and JSON.

mod html;
mod markdown;

use std::path::Path;

use catoptric::Error;
use catoptric::analysis::measure::{Quantity, Ratio};
use catoptric::image::io::write_bytes;
use serde_json::{Value, json};

use super::super::write_json;

pub(super) use markdown::section as to_markdown;

/// What one bench found.
pub(super) struct Section {
    /// One word, as after `bench`.
    pub(super) id: &'static str,
    pub(super) title: String,
    pub(super) blocks: Vec<Block>,
    /// For JSON. Ratios in it (see [`ratio`]) are counted in the report's head.
    pub(super) figures: Value,
}

/// A piece of a section.
pub(super) enum Block {
    /// A paragraph; no markup.
    Text(String),
    Table(Table),
    Plot(Plot),
}

/// Cells are plain text.
pub(super) struct Table {
    pub(super) caption: String,
    pub(super) head: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
}

impl Table {
    pub(super) fn new(caption: impl Into<String>, head: &[&str]) -> Self {
        let head = head.iter().map(|&cell| cell.to_owned()).collect();
        Self { caption: caption.into(), head, rows: Vec::new() }
    }

    /// Panics if it has not a cell for each column.
    pub(super) fn row(&mut self, cells: Vec<String>) {
        assert_eq!(cells.len(), self.head.len(), "{}", self.caption);
        self.rows.push(cells);
    }
}

/// A picture to look at.
pub(super) struct Plot {
    /// Its file's, without extension.
    pub(super) name: String,
    pub(super) caption: String,
    pub(super) image: Image,
}

pub(super) enum Image {
    Svg(String),
    Png(Vec<u8>),
}

impl Plot {
    fn file(&self) -> String {
        let extension = match self.image {
            Image::Svg(_) => "svg",
            Image::Png(_) => "png",
        };
        format!("{}.{extension}", self.name)
    }
}

/// A quantity for JSON; null if nothing was measured.
pub(super) fn quantity(of: Option<Quantity>) -> Value {
    of.map_or(Value::Null, |Quantity { median, q1, q3, n }| {
        json!({ "median": rounded(median), "q1": rounded(q1), "q3": rounded(q3), "n": n })
    })
}

/// A ratio for JSON: as a quantity, with `noisy`.
pub(super) fn ratio(of: Option<Ratio>) -> Value {
    of.map_or(Value::Null, |Ratio { of, noisy }| {
        let mut value = quantity(Some(of));
        value["noisy"] = json!(noisy);
        value
    })
}

/// Five digits: more were not measured.
fn rounded(x: f64) -> Value {
    let text = format!("{x:.4e}");
    text.parse::<f64>().map_or(Value::Null, |x| json!(x))
}

/// A median for people, with about three digits.
pub(super) fn number(x: f64) -> String {
    let digits = match x.abs() {
        a if a >= 100.0 => 0,
        a if a >= 10.0 => 1,
        a if a >= 1.0 => 2,
        _ => 3,
    };
    format!("{x:.digits$}")
}

/// A quantity's median for people.
pub(super) fn median(of: Option<Quantity>) -> String {
    of.map_or("–".to_owned(), |q| number(q.median))
}

/// A ratio for people; `~` says that it is noisy.
pub(super) fn times(of: Option<Ratio>) -> String {
    of.map_or("–".to_owned(), |r| {
        format!("{}{}", number(r.of.median), if r.noisy { " ~" } else { "" })
    })
}

/// All ratios in figures, each with the path that leads to it.
pub(super) fn ratios(figures: &Value) -> Vec<(String, Ratio)> {
    let mut found = Vec::new();
    walk(figures, String::new(), &mut found);
    found
}

fn walk(value: &Value, path: String, found: &mut Vec<(String, Ratio)>) {
    let at = |key: &str| value.get(key).and_then(Value::as_f64);
    let noisy = value.get("noisy").and_then(Value::as_bool);
    if let (Some(noisy), Some(median), Some(q1), Some(q3)) =
        (noisy, at("median"), at("q1"), at("q3"))
    {
        let n = value["n"].as_u64().and_then(|n| usize::try_from(n).ok()).unwrap_or(0);
        found.push((path, Ratio { of: Quantity { median, q1, q3, n }, noisy }));
        return;
    }
    match value {
        Value::Object(map) => {
            map.iter().for_each(|(key, inner)| walk(inner, format!("{path}/{key}"), found));
        }
        Value::Array(list) => {
            list.iter()
                .enumerate()
                .for_each(|(i, inner)| walk(inner, format!("{path}/{i}"), found));
        }
        _ => {}
    }
}

/// How many ratios there are, and how many of them are noisy.
pub(super) fn tally(figures: &Value) -> [usize; 2] {
    let all = ratios(figures);
    [all.len(), all.iter().filter(|(_, ratio)| ratio.noisy).count()]
}

/// A report's head: what was run, where and when.
pub(super) struct Head {
    pub(super) title: String,
    /// Machine, settings, versions.
    pub(super) facts: Vec<(&'static str, String)>,
    pub(super) figures: Value,
}

/// Writes report.html, report.md, report.json and the plots into a folder, which is made if it is not there.
pub(super) fn write(folder: &Path, head: &Head, sections: &[Section]) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::Output {
        name: folder.display().to_string(),
        problem: e.to_string(),
    })?;
    for block in sections.iter().flat_map(|section| &section.blocks) {
        let Block::Plot(plot) = block else { continue };
        let bytes = match &plot.image {
            Image::Svg(text) => text.as_bytes(),
            Image::Png(bytes) => bytes,
        };
        write_bytes(&folder.join(plot.file()), bytes)?;
    }
    write_bytes(&folder.join("report.md"), markdown::report(head, sections).as_bytes())?;
    write_bytes(&folder.join("report.html"), html::report(head, sections).as_bytes())?;
    write_json(Some(&folder.join("report.json")), &figures(head, sections))
}

/// The head's figures with those of each section by its id.
pub(super) fn figures(head: &Head, sections: &[Section]) -> Value {
    let mut value = head.figures.clone();
    for section in sections {
        value[section.id] = section.figures.clone();
    }
    let [all, noisy] = tally(&value);
    value["ratios"] = json!({ "count": all, "noisy_count": noisy });
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn section(spread: f64) -> Section {
        let values = [1.0, 1.0 + spread, 1.0, 1.0 + spread, 1.0 + spread];
        let mut table = Table::new("Times", &["what", "ms"]);
        table.row(vec!["a <b> | c".into(), "1.5".into()]);
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\"><path/></svg>";
        Section {
            id: "tables",
            title: "A & B".into(),
            blocks: vec![
                Block::Text("Less < more.".into()),
                Block::Table(table),
                Block::Plot(Plot {
                    name: "p".into(),
                    caption: "P".into(),
                    image: Image::Svg(svg.into()),
                }),
                Block::Plot(Plot {
                    name: "q".into(),
                    caption: "Q".into(),
                    image: Image::Png(vec![1, 2]),
                }),
            ],
            figures: json!({ "rows": [{ "ratio": ratio(Ratio::of(&values, &[1.0; 5])) }, 3] }),
        }
    }

    #[test]
    fn noisy_ratios_are_found_wherever_they_are() {
        assert_eq!(tally(&section(0.05).figures), [1, 0]);
        assert_eq!(tally(&section(0.5).figures), [1, 1]);
        assert_eq!(ratios(&section(0.5).figures)[0].0, "/rows/0/ratio");
        assert_eq!(times(Ratio::of(&[2.0], &[1.0])), "2.00");
        assert_eq!(times(Ratio::of(&[2.0, 9.0], &[1.0, 1.0])), "2.00 ~");
        assert_eq!(times(None), "–");
    }

    #[test]
    fn a_report_is_one_folder() {
        let folder = tempfile::TempDir::new().unwrap();
        let place = folder.path().join("new");
        let head = Head {
            title: "T".into(),
            facts: vec![("CPU", "x < y".into())],
            figures: json!({ "version": "1" }),
        };
        write(&place, &head, &[section(0.0)]).unwrap();
        let read = |name: &str| std::fs::read_to_string(place.join(name)).unwrap();
        let page = read("report.html");
        assert!(page.contains("a &lt;b&gt; | c") && page.contains("A &amp; B"), "{page}");
        assert!(page.contains("data:image/png;base64,AQI=") && page.contains("<path/>"), "{page}");
        assert!(read("report.md").contains("| a <b> \\| c | 1.5 |"));
        let value: Value = serde_json::from_str(&read("report.json")).unwrap();
        assert_eq!(value["ratios"]["count"], 1);
        assert_eq!(value["tables"]["rows"][1], 3);
        assert_eq!(std::fs::read(place.join("q.png")).unwrap(), [1, 2]);
        assert!(read("p.svg").starts_with("<svg"));
    }
}
