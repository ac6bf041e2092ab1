//! PLY polygon meshes through `ply-rs-bw`: ASCII and both binary orders.
//!
//! Format: Turk, "The PLY Polygon File Format", 1994. Vertices and faces go element by element into a
//! [`Record`]; other elements and properties are passed over.

use std::path::Path;

use glam::Vec3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
    ScalarType,
};

use super::{GET_IT_AGAIN, REPAIR, REPORT_EVERY, STAGE, defect, linear_from_srgb, no_faces};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::Mesh;

/// Reads a PLY file. Colours of an integer type are sRGB, those of a floating-point type linear.
pub(super) fn read(path: &Path, bytes: &[u8], cx: &Context) -> Result<Mesh> {
    let (header, header_lines, body) = header(path, bytes)?;
    check_counts(path, &header, body)?;
    let file = File { path, cx, encoding: header.encoding, total_bytes: body.len() };
    let mut cursor = Cursor { rest: body, line: header_lines };

    let vertex = header.elements.get("vertex");
    let vertices = vertex.map_or(0, |v| v.count);
    let layout = Layout::of(path, vertex)?;
    let (mut positions, mut normals, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    let mut triangles = Vec::new();
    for element in header.elements.values() {
        file.elements(&mut cursor, element, |index, record| match element.name.as_str() {
            "vertex" => {
                let [position, normal, color] = record.vectors();
                positions.push(position);
                if layout.normals {
                    normals.push(normal);
                }
                if let Some(scale) = layout.color_scale {
                    colors.push(scale.linear(color));
                }
                Ok(())
            }
            "face" => fan(&record.polygon, vertices, &mut triangles)
                .map_err(|p| Error::file(path, format!("face {index}"), p, REPAIR)),
            _ => Ok(()),
        })?;
    }
    if triangles.is_empty() {
        return Err(no_faces(path));
    }
    Mesh::new(positions, normals, colors, triangles).map_err(|d| defect(path, d))
}

/// Whether a file that begins so has vertices and no faces; not if it is none.
pub(super) fn has_no_faces(path: &Path, start: &[u8]) -> bool {
    let Ok((header, ..)) = header(path, start) else { return false };
    let count = |name: &str| header.elements.get(name).map_or(0, |element| element.count);
    count("vertex") > 0 && count("face") == 0
}

/// The header, how many lines it has, and what follows it.
pub(super) fn header<'a>(path: &Path, bytes: &'a [u8]) -> Result<(Header, usize, &'a [u8])> {
    if !bytes.starts_with(b"ply") {
        return Err(Error::file(path, "line 1", "does not say \"ply\"", "give a PLY file"));
    }
    let (mut lines, mut end) = (0, 0);
    let found = bytes.split_inclusive(|&b| b == b'\n').any(|line| {
        lines += 1;
        end += line.len();
        line.trim_ascii() == b"end_header"
    });
    if !found {
        return Err(Error::file(path, "", "has a header without \"end_header\"", GET_IT_AGAIN));
    }
    let (text, body) = bytes.split_at(end);
    // Comments may be in any encoding.
    let text = String::from_utf8_lossy(text);
    let header = Parser::<Record>::new().read_header(&mut Reader::new(text.as_bytes())).map_err(
        |e| match e.line().and_then(|n| Some((n, text.lines().nth(n - 1)?))) {
            Some((n, line)) => {
                let shown: String = line.chars().take(60).collect();
                let problem = format!("\"{shown}\" is not a line of a PLY header");
                Error::file(path, format!("line {n}"), problem, REPAIR)
            }
            None => Error::file(path, "", format!("has a bad header: {}", first_line(&e)), REPAIR),
        },
    )?;
    // The parser keeps the last of several of one name, and would then lose its place in the data.
    let said = |word: &str| text.lines().filter(|l| l.split(' ').next() == Some(word)).count();
    let properties: usize = header.elements.values().map(|e| e.properties.len()).sum();
    if said("element") != header.elements.len() || said("property") != properties {
        let problem = "has a header that gives two elements or properties the same name";
        return Err(Error::file(path, "", problem, REPAIR));
    }
    Ok((header, lines, body))
}

pub(super) fn first_line(error: &impl std::fmt::Display) -> String {
    error.to_string().lines().next().unwrap_or_default().trim_end_matches('.').to_owned()
}

/// Refuses counts that the rest of the file cannot hold.
fn check_counts(path: &Path, header: &Header, body: &[u8]) -> Result<()> {
    let mut least: u128 = 0;
    for element in header.elements.values() {
        let bytes: usize = match header.encoding {
            // A digit and a separator.
            Encoding::Ascii => 2 * element.properties.len(),
            _ => element.properties.values().map(|p| least_bytes(&p.data_type)).sum(),
        };
        least += element.count as u128 * bytes as u128;
        // The last separator of a text may be missing.
        if least > body.len() as u128 + 1 {
            let problem = format!(
                "promises {} elements \"{}\", but only {} bytes follow the header",
                element.count,
                element.name,
                body.len()
            );
            return Err(Error::file(path, "", problem, GET_IT_AGAIN));
        }
    }
    Ok(())
}

/// Bytes of a binary property, at least: a list may be empty.
fn least_bytes(data_type: &PropertyType) -> usize {
    match data_type {
        PropertyType::Scalar(number) | PropertyType::List(number, _) => match number {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        },
    }
}

/// Which optional properties all vertices have.
pub(super) struct Layout {
    pub(super) normals: bool,
    pub(super) color_scale: Option<ColorScale>,
    pub(super) intensity: bool,
}

impl Layout {
    pub(super) fn of(path: &Path, vertex: Option<&ElementDef>) -> Result<Self> {
        let mut types: [Option<&ScalarType>; SLOTS] = [None; SLOTS];
        for property in vertex.iter().flat_map(|v| v.properties.values()) {
            if let (Some(slot), PropertyType::Scalar(number)) =
                (slot(&property.name), &property.data_type)
            {
                types[slot] = Some(number);
            }
        }
        if types[..3].contains(&None) {
            return Err(Error::file(path, "", "has no vertices with x, y and z", REPAIR));
        }
        Ok(Self {
            normals: !types[3..6].contains(&None),
            color_scale: match types[6..9] {
                [Some(red), Some(_), Some(_)] => Some(ColorScale::of(red)),
                _ => None,
            },
            intensity: types[9].is_some(),
        })
    }
}

/// How a stored colour becomes a linear one.
#[derive(Clone, Copy)]
pub(super) enum ColorScale {
    /// Stored as it is.
    Linear,
    /// sRGB with this as white.
    Srgb(f32),
}

impl ColorScale {
    /// By the type of the property. Wide integers hold bytes in practice, but for `ushort`.
    fn of(number: &ScalarType) -> Self {
        match number {
            ScalarType::Float | ScalarType::Double => Self::Linear,
            ScalarType::UShort => Self::Srgb(65535.0),
            _ => Self::Srgb(255.0),
        }
    }

    fn linear(self, color: Vec3) -> Vec3 {
        match self {
            Self::Linear => color,
            Self::Srgb(white) => (color / white).map(linear_from_srgb),
        }
    }
}

/// Any element: the numbers that matter, each in its slot, and a polygon. f64 holds every number of PLY.
#[derive(Default)]
pub(super) struct Record {
    pub(super) values: [f64; SLOTS],
    polygon: Vec<f64>,
}

/// Numbers of a vertex that matter.
pub(super) const SLOTS: usize = 10;

/// Where a vertex property goes: position 0–2, normal 3–5, colour 6–8, intensity 9. The names of columns of text, too.
pub(super) fn slot(name: &str) -> Option<usize> {
    Some(match name {
        "x" => 0,
        "y" => 1,
        "z" => 2,
        "nx" | "normal_x" => 3,
        "ny" | "normal_y" => 4,
        "nz" | "normal_z" => 5,
        "red" | "r" | "diffuse_red" => 6,
        "green" | "g" | "diffuse_green" => 7,
        "blue" | "b" | "diffuse_blue" => 8,
        "intensity" | "scalar_intensity" | "scalar_Intensity" | "reflectance" => 9,
        _ => return None,
    })
}

fn is_polygon(name: &str) -> bool {
    matches!(name, "vertex_indices" | "vertex_index")
}

impl Record {
    fn set(&mut self, name: &str, value: f64) {
        if let Some(slot) = slot(name) {
            self.values[slot] = value;
        }
    }

    /// Position, normal and colour.
    #[expect(clippy::cast_possible_truncation, reason = "what is too large becomes infinite")]
    fn vectors(&self) -> [Vec3; 3] {
        let v = self.values.map(|v| v as f32);
        [0, 3, 6].map(|i| Vec3::from_slice(&v[i..]))
    }
}

impl PropertyAccess for Record {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        fn list<T: Copy + Into<f64>>(values: &[T]) -> Vec<f64> {
            values.iter().map(|&v| v.into()).collect()
        }
        match property {
            Property::Char(v) => self.set(name, v.into()),
            Property::UChar(v) => self.set(name, v.into()),
            Property::Short(v) => self.set(name, v.into()),
            Property::UShort(v) => self.set(name, v.into()),
            Property::Int(v) => self.set(name, v.into()),
            Property::UInt(v) => self.set(name, v.into()),
            Property::Float(v) => self.set(name, v.into()),
            Property::Double(v) => self.set(name, v),
            _ if !is_polygon(name) => return PropertyAccessResult::Ignored,
            Property::ListChar(v) => self.polygon = list(&v),
            Property::ListUChar(v) => self.polygon = list(&v),
            Property::ListShort(v) => self.polygon = list(&v),
            Property::ListUShort(v) => self.polygon = list(&v),
            Property::ListInt(v) => self.polygon = list(&v),
            Property::ListUInt(v) => self.polygon = list(&v),
            Property::ListFloat(v) => self.polygon = list(&v),
            Property::ListDouble(v) => self.polygon = v,
        }
        PropertyAccessResult::Set
    }
}

/// Appends a polygon as a fan of triangles; fewer than three corners are none.
#[expect(clippy::cast_possible_truncation, reason = "checked just before")]
fn fan(polygon: &[f64], vertices: usize, triangles: &mut Vec<[u32; 3]>) -> Result<(), String> {
    let limit = vertices.min(u32::MAX as usize) as f64;
    let good = |&&i: &&f64| i >= 0.0 && i < limit && i.fract() == 0.0;
    if let Some(index) = polygon.iter().find(|i| !good(i)) {
        return Err(format!("names vertex {index}, but there are {vertices} vertices"));
    }
    let corner = |k: usize| polygon[k] as u32;
    triangles.extend((2..polygon.len()).map(|k| [corner(0), corner(k - 1), corner(k)]));
    Ok(())
}

/// How far the data has been read.
struct Cursor<'a> {
    rest: &'a [u8],
    /// Lines taken so far, for text.
    line: usize,
}

/// What is the same for all elements of a file.
struct File<'a> {
    path: &'a Path,
    cx: &'a Context,
    encoding: Encoding,
    total_bytes: usize,
}

impl File<'_> {
    /// Reads all elements of one kind and hands each to `visit` with its index.
    fn elements(
        &self,
        cursor: &mut Cursor,
        element: &ElementDef,
        mut visit: impl FnMut(usize, Record) -> Result<()>,
    ) -> Result<()> {
        // Without properties they take no space, however many there are.
        let count = if element.properties.is_empty() { 0 } else { element.count };
        let parser = Parser::<Record>::new();
        for index in 0..count {
            if index.is_multiple_of(REPORT_EVERY) {
                let left = cursor.rest.len() as f64 / self.total_bytes.max(1) as f64;
                self.cx.step(STAGE, 1.0 - left)?;
            }
            let rest = &mut cursor.rest;
            let record = match self.encoding {
                Encoding::Ascii => self.text_element(cursor, element, index)?,
                Encoding::BinaryLittleEndian => parser
                    .read_little_endian_element(rest, element)
                    .map_err(|e| self.bad_element(element, index, &e))?,
                Encoding::BinaryBigEndian => parser
                    .read_big_endian_element(rest, element)
                    .map_err(|e| self.bad_element(element, index, &e))?,
            };
            visit(index, record)?;
        }
        Ok(())
    }

    /// One line of text. Not `read_ascii_element`, which refuses numbers like `.5`, `1.` and `nan`.
    fn text_element(
        &self,
        cursor: &mut Cursor,
        element: &ElementDef,
        index: usize,
    ) -> Result<Record> {
        let mut line: &[u8] = b"";
        while line.is_empty() {
            if cursor.rest.is_empty() {
                return Err(self.cut_off(element, index));
            }
            let end =
                cursor.rest.iter().position(|&b| b == b'\n').map_or(cursor.rest.len(), |i| i + 1);
            let (first, rest) = cursor.rest.split_at(end);
            line = first.trim_ascii();
            cursor.rest = rest;
            cursor.line += 1;
        }
        text_record(line, element).map_err(|problem| {
            let remedy = if cursor.rest.is_empty() { GET_IT_AGAIN } else { REPAIR };
            Error::file(self.path, format!("line {}", cursor.line), problem, remedy)
        })
    }

    fn bad_element(
        &self,
        element: &ElementDef,
        index: usize,
        error: &ply_rs_bw::parser::ParseError,
    ) -> Error {
        if error.kind() == std::io::ErrorKind::UnexpectedEof {
            return self.cut_off(element, index);
        }
        let place = format!("{} {index}", element.name);
        Error::file(self.path, place, first_line(error), REPAIR)
    }

    fn cut_off(&self, element: &ElementDef, index: usize) -> Error {
        let ElementDef { name, count, .. } = element;
        let problem = format!("the file ends here, but its header promises {count} of them");
        Error::file(self.path, format!("{name} {index}"), problem, GET_IT_AGAIN)
    }
}

/// Reads a line of text as an element.
pub(super) fn text_record(line: &[u8], element: &ElementDef) -> Result<Record, String> {
    let line = str::from_utf8(line).map_err(|_| "is not text")?;
    let mut words = line.split_ascii_whitespace();
    let mut number = || {
        let word = words.next().ok_or("has fewer numbers than the header promises")?;
        word.parse::<f64>().map_err(|_| format!("\"{word}\" is not a number"))
    };
    let mut record = Record::default();
    for (name, property) in &element.properties {
        match property.data_type {
            PropertyType::Scalar(_) => record.set(name, number()?),
            PropertyType::List(..) => {
                let count = number()?;
                if !(count >= 0.0 && count.fract() == 0.0) {
                    return Err(format!("has a list of {count} numbers"));
                }
                // The line ends before an absurd count does.
                let mut taken = 0.0;
                while taken < count {
                    let value = number()?;
                    if is_polygon(name) {
                        record.polygon.push(value);
                    }
                    taken += 1.0;
                }
            }
        }
    }
    Ok(record)
}
