//! The vertices of a PLY file, in any of its three encodings.

use std::io;

use glam::DVec3;
use ply_rs_bw::parser::{ParseError, Parser};
use ply_rs_bw::ply::{ElementDef, Encoding};

use super::{Input, LONGEST, Source};
use crate::error::Result;
use crate::scene::load::ply::{Layout, Record, first_line, header, text_record};
use crate::scene::load::{GET_IT_AGAIN, REPAIR};

pub(super) struct Vertices {
    vertex: ElementDef,
    encoding: Encoding,
    parser: Parser<Record>,
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
        Layout::of(&input.path, header.elements.get("vertex"))?;
        let mut vertices = Self {
            vertex: ElementDef::new("vertex".into()),
            encoding: header.encoding,
            parser: Parser::new(),
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
    fn next(&mut self, input: &mut Input, index: u64) -> Result<Option<DVec3>> {
        if index >= self.vertex.count as u64 {
            return Ok(None);
        }
        let record = read(input, &self.parser, self.encoding, &self.vertex, index)?;
        Ok(Some(record.position()))
    }

    fn place(&self, index: u64) -> String {
        format!("vertex {index}")
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
