//! Wavefront OBJ through `tobj`.
//!
//! `tobj` is handed only what a mesh is made of: vertices, normals and faces. Groups and texture coordinates
//! would split vertices, and with them the averaged normals of a mirror; its errors name no line; and where
//! only some vertices have colours it gives them to the wrong ones. So [`Source`] sits in between, and keeps materials and
//! texture coordinates itself, a triangle at a time.

use std::fmt::Write as _;
use std::io::{self, BufRead, Read};
use std::path::Path;

use glam::{Vec2, Vec3};

use super::model::{Assembly, Model};
use super::mtl::{self, Named};
use super::nearby::Nearby;
use super::textures::Textures;
use super::{GET_IT_AGAIN, REPAIR, REPORT_EVERY, STAGE, defect, no_faces};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::mesh::MAX_COORDINATE;
use crate::image::color::srgb_to_linear;
use crate::scene::file::LIGHT_GREY;
use crate::scene::library::listed;
use crate::scene::materials::Material;

const OPTIONS: tobj::LoadOptions = tobj::LoadOptions {
    single_index: true,
    triangulate: true,
    ignore_points: true,
    ignore_lines: true,
};

/// Reads an OBJ file with its materials. Vertex colours are taken as sRGB from 0 to 1, as common modellers write them.
/// What has a mirror's material becomes a mirror.
pub(super) fn read(path: &Path, bytes: &[u8], outside: bool, cx: &Context) -> Result<Model> {
    let counts = Counts::of(bytes);
    if counts.faces == 0 {
        return Err(no_faces(path));
    }
    let mut source = Source {
        path,
        cx,
        counts,
        rest: bytes,
        total_bytes: bytes.len(),
        line: 0,
        vertices: 0,
        normals: 0,
        tidy: String::new(),
        taken: 0,
        error: None,
        paints: Paints::default(),
    };
    let loaded = tobj::load_obj_buf(&mut source, &OPTIONS, |_| Ok(Default::default()));
    if let Some(error) = source.error {
        return Err(error);
    }
    let place = format!("line {}", source.line);
    let (models, _) = loaded.map_err(|e| Error::file(path, place, e.to_string(), REPAIR))?;
    let mesh = models.into_iter().next().map(|m| m.mesh).filter(|m| !m.indices.is_empty());
    let mesh = mesh.ok_or_else(|| no_faces(path))?;
    let vectors =
        |list: &[f32]| -> Vec<Vec3> { list.chunks_exact(3).map(Vec3::from_slice).collect() };
    let complete = mesh.normals.len() == mesh.positions.len();
    let colors = vectors(&mesh.vertex_color);
    let assembly = Assembly {
        positions: vectors(&mesh.positions),
        normals: if complete { vectors(&mesh.normals) } else { Vec::new() },
        colors: colors.into_iter().map(|c| c.map(srgb_to_linear)).collect(),
        triangles: mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        ..Assembly::default()
    };
    source.paints.paint(path, assembly, outside, cx)
}

/// Whether there are vertices and no faces.
pub(super) fn has_no_faces(bytes: &[u8]) -> bool {
    let counts = Counts::of(bytes);
    counts.faces == 0 && counts.vertices > 0
}

/// What a file says of its faces' materials.
#[derive(Default)]
struct Paints {
    /// Material files, each once.
    libraries: Vec<String>,
    /// Materials in the order in which they are first used.
    names: Vec<String>,
    /// One of `names` that the next faces have.
    current: Option<u32>,
    /// A triangle's name; `u32::MAX` is none.
    of_triangle: Vec<u32>,
    /// All `vt`.
    coordinates: Vec<Vec2>,
    /// Indices of a triangle's; empty if no material is named.
    corners: Vec<[u32; 3]>,
    /// Faces of fewer than three vertices.
    edges: usize,
}

impl Paints {
    fn use_material(&mut self, name: &str) {
        let known = self.names.iter().position(|known| known == name).unwrap_or_else(|| {
            self.names.push(name.to_owned());
            self.names.len() - 1
        });
        self.current = u32::try_from(known).ok();
    }

    /// Notes the triangles of a face, in `tobj`'s order: a fan about its first corner.
    fn face(&mut self, coordinates: &[u32]) {
        if self.libraries.is_empty() && self.current.is_none() {
            return;
        }
        for k in 2..coordinates.len() {
            self.of_triangle.push(self.current.unwrap_or(u32::MAX));
            self.corners.push([coordinates[0], coordinates[k - 1], coordinates[k]]);
        }
    }

    /// Gives the mesh its materials, and divides it into what is diffuse and each mirror.
    fn paint(&self, path: &Path, mut mesh: Assembly, outside: bool, cx: &Context) -> Result<Model> {
        let mut textures = Textures::default();
        if self.edges > 0 {
            let (shown, count) = (path.display(), self.edges);
            textures
                .notes
                .push(format!("{shown}: {count} faces of fewer than three vertices left out"));
        }
        let named = self.named(path, outside, &mut textures, cx)?;
        // Faces before the first material have none; the list begins where `face` began to note.
        let first = mesh.triangles.len() - self.of_triangle.len();
        let material = |t: usize| {
            let name = *t.checked_sub(first).and_then(|t| self.of_triangle.get(t))?;
            let name = self.names.get(name as usize)?;
            named.iter().position(|n| n.name == *name)
        };
        let model = |parts, notes| Model { parts, eye: None, notes };
        if named.is_empty() || (0..mesh.triangles.len()).all(|t| material(t).is_none()) {
            let part = mesh.part(String::new(), None).map_err(|d| defect(path, d))?;
            return Ok(model(vec![part], textures.notes));
        }
        let plain = if mesh.colors.is_empty() { LIGHT_GREY } else { Vec3::ONE };
        mesh.materials = named.iter().map(|n| n.material.clone()).collect();
        mesh.materials.push(Material { color: plain, texture: None });
        let textured = named.iter().any(|n| n.material.texture.is_some());
        for t in 0..mesh.triangles.len() {
            let found = material(t);
            let index = found.unwrap_or(named.len());
            mesh.of_triangle.push(u32::try_from(index).unwrap_or(0));
            if textured {
                let corners = t.checked_sub(first).map_or([u32::MAX; 3], |t| self.corners[t]);
                mesh.uv.push(corners.map(|i| match (found, self.coordinates.get(i as usize)) {
                    (Some(m), Some(uv)) => {
                        let uv = *uv * named[m].scale + named[m].offset;
                        // Upwards in the file.
                        Vec2::new(uv.x, 1.0 - uv.y)
                    }
                    _ => Vec2::ZERO,
                }));
            }
        }
        let mirrors: Vec<usize> = (0..named.len()).filter(|&m| named[m].mirror.is_some()).collect();
        let of = |t: usize| mesh.of_triangle[t] as usize;
        let groups = std::iter::once(None).chain(mirrors.iter().map(|&m| Some(m)));
        let mut parts = Vec::new();
        for group in groups {
            let belongs = |t: usize| match group {
                Some(m) => of(t) == m,
                None => !mirrors.contains(&of(t)),
            };
            let piece = mesh.subset(belongs);
            if piece.triangles.is_empty() {
                continue;
            }
            let (name, mirror) =
                group.map_or(("diffuse", None), |m| (named[m].name.as_str(), named[m].mirror));
            let piece = if mirror.is_some() {
                Assembly { of_triangle: vec![], uv: vec![], materials: vec![], ..piece }
            } else {
                piece
            };
            parts.push(piece.part(name.to_owned(), mirror).map_err(|d| defect(path, d))?);
        }
        Ok(model(parts, textures.notes))
    }

    /// The materials that faces use, as far as they are found.
    fn named(
        &self,
        path: &Path,
        outside: bool,
        textures: &mut Textures,
        cx: &Context,
    ) -> Result<Vec<Named>> {
        let nearby = Nearby::of(path, outside);
        let mut named: Vec<Named> = Vec::new();
        for library in &self.libraries {
            match nearby.find_loosely(library) {
                Ok(file) => match super::bytes(&file) {
                    Ok(bytes) => named.extend(mtl::read(&file, &bytes, outside, textures, cx)?),
                    Err(error) => {
                        textures.notes.push(format!("{error}: shown without its materials"));
                    }
                },
                Err(why) => {
                    let error = why.error(&path.display().to_string(), "", library);
                    textures.notes.push(format!("{error}: shown without its materials"));
                }
            }
        }
        let unknown = |name: &&str| named.iter().all(|n| n.name != **name);
        let missing: Vec<&str> = self.names.iter().map(String::as_str).filter(unknown).collect();
        if !named.is_empty() && !missing.is_empty() {
            textures.notes.push(format!(
                "{}: no material file has {}: shown without",
                path.display(),
                listed(missing)
            ));
        }
        named.retain(|n| self.names.contains(&n.name));
        Ok(named)
    }
}

/// What the file holds, counted before it is parsed.
#[derive(Clone, Copy, Default)]
struct Counts {
    vertices: i64,
    normals: i64,
    coordinates: i64,
    faces: i64,
    /// Vertices with a colour.
    colored: i64,
}

impl Counts {
    fn of(bytes: &[u8]) -> Self {
        let mut counts = Self::default();
        for line in bytes.split(|&b| b == b'\n') {
            match keyword(line) {
                b"v" => {
                    counts.vertices += 1;
                    let words = code(line).split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
                    counts.colored += i64::from(words.count() == 7);
                }
                b"vn" => counts.normals += 1,
                b"vt" => counts.coordinates += 1,
                b"f" => counts.faces += 1,
                _ => {}
            }
        }
        counts
    }
}

/// The first word of a line.
fn keyword(line: &[u8]) -> &[u8] {
    let line = line.trim_ascii_start();
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    &line[..end]
}

/// A line without its comment.
fn code(line: &[u8]) -> &[u8] {
    line.split(|&b| b == b'#').next().unwrap_or_default()
}

/// The checked and tidied lines of an OBJ file, for `tobj` to read.
struct Source<'a> {
    path: &'a Path,
    cx: &'a Context,
    counts: Counts,
    rest: &'a [u8],
    total_bytes: usize,
    /// Number of the last line taken, from 1.
    line: usize,
    /// Vertices and normals so far: what relative indices count back from.
    vertices: i64,
    normals: i64,
    /// The current line as `tobj` shall see it, and how much of it was read.
    tidy: String,
    taken: usize,
    /// Why reading stopped; `tobj` would swallow it.
    error: Option<Error>,
    paints: Paints,
}

impl Source<'_> {
    /// Makes the next line that matters the current one; leaves it empty at the end of the file.
    fn advance(&mut self) -> Result<()> {
        self.tidy.clear();
        self.taken = 0;
        while self.tidy.is_empty() && !self.rest.is_empty() {
            if self.line.is_multiple_of(REPORT_EVERY) {
                let left = self.rest.len() as f64 / self.total_bytes as f64;
                self.cx.step(STAGE, 1.0 - left)?;
            }
            let end = self.rest.iter().position(|&b| b == b'\n').map_or(self.rest.len(), |i| i + 1);
            let (line, rest) = self.rest.split_at(end);
            self.rest = rest;
            self.line += 1;
            let key = keyword(line);
            if matches!(key, b"v" | b"vn" | b"vt" | b"f") {
                let checked = match str::from_utf8(code(line)) {
                    Ok(text) => self.tidy_up(text, !line.ends_with(b"\n")),
                    Err(_) => Err(("is not text".into(), GET_IT_AGAIN)),
                };
                checked.map_err(|(problem, remedy)| {
                    Error::file(self.path, format!("line {}", self.line), problem, remedy)
                })?;
                if !self.tidy.is_empty() {
                    self.tidy.push('\n');
                }
            } else if matches!(key, b"usemtl" | b"mtllib") {
                // A name may be in any encoding, and have spaces.
                let text = String::from_utf8_lossy(line);
                let name = text.trim_start()[key.len()..].trim();
                match key {
                    b"usemtl" => self.paints.use_material(name),
                    _ if self.paints.libraries.iter().any(|known| known == name) => {}
                    _ => self.paints.libraries.push(name.to_owned()),
                }
            }
        }
        Ok(())
    }

    /// Checks a line and rewrites it without what is not needed. `is_cut`: it has no end, being the last one.
    fn tidy_up(&mut self, line: &str, is_cut: bool) -> Result<(), (String, &'static str)> {
        let mut words = line.split_ascii_whitespace();
        let key = words.next().unwrap_or_default();
        let count = words.clone().count();
        if key == "vt" {
            let mut number = || words.next().and_then(|word| word.parse::<f32>().ok());
            let place = Vec2::new(number().unwrap_or(0.0), number().unwrap_or(0.0));
            self.paints.coordinates.push(place);
            return Ok(());
        }
        if key == "f" && count < 3 {
            if is_cut {
                let problem = format!("has a face of {count} vertices, which needs at least 3");
                return Err((problem, GET_IT_AGAIN));
            }
            // Edges without a face, as some programs write them.
            self.paints.edges += 1;
            return Ok(());
        }
        self.tidy.push_str(key);
        if key == "f" {
            let corners: Result<Vec<u32>, String> = words.map(|word| self.corner(word)).collect();
            self.paints.face(&corners.map_err(|p| (p, REPAIR))?);
            return Ok(());
        }
        // A vertex may have a weight or a colour; colours are of use if all have them.
        let all_colored = self.counts.colored == self.counts.vertices;
        let keep = match (key, count) {
            ("v", 4) => 4,
            ("v", 6) if all_colored => 6,
            ("v", 3 | 6) | ("vn", 3..) => 3,
            _ => return Err((format!("has {count} numbers after \"{key}\""), GET_IT_AGAIN)),
        };
        for (i, word) in words.enumerate() {
            match word.parse::<f32>() {
                Ok(number) if number.abs() <= MAX_COORDINATE => {}
                // The mesh would name another vertex: `tobj` numbers them in the order of the faces.
                Ok(number) if number.is_finite() => {
                    return Err((format!("{word} is larger than {MAX_COORDINATE:e}"), REPAIR));
                }
                Ok(_) => return Err((format!("\"{word}\" is not a finite number"), REPAIR)),
                Err(_) => return Err((format!("\"{word}\" is not a number"), REPAIR)),
            }
            if i < keep {
                let _ = write!(self.tidy, " {word}");
            }
        }
        *(if key == "v" { &mut self.vertices } else { &mut self.normals }) += 1;
        Ok(())
    }

    /// Checks a corner of a face ("v", "v/vt", "v//vn", "v/vt/vn") and appends it without vt, whose index it returns;
    /// `u32::MAX` is none.
    fn corner(&mut self, word: &str) -> Result<u32, String> {
        let mut parts = word.split('/');
        let vertex = parts.next().unwrap_or_default();
        let coordinate = parts.next().unwrap_or_default();
        let normal = parts.next().unwrap_or_default();
        let c = self.counts;
        let coordinates = i64::try_from(self.paints.coordinates.len()).unwrap_or(i64::MAX);
        let mut at = 0;
        for (index, what, so_far, total) in [
            (vertex, "vertex", self.vertices, c.vertices),
            (normal, "normal", self.normals, c.normals),
            (coordinate, "texture coordinate", coordinates, c.coordinates),
        ] {
            at = 0;
            if what != "vertex" && index.is_empty() {
                continue;
            }
            let number: i64 =
                index.parse().map_err(|_| format!("\"{word}\" is not a corner of a face"))?;
            // Indices count from 1, or backwards from the last one so far.
            let absolute = if number < 0 { so_far.saturating_add(number) + 1 } else { number };
            if !(1..=total).contains(&absolute) {
                return Err(format!("names {what} {number}, but there are {total}"));
            }
            at = absolute;
        }
        let slashes = if normal.is_empty() { "" } else { "//" };
        let _ = write!(self.tidy, " {vertex}{slashes}{normal}");
        // From 1 in the file.
        Ok(u32::try_from(at - 1).unwrap_or(u32::MAX))
    }
}

impl BufRead for Source<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.taken == self.tidy.len()
            && let Err(error) = self.advance()
        {
            self.error = Some(error);
            return Err(io::Error::other("see Source::error"));
        }
        Ok(&self.tidy.as_bytes()[self.taken..])
    }

    fn consume(&mut self, amount: usize) {
        self.taken += amount;
    }
}

impl Read for Source<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(into)?;
        self.consume(count);
        Ok(count)
    }
}
