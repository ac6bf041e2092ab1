//! Models from files: one file a format.
//!
//! A reader is given the whole file as bytes and returns a checked [`Model`], or an error that names the file
//! and the place in it. No reader allocates by a number that it finds in a file.

use std::f64::consts::FRAC_1_SQRT_2;
use std::fs;
use std::io::Read;
use std::path::Path;

pub use environment::environment;
use glam::DQuat;

use super::prepared::DEFAULT_SURFELS;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::MeshDefect;
pub(super) use crate::image::color::srgb_to_linear as linear_from_srgb;

mod cloud;
mod environment;
mod gltf;
mod model;
mod mtl;
mod nearby;
mod obj;
mod ply;
pub mod points;
mod stl;
mod textures;

pub use model::{Model, Part};
pub use nearby::{Nearby, Unfound};

/// Extensions of the formats that [`model`] reads, in lower case: meshes, then points.
pub const EXTENSIONS: &[&str] =
    &["obj", "ply", "stl", "gltf", "glb", "las", "laz", "xyz", "csv", "txt", "npy"];

/// The stage that is reported while a file is read.
const STAGE: &str = "loading";
/// Lines or elements between two reports of progress: some milliseconds.
const REPORT_EVERY: usize = 1 << 16;

const GET_IT_AGAIN: &str = "the file is damaged or cut off: get or export it again";
const REPAIR: &str = "repair the file or export it again";

/// Bytes while a file is read, for each of its own: its contents, and what becomes of them (measured: a text of small
/// numbers takes most).
const READING: u64 = 4;

/// How files are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadOptions {
    /// Files that a file names may lie outside of its folder.
    pub outside: bool,
    /// Which axis of models is up; `None`: the usual one of each format.
    pub up: Option<UpAxis>,
    /// Points of a cloud, at most: a denser one is thinned evenly.
    pub points: usize,
    /// Seed of what is random.
    pub seed: u64,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { outside: false, up: None, points: DEFAULT_SURFELS, seed: 1 }
    }
}

/// Reads a file with all that is in it; the extension, in any case, tells the format.
///
/// Polygons become fans of triangles. Normals and colours are kept where every vertex has them. A file without faces is a cloud
/// of points.
///
/// # Errors
/// [`Error::Input`] if the file cannot be read, holds nothing to be shown or is too large, [`Error::Cancelled`].
pub fn model(path: &Path, options: &ReadOptions, cx: &Context) -> Result<Model> {
    let length = check_readable(path)?;
    if !is_model(path) {
        let (last, first) = EXTENSIONS.split_last().expect("there are some");
        let problem = "is not of a kind that can be read";
        let remedy = format!("convert it: .{} and .{last} are supported", first.join(", ."));
        return Err(Error::file(path, "", problem, remedy));
    }
    if is_cloud(path)? {
        return cloud::read(path, options, cx);
    }
    let needed = length.saturating_mul(READING);
    cx.room_for(&path.display().to_string(), "its contents", needed)?;
    let model = model_of_bytes(path, &bytes(path)?, options, cx)?;
    cx.step(STAGE, 1.0)?;
    Ok(model)
}

/// Whether a file has points and no faces.
fn is_cloud(path: &Path) -> Result<bool> {
    match extension(path).as_deref() {
        Some("ply") => {
            let mut start = Vec::new();
            let file = fs::File::open(path).map_err(|e| unreadable(path, &e))?;
            file.take(LONGEST_HEADER).read_to_end(&mut start).map_err(|e| unreadable(path, &e))?;
            Ok(ply::has_no_faces(path, &start))
        }
        Some("obj") => Ok(obj::has_no_faces(&bytes(path)?)),
        Some("stl" | "gltf" | "glb") => Ok(false),
        _ => Ok(true),
    }
}

/// PLY headers are shorter, bytes.
const LONGEST_HEADER: u64 = 1 << 16;

/// The same for the contents of a file with a mesh. The name tells the format, and where the files lie that it names.
///
/// # Errors
/// As [`model`].
pub fn model_of_bytes(
    path: &Path,
    bytes: &[u8],
    options: &ReadOptions,
    cx: &Context,
) -> Result<Model> {
    match extension(path).as_deref() {
        Some("obj") => obj::read(path, bytes, options.outside, cx),
        Some("stl") => stl::read(path, bytes, cx).map(Model::of_mesh),
        Some("gltf" | "glb") => gltf::read(path, bytes, options.outside, cx),
        _ => ply::read(path, bytes, cx).map(Model::of_mesh),
    }
}

/// Which way is up in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpAxis {
    /// +y, as in the program's world.
    Y,
    /// +z, as in CAD, geodesy and Blender.
    Z,
}

/// Turns +z to +y.
pub const Z_TO_Y: DQuat = DQuat::from_xyzw(-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2);

impl UpAxis {
    /// Which way is up in files of this kind where nothing is said.
    fn usual(path: &Path) -> Self {
        match extension(path).as_deref() {
            Some("las" | "laz") => Self::Z,
            _ => Self::Y,
        }
    }
}

impl ReadOptions {
    /// What turns a model, as it was read, upright: not what is usual for its format, which is turned already.
    pub fn turn(&self, path: &Path) -> DQuat {
        let usual = UpAxis::usual(path);
        match (self.up.unwrap_or(usual), usual) {
            (UpAxis::Z, UpAxis::Y) => Z_TO_Y,
            (UpAxis::Y, UpAxis::Z) => Z_TO_Y.conjugate(),
            _ => DQuat::IDENTITY,
        }
    }
}

/// Whether the extension is one of [`EXTENSIONS`].
pub fn is_model(path: &Path) -> bool {
    extension(path).is_some_and(|e| EXTENSIONS.contains(&e.as_str()))
}

/// The extension in lower case.
pub(super) fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

/// The length of a file, bytes; refuses what is not a file with something in it.
fn check_readable(path: &Path) -> Result<u64> {
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
    Ok(data.len())
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
        MeshDefect::Empty
        | MeshDefect::Count { .. }
        | MeshDefect::TooMany
        | MeshDefect::ZeroArea => String::new(),
    };
    Error::file(path, place, defect.to_string(), REPAIR)
}

/// There are no faces, in the words of both formats.
fn no_faces(path: &Path) -> Error {
    let remedy = "give a triangle or polygon mesh";
    Error::file(path, "", "has no faces", remedy)
}

#[cfg(test)]
mod tests;
