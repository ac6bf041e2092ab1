//! Executes lookup passes: what a mirror reflects, by the direction of the reflected ray.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::camera::RayScale;
use crate::camera::mirror_ray::{RaySource, reflected_ray};
use crate::error::Result;
use crate::image::{NONE, Planes, Reason};
use crate::plan::{EnvironmentCube, LookupPass, Reflection};
use crate::scene::prepared::PreparedScene;
use crate::visibility::{NONE_ID, Visibility};

/// A pixel of a mirror: its index, its mirror and the direction to look up.
pub(crate) struct Asked {
    /// Index into the picture.
    pub(crate) pixel: usize,
    /// Index of the mirror.
    pub(crate) mirror: usize,
    /// Any length.
    pub(crate) direction: Vec3,
}

/// Reads the cubes: radiance times coverage, and coverage.
pub(crate) type Reader<'a> =
    dyn Fn(&Arc<Vec<EnvironmentCube>>, &[Asked]) -> Result<Vec<[f32; 4]>> + 'a;

/// On the CPU.
#[expect(clippy::unnecessary_wraps, reason = "a reader may be a device that fails")]
pub(crate) fn by_cpu(cubes: &Arc<Vec<EnvironmentCube>>, asked: &[Asked]) -> Result<Vec<[f32; 4]>> {
    Ok(asked.par_iter().map(|a| cubes[a.mirror].radiance.at(a.direction)).collect())
}

/// Executes the pass.
///
/// # Errors
/// The reader failed.
pub(crate) fn lookup(
    pass: &LookupPass<'_>,
    scene: &PreparedScene,
    visibility: &Visibility,
    reader: &Reader<'_>,
    out: &mut Reflection,
) -> Result<()> {
    let width = visibility.size.width as usize;
    let ask = |(pixel, &id): (usize, &u32)| {
        let px = Vec2::new((pixel % width) as f32 + 0.5, (pixel / width) as f32 + 0.5);
        let triangle = (id != NONE_ID).then(|| scene.mirror_triangle(id))?;
        let scale = RayScale::EyeDistance;
        let (origin, ray) = reflected_ray(pass.eye, px, &triangle, RaySource::Surface, scale)?;
        let mirror = scene.mirror_of(id).0;
        Some(Asked { pixel, mirror, direction: pass.direction(mirror, origin, ray) })
    };
    let asked: Vec<Asked> = visibility.mirror_ids.par_iter().enumerate().filter_map(ask).collect();
    let read = reader(&pass.cubes, &asked)?;
    out.radiance.clear();
    out.radiance.resize(visibility.size.pixels(), Vec3::ZERO);
    out.coverage.clear();
    out.coverage.resize(visibility.size.pixels(), 0.0);
    for (asked, [r, g, b, coverage]) in asked.iter().zip(read) {
        out.radiance[asked.pixel] = Vec3::new(r, g, b);
        out.coverage[asked.pixel] = coverage;
        if let Some(planes) = out.planes.as_deref_mut() {
            planes.coverage[asked.pixel] = coverage;
            describe(scene, &pass.cubes[asked.mirror], asked, planes);
        }
    }
    Ok(())
}

/// What the nearest texel saw.
fn describe(scene: &PreparedScene, cube: &EnvironmentCube, asked: &Asked, planes: &mut Planes) {
    let texel = cube.radiance.nearest(asked.direction);
    let Some((triangle, weights)) = cube.seen[texel] else { return };
    let (position, normal) = scene.surface_at(triangle, weights);
    let i = asked.pixel;
    planes.position[i] = (position.as_dvec3() + scene.origin).as_vec3().to_array();
    planes.normal[i] = normal.to_array();
    planes.object[i] = u32::try_from(scene.object_of_triangle(triangle).0).unwrap_or(NONE);
    planes.reason[i] = Reason::Object as u32;
}
