//! The vertices of a PLY file, in any of its three encodings.

use std::io::{self, Read};

use ply_rs_bw::parser::{ParseError, Parser};
use ply_rs_bw::ply::{ElementDef, Encoding, PropertyType, ScalarType};

use super::{Colors, FilePoint, Input, LONGEST, PointLayout, Source};
use crate::error::Result;
use crate::scene::load::ply::{
    ColorScale, Layout, Record, SLOTS, first_line, header, slot, text_record,
};
use crate::scene::load::{GET_IT_AGAIN, REPAIR};

pub(super) struct Vertices {
    vertex: ElementDef,
    encoding: Encoding,
    parser: Parser<Record>,
    /// For vertices without lists in a binary file.
    rows: Option<FixedRows>,
    layout: PointLayout,
}

impl Vertices {
    /// Reads the header and what stands before the vertices.
    pub(super) fn open(input: &mut Input) -> Result<Self> {
        let mut text = Vec::new();
        while text.len() < LONGEST && input.next_line()? {
            text.extend_from_slice(&input.line);
            if input.line.trim_ascii() == b"end_header" {
                break;
            }
        }
        let (header, ..) = header(&input.path, &text)?;
        let layout = Layout::of(&input.path, header.elements.get("vertex"))?;
        let colors = match layout.color_scale {
            Some(ColorScale::Linear) => Some(Colors::Linear),
            Some(ColorScale::Srgb(white)) => Some(Colors::Srgb(white)),
            None => layout.intensity.then_some(Colors::Intensity),
        };
        let mut vertices = Self {
            vertex: ElementDef::new("vertex".into()),
            encoding: header.encoding,
            parser: Parser::new(),
            rows: None,
            layout: PointLayout { normals: layout.normals, colors },
        };
        // Without properties they take no space, however many there are.
        let count = |e: &ElementDef| if e.properties.is_empty() { 0 } else { e.count as u64 };
        if let Some(e) = header.elements.values().find(|e| count(e) > input.total_bytes) {
            let problem = format!(
                "promises {} elements \"{}\", but has only {} bytes",
                e.count, e.name, input.total_bytes
            );
            return Err(input.error("", problem, GET_IT_AGAIN));
        }
        for element in header.elements.values() {
            if element.name == "vertex" {
                vertices.vertex = element.clone();
                vertices.rows = FixedRows::of(element, header.encoding);
                break;
            }
            for index in 0..count(element) {
                read(input, &vertices.parser, vertices.encoding, element, index)?;
            }
        }
        Ok(vertices)
    }
}

impl Source for Vertices {
    fn layout(&self) -> PointLayout {
        self.layout
    }

    fn next(&mut self, input: &mut Input, index: u64) -> Result<Option<FilePoint>> {
        if index >= self.vertex.count as u64 {
            return Ok(None);
        }
        let values = match &mut self.rows {
            Some(rows) => rows.next(input).map_err(|_| cut_off(input, &self.vertex, index))?,
            None => read(input, &self.parser, self.encoding, &self.vertex, index)?.values,
        };
        Ok(Some(FilePoint::of_slots(&values, self.layout)))
    }

    fn place(&self, index: u64) -> String {
        format!("vertex {index}")
    }
}

/// Binary elements without lists, which all have the same length: ten times as fast as the parser.
struct FixedRows {
    row: Vec<u8>,
    /// Slot, place in the row and type of each number that matters.
    numbers: Vec<(usize, usize, ScalarType)>,
    little: bool,
}

impl FixedRows {
    /// `None` if there are lists or it is text.
    fn of(element: &ElementDef, encoding: Encoding) -> Option<Self> {
        let little = match encoding {
            Encoding::BinaryLittleEndian => true,
            Encoding::BinaryBigEndian => false,
            Encoding::Ascii => return None,
        };
        let (mut numbers, mut length) = (Vec::new(), 0);
        for property in element.properties.values() {
            let PropertyType::Scalar(number) = &property.data_type else { return None };
            numbers.extend(slot(&property.name).map(|slot| (slot, length, number.clone())));
            length += match number {
                ScalarType::Char | ScalarType::UChar => 1,
                ScalarType::Short | ScalarType::UShort => 2,
                ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
                ScalarType::Double => 8,
            };
        }
        Some(Self { row: vec![0; length], numbers, little })
    }

    fn next(&mut self, input: &mut Input) -> io::Result<[f64; SLOTS]> {
        input.read_exact(&mut self.row)?;
        let mut values = [0.0; SLOTS];
        for (slot, at, number) in &self.numbers {
            let little = self.little;
            macro_rules! decode {
                ($t:ty) => {{
                    let mut bytes = [0; size_of::<$t>()];
                    bytes.copy_from_slice(&self.row[*at..at + size_of::<$t>()]);
                    let decode = if little { <$t>::from_le_bytes } else { <$t>::from_be_bytes };
                    f64::from(decode(bytes))
                }};
            }
            values[*slot] = match number {
                ScalarType::Char => decode!(i8),
                ScalarType::UChar => decode!(u8),
                ScalarType::Short => decode!(i16),
                ScalarType::UShort => decode!(u16),
                ScalarType::Int => decode!(i32),
                ScalarType::UInt => decode!(u32),
                ScalarType::Float => decode!(f32),
                ScalarType::Double => decode!(f64),
            };
        }
        Ok(values)
    }
}

fn read(
    input: &mut Input,
    parser: &Parser<Record>,
    encoding: Encoding,
    element: &ElementDef,
    index: u64,
) -> Result<Record> {
    let read = match encoding {
        Encoding::BinaryLittleEndian => parser.read_little_endian_element(input, element),
        Encoding::BinaryBigEndian => parser.read_big_endian_element(input, element),
        Encoding::Ascii => return text_element(input, element, index),
    };
    read.map_err(|e: ParseError| match e.kind() {
        io::ErrorKind::UnexpectedEof => cut_off(input, element, index),
        _ => input.error(format!("{} {index}", element.name), first_line(&e), REPAIR),
    })
}

fn text_element(input: &mut Input, element: &ElementDef, index: u64) -> Result<Record> {
    while input.next_line()? {
        let line = input.line.trim_ascii();
        if !line.is_empty() {
            return text_record(line, element)
                .map_err(|problem| input.error(input.place(), problem, REPAIR));
        }
    }
    Err(cut_off(input, element, index))
}

fn cut_off(input: &Input, element: &ElementDef, index: u64) -> crate::Error {
    let problem = format!("the file ends here, but its header promises {} of them", element.count);
    input.error(format!("{} {index}", element.name), problem, GET_IT_AGAIN)
}
