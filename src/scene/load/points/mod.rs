//! Points from files, a part at a time: the file may be larger than the memory.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use super::ply::SLOTS;
use super::{REPAIR, check_readable, extension, unreadable};
use crate::error::{Error, Result};

mod las;
mod npy;
mod ply;
#[cfg(test)]
mod tests;
mod text;

/// Extensions of the files that [`PointReader`] reads, in lower case.
pub const POINT_EXTENSIONS: &[&str] = &["ply", "obj", "xyz", "csv", "txt", "npy", "las", "laz"];

/// Coordinates beyond this cannot be squared and summed safely with f32 meshes.
const MAX_COORDINATE: f64 = 1e15;
/// Headers and lines are shorter, bytes.
const LONGEST: usize = 1 << 16;
/// Bytes asked of the system at once.
const BUFFER: usize = 1 << 18;
/// Lines that are looked at to find out what their columns are, at most.
const PEEKED: usize = 1000;
/// Points that room is made for beforehand, at most.
const ROOM: usize = 1 << 16;

/// Reads points in f64, in the order of the file: the vertices of `.ply` and `.obj`, the rows of `.xyz`, `.csv`, `.txt` (three
/// numbers first, or columns named x, y and z) and `.npy` (floats of shape (n, 3) or wider), the records of `.las` and `.laz`.
///
/// Rows of text without names of columns, by the number of columns in the first of them: 4 are a position and an intensity;
/// 6 a position and a normal, if these all have unit length, else a colour; 7 a position, an intensity and a colour; 9 a
/// position, a normal and a colour in either order. What else there is, is passed over.
pub struct PointReader {
    input: Input,
    source: Box<dyn Source + Send>,
    /// Points so far.
    index: u64,
}

/// A point as a file has it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilePoint {
    /// Finite.
    pub position: DVec3,
    /// Of any length, maybe not finite; zero if the file has none.
    pub normal: Vec3,
    /// Numbers as they are stored, maybe not finite: see [`Colors`]. Zero if the file has none.
    pub color: Vec3,
}

impl FilePoint {
    /// From the numbers of a PLY record.
    #[expect(clippy::cast_possible_truncation, reason = "what is too large becomes infinite")]
    fn of_slots(values: &[f64; SLOTS], layout: PointLayout) -> Self {
        let vector = |from: usize| Vec3::from_array([0, 1, 2].map(|k| values[from + k] as f32));
        let color = match layout.colors {
            Some(Colors::Intensity) => Vec3::splat(values[9] as f32),
            _ => vector(6),
        };
        Self { position: DVec3::from_slice(values), normal: vector(3), color }
    }
}

/// What the points of a file have besides their places.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointLayout {
    /// Whether there are normals.
    pub normals: bool,
    /// What the colours are, if there are any.
    pub colors: Option<Colors>,
}

/// What the numbers of a colour mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Colors {
    /// Linear RGB.
    Linear,
    /// sRGB with this number as white.
    Srgb(f32),
    /// Only the largest number of the whole file tells: up to 1 it is linear RGB, up to 255 sRGB in 8 bits, else in 16.
    ByLargest,
    /// Three times how much light came back to a scanner, in no known unit.
    Intensity,
}

/// Where points stand in a file.
trait Source {
    /// What every point has.
    fn layout(&self) -> PointLayout {
        PointLayout::default()
    }
    /// The next point; `None` at the end.
    fn next(&mut self, input: &mut Input, index: u64) -> Result<Option<FilePoint>>;
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
            Some("las" | "laz") => Box::new(las::Records::open(&mut input)?),
            Some("obj") => Box::new(text::ObjVertices::open(&mut input)?),
            Some("xyz" | "csv" | "txt") => Box::new(text::Rows::open(&mut input)?),
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

    /// What the points have besides their places.
    pub fn layout(&self) -> PointLayout {
        self.source.layout()
    }

    /// The places of the next points, at most so many; none at the end.
    ///
    /// # Errors
    /// See [`PointReader::read_whole`].
    pub fn read(&mut self, most: usize) -> Result<Vec<DVec3>> {
        Ok(self.read_whole(most)?.into_iter().map(|point| point.position).collect())
    }

    /// The next points with all that they have, at most so many; none at the end.
    ///
    /// # Errors
    /// [`Error::Input`] names the first line or element that is no point; it is also an error if there is none at all.
    pub fn read_whole(&mut self, most: usize) -> Result<Vec<FilePoint>> {
        let mut points = Vec::with_capacity(most.min(ROOM));
        while points.len() < most {
            let Some(point) = self.source.next(&mut self.input, self.index)? else { break };
            if !point.position.to_array().into_iter().all(is_coordinate) {
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
    /// The lines that come next, as many as are at hand and whole; they stay to be read.
    fn peek(&mut self) -> Result<Vec<String>> {
        let head = self.file.fill_buf().map_err(|e| unreadable(&self.path, &e))?;
        let mut lines: Vec<&[u8]> = head.split(|&b| b == b'\n').take(PEEKED + 1).collect();
        // The last one may go on, unless this is the whole file.
        if head.len() as u64 != self.total_bytes || lines.len() > PEEKED {
            lines.pop();
        }
        let text =
            |line| String::from_utf8_lossy(line).trim_start_matches('\u{feff}').trim().to_owned();
        Ok(lines.into_iter().map(text).collect())
    }

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
