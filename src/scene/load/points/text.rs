//! Points from lines of text.

use glam::DVec3;

use super::{Input, NO_COORDINATE, Source, is_coordinate};
use crate::error::Result;
use crate::scene::load::REPAIR;

/// The `v` lines of an OBJ file.
pub(super) struct ObjVertices;

impl Source for ObjVertices {
    fn next(&mut self, input: &mut Input, _index: u64) -> Result<Option<DVec3>> {
        while input.next_line()? {
            // Names and comments may be in any encoding.
            if input.line.trim_ascii_start().starts_with(b"v") {
                let mut words = input.text()?.split_ascii_whitespace();
                if words.next() == Some("v") {
                    return point(input, [words.next(), words.next(), words.next()]).map(Some);
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
#[derive(Default)]
pub(super) struct Rows {
    /// Of x, y and z, once a row was seen.
    columns: Option<[usize; 3]>,
}

impl Source for Rows {
    fn next(&mut self, input: &mut Input, _index: u64) -> Result<Option<DVec3>> {
        while input.next_line()? {
            let text = input.text()?;
            if text.is_empty() || text.starts_with('#') {
                continue;
            }
            let columns = match self.columns {
                Some(columns) => columns,
                None => {
                    let columns = named_columns(text);
                    self.columns = Some(columns.unwrap_or([0, 1, 2]));
                    if columns.is_some() {
                        continue;
                    }
                    if words(text).next().is_some_and(is_name) {
                        if words(text).count() != 3 {
                            let problem = "names columns, but not x, y and z";
                            let remedy = "name the columns of the coordinates x, y and z";
                            return Err(input.error(input.place(), problem, remedy));
                        }
                        continue;
                    }
                    [0, 1, 2]
                }
            };
            return point(input, columns.map(|c| words(text).nth(c))).map(Some);
        }
        Ok(None)
    }

    fn place(&self, index: u64) -> String {
        format!("row {index}")
    }
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

/// Where x, y and z stand, if a line names them.
fn named_columns(text: &str) -> Option<[usize; 3]> {
    let at = |axis: &str| words(text).position(|word| word.eq_ignore_ascii_case(axis));
    Some([at("x")?, at("y")?, at("z")?])
}

fn point(input: &Input, words: [Option<&str>; 3]) -> Result<DVec3> {
    let mut values = [0.0; 3];
    for (value, word) in values.iter_mut().zip(words) {
        let Some(word) = word else {
            return Err(input.error(input.place(), "has fewer than three numbers", REPAIR));
        };
        *value = word.parse().map_err(|_| {
            input.error(input.place(), format!("\"{word}\" is not a number"), REPAIR)
        })?;
        if !is_coordinate(*value) {
            return Err(input.error(input.place(), format!("\"{word}\" {NO_COORDINATE}"), REPAIR));
        }
    }
    Ok(DVec3::from_array(values))
}
