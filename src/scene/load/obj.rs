//! Wavefront OBJ through `tobj`.
//!
//! `tobj` is handed only what a mesh is made of: vertices, normals and faces. Groups and texture coordinates
//! would split vertices, and with them the averaged normals of a mirror; its errors name no line; and where
//! only some vertices have colours it gives them to the wrong ones. So [`Source`] sits in between.

use std::fmt::Write as _;
use std::io::{self, BufRead, Read};
use std::path::Path;

use glam::Vec3;

use super::{GET_IT_AGAIN, REPAIR, REPORT_EVERY, STAGE, defect, linear_from_srgb, no_faces};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::Mesh;
use crate::geometry::mesh::MAX_COORDINATE;

const OPTIONS: tobj::LoadOptions = tobj::LoadOptions {
    single_index: true,
    triangulate: true,
    ignore_points: true,
    ignore_lines: true,
};

/// Reads an OBJ file. Vertex colours are taken as sRGB from 0 to 1, as common modellers write them.
pub(super) fn read(path: &Path, bytes: &[u8], cx: &Context) -> Result<Mesh> {
    let counts = Counts::of(bytes);
    if counts.faces == 0 {
        return Err(no_faces(path));
    }
    let mut source = Source {
        path,
        cx,
        counts,
        rest: bytes,
        total_bytes: bytes.len(),
        line: 0,
        vertices: 0,
        normals: 0,
        tidy: String::new(),
        taken: 0,
        error: None,
    };
    let loaded = tobj::load_obj_buf(&mut source, &OPTIONS, |_| Ok(Default::default()));
    if let Some(error) = source.error {
        return Err(error);
    }
    let place = format!("line {}", source.line);
    let (models, _) = loaded.map_err(|e| Error::file(path, place, e.to_string(), REPAIR))?;
    let mesh = models.into_iter().next().ok_or_else(|| no_faces(path))?.mesh;
    let vectors =
        |list: &[f32]| -> Vec<Vec3> { list.chunks_exact(3).map(Vec3::from_slice).collect() };
    let complete = mesh.normals.len() == mesh.positions.len();
    let normals = if complete { vectors(&mesh.normals) } else { Vec::new() };
    let colors = vectors(&mesh.vertex_color);
    let colors = colors.into_iter().map(|c| c.map(linear_from_srgb)).collect();
    let triangles = mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    Mesh::new(vectors(&mesh.positions), normals, colors, triangles).map_err(|d| defect(path, d))
}

/// What the file holds, counted before it is parsed.
#[derive(Clone, Copy, Default)]
struct Counts {
    vertices: i64,
    normals: i64,
    faces: i64,
    /// Vertices with a colour.
    colored: i64,
}

impl Counts {
    fn of(bytes: &[u8]) -> Self {
        let mut counts = Self::default();
        for line in bytes.split(|&b| b == b'\n') {
            match keyword(line) {
                b"v" => {
                    counts.vertices += 1;
                    let words = code(line).split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
                    counts.colored += i64::from(words.count() == 7);
                }
                b"vn" => counts.normals += 1,
                b"f" => counts.faces += 1,
                _ => {}
            }
        }
        counts
    }
}

/// The first word of a line.
fn keyword(line: &[u8]) -> &[u8] {
    let line = line.trim_ascii_start();
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    &line[..end]
}

/// A line without its comment.
fn code(line: &[u8]) -> &[u8] {
    line.split(|&b| b == b'#').next().unwrap_or_default()
}

/// The checked and tidied lines of an OBJ file, for `tobj` to read.
struct Source<'a> {
    path: &'a Path,
    cx: &'a Context,
    counts: Counts,
    rest: &'a [u8],
    total_bytes: usize,
    /// Number of the last line taken, from 1.
    line: usize,
    /// Vertices and normals so far: what relative indices count back from.
    vertices: i64,
    normals: i64,
    /// The current line as `tobj` shall see it, and how much of it was read.
    tidy: String,
    taken: usize,
    /// Why reading stopped; `tobj` would swallow it.
    error: Option<Error>,
}

impl Source<'_> {
    /// Makes the next line that matters the current one; leaves it empty at the end of the file.
    fn advance(&mut self) -> Result<()> {
        self.tidy.clear();
        self.taken = 0;
        while self.tidy.is_empty() && !self.rest.is_empty() {
            if self.line.is_multiple_of(REPORT_EVERY) {
                let left = self.rest.len() as f64 / self.total_bytes as f64;
                self.cx.step(STAGE, 1.0 - left)?;
            }
            let end = self.rest.iter().position(|&b| b == b'\n').map_or(self.rest.len(), |i| i + 1);
            let (line, rest) = self.rest.split_at(end);
            self.rest = rest;
            self.line += 1;
            if matches!(keyword(line), b"v" | b"vn" | b"f") {
                let checked = match str::from_utf8(code(line)) {
                    Ok(text) => self.tidy_up(text),
                    Err(_) => Err(("is not text".into(), GET_IT_AGAIN)),
                };
                checked.map_err(|(problem, remedy)| {
                    Error::file(self.path, format!("line {}", self.line), problem, remedy)
                })?;
                self.tidy.push('\n');
            }
        }
        Ok(())
    }

    /// Checks a line and rewrites it without what is not needed.
    fn tidy_up(&mut self, line: &str) -> Result<(), (String, &'static str)> {
        let mut words = line.split_ascii_whitespace();
        let key = words.next().unwrap_or_default();
        let count = words.clone().count();
        self.tidy.push_str(key);
        if key == "f" {
            if count < 3 {
                let problem = format!("has a face of {count} vertices, which needs at least 3");
                return Err((problem, GET_IT_AGAIN));
            }
            return words.try_for_each(|word| self.corner(word)).map_err(|p| (p, REPAIR));
        }
        // A vertex may have a weight or a colour; colours are of use if all have them.
        let all_colored = self.counts.colored == self.counts.vertices;
        let keep = match (key, count) {
            ("v", 4) => 4,
            ("v", 6) if all_colored => 6,
            ("v", 3 | 6) | ("vn", 3..) => 3,
            _ => return Err((format!("has {count} numbers after \"{key}\""), GET_IT_AGAIN)),
        };
        for (i, word) in words.enumerate() {
            match word.parse::<f32>() {
                Ok(number) if number.abs() <= MAX_COORDINATE => {}
                // The mesh would name another vertex: `tobj` numbers them in the order of the faces.
                Ok(number) if number.is_finite() => {
                    return Err((format!("{word} is larger than {MAX_COORDINATE:e}"), REPAIR));
                }
                Ok(_) => return Err((format!("\"{word}\" is not a finite number"), REPAIR)),
                Err(_) => return Err((format!("\"{word}\" is not a number"), REPAIR)),
            }
            if i < keep {
                let _ = write!(self.tidy, " {word}");
            }
        }
        *(if key == "v" { &mut self.vertices } else { &mut self.normals }) += 1;
        Ok(())
    }

    /// Checks a corner of a face ("v", "v/vt", "v//vn", "v/vt/vn") and appends it without vt.
    fn corner(&mut self, word: &str) -> Result<(), String> {
        let mut parts = word.split('/');
        let vertex = parts.next().unwrap_or_default();
        let normal = parts.nth(1).unwrap_or_default();
        let c = self.counts;
        for (index, what, so_far, total) in [
            (vertex, "vertex", self.vertices, c.vertices),
            (normal, "normal", self.normals, c.normals),
        ] {
            if what == "normal" && index.is_empty() {
                continue;
            }
            let number: i64 =
                index.parse().map_err(|_| format!("\"{word}\" is not a corner of a face"))?;
            // Indices count from 1, or backwards from the last one so far.
            let absolute = if number < 0 { so_far.saturating_add(number) + 1 } else { number };
            if !(1..=total).contains(&absolute) {
                return Err(format!("names {what} {number}, but there are {total}"));
            }
        }
        let slashes = if normal.is_empty() { "" } else { "//" };
        let _ = write!(self.tidy, " {vertex}{slashes}{normal}");
        Ok(())
    }
}

impl BufRead for Source<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.taken == self.tidy.len()
            && let Err(error) = self.advance()
        {
            self.error = Some(error);
            return Err(io::Error::other("see Source::error"));
        }
        Ok(&self.tidy.as_bytes()[self.taken..])
    }

    fn consume(&mut self, amount: usize) {
        self.taken += amount;
    }
}

impl Read for Source<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(into)?;
        self.consume(count);
        Ok(count)
    }
}
