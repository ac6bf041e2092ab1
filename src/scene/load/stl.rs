//! STL, ASCII and binary, through `stl_io`.
//!
//! Its reader takes every file that begins with "solid " for text, as many binary ones do, and every other text for binary;
//! and it ends at the first of several solids. So it is told what it has, and is given one solid.

use std::io::Cursor;
use std::path::Path;

use glam::Vec3;

use super::{GET_IT_AGAIN, REPAIR, REPORT_EVERY, STAGE, defect};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::Mesh;

/// Bytes before a binary file's triangles, and of each.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Reads an STL file. Corners at one place become one vertex; facets' normals are left, and vertices get the average of
/// theirs: facets say nothing of the smooth surface that they stand for.
pub(super) fn read(path: &Path, bytes: &[u8], cx: &Context) -> Result<Mesh> {
    let told = if is_binary(bytes) { binary(path, bytes)? } else { text(path, bytes)? };
    let total = told.len() as f64;
    let mut source = Cursor::new(told);
    let damaged = |place: String, error: &std::io::Error| {
        let cut = error.kind() == std::io::ErrorKind::UnexpectedEof;
        let (problem, remedy) = if cut {
            ("the file ends within it".to_owned(), GET_IT_AGAIN)
        } else {
            (error.to_string(), REPAIR)
        };
        Error::file(path, place, problem, remedy)
    };
    let facets =
        stl_io::create_stl_reader(&mut source).map_err(|e| damaged("header".into(), &e))?;
    let mut names = std::collections::HashMap::new();
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for (i, facet) in facets.enumerate() {
        if i % REPORT_EVERY == 0 {
            cx.step(STAGE, ((i * TRIANGLE) as f64 / total).min(1.0))?;
        }
        let facet = facet.map_err(|e| damaged(format!("facet {i}"), &e))?;
        let mut corners = [0; 3];
        for (corner, vertex) in corners.iter_mut().zip(facet.vertices) {
            // No file holds more corners than there are indices: a facet has 50 bytes, and the file was read.
            let next = u32::try_from(positions.len())
                .map_err(|_| Error::file(path, "", "has too many vertices", "divide it"))?;
            // Zero has two signs.
            let place = vertex.0.map(|v| (v + 0.0).to_bits());
            *corner = *names.entry(place).or_insert(next);
            if *corner == next {
                positions.push(Vec3::from_array(vertex.0));
            }
        }
        triangles.push(corners);
    }
    if triangles.is_empty() {
        return Err(super::no_faces(path));
    }
    Mesh::new(positions, vec![], vec![], triangles).map_err(|d| defect(path, d))
}

/// Whether the file is as long as a binary one with its number of triangles, or no text begins it.
fn is_binary(bytes: &[u8]) -> bool {
    let count = bytes.get(80..HEADER).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let long = |count: u32| HEADER as u64 + TRIANGLE as u64 * u64::from(count);
    count.is_some_and(|count| long(count) == bytes.len() as u64) || !begins(bytes, "solid")
}

fn begins(line: &[u8], word: &str) -> bool {
    line.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word.as_bytes()))
}

/// A binary file that cannot be taken for a text.
fn binary(path: &Path, bytes: &[u8]) -> Result<Vec<u8>> {
    let Some(count) = bytes.get(80..HEADER).and_then(|b| b.try_into().ok()) else {
        return Err(Error::file(path, "", "is neither a binary nor a text STL file", GET_IT_AGAIN));
    };
    let count = u32::from_le_bytes(count) as usize;
    let held = (bytes.len() - HEADER) / TRIANGLE;
    if count > held {
        let problem = format!("promises {count} facets, but holds {held}");
        return Err(Error::file(path, "", problem, GET_IT_AGAIN));
    }
    let mut told = bytes.to_vec();
    told[0] = b' ';
    Ok(told)
}

/// The facets of all solids of a text, as one.
fn text(path: &Path, bytes: &[u8]) -> Result<Vec<u8>> {
    let mut told = b"solid \n".to_vec();
    let mut open = false;
    for line in bytes.split(|&b| b == b'\n') {
        let line = line.trim_ascii();
        if begins(line, "endsolid") {
            open = false;
        } else if begins(line, "solid") {
            open = true;
        } else if begins(line, "facet") {
            // Normals are left out anyway, and those of slivers are no numbers in many files.
            told.extend_from_slice(b"facet normal 0 0 0\n");
        } else {
            told.extend_from_slice(&line.to_ascii_lowercase());
            told.push(b'\n');
        }
    }
    if open {
        return Err(Error::file(path, "", "ends before \"endsolid\"", GET_IT_AGAIN));
    }
    told.extend_from_slice(b"endsolid\n");
    Ok(told)
}
