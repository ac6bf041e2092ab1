//! Where things are: objects and mirrors move without their surfels or trees, and light follows.

use glam::{DVec3, Vec3};

use super::{Cloud, PreparedScene, another_version};
use crate::accel::TriangleBvh;
use crate::context::Context;
use crate::error::Result;
use crate::geometry::{Aabb, Mesh, Similarity};
use crate::scene::shade;
use crate::scene::sun_map::{Caster, SunMap};

impl PreparedScene {
    /// Moves an object (object space to world). Its surfels and tree stay as they are; call
    /// [`PreparedScene::shade`] when light and shadows should follow.
    pub fn place(&mut self, object: usize, transform: &Similarity) {
        self.placement_version = another_version();
        let to_scene = from_origin(transform, self.origin);
        self.clouds[object].place(to_scene);
        let object = &mut self.objects[object];
        object.detail = object.own_detail * narrow(to_scene.scale);
        object.to_scene = to_scene;
        object.positions = to_scene_positions(&object.mesh, &to_scene);
    }

    /// Moves a mirror (its local space to world). Its surfels and tree stay as they are, and so does
    /// [`PreparedScene::origin`]: far from there, where f32 is coarser, a scene had better be prepared anew. Mirrors cast
    /// no shadows, so nothing has to be shaded.
    ///
    /// # Panics
    /// If there is no such mirror.
    pub fn place_mirror(&mut self, mirror: usize, transform: &Similarity) {
        self.placement_version = another_version();
        self.set_mirror(mirror, transform);
        self.build_mirror_triangles();
    }

    /// Moves a mirror, but not its triangles in the BVH of all mirrors.
    pub(super) fn set_mirror(&mut self, mirror: usize, transform: &Similarity) {
        let to_scene = from_origin(transform, self.origin);
        self.clouds[self.objects.len() + mirror].place(to_scene);
        let mirror = &mut self.mirrors[mirror];
        mirror.positions = to_scene_positions(&mirror.mesh, &to_scene);
        let normals = mirror.mesh.normals().iter();
        mirror.normals = normals.map(|n| to_scene.direction(n.as_dvec3()).as_vec3()).collect();
    }

    pub(super) fn build_mirror_triangles(&mut self) {
        let mirrors = self.mirrors.iter();
        self.mirror_triangles = bvh(mirrors.map(|m| (&*m.mesh, &m.positions[..])));
    }

    /// Rebuilds the triangles' BVH from the objects' places and shades all surfels.
    ///
    /// # Errors
    /// Cancelled.
    pub fn shade(&mut self, cx: &Context) -> Result<()> {
        self.triangles = bvh(self.objects.iter().map(|o| (&*o.mesh, &o.positions[..])));
        self.sun_map = self.map_shadows();
        for (cloud, object) in self.clouds.iter().zip(&self.objects) {
            let range = cloud.surfels.start as usize..cloud.surfels.end as usize;
            shade::bake(
                &mut self.surfels,
                range,
                &cloud.to_scene,
                object.detail,
                &self.triangles,
                &self.light,
                cx,
            )?;
        }
        self.average();
        Ok(())
    }

    fn map_shadows(&self) -> SunMap {
        let objects = self.objects.iter().zip(&self.clouds);
        let casters: Vec<Caster> = objects
            .map(|(object, cloud)| Caster {
                positions: &object.positions,
                triangles: object.mesh.triangles(),
                edges: &object.edges,
                // The squares that stand for points do not close.
                closed: cloud.closed && !object.is_cloud,
            })
            .collect();
        let apart = shade::Sun::new(&self.triangles, &self.light).apart;
        SunMap::new(&casters, self.light.to_sun, apart)
    }
}

impl Cloud {
    pub(super) fn place(&mut self, to_scene: Similarity) {
        let local = self.tree.bounds();
        let corner = |i: u32| {
            let pick = |bit: u32, lo: f32, hi: f32| if i >> bit & 1 == 0 { lo } else { hi };
            DVec3::new(
                pick(0, local.min.x, local.max.x).into(),
                pick(1, local.min.y, local.max.y).into(),
                pick(2, local.min.z, local.max.z).into(),
            )
        };
        let bounds = Aabb::of((0..8).map(|i| to_scene.point(corner(i)).as_vec3()));
        // The corners were rounded.
        let slack = (bounds.min.abs().max(bounds.max.abs())) * (2.0 * f32::EPSILON);
        self.bounds = Aabb { min: bounds.min - slack, max: bounds.max + slack };
        self.to_scene = to_scene;
    }
}

#[expect(clippy::cast_possible_truncation, reason = "lengths are f32 everywhere")]
fn narrow(x: f64) -> f32 {
    x as f32
}

/// Of meshes with their positions in scene space.
fn bvh<'a>(meshes: impl Iterator<Item = (&'a Mesh, &'a [Vec3])>) -> TriangleBvh {
    let corners: Vec<[Vec3; 3]> = meshes
        .flat_map(|(mesh, at)| mesh.triangles().iter().map(|t| t.map(|i| at[i as usize])))
        .collect();
    TriangleBvh::build(&corners)
}

fn from_origin(transform: &Similarity, origin: DVec3) -> Similarity {
    Similarity { translation: transform.translation - origin, ..*transform }
}

fn to_scene_positions(mesh: &Mesh, to_scene: &Similarity) -> Vec<Vec3> {
    mesh.positions().iter().map(|p| to_scene.point(p.as_dvec3()).as_vec3()).collect()
}
