//! What a file holds: things with their own colours and places.

use std::path::Path;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::defect;
use crate::error::Result;
use crate::geometry::mesh::MAX_COORDINATE;
use crate::geometry::{Mesh, MeshDefect, Similarity, Surfels};
use crate::scene::description::{EyeDescription, Paint};
use crate::scene::materials::{Material, Materials};

/// The contents of a file.
#[derive(Clone, Debug)]
pub struct Model {
    /// In the order of the file; there is one at least, and none has the name of another.
    pub parts: Vec<Part>,
    /// The file's first camera, in its own space.
    pub eye: Option<EyeDescription>,
    /// What was passed over or guessed.
    pub notes: Vec<String>,
}

/// A thing in a file.
#[derive(Clone, Debug)]
pub struct Part {
    /// As the file calls it; may be empty if it is the only one.
    pub name: String,
    /// Its own space.
    pub mesh: Arc<Mesh>,
    /// See [`Object::points`](crate::scene::description::Object::points).
    pub points: Option<Arc<Surfels>>,
    /// Its colours, if the file gives any.
    pub paint: Option<Paint>,
    /// Linear RGB factor of what it reflects, if the file says that it is a mirror.
    pub mirror: Option<Vec3>,
    /// Its own space to the file's: large offsets would be lost in f32.
    pub own: Similarity,
}

impl Model {
    /// A file of a single mesh.
    pub(super) fn of_mesh(mesh: Mesh) -> Self {
        let paint = (!mesh.colors().is_empty()).then_some(Paint::Vertex);
        let own = Similarity::IDENTITY;
        let name = String::new();
        let part = Part { name, mesh: Arc::new(mesh), points: None, paint, mirror: None, own };
        Self { parts: vec![part], eye: None, notes: Vec::new() }
    }

    /// Of its parts.
    pub fn names(&self) -> Vec<&str> {
        self.parts.iter().map(|part| part.name.as_str()).collect()
    }

    /// All parts as one that is no mirror.
    ///
    /// # Errors
    /// There are more vertices than indices.
    pub fn merged(self, path: &Path) -> Result<Part> {
        let mut parts = self.parts;
        if parts.len() == 1 {
            let part = parts.remove(0);
            return Ok(Part { mirror: None, ..part });
        }
        let mut all = Assembly::default();
        for part in parts {
            all.append(Assembly::of(&part)).map_err(|d| defect(path, d))?;
        }
        all.part(String::new(), None).map_err(|d| defect(path, d))
    }
}

/// A mesh under construction: pieces with materials become one.
#[derive(Default)]
pub(super) struct Assembly {
    pub positions: Vec<Vec3>,
    /// One a vertex, zero where there is none; or none at all.
    pub normals: Vec<Vec3>,
    /// Linear RGB, one a vertex, or none at all.
    pub colors: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    /// One a triangle, or none at all: no material is said.
    pub of_triangle: Vec<u32>,
    /// One a triangle, or none at all.
    pub uv: Vec<[Vec2; 3]>,
    pub materials: Vec<Material>,
}

impl Assembly {
    fn of(part: &Part) -> Self {
        let mesh = &part.mesh;
        let count = mesh.triangles().len();
        let (of_triangle, uv, materials) = match &part.paint {
            Some(Paint::Materials(m)) => m.parts(),
            Some(Paint::Constant(color)) => {
                (vec![0; count], vec![], vec![Material { color: *color, texture: None }])
            }
            _ => (vec![], vec![], vec![]),
        };
        Self {
            positions: mesh.positions().to_vec(),
            normals: mesh.normals().to_vec(),
            colors: mesh.colors().to_vec(),
            triangles: mesh.triangles().to_vec(),
            of_triangle,
            uv,
            materials,
        }
    }

    /// Adds all of another one.
    pub(super) fn append(&mut self, mut other: Self) -> Result<(), MeshDefect> {
        let first = self.positions.len();
        if u32::try_from(first + other.positions.len()).is_err() {
            return Err(MeshDefect::TooMany);
        }
        self.fill();
        other.fill();
        both(&mut self.normals, &mut other.normals, first, other.positions.len(), Vec3::ZERO);
        both(&mut self.colors, &mut other.colors, first, other.positions.len(), Vec3::ONE);
        let (own, more) = (self.triangles.len(), other.triangles.len());
        both(&mut self.uv, &mut other.uv, own, more, [Vec2::ZERO; 3]);
        let (vertices, materials) = (count(first), count(self.materials.len()));
        self.positions.append(&mut other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + vertices)));
        self.of_triangle.extend(other.of_triangle.iter().map(|m| m + materials));
        self.materials.append(&mut other.materials);
        Ok(())
    }

    /// Where no material is said, triangles are plain.
    fn fill(&mut self) {
        if self.of_triangle.len() < self.triangles.len() {
            let color =
                if self.colors.is_empty() { super::super::file::LIGHT_GREY } else { Vec3::ONE };
            let plain = count(self.materials.len());
            self.materials.push(Material { color, texture: None });
            self.of_triangle.resize(self.triangles.len(), plain);
        }
    }

    /// Those triangles of it, and no vertices but theirs.
    pub(super) fn subset(&self, wanted: impl Fn(usize) -> bool) -> Self {
        let mut names = vec![u32::MAX; self.positions.len()];
        let mut of = Self { materials: self.materials.clone(), ..Self::default() };
        for (t, corners) in self.triangles.iter().enumerate().filter(|(t, _)| wanted(*t)) {
            of.triangles.push(corners.map(|corner| {
                let old = corner as usize;
                if names[old] == u32::MAX {
                    names[old] = count(of.positions.len());
                    of.positions.push(self.positions[old]);
                    of.normals.extend(self.normals.get(old));
                    of.colors.extend(self.colors.get(old));
                }
                names[old]
            }));
            of.of_triangle.extend(self.of_triangle.get(t));
            of.uv.extend(self.uv.get(t));
        }
        of
    }

    /// # Errors
    /// It is no proper mesh.
    pub(super) fn part(self, name: String, mirror: Option<Vec3>) -> Result<Part, MeshDefect> {
        let Self { positions, normals, colors, triangles, of_triangle, uv, materials } = self;
        let plain = |m: &Material| m.texture.is_none() && m.color == materials[0].color;
        let constant = materials.first().filter(|_| materials.iter().all(plain)).map(|m| m.color);
        let paint = match constant {
            _ if of_triangle.is_empty() || materials.is_empty() => {
                (!colors.is_empty()).then_some(Paint::Vertex)
            }
            Some(color) if colors.is_empty() => Some(Paint::Constant(color)),
            Some(Vec3::ONE) => Some(Paint::Vertex),
            _ => Some(Paint::Materials(Arc::new(Materials::new(of_triangle, uv, materials)))),
        };
        let mesh = Arc::new(Mesh::new(positions, normals, colors, triangles)?);
        Ok(Part { name, mesh, points: None, paint, mirror, own: Similarity::IDENTITY })
    }

    /// The first vertex that no mesh may have.
    pub(super) fn not_finite(&self) -> Option<usize> {
        let bad = |v: &Vec3| !v.abs().cmple(Vec3::splat(MAX_COORDINATE)).all();
        self.positions.iter().position(bad)
    }
}

/// If one of the lists has elements, both get as many as they should have.
fn both<T: Copy>(own: &mut Vec<T>, other: &mut Vec<T>, own_len: usize, len: usize, none: T) {
    if !own.is_empty() || !other.is_empty() {
        own.resize(own_len, none);
        other.resize(len, none);
        own.append(other);
    }
}

/// Checked in [`Assembly::append`].
fn count(n: usize) -> u32 {
    u32::try_from(n).expect("fewer than 2^32 of them")
}
