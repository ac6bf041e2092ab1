//! Paths, or counts of images, as rows of a file: comma-separated text, a structured array of NumPy, or a PLY point
//! cloud.
//!
//! Rows are made in parallel and written in turn. How many there are is known at the end only: then the header is
//! written once more, as long as it was.

use std::io::{self, Seek, SeekFrom, Write};

use glam::DVec3;
use npyz::{DType, Field, WriteOptions, WriterBuilder};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, PropertyDef, PropertyType, ScalarType, Version,
};
use ply_rs_bw::writer::Writer as PlyWriter;
use rayon::prelude::*;

use super::{ImageCount, Occluder, Path, PathSet, Refinement};

/// A format of [`TableWriter`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableFormat {
    /// Text: a line of names, then a line a row.
    Csv,
    /// A one-dimensional structured array of NumPy, little endian, unaligned.
    Npy,
    /// PLY, binary little endian: a vertex a row.
    Ply,
}

impl TableFormat {
    /// By extension, in any case: csv, npy or ply.
    pub fn of(path: &std::path::Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "csv" => Some(Self::Csv),
            "npy" => Some(Self::Npy),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }
}

/// What a table has rows of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableRows {
    /// Paths: [`PATH_COLUMNS`].
    Paths,
    /// Points: [`COUNT_COLUMNS`].
    Counts,
}

/// A column: name and type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Column {
    /// As in CSV and NumPy.
    pub name: &'static str,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Int8,
    UInt8,
    UInt32,
    Float64,
}

/// A value of a column.
#[derive(Clone, Copy, Debug)]
enum Value {
    Int8(i8),
    UInt8(u8),
    UInt32(u32),
    Float64(f64),
}

const fn column(name: &'static str, kind: Kind) -> Column {
    Column { name, kind }
}

/// Columns of paths. Positions are in world space; in PLY the ghost is x, y, z.
pub const PATH_COLUMNS: [Column; 29] = [
    column("ghost_x", Kind::Float64),
    column("ghost_y", Kind::Float64),
    column("ghost_z", Kind::Float64),
    column("point", Kind::UInt32),
    column("mirror", Kind::UInt32),
    column("triangle", Kind::UInt32),
    column("w1", Kind::Float64),
    column("w2", Kind::Float64),
    column("w3", Kind::Float64),
    column("mirror_x", Kind::Float64),
    column("mirror_y", Kind::Float64),
    column("mirror_z", Kind::Float64),
    column("lambda", Kind::Float64),
    column("length", Kind::Float64),
    column("to_mirror_x", Kind::Float64),
    column("to_mirror_y", Kind::Float64),
    column("to_mirror_z", Kind::Float64),
    column("to_point_x", Kind::Float64),
    column("to_point_y", Kind::Float64),
    column("to_point_z", Kind::Float64),
    column("det_j", Kind::Float64),
    column("caustic_sine", Kind::Float64),
    column("miss", Kind::Float64),
    column("parity", Kind::Int8),
    column("near_caustic", Kind::UInt8),
    column("eye_leg", Kind::UInt8),
    column("point_leg", Kind::UInt8),
    column("occluded", Kind::UInt8),
    column("refinement", Kind::UInt8),
];

/// Columns of counts. In PLY the point is x, y, z.
pub const COUNT_COLUMNS: [Column; 5] = [
    column("point_x", Kind::Float64),
    column("point_y", Kind::Float64),
    column("point_z", Kind::Float64),
    column("images", Kind::UInt32),
    column("near_caustic", Kind::UInt8),
];

fn path_row(index: u32, point: DVec3, eye: DVec3, path: &Path) -> [Value; PATH_COLUMNS.len()] {
    use Value::{Float64 as F, Int8, UInt8, UInt32};
    let (ghost, p) = (path.ghost(eye), path.mirror_point);
    let [to_mirror, to_point] = path.directions(eye, point);
    let [w1, w2, w3] = path.weights;
    let leg = |occluder: Occluder| {
        UInt8(match occluder {
            Occluder::None => 0,
            Occluder::Mirror => 1,
            Occluder::Object => 2,
        })
    };
    let refinement = match path.refinement {
        Refinement::Camera => 0,
        Refinement::Surface => 1,
        Refinement::Failed => 2,
    };
    [
        F(ghost.x),
        F(ghost.y),
        F(ghost.z),
        UInt32(index),
        UInt32(path.mirror),
        UInt32(path.triangle),
        F(w1),
        F(w2),
        F(w3),
        F(p.x),
        F(p.y),
        F(p.z),
        F(path.lambda),
        F(path.length),
        F(to_mirror.x),
        F(to_mirror.y),
        F(to_mirror.z),
        F(to_point.x),
        F(to_point.y),
        F(to_point.z),
        F(path.det_j),
        F(path.caustic_sine),
        F(path.miss),
        Int8(path.parity()),
        UInt8(path.near_caustic().into()),
        leg(path.eye_leg),
        leg(path.point_leg),
        UInt8(path.is_occluded().into()),
        UInt8(refinement),
    ]
}

fn count_row(point: DVec3, count: ImageCount) -> [Value; COUNT_COLUMNS.len()] {
    use Value::{Float64 as F, UInt8, UInt32};
    [F(point.x), F(point.y), F(point.z), UInt32(count.images), UInt8(count.near_caustic.into())]
}

/// Writes rows as they come. Nothing is complete before [`TableWriter::finish`].
pub struct TableWriter<W> {
    out: W,
    format: TableFormat,
    columns: &'static [Column],
    /// Bytes of the header.
    header: usize,
    rows: u64,
}

/// Points whose rows are made by one thread at a time.
const BLOCK: usize = 512;
/// Blocks made before they are written.
const BLOCKS: usize = 16;

impl<W: Write + Seek> TableWriter<W> {
    /// Begins a table.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn new(mut out: W, format: TableFormat, rows: TableRows) -> io::Result<Self> {
        let columns = match rows {
            TableRows::Paths => &PATH_COLUMNS[..],
            TableRows::Counts => &COUNT_COLUMNS[..],
        };
        let header = header(format, columns, u64::MAX)?;
        out.write_all(&header)?;
        Ok(Self { out, format, columns, header: header.len(), rows: 0 })
    }

    /// Appends the paths from `eye` to `points` (world space), of which the first has the index `first`.
    ///
    /// # Errors
    /// Those of `out`.
    ///
    /// # Panics
    /// If `paths` are those of another number of points, or the index of a point needs more than 32 bits.
    pub fn paths(
        &mut self,
        eye: DVec3,
        first: u64,
        points: &[DVec3],
        paths: &PathSet,
    ) -> io::Result<()> {
        assert_eq!(points.len(), paths.points(), "paths of these points");
        self.blocks(points.len(), |i, row| {
            let index = u32::try_from(first + i as u64).expect("point indices have 32 bits");
            for path in paths.of(i) {
                row(&path_row(index, points[i], eye, path));
            }
        })
    }

    /// Appends the counts of `points` (world space).
    ///
    /// # Errors
    /// Those of `out`.
    pub fn counts(&mut self, points: &[DVec3], counts: &[ImageCount]) -> io::Result<()> {
        self.blocks(points.len(), |i, row| row(&count_row(points[i], counts[i])))
    }

    /// Makes the rows of points 0 to `points`; `make` hands each row of a point to its second argument.
    fn blocks(
        &mut self,
        points: usize,
        make: impl Fn(usize, &mut dyn FnMut(&[Value])) + Sync,
    ) -> io::Result<()> {
        let text = self.format == TableFormat::Csv;
        let starts: Vec<usize> = (0..points).step_by(BLOCK).collect();
        for starts in starts.chunks(BLOCKS) {
            let blocks: Vec<(Vec<u8>, u64)> = starts
                .par_iter()
                .map(|start| {
                    let (mut bytes, mut rows) = (Vec::new(), 0);
                    let mut add = |row: &[Value]| {
                        rows += 1;
                        if text { as_text(row, &mut bytes) } else { as_bytes(row, &mut bytes) }
                    };
                    for i in *start..(start + BLOCK).min(points) {
                        make(i, &mut add);
                    }
                    (bytes, rows)
                })
                .collect();
            for (bytes, rows) in blocks {
                self.out.write_all(&bytes)?;
                self.rows += rows;
            }
        }
        Ok(())
    }

    /// Completes the table and gives back what it was written to.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn finish(mut self) -> io::Result<W> {
        let mut header = header(self.format, self.columns, self.rows)?;
        if header.len() < self.header {
            lengthen(self.format, &mut header, self.header);
        }
        self.out.seek(SeekFrom::Start(0))?;
        self.out.write_all(&header)?;
        self.out.flush()?;
        Ok(self.out)
    }

    /// Rows so far.
    pub fn rows(&self) -> u64 {
        self.rows
    }
}

fn as_text(row: &[Value], out: &mut Vec<u8>) {
    for (i, value) in row.iter().enumerate() {
        if i > 0 {
            out.push(b',');
        }
        // A vector takes all that is written.
        let _ = match value {
            Value::Int8(v) => write!(out, "{v}"),
            Value::UInt8(v) => write!(out, "{v}"),
            Value::UInt32(v) => write!(out, "{v}"),
            Value::Float64(v) => write!(out, "{v}"),
        };
    }
    out.push(b'\n');
}

fn as_bytes(row: &[Value], out: &mut Vec<u8>) {
    for value in row {
        match value {
            Value::Int8(v) => out.extend(v.to_le_bytes()),
            Value::UInt8(v) => out.push(*v),
            Value::UInt32(v) => out.extend(v.to_le_bytes()),
            Value::Float64(v) => out.extend(v.to_le_bytes()),
        }
    }
}

/// The header of a table of so many rows.
fn header(format: TableFormat, columns: &[Column], rows: u64) -> io::Result<Vec<u8>> {
    match format {
        TableFormat::Csv => {
            let names: Vec<&str> = columns.iter().map(|c| c.name).collect();
            Ok(format!("{}\n", names.join(",")).into_bytes())
        }
        TableFormat::Npy => {
            let field = |c: &Column| {
                let scalar = match c.kind {
                    Kind::Int8 => "|i1",
                    Kind::UInt8 => "|u1",
                    Kind::UInt32 => "<u4",
                    Kind::Float64 => "<f8",
                };
                let scalar = scalar.parse().expect("a type of NumPy");
                Field { name: c.name.into(), dtype: DType::new_scalar(scalar) }
            };
            let dtype = DType::Record(columns.iter().map(field).collect());
            let options = WriteOptions::new_header_only().dtype(dtype).shape(&[rows]);
            options.writer(Vec::new()).write_header_only()
        }
        TableFormat::Ply => ply_header(columns, rows),
    }
}

fn ply_header(columns: &[Column], rows: u64) -> io::Result<Vec<u8>> {
    let mut vertex = ElementDef::new("vertex".into());
    vertex.count = usize::try_from(rows).unwrap_or(usize::MAX);
    for (column, axis) in
        columns.iter().zip(["x", "y", "z"].map(Some).into_iter().chain([None; 64]))
    {
        let scalar = match column.kind {
            Kind::Int8 => ScalarType::Char,
            Kind::UInt8 => ScalarType::UChar,
            Kind::UInt32 => ScalarType::UInt,
            Kind::Float64 => ScalarType::Double,
        };
        let name = axis.unwrap_or(column.name).to_owned();
        vertex
            .properties
            .insert(name.clone(), PropertyDef::new(name, PropertyType::Scalar(scalar)));
    }
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.version = Version { major: 1, minor: 0 };
    header.elements.insert("vertex".into(), vertex);
    let mut bytes = Vec::new();
    PlyWriter::<ply_rs_bw::ply::DefaultElement>::new().write_header(&mut bytes, &header)?;
    Ok(bytes)
}

/// Fills a header up to `length` without a change of meaning.
fn lengthen(format: TableFormat, header: &mut Vec<u8>, length: usize) {
    let missing = length - header.len();
    match format {
        TableFormat::Csv => {}
        TableFormat::Npy => {
            // Spaces before the end of the line, which the length in bytes 8 and 9 counts (version 1).
            let end = header.len() - 1;
            header.splice(end..end, std::iter::repeat_n(b' ', missing));
            let text = u16::try_from(length - 10).expect("short headers have version 1");
            header[8..10].copy_from_slice(&text.to_le_bytes());
        }
        TableFormat::Ply => {
            // The number of elements is less than it could be by some digits, which zeros replace.
            let start = header.windows(15).position(|w| w == b"element vertex ").unwrap_or(0) + 15;
            header.splice(start..start, std::iter::repeat_n(b'0', missing));
        }
    }
}
