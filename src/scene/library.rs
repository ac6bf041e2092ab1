//! Meshes by name or file, each made once and shared.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{builtin, load};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::Mesh;

/// Makes meshes and remembers them.
pub(super) struct Library<'a> {
    cx: &'a Context,
    meshes: Vec<(Source, Arc<Mesh>)>,
}

#[derive(PartialEq)]
enum Source {
    File(PathBuf),
    Shape(String, Option<usize>),
}

impl<'a> Library<'a> {
    pub(super) fn new(cx: &'a Context) -> Self {
        Self { cx, meshes: Vec::new() }
    }

    /// The mesh in a file.
    pub(super) fn file(&mut self, path: &Path) -> Result<Arc<Mesh>> {
        // If it cannot be resolved, reading it says why.
        let resolved = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let cx = self.cx;
        self.get(Source::File(resolved), || load::mesh(path, cx))
    }

    /// A built-in shape with about so many triangles; `unknown` says where the name was given.
    pub(super) fn shape(
        &mut self,
        name: &str,
        triangles: Option<usize>,
        unknown: impl FnOnce(String, String) -> Error,
    ) -> Result<Arc<Mesh>> {
        self.get(Source::Shape(name.to_owned(), triangles), || {
            builtin::shape(name, triangles).ok_or_else(|| {
                let problem = format!("there is no built-in shape \"{name}\"");
                unknown(problem, format!("the shapes are {}", builtin::SHAPES.join(", ")))
            })
        })
    }

    fn get(&mut self, source: Source, make: impl FnOnce() -> Result<Mesh>) -> Result<Arc<Mesh>> {
        if let Some((_, mesh)) = self.meshes.iter().find(|(s, _)| *s == source) {
            return Ok(Arc::clone(mesh));
        }
        let mesh = Arc::new(make()?);
        self.meshes.push((source, Arc::clone(&mesh)));
        Ok(mesh)
    }
}

/// `stem`, or with the first number from 2 on that makes it none of `taken`.
pub(super) fn unique(stem: &str, taken: &[String]) -> String {
    let mut names = std::iter::once(stem.to_owned()).chain((2..).map(|n| format!("{stem}-{n}")));
    names.find(|name| !taken.contains(name)).unwrap_or_default()
}

/// A file's name without folder and extension.
pub(super) fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
