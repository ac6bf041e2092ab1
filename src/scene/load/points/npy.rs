//! The rows of an array of NumPy, through `npyz`.

use std::io::{self, Read};

use glam::DVec3;
use npyz::{Deserialize, NpyHeader, Order, TypeRead};

use super::{FilePoint, Input, LONGEST, Source};
use crate::error::Result;
use crate::scene::load::GET_IT_AGAIN;

pub(super) struct Rows {
    rows: u64,
    columns: u64,
    decode: Decode,
}

/// How a number stands in the file, in either byte order.
enum Decode {
    Single(<f32 as Deserialize>::TypeReader),
    Double(<f64 as Deserialize>::TypeReader),
}

/// A row has no more numbers.
const MOST_COLUMNS: u64 = 1024;

/// Brackets within each other in the header of an array: the dictionary and the shape, and the list of a record. The time of the
/// crate's parser doubles with each.
const DEEPEST: usize = 4;

/// How deep brackets lie in each other, at most.
fn nested(text: &[u8]) -> usize {
    let (mut depth, mut deepest) = (0usize, 0);
    for byte in text {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(depth);
    }
    deepest
}

impl Rows {
    pub(super) fn open(input: &mut Input) -> Result<Self> {
        let text = header_bytes(input)?;
        if nested(&text) > DEEPEST {
            let problem = "has a header with too many brackets within each other";
            return Err(input.error("", problem, GET_IT_AGAIN));
        }
        let header = NpyHeader::from_reader(&text[..])
            .map_err(|e| input.error("", format!("has a bad header: {e}"), GET_IT_AGAIN))?;
        let remedy = "save an array of floats of shape (n, 3), in C order";
        let [rows, columns @ 3..=MOST_COLUMNS] = header.shape()[..] else {
            let problem = format!("has shape {:?}", header.shape());
            return Err(input.error("", problem, remedy));
        };
        if header.order() != Order::C {
            return Err(input.error("", "is in Fortran order", remedy));
        }
        let dtype = header.dtype();
        let (decode, size) = if let Ok(double) = f64::reader(&dtype) {
            (Decode::Double(double), 8)
        } else if let Ok(single) = f32::reader(&dtype) {
            (Decode::Single(single), 4)
        } else {
            let problem = format!("has elements {}", dtype.descr());
            return Err(input.error("", problem, remedy));
        };
        let promised = u128::from(rows) * u128::from(columns) * size;
        let held = u128::from(input.total_bytes.saturating_sub(input.bytes));
        if promised > held {
            let problem = format!("promises {promised} bytes of numbers, but has only {held}");
            return Err(input.error("", problem, GET_IT_AGAIN));
        }
        Ok(Self { rows, columns, decode })
    }
}

impl Source for Rows {
    fn next(&mut self, input: &mut Input, index: u64) -> Result<Option<FilePoint>> {
        if index >= self.rows {
            return Ok(None);
        }
        let mut point = DVec3::ZERO;
        for k in 0..self.columns {
            let value = match &self.decode {
                Decode::Single(single) => single.read_one(&mut *input).map(f64::from),
                Decode::Double(double) => double.read_one(&mut *input),
            };
            let value = value
                .map_err(|_| input.error(self.place(index), "the file ends here", GET_IT_AGAIN))?;
            match k {
                0 => point.x = value,
                1 => point.y = value,
                2 => point.z = value,
                _ => {}
            }
        }
        Ok(Some(FilePoint { position: point, ..Default::default() }))
    }

    fn place(&self, index: u64) -> String {
        format!("row {index}")
    }
}

/// The header's own bytes: what it says of its length is checked before there is room for it.
fn header_bytes(input: &mut Input) -> Result<Vec<u8>> {
    let mut text = vec![0; 10];
    read_exact(input, &mut text)?;
    if !text.starts_with(b"\x93NUMPY") {
        return Err(input.error(
            "",
            "is no array of NumPy",
            "give a file that numpy.save has written",
        ));
    }
    let two = |bytes: &[u8]| usize::from(u16::from_le_bytes([bytes[0], bytes[1]]));
    let mut length = two(&text[8..]);
    // Two bytes say it in version 1, four later.
    if text[6] > 1 {
        text.resize(12, 0);
        read_exact(input, &mut text[10..])?;
        length |= two(&text[10..]) << 16;
    }
    if length > LONGEST {
        return Err(input.error("", format!("has a header of {length} bytes"), GET_IT_AGAIN));
    }
    let start = text.len();
    text.resize(start + length, 0);
    read_exact(input, &mut text[start..])?;
    Ok(text)
}

fn read_exact(input: &mut Input, bytes: &mut [u8]) -> Result<()> {
    let read: io::Result<()> = input.read_exact(bytes);
    read.map_err(|_| input.error("", "ends within its header", GET_IT_AGAIN))
}
