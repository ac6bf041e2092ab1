//! Triangle meshes that were checked once and are trusted afterwards.

use glam::Vec3;
use rayon::prelude::*;

use super::Aabb;

/// A checked triangle mesh in its own (local) space.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    colors: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

/// Why triangles are not a mesh.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MeshDefect {
    /// No vertices or no triangles.
    #[error("has no triangles")]
    Empty,
    /// A coordinate, normal or colour of this vertex is NaN or infinite, or too large to be squared.
    #[error("is not a finite number, or larger than 1e15")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("names vertex {index}, but there are {vertices} vertices")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The index that it names.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// `normals` or `colors` do not match the number of vertices.
    #[error("has {found} {what} for {vertices} vertices")]
    Count {
        /// "normals" or "colours".
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        vertices: usize,
    },
    /// More vertices than an index of 32 bits can name.
    #[error("has more than 4294967295 vertices")]
    TooMany,
    /// All triangles are degenerate.
    #[error("has zero area")]
    ZeroArea,
}

/// Coordinates beyond this cannot be squared and summed safely in f32.
pub(crate) const MAX_COORDINATE: f32 = 1e15;

/// Share of a closed mesh's area whose normals have to agree with its triangles' sides.
const MOSTLY: f64 = 0.999;

impl Mesh {
    /// Checks the parts and completes the normals.
    ///
    /// `normals`: one a vertex, or empty. Missing and zero ones become the angle-weighted average of the
    /// adjacent triangles; the others are normalised. `colors`: linear RGB, one a vertex, or empty.
    ///
    /// # Errors
    /// [`MeshDefect`] names the first thing that is wrong.
    pub fn new(
        positions: Vec<Vec3>,
        normals: Vec<Vec3>,
        colors: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshDefect> {
        let vertices = positions.len();
        if vertices == 0 || triangles.is_empty() {
            return Err(MeshDefect::Empty);
        }
        for (what, found) in [("normals", normals.len()), ("colours", colors.len())] {
            if found != 0 && found != vertices {
                return Err(MeshDefect::Count { what, found, vertices });
            }
        }
        for list in [&positions, &normals, &colors] {
            let bad = |v: &Vec3| !(v.abs().cmple(Vec3::splat(MAX_COORDINATE)).all());
            if let Some(vertex) = list.iter().position(bad) {
                return Err(MeshDefect::NotFinite { vertex });
            }
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices) {
                return Err(MeshDefect::IndexOutOfRange { triangle, index, vertices });
            }
        }
        let mut mesh = Self { positions, normals, colors, triangles };
        if mesh.area() <= 0.0 {
            return Err(MeshDefect::ZeroArea);
        }
        mesh.complete_normals();
        Ok(mesh)
    }

    /// No vertices, no triangles: the mesh of things that are known by their surfels only.
    pub(crate) const fn none() -> Self {
        Self {
            positions: Vec::new(),
            normals: Vec::new(),
            colors: Vec::new(),
            triangles: Vec::new(),
        }
    }

    /// Vertex positions.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Unit vertex normals, one a vertex.
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// Linear RGB vertex colours, one a vertex or none at all.
    pub fn colors(&self) -> &[Vec3] {
        &self.colors
    }

    /// Vertex indices of each triangle, counter-clockwise seen from the front.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Corner positions of a triangle.
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
    }

    /// Area of a triangle.
    pub fn triangle_area(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.corners(triangle).map(|p| p.as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    }

    /// Sum of the triangles' areas.
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|t| self.triangle_area(t)).sum()
    }

    /// Tight box of the vertices that triangles use.
    pub fn bounds(&self) -> Aabb {
        Aabb::of(self.triangles.iter().flatten().map(|&i| self.positions[i as usize]))
    }

    /// Whether the triangles enclose a volume and the normals point out of it: every edge has one triangle on each
    /// side. Vertices at one place count as one.
    pub fn is_closed_outward(&self) -> bool {
        let name = self.places();
        let mut edges = Vec::with_capacity(3 * self.triangles.len());
        let (mut volume, mut outward) = (0.0, 0.0);
        let middle = self.bounds().center().as_dvec3();
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| name[i as usize]);
            if a == b || b == c || c == a {
                continue;
            }
            for (from, to) in [(a, b), (b, c), (c, a)] {
                edges.push(if from < to { (from, to, 1i8) } else { (to, from, -1) });
            }
            let p = triangle.map(|i| self.positions[i as usize].as_dvec3() - middle);
            let face = (p[1] - p[0]).cross(p[2] - p[0]);
            volume += p[0].dot(face);
            let normal: Vec3 = triangle.iter().map(|&i| self.normals[i as usize]).sum();
            outward += normal.as_dvec3().dot(face).signum() * face.length();
        }
        edges.par_sort_unstable();
        let pairs = edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
        let area = 2.0 * self.area();
        volume > 0.0 && outward > MOSTLY * area && edges.len().is_multiple_of(2) && { pairs }
            .all(|pair| pair.len() == 2 && pair[0].2 + pair[1].2 == 0)
    }

    /// Fills in missing normals: the average of the adjacent triangles' normals, weighted by the angle
    /// at the vertex (Thürmer & Wüthrich 1998).
    fn complete_normals(&mut self) {
        self.normals.resize(self.positions.len(), Vec3::ZERO);
        let usable = |n: Vec3| n.length_squared() > 1e-12;
        let given: Vec<bool> = self.normals.iter().map(|&n| usable(n)).collect();
        if !given.iter().all(|&g| g) {
            for corners in &self.triangles {
                let p = corners.map(|i| self.positions[i as usize]);
                let Some(normal) = (p[1] - p[0]).cross(p[2] - p[0]).try_normalize() else {
                    continue;
                };
                for k in 0..3 {
                    let (to_next, to_last) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                    let vertex = corners[k] as usize;
                    if !given[vertex] {
                        self.normals[vertex] += normal * to_next.angle_between(to_last);
                    }
                }
            }
        }
        for normal in &mut self.normals {
            *normal = normal.normalize_or(Vec3::Y);
        }
    }
}
