//! Things by name or file, each made once and shared.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::description::{Paint, Proxy, Source};
use super::fit::{fit, world_bounds};
use super::load::{Model, Part, ReadOptions};
use super::{builtin, load};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::{Mesh, Similarity, Surfels};

/// Peak bytes a triangle of a shape while it is made: two corners' worth of vertices, and the indices, twice.
const TRIANGLE_BYTES: u64 = 150;

/// Makes things and remembers them.
pub(super) struct Library<'a> {
    pub(super) options: ReadOptions,
    pub(super) cx: &'a Context,
    /// What the files' readers had to say.
    pub(super) notes: Vec<String>,
    models: Vec<(PathBuf, Model)>,
    known: Vec<Found>,
}

/// A mesh, or points and what stands for them; its colours, if it brings any; where it comes from, and so how its own space
/// lies in the file's.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub mesh: Arc<Mesh>,
    pub points: Option<Arc<Surfels>>,
    pub paint: Option<Paint>,
    pub source: Source,
}

impl Found {
    /// Its own space to the file's.
    pub(super) fn own(&self) -> Similarity {
        self.source.own()
    }

    fn of(part: Part, path: PathBuf, name: Option<String>) -> Self {
        let Part { mesh, points, paint, own, .. } = part;
        Self { mesh, points, paint, source: Source::File { path, part: name, own } }
    }

    /// As a mirror.
    ///
    /// # Errors
    /// It has no triangles.
    pub(super) fn mirror(self) -> Result<Self> {
        match (&self.points, &self.source) {
            (Some(_), Source::File { path, .. }) => {
                let problem = "is a cloud of points, and mirrors are made of triangles";
                Err(Error::file(path, "", problem, "make it an object, or a mesh of it"))
            }
            _ => Ok(self),
        }
    }
}

impl<'a> Library<'a> {
    pub(super) fn new(options: ReadOptions, cx: &'a Context) -> Self {
        Self { options, cx, notes: Vec::new(), models: Vec::new(), known: Vec::new() }
    }

    /// All that is in a file, one by one: each with its name and what it reflects, if it is a mirror.
    pub(super) fn model(&mut self, path: &Path) -> Result<Vec<(Part, Found)>> {
        let (resolved, model) = self.read(path)?;
        let single = model.parts.len() == 1;
        let mut all = Vec::new();
        for part in model.parts.clone() {
            let name = (!single).then(|| part.name.clone());
            let found = Found::of(part.clone(), resolved.clone(), name);
            all.push((part, self.remember(found)));
        }
        Ok(all)
    }

    /// The camera in a file that was read.
    pub(super) fn eye(&self, path: &Path) -> Option<super::description::EyeDescription> {
        let resolved = resolved(path);
        self.models.iter().find(|(known, _)| *known == resolved)?.1.eye
    }

    /// What is in a file as one thing.
    pub(super) fn file(&mut self, path: &Path) -> Result<Found> {
        if let Some(found) = self.known_of(path, None) {
            return Ok(found);
        }
        let (resolved, model) = self.read(path)?;
        let note = (model.parts.len() > 1).then(|| {
            let (shown, names) = (path.display(), listed(model.names()));
            format!("{shown}: {names} are taken as one; a scene file can take one alone (part)")
        });
        let merged = model.clone().merged(path)?;
        self.notes.extend(note);
        Ok(self.remember(Found::of(merged, resolved, None)))
    }

    /// One of the parts of a file; `unknown` says where the name was given.
    pub(super) fn part(
        &mut self,
        path: &Path,
        name: &str,
        unknown: impl FnOnce(String, String) -> Error,
    ) -> Result<Found> {
        if let Some(found) = self.known_of(path, Some(name)) {
            return Ok(found);
        }
        let (resolved, model) = self.read(path)?;
        let wanted = model.parts.iter().find(|p| p.name == name).cloned();
        let Some(wanted) = wanted else {
            let problem = format!("{} has no part \"{name}\"", path.display());
            let remedy = match model.parts[..] {
                [_] => "it is all one: leave the part out".to_owned(),
                _ => format!("there are {}", listed(model.names())),
            };
            return Err(unknown(problem, remedy));
        };
        Ok(self.remember(Found::of(wanted, resolved, Some(name.to_owned()))))
    }

    fn known_of(&self, path: &Path, part: Option<&str>) -> Option<Found> {
        let resolved = resolved(path);
        let is_same = |f: &&Found| matches!(&f.source, Source::File { path, part: known, .. } if *path == resolved && known.as_deref() == part);
        self.known.iter().find(is_same).cloned()
    }

    /// A built-in shape with about so many triangles; `unknown` says where the name was given.
    pub(super) fn shape(
        &mut self,
        name: &str,
        triangles: Option<usize>,
        unknown: impl FnOnce(String, String) -> Error,
    ) -> Result<Found> {
        let source = Source::Shape { name: name.to_owned(), triangles };
        if let Some(found) = self.known.iter().find(|f| f.source == source) {
            return Ok(found.clone());
        }
        let bytes = TRIANGLE_BYTES.saturating_mul(triangles.unwrap_or(0) as u64);
        self.cx.room_for(name, &format!("{} triangles", triangles.unwrap_or(0)), bytes)?;
        let mesh = builtin::shape(name, triangles).ok_or_else(|| {
            let problem = format!("there is no built-in shape \"{name}\"");
            unknown(problem, format!("the shapes are {}", builtin::SHAPES.join(", ")))
        })?;
        Ok(self.remember(Found { mesh: Arc::new(mesh), points: None, paint: None, source }))
    }

    /// What stands for a mirror: a file in the mirror's own space, or a built-in shape, made as large as the mirror.
    pub(super) fn proxy(
        &mut self,
        input: &str,
        mirror: &Mesh,
        unknown: impl FnOnce(String, String) -> Error,
    ) -> Result<Proxy> {
        let path = Path::new(input);
        if !builtin::SHAPES.contains(&input) && (load::is_model(path) || path.exists()) {
            let found = self.file(path)?.mirror()?;
            let transform = found.own();
            return Ok(Proxy { mesh: found.mesh, source: Some(found.source), transform });
        }
        let found = self.shape(input, None, unknown)?;
        let (min, max) = world_bounds(mirror, &Similarity::IDENTITY);
        let base = DVec3::new(0.5 * (min.x + max.x), min.y, 0.5 * (min.z + max.z));
        let things = [(&*found.mesh, Similarity::IDENTITY)];
        let transform = fit(&things, DQuat::IDENTITY, (max - min).length(), base);
        Ok(Proxy { mesh: found.mesh, source: Some(found.source), transform })
    }

    /// The file's path, and its contents.
    fn read(&mut self, path: &Path) -> Result<(PathBuf, &Model)> {
        let resolved = resolved(path);
        let known = self.models.iter().position(|(known, _)| *known == resolved);
        let index = match known {
            Some(index) => index,
            None => {
                let model = load::model(path, &self.options, self.cx)?;
                self.notes.extend(model.notes.iter().cloned());
                self.models.push((resolved.clone(), model));
                self.models.len() - 1
            }
        };
        Ok((resolved, &self.models[index].1))
    }

    fn remember(&mut self, found: Found) -> Found {
        self.known.push(found.clone());
        found
    }
}

/// Names in a list for people, at most.
const NAMED: usize = 12;

/// Names for people.
pub(super) fn listed(mut names: Vec<&str>) -> String {
    let more = names.len().saturating_sub(NAMED);
    names.truncate(NAMED);
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{rest}", names.join(", "))
}

/// If a path cannot be resolved, reading it says why.
fn resolved(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
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
