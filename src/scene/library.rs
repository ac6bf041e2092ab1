//! Meshes by name or file, each made once and shared.

use std::path::Path;
use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::description::{Proxy, Source};
use super::fit::{fit, world_bounds};
use super::{builtin, load};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::{Mesh, Similarity};

/// Makes meshes and remembers them.
pub(super) struct Library<'a> {
    cx: &'a Context,
    meshes: Vec<Found>,
}

/// A mesh and where it comes from.
pub(super) type Found = (Arc<Mesh>, Source);

impl<'a> Library<'a> {
    pub(super) fn new(cx: &'a Context) -> Self {
        Self { cx, meshes: Vec::new() }
    }

    /// The mesh in a file.
    pub(super) fn file(&mut self, path: &Path) -> Result<Found> {
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
    ) -> Result<Found> {
        self.get(Source::Shape { name: name.to_owned(), triangles }, || {
            builtin::shape(name, triangles).ok_or_else(|| {
                let problem = format!("there is no built-in shape \"{name}\"");
                unknown(problem, format!("the shapes are {}", builtin::SHAPES.join(", ")))
            })
        })
    }

    /// What stands for a mirror: a file in the mirror's own space, or a built-in shape, made as large as the mirror.
    pub(super) fn proxy(
        &mut self,
        input: &str,
        mirror: &Mesh,
        unknown: impl FnOnce(String, String) -> Error,
    ) -> Result<Proxy> {
        let path = Path::new(input);
        if !builtin::SHAPES.contains(&input) && (load::is_mesh(path) || path.exists()) {
            let (mesh, source) = self.file(path)?;
            return Ok(Proxy { mesh, source: Some(source), transform: Similarity::IDENTITY });
        }
        let (mesh, source) = self.shape(input, None, unknown)?;
        let (min, max) = world_bounds(mirror, &Similarity::IDENTITY);
        let base = DVec3::new(0.5 * (min.x + max.x), min.y, 0.5 * (min.z + max.z));
        let transform = fit(&mesh, DQuat::IDENTITY, (max - min).length(), base);
        Ok(Proxy { mesh, source: Some(source), transform })
    }

    fn get(&mut self, source: Source, make: impl FnOnce() -> Result<Mesh>) -> Result<Found> {
        if let Some((mesh, _)) = self.meshes.iter().find(|(_, s)| *s == source) {
            return Ok((Arc::clone(mesh), source));
        }
        let mesh = Arc::new(make()?);
        self.meshes.push((Arc::clone(&mesh), source.clone()));
        Ok((mesh, source))
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
