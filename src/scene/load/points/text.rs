//! Points from lines of text.

use super::{Colors, FilePoint, Input, NO_COORDINATE, PointLayout, Source, is_coordinate};
use crate::error::Result;
use crate::scene::load::REPAIR;
use crate::scene::load::ply::{SLOTS, slot};

/// The `v` lines of an OBJ file.
pub(super) struct ObjVertices {
    /// Whether the first one has a colour.
    colored: bool,
}

impl ObjVertices {
    pub(super) fn open(input: &mut Input) -> Result<Self> {
        let lines = input.peek()?;
        let first = lines.iter().find(|line| line.split_ascii_whitespace().next() == Some("v"));
        Ok(Self { colored: first.is_some_and(|line| line.split_ascii_whitespace().count() == 7) })
    }
}

impl Source for ObjVertices {
    fn layout(&self) -> PointLayout {
        PointLayout { colors: self.colored.then_some(Colors::Srgb(1.0)), normals: false }
    }

    fn next(&mut self, input: &mut Input, _index: u64) -> Result<Option<FilePoint>> {
        while input.next_line()? {
            // Names and comments may be in any encoding.
            if input.line.trim_ascii_start().starts_with(b"v") {
                let mut words = input.text()?.split_ascii_whitespace();
                if words.next() == Some("v") {
                    let slots: &[usize] =
                        if self.colored { &[0, 1, 2, 6, 7, 8] } else { &[0, 1, 2] };
                    let values = values(input, words, |column| slots.get(column).copied())?;
                    return Ok(Some(FilePoint::of_slots(&values, self.layout())));
                }
            }
        }
        Ok(None)
    }

    fn place(&self, index: u64) -> String {
        format!("vertex {index}")
    }
}

/// Rows of numbers; the first may name the columns.
pub(super) struct Rows {
    /// Where the number of each column goes, as in a PLY record.
    slots: Vec<Option<usize>>,
    /// What the first row is, while it is still to come.
    first: Option<First>,
    layout: PointLayout,
}

/// What a first row may be.
enum First {
    Numbers,
    Names,
    /// Names, but none that tell where the coordinates are.
    UselessNames,
}

impl Rows {
    /// Looks at the first rows to tell what the columns are.
    pub(super) fn open(input: &mut Input) -> Result<Self> {
        let lines = input.peek()?;
        let mut rows = lines.iter().filter(|line| !is_comment(line)).peekable();
        let mut first = First::Numbers;
        let mut slots = Vec::new();
        if let Some(line) = rows.next_if(|line| words(line).next().is_some_and(is_name)) {
            slots = words(line).map(|word| slot(&word.to_ascii_lowercase())).collect();
            first = First::Names;
            if (0..3).any(|axis| !slots.contains(&Some(axis))) {
                slots.clear();
                if words(line).count() != 3 {
                    first = First::UselessNames;
                }
            }
        }
        if slots.is_empty() {
            let rows: Vec<Vec<f32>> = rows.map(|line| numbers(line)).collect();
            slots = guess(&rows).iter().map(|&slot| Some(slot)).collect();
        }
        let has =
            |range: std::ops::Range<usize>| range.into_iter().all(|i| slots.contains(&Some(i)));
        let colors = match (has(6..9), has(9..10)) {
            (true, _) => Some(Colors::ByLargest),
            (false, true) => Some(Colors::Intensity),
            _ => None,
        };
        let layout = PointLayout { normals: has(3..6), colors };
        Ok(Self { slots, first: Some(first), layout })
    }
}

impl Source for Rows {
    fn layout(&self) -> PointLayout {
        self.layout
    }

    fn next(&mut self, input: &mut Input, _index: u64) -> Result<Option<FilePoint>> {
        while input.next_line()? {
            let text = input.text()?;
            if is_comment(text) {
                continue;
            }
            match self.first.take() {
                Some(First::UselessNames) => {
                    let problem = "names columns, but not x, y and z";
                    let remedy = "name the columns of the coordinates x, y and z";
                    return Err(input.error(input.place(), problem, remedy));
                }
                Some(First::Names) => continue,
                Some(First::Numbers) | None => {}
            }
            let slot = |column| self.slots.get(column).copied().flatten();
            let values = values(input, words(text), slot)?;
            return Ok(Some(FilePoint::of_slots(&values, self.layout)));
        }
        Ok(None)
    }

    fn place(&self, index: u64) -> String {
        format!("row {index}")
    }
}

/// Where the numbers of the columns go, by rows of numbers: see [`super::PointReader`].
fn guess(rows: &[Vec<f32>]) -> &'static [usize] {
    let columns = rows.first().map_or(0, Vec::len);
    if rows.iter().any(|row| row.len() != columns || row.iter().any(|v| v.is_nan())) {
        return &[0, 1, 2];
    }
    let is_normal = |from: usize| {
        rows.iter().all(|row| {
            let sum = row.iter().skip(from).take(3).map(|v| v * v).sum::<f32>();
            (sum.sqrt() - 1.0).abs() < UNIT_TOLERANCE
        })
    };
    match columns {
        4 => &[0, 1, 2, 9],
        6 if is_normal(3) => &[0, 1, 2, 3, 4, 5],
        6 => &[0, 1, 2, 6, 7, 8],
        7 => &[0, 1, 2, 9, 6, 7, 8],
        9 if is_normal(3) => &[0, 1, 2, 3, 4, 5, 6, 7, 8],
        9 if is_normal(6) => &[0, 1, 2, 6, 7, 8, 3, 4, 5],
        _ => &[0, 1, 2],
    }
}

/// Normals written with three digits are as far from unit length.
const UNIT_TOLERANCE: f32 = 2e-3;

fn numbers(line: &str) -> Vec<f32> {
    words(line).map(|word| word.parse().unwrap_or(f32::NAN)).collect()
}

fn is_comment(line: &str) -> bool {
    line.is_empty() || line.starts_with('#') || line.starts_with("//")
}

/// Words between commas, semicolons, or white space.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let mark = [',', ';'].into_iter().find(|mark| text.contains(*mark));
    let at = move |c: char| mark.map_or(c.is_ascii_whitespace(), |mark| c == mark);
    // White space may be of any length.
    text.split(at)
        .map(|word| word.trim().trim_matches('"'))
        .filter(move |word| mark.is_some() || !word.is_empty())
}

fn is_name(word: &str) -> bool {
    word.parse::<f64>().is_err() && word.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// The numbers of the last line, by its words and where the number of each column goes.
fn values<'a>(
    input: &Input,
    words: impl Iterator<Item = &'a str>,
    slot: impl Fn(usize) -> Option<usize>,
) -> Result<[f64; SLOTS]> {
    let mut values = [0.0; SLOTS];
    let mut coordinates = 0;
    for (column, word) in words.enumerate() {
        let Some(slot) = slot(column) else { continue };
        let value: f64 = word.parse().map_err(|_| {
            input.error(input.place(), format!("\"{word}\" is not a number"), REPAIR)
        })?;
        if slot < 3 {
            coordinates += 1;
            if !is_coordinate(value) {
                let problem = format!("\"{word}\" {NO_COORDINATE}");
                return Err(input.error(input.place(), problem, REPAIR));
            }
        }
        values[slot] = value;
    }
    if coordinates < 3 {
        return Err(input.error(input.place(), "has fewer than three numbers", REPAIR));
    }
    Ok(values)
}
