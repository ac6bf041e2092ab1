//! From the reflected objects to the final picture: environment where nothing landed, tint, direct view.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::direct::{DirectView, compose};
use super::look::Look;
use crate::camera::mirror_ray::{RaySource, reflected_ray};
use crate::camera::{Eye, RayScale};
use crate::image::Picture;
use crate::plan::Reflection;
use crate::scene::prepared::PreparedScene;
use crate::visibility::{NONE_ID, SurfaceMesh, Visibility};

/// Completes `reflection` (environment, tint; its planes' radiance, where there are planes) and draws the picture of what the eye sees.
///
/// `white`: see [`DirectView::white`].
pub fn finish(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    reflection: &mut Reflection,
    white: f32,
    picture: &mut Picture,
) {
    let width = eye.size.width as usize;
    let environment_included = reflection.environment_included;
    reflection
        .radiance
        .par_chunks_mut(width)
        .zip(reflection.coverage.par_chunks(width))
        .enumerate()
        .for_each(|(y, (row, coverage))| {
            for (x, (radiance, &covered)) in row.iter_mut().zip(coverage).enumerate() {
                let id = visibility.mirror_ids[y * width + x];
                if id != NONE_ID {
                    if covered < 1.0 && !environment_included {
                        let px = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                        let sky = reflected_sky(scene, eye, id, px);
                        // Where nothing landed the radiance is an older picture's.
                        let behind = sky * (1.0 - covered);
                        *radiance = if covered > 0.0 { *radiance + behind } else { behind };
                    }
                    *radiance *= scene.mirrors[scene.mirror_of(id).0].tint;
                }
            }
        });
    if let Some(planes) = &mut reflection.planes {
        let seen = visibility.mirror_ids.iter().zip(&reflection.radiance);
        let of_mirror = |(&id, radiance): (&u32, &Vec3)| {
            if id == NONE_ID { [0.0; 3] } else { radiance.to_array() }
        };
        planes.radiance = seen.map(of_mirror).collect();
    }
    let mirrors = mirror_surfaces(scene);
    let objects = object_surfaces(scene);
    let view = DirectView {
        eye,
        mirrors: &mirrors,
        objects: &objects,
        visibility,
        reflection: &reflection.radiance,
        white,
    };
    picture.width = eye.size.width;
    picture.height = eye.size.height;
    picture.rgb.resize(eye.size.pixels(), [0.0; 3]);
    compose(&view, &Look::new(scene), &mut picture.rgb);
}

/// The mirrors as the rasteriser takes them.
pub fn mirror_surfaces(scene: &PreparedScene) -> Vec<SurfaceMesh<'_>> {
    scene
        .mirrors
        .iter()
        .map(|m| SurfaceMesh { positions: &m.positions, triangles: m.mesh.triangles() })
        .collect()
}

/// The objects as the rasteriser takes them.
pub fn object_surfaces(scene: &PreparedScene) -> Vec<SurfaceMesh<'_>> {
    scene
        .objects
        .iter()
        .map(|o| SurfaceMesh { positions: &o.positions, triangles: o.mesh.triangles() })
        .collect()
}

/// The environment in the direction of the view ray reflected at the interpolated normal.
fn reflected_sky(scene: &PreparedScene, eye: &Eye, triangle: u32, px: Vec2) -> Vec3 {
    let mirror = scene.mirror_triangle(triangle);
    let ray = reflected_ray(eye, px, &mirror, RaySource::Surface, RayScale::EyeDistance);
    let direction = ray.map_or(Vec3::Y, |(_, direction)| direction);
    scene.environment.radiance(direction, &scene.light)
}
