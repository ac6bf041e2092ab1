//! Points from files, a part at a time: the file may be larger than the memory.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::{REPAIR, check_readable, extension, unreadable};
use crate::error::{Error, Result};

mod npy;
mod ply;
#[cfg(test)]
mod tests;
mod text;

/// Extensions of the files that [`PointReader`] reads, in lower case.
pub const POINT_EXTENSIONS: &[&str] = &["ply", "obj", "xyz", "csv", "txt", "npy"];

/// Coordinates beyond this cannot be squared and summed safely with f32 meshes.
const MAX_COORDINATE: f64 = 1e15;
/// Headers and lines are shorter, bytes.
const LONGEST: usize = 1 << 16;
/// Bytes asked of the system at once.
const BUFFER: usize = 1 << 18;
/// Points that room is made for beforehand, at most.
const ROOM: usize = 1 << 16;

/// Reads points in f64, in the order of the file: the vertices of `.ply` and `.obj`, the rows of `.xyz`, `.csv`, `.txt` (three
/// numbers first, or columns named x, y and z) and `.npy` (floats of shape (n, 3) or wider).
pub struct PointReader {
    input: Input,
    source: Box<dyn Source + Send>,
    /// Points so far.
    index: u64,
}

/// Where points stand in a file.
trait Source {
    /// The next point; `None` at the end.
    fn next(&mut self, input: &mut Input, index: u64) -> Result<Option<DVec3>>;
    /// What to call the place of the point that was read last.
    fn place(&self, index: u64) -> String;
}

/// A file that knows how much of it has been read.
struct Input {
    path: PathBuf,
    file: BufReader<File>,
    bytes: u64,
    total_bytes: u64,
    /// Of the last line, with its end.
    line: Vec<u8>,
    /// Lines so far.
    lines: u64,
}

impl PointReader {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// [`Error::Input`]: it cannot be read, or is no file of points.
    pub fn open(path: &Path) -> Result<Self> {
        check_readable(path)?;
        let file = File::open(path).map_err(|e| unreadable(path, &e))?;
        let mut input = Input {
            path: path.to_owned(),
            total_bytes: file.metadata().map_or(0, |data| data.len()),
            file: BufReader::with_capacity(BUFFER, file),
            bytes: 0,
            line: Vec::new(),
            lines: 0,
        };
        let source: Box<dyn Source + Send> = match extension(path).as_deref() {
            Some("ply") => Box::new(ply::Vertices::open(&mut input)?),
            Some("npy") => Box::new(npy::Rows::open(&mut input)?),
            Some("obj") => Box::new(text::ObjVertices),
            Some("xyz" | "csv" | "txt") => Box::new(text::Rows::default()),
            _ => {
                let remedy = format!("convert it: .{} are supported", POINT_EXTENSIONS.join(", ."));
                let problem = "is not of a kind that points are read from";
                return Err(Error::file(path, "", problem, remedy));
            }
        };
        Ok(Self { input, source, index: 0 })
    }

    /// How far the file has been read, 0 to 1.
    pub fn done(&self) -> f64 {
        self.input.bytes as f64 / self.input.total_bytes.max(1) as f64
    }

    /// The next points, at most so many; none at the end.
    ///
    /// # Errors
    /// [`Error::Input`] names the first line or element that is no point; it is also an error if there is none at all.
    pub fn read(&mut self, most: usize) -> Result<Vec<DVec3>> {
        let mut points = Vec::with_capacity(most.min(ROOM));
        while points.len() < most {
            let Some(point) = self.source.next(&mut self.input, self.index)? else { break };
            if !point.to_array().into_iter().all(is_coordinate) {
                let place = self.source.place(self.index);
                return Err(self.input.error(place, NO_COORDINATE, REPAIR));
            }
            self.index += 1;
            points.push(point);
        }
        if self.index == 0 {
            return Err(self.input.error("", "has no points", "give a file with some"));
        }
        Ok(points)
    }
}

const NO_COORDINATE: &str = "is not a finite number, or larger than 1e15";

fn is_coordinate(value: f64) -> bool {
    value.abs() <= MAX_COORDINATE
}

impl Input {
    fn error(&self, place: impl Into<String>, problem: impl Into<String>, remedy: &str) -> Error {
        Error::file(&self.path, place, problem, remedy)
    }

    /// Reads the next line into `line`; `false` at the end of the file.
    fn next_line(&mut self) -> Result<bool> {
        self.line.clear();
        let read = (&mut self.file).take(LONGEST as u64).read_until(b'\n', &mut self.line);
        let count = read.map_err(|e| unreadable(&self.path, &e))?;
        self.bytes += count as u64;
        if count == 0 {
            return Ok(false);
        }
        self.lines += 1;
        if count == LONGEST && self.line.last() != Some(&b'\n') {
            let problem = format!("is longer than {LONGEST} bytes");
            return Err(self.error(self.place(), problem, REPAIR));
        }
        Ok(true)
    }

    /// The last line.
    fn place(&self) -> String {
        format!("line {}", self.lines)
    }

    /// The last line without its end.
    fn text(&self) -> Result<&str> {
        let text = str::from_utf8(&self.line);
        let text = text.map_err(|_| self.error(self.place(), "is not text", REPAIR))?;
        // Some programs begin a text with its byte order.
        Ok(text.trim_start_matches('\u{feff}').trim())
    }
}

impl Read for Input {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(out)?;
        self.bytes += count as u64;
        Ok(count)
    }
}
