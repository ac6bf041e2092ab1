//! What belongs to what: surfels to clouds, triangles to objects and mirrors; and what a point of an object looks like.

use glam::Vec3;

use super::PreparedScene;
use crate::camera::MirrorTriangle;
use crate::scene::shade::{Sun, SurfacePoint, shade};

impl PreparedScene {
    /// Mirrors nearer to where a reflected ray starts than this, in scene units, do not hide what it sees: the facets
    /// of a mirror stand in the way of the rays of its smooth surface.
    pub fn mirror_clearance(&self) -> f32 {
        const CLEARANCE: f32 = 5e-3;
        CLEARANCE * self.mirror_triangles.bounds().diagonal()
    }

    /// Surfels from this one on are mirrors'.
    pub fn first_mirror_surfel(&self) -> u32 {
        self.clouds[..self.objects.len()].last().map_or(0, |cloud| cloud.representatives.end)
    }

    /// Number of mirror triangles over all mirrors.
    pub fn mirror_triangle_count(&self) -> usize {
        self.mirrors.iter().map(|m| m.mesh.triangles().len()).sum()
    }

    /// The mirror of a mirror triangle and the triangle's index in it.
    pub fn mirror_of(&self, triangle: u32) -> (usize, usize) {
        let mirror = self.mirrors.partition_point(|m| m.first_triangle <= triangle) - 1;
        (mirror, (triangle - self.mirrors[mirror].first_triangle) as usize)
    }

    /// Corners and normals of a mirror triangle.
    pub fn mirror_triangle(&self, triangle: u32) -> MirrorTriangle {
        let (mirror, triangle) = self.mirror_of(triangle);
        let mirror = &self.mirrors[mirror];
        let corner = mirror.mesh.triangles()[triangle];
        MirrorTriangle {
            corners: corner.map(|i| mirror.positions[i as usize]),
            normals: corner.map(|i| mirror.normals[i as usize]),
        }
    }

    /// The object of one of [`PreparedScene::triangles`] and the triangle's index in it.
    pub fn object_of_triangle(&self, triangle: u32) -> (usize, usize) {
        let object = self.objects.partition_point(|o| o.first_triangle <= triangle) - 1;
        (object, (triangle - self.objects[object].first_triangle) as usize)
    }

    /// The cloud of a surfel or representative.
    pub fn cloud_of_surfel(&self, surfel: u32) -> usize {
        self.clouds.partition_point(|o| o.representatives.end <= surfel)
    }

    /// Where a point of one of [`PreparedScene::triangles`] is (scene space), and its unit normal there.
    pub fn surface_at(&self, triangle: u32, weights: [f32; 3]) -> (Vec3, Vec3) {
        let (object, triangle) = self.object_of_triangle(triangle);
        let object = &self.objects[object];
        let corner = object.mesh.triangles()[triangle].map(|i| object.positions[i as usize]);
        let position = corner[0] * weights[0] + corner[1] * weights[1] + corner[2] * weights[2];
        (position, object.normal(triangle, weights))
    }

    /// What is seen of a point of one of [`PreparedScene::triangles`]: linear RGB radiance.
    pub fn radiance_of(&self, sun: &Sun<'_>, triangle: u32, weights: [f32; 3]) -> Vec3 {
        let (position, normal) = self.surface_at(triangle, weights);
        let (object, triangle) = self.object_of_triangle(triangle);
        let albedo = self.objects[object].albedo(triangle, weights);
        let facing = normal.dot(self.light.to_sun);
        let point = SurfacePoint { position, normal, extent: self.objects[object].detail };
        let by_ray = || sun.visible_from(&point);
        let lit = facing > 0.0
            && self.sun_map.lights_point(point.lifted(), facing).unwrap_or_else(by_ray);
        shade(albedo, normal, lit, &self.light)
    }
}
