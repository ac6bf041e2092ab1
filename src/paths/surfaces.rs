//! The mirrors in f64, and what hides paths.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::accel::TriangleBvh;
use crate::geometry::{Mesh, Similarity};
use crate::scene::builtin::{self, SmoothSurface};
use crate::scene::description::{Mirror, Scene, Source};

/// What paths run between: a scene's mirrors, and what may stand in the way. No surfels are made.
pub struct PathScene {
    /// World position of the zero of everything else here, near the mirrors.
    pub(super) origin: DVec3,
    pub(super) mirrors: Vec<MirrorSurface>,
    pub(super) mirror_triangles: TriangleBvh,
    pub(super) object_triangles: TriangleBvh,
    /// A mirror nearer to P than this hides nothing: there its facets stand in the way of its own smooth surface.
    pub(super) clearance: f64,
}

/// A mirror, relative to the origin.
pub(super) struct MirrorSurface {
    pub(super) mesh: Arc<Mesh>,
    pub(super) positions: Vec<DVec3>,
    /// Unit.
    pub(super) normals: Vec<DVec3>,
    /// The mesh's own space to that of the scene.
    pub(super) to_scene: Similarity,
    /// What the mesh approximates, in its own space, if that has a closed form.
    pub(super) smooth: Option<SmoothSurface>,
    /// Of each triangle the one beyond the edge opposite to each corner.
    neighbors: Vec<[u32; 3]>,
}

/// Beyond an edge that has no, or several, triangles on its other side.
pub(super) const NO_TRIANGLE: u32 = u32::MAX;

/// See [`PathScene::clearance`]: a share of the diagonal of all mirrors' box, as for frames.
const CLEARANCE: f64 = 5e-3;

/// Normals of two triangles at a common corner differ by less than this where the surface is smooth.
const SMOOTH: f64 = 1e-3;

impl PathScene {
    /// Takes meshes and places of a scene.
    pub fn new(scene: &Scene) -> Self {
        let mirrors = || scene.mirrors.iter();
        let world = mirrors()
            .flat_map(|m| m.mesh.positions().iter().map(|p| m.transform.point(p.as_dvec3())));
        let (min, max) = world
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)));
        let middle = (min + max) * 0.5;
        let known = middle.is_finite();
        let origin = if known { middle.round() } else { DVec3::ZERO };
        let mirrors: Vec<_> = mirrors().map(|m| MirrorSurface::new(m, origin)).collect();
        let of_mirrors = mirrors.iter().flat_map(|m| triangles(&m.mesh, &m.positions));
        let mirror_triangles = TriangleBvh::build(&of_mirrors.collect::<Vec<_>>());
        let of_objects = scene.objects.iter().flat_map(|object| {
            let place = |p: &Vec3| object.transform.point(p.as_dvec3()) - origin;
            let positions: Vec<DVec3> = object.mesh.positions().iter().map(place).collect();
            triangles(&object.mesh, &positions).collect::<Vec<_>>()
        });
        Self {
            origin,
            mirror_triangles,
            object_triangles: TriangleBvh::build(&of_objects.collect::<Vec<_>>()),
            clearance: if known { CLEARANCE * (max - min).length() } else { 0.0 },
            mirrors,
        }
    }

    /// Number of mirror triangles over all mirrors.
    pub fn mirror_triangle_count(&self) -> usize {
        self.mirrors.iter().map(|m| m.mesh.triangles().len()).sum()
    }
}

impl MirrorSurface {
    fn new(mirror: &Mirror, origin: DVec3) -> Self {
        let (mesh, transform) = (&mirror.mesh, &mirror.transform);
        let to_scene = Similarity { translation: transform.translation - origin, ..*transform };
        let normal = |n: &Vec3| to_scene.direction(n.as_dvec3()).normalize_or(DVec3::Y);
        let smooth = match &mirror.source {
            Some(Source::Shape { name, triangles }) => builtin::smooth(name, *triangles),
            _ => None,
        };
        Self {
            mesh: Arc::clone(mesh),
            positions: mesh.positions().iter().map(|p| to_scene.point(p.as_dvec3())).collect(),
            normals: mesh.normals().iter().map(normal).collect(),
            to_scene,
            smooth,
            neighbors: neighbors(mesh),
        }
    }

    /// Corners of a triangle.
    pub(super) fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.mesh.triangles()[triangle].map(|i| self.positions[i as usize])
    }

    /// Unit normals at the corners of a triangle.
    pub(super) fn corner_normals(&self, triangle: usize) -> [DVec3; 3] {
        self.mesh.triangles()[triangle].map(|i| self.normals[i as usize])
    }

    /// Point of a triangle.
    pub(super) fn point(&self, triangle: usize, w: [f64; 3]) -> DVec3 {
        let v = self.corners(triangle);
        v[0] * w[0] + v[1] * w[1] + v[2] * w[2]
    }

    /// Interpolated unit normal; zero where the corners' cancel.
    pub(super) fn normal(&self, triangle: usize, w: [f64; 3]) -> DVec3 {
        let n = self.corner_normals(triangle);
        (n[0] * w[0] + n[1] * w[1] + n[2] * w[2]).normalize_or_zero()
    }

    /// The triangle beyond the edge opposite to `corner`, and its weights at the point of the edge nearest to `w`. `None` at the
    /// mirror's border and at creases.
    pub(super) fn across(
        &self,
        triangle: usize,
        corner: usize,
        w: [f64; 3],
    ) -> Option<(u32, [f64; 3])> {
        let next = self.neighbors[triangle][corner];
        if next == NO_TRIANGLE {
            return None;
        }
        let (here, there) = (self.mesh.triangles()[triangle], self.mesh.triangles()[next as usize]);
        let mut weights = [0.0; 3];
        for k in [(corner + 1) % 3, (corner + 2) % 3] {
            let own = here[k] as usize;
            let place = self.mesh.positions()[own];
            let same = |i: &u32| self.mesh.positions()[*i as usize] == place;
            let at = there.iter().position(same)?;
            if self.normals[there[at] as usize].distance(self.normals[own]) > SMOOTH {
                return None;
            }
            weights[at] = w[k].max(0.0);
        }
        let sum: f64 = weights.iter().sum();
        (sum > 0.0).then(|| (next, weights.map(|w| w / sum)))
    }
}

fn neighbors(mesh: &Mesh) -> Vec<[u32; 3]> {
    let mut list = vec![[NO_TRIANGLE; 3]; mesh.triangles().len()];
    let at = |i: u32| mesh.positions()[i as usize];
    for edge in mesh.shared_edges() {
        let ends = edge.vertices.map(at);
        let [a, b] = edge.triangles;
        if a == NO_TRIANGLE || b == NO_TRIANGLE {
            continue;
        }
        for (own, other) in [(a, b), (b, a)] {
            let corners = mesh.triangles()[own as usize];
            if let Some(k) = corners.iter().position(|i| !ends.contains(&at(*i))) {
                list[own as usize][k] = other;
            }
        }
    }
    list
}

fn triangles(mesh: &Mesh, positions: &[DVec3]) -> impl Iterator<Item = [Vec3; 3]> {
    mesh.triangles().iter().map(move |t| t.map(|i| positions[i as usize].as_vec3()))
}
