//! Meshes from files: one file a format.
//!
//! A reader is given the whole file as bytes and returns a checked [`Mesh`], or an error that names the file
//! and the place in it. No reader allocates by a number that it finds in a file.

use std::fs;
use std::path::Path;

pub use environment::environment;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::{Mesh, MeshDefect};

mod environment;
mod obj;
mod ply;
pub mod points;

/// Extensions of the formats that [`mesh`] reads, in lower case.
pub const EXTENSIONS: &[&str] = &["obj", "ply"];

/// The stage that is reported while a file is read.
const STAGE: &str = "loading";
/// Lines or elements between two reports of progress: some milliseconds.
const REPORT_EVERY: usize = 1 << 16;

const GET_IT_AGAIN: &str = "the file is damaged or cut off: get or export it again";
const REPAIR: &str = "repair the file or export it again";

/// Reads a mesh; the extension, in any case, tells the format.
///
/// Polygons become fans of triangles. Normals and colours are kept where every vertex has them.
///
/// # Errors
/// [`Error::Input`] if the file cannot be read or holds no proper mesh, [`Error::Cancelled`].
pub fn mesh(path: &Path, cx: &Context) -> Result<Mesh> {
    check_readable(path)?;
    let mesh = match extension(path).as_deref() {
        Some("obj") => obj::read(path, &bytes(path)?, cx)?,
        Some("ply") => ply::read(path, &bytes(path)?, cx)?,
        _ => {
            let known = EXTENSIONS.join(" and .");
            let problem = "is not of a kind that can be read";
            return Err(Error::file(
                path,
                "",
                problem,
                format!("convert it: .{known} are supported"),
            ));
        }
    };
    cx.step(STAGE, 1.0)?;
    Ok(mesh)
}

/// Whether the extension is one of [`EXTENSIONS`].
pub fn is_mesh(path: &Path) -> bool {
    extension(path).is_some_and(|e| EXTENSIONS.contains(&e.as_str()))
}

/// The extension in lower case.
pub(super) fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

/// Refuses what is not a file with something in it.
fn check_readable(path: &Path) -> Result<()> {
    let data = fs::metadata(path).map_err(|e| unreadable(path, &e))?;
    if data.is_dir() {
        return Err(Error::file(path, "", "is a folder", "name a file in it"));
    }
    if !data.is_file() {
        return Err(Error::file(path, "", "is not a regular file", "save its contents to a file"));
    }
    if data.len() == 0 {
        return Err(Error::file(path, "", "is empty", GET_IT_AGAIN));
    }
    Ok(())
}

/// The bytes of a file that is not empty.
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>> {
    check_readable(path)?;
    fs::read(path).map_err(|e| unreadable(path, &e))
}

fn unreadable(path: &Path, error: &std::io::Error) -> Error {
    if error.kind() == std::io::ErrorKind::NotFound {
        Error::file(path, "", "does not exist", "check the name and the folder")
    } else {
        Error::file(path, "", format!("cannot be read: {error}"), "check its permissions")
    }
}

/// A defect of the mesh in a file.
fn defect(path: &Path, defect: MeshDefect) -> Error {
    let place = match defect {
        MeshDefect::NotFinite { vertex } => format!("vertex {vertex}"),
        MeshDefect::IndexOutOfRange { triangle, .. } => format!("triangle {triangle}"),
        MeshDefect::Empty | MeshDefect::Count { .. } | MeshDefect::ZeroArea => String::new(),
    };
    Error::file(path, place, defect.to_string(), REPAIR)
}

/// There are no faces, in the words of both formats.
fn no_faces(path: &Path) -> Error {
    let remedy = "give a triangle or polygon mesh: point clouds are not supported yet";
    Error::file(path, "", "has no faces", remedy)
}

/// Linear value of an sRGB one, both 0 to 1 (IEC 61966-2-1).
pub(super) fn linear_from_srgb(value: f32) -> f32 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests;
