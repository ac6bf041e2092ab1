//! The mirrors in f64, and what hides paths.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::accel::TriangleBvh;
use crate::geometry::{Mesh, Similarity};
use crate::scene::description::Scene;

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
}

/// See [`PathScene::clearance`]: a share of the diagonal of all mirrors' box, as for frames.
const CLEARANCE: f64 = 5e-3;

impl PathScene {
    /// Takes meshes and places of a scene.
    pub fn new(scene: &Scene) -> Self {
        let mut world: Vec<MirrorSurface> =
            scene.mirrors.iter().map(|m| MirrorSurface::new(&m.mesh, &m.transform)).collect();
        let all = || world.iter().flat_map(|m| &m.positions);
        let (min, max) = all().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| {
            (min.min(*p), max.max(*p))
        });
        let middle = (min + max) * 0.5;
        let origin = if middle.is_finite() { middle.round() } else { DVec3::ZERO };
        for position in world.iter_mut().flat_map(|m| &mut m.positions) {
            *position -= origin;
        }
        let mirror_triangles: Vec<[Vec3; 3]> =
            world.iter().flat_map(|m| corners(&m.mesh, &m.positions)).collect();
        let mut object_triangles = Vec::new();
        for object in &scene.objects {
            let place = |p: &Vec3| object.transform.point(p.as_dvec3()) - origin;
            let positions: Vec<DVec3> = object.mesh.positions().iter().map(place).collect();
            object_triangles.extend(corners(&object.mesh, &positions));
        }
        let size = if middle.is_finite() { (max - min).length() } else { 0.0 };
        Self {
            origin,
            mirrors: world,
            mirror_triangles: TriangleBvh::build(&mirror_triangles),
            object_triangles: TriangleBvh::build(&object_triangles),
            clearance: CLEARANCE * size,
        }
    }

    /// Number of mirror triangles over all mirrors.
    pub fn mirror_triangle_count(&self) -> usize {
        self.mirrors.iter().map(|m| m.mesh.triangles().len()).sum()
    }
}

impl MirrorSurface {
    fn new(mesh: &Arc<Mesh>, transform: &Similarity) -> Self {
        let normal = |n: &Vec3| transform.direction(n.as_dvec3()).normalize_or(DVec3::Y);
        Self {
            mesh: Arc::clone(mesh),
            positions: mesh.positions().iter().map(|p| transform.point(p.as_dvec3())).collect(),
            normals: mesh.normals().iter().map(normal).collect(),
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
}

fn corners(mesh: &Mesh, positions: &[DVec3]) -> impl Iterator<Item = [Vec3; 3]> {
    mesh.triangles().iter().map(move |t| t.map(|i| positions[i as usize].as_vec3()))
}
