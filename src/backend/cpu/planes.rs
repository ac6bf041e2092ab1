//! What was seen at every pixel, re-derived from the winning keys by the same projection.

use glam::Vec3;
use rayon::prelude::*;

use super::splat::{EMPTY, FILLS, Landed, Projection};
use crate::camera::three_ray::project;
use crate::image::{NONE, Planes, Reason};
use crate::plan::SplatPass;
use crate::scene::prepared::PreparedScene;
use crate::visibility::Visibility;

/// One pixel's entries.
struct Seen {
    pixel: usize,
    surfel: u32,
    object: u32,
    lambda: f32,
    splat: [f32; 2],
    images: u32,
}

/// Which mirror triangle each pixel belongs to, and that it shows the environment until something lands there.
pub(crate) fn mark_mirrors(scene: &PreparedScene, visibility: &Visibility, planes: &mut Planes) {
    for (pixel, &id) in visibility.mirror_ids.iter().enumerate() {
        if id != crate::visibility::NONE_ID {
            let (mirror, triangle) = scene.mirror_of(id);
            planes.mirror[pixel] = u32::try_from(mirror).unwrap_or(NONE);
            planes.mirror_triangle[pixel] = u32::try_from(triangle).unwrap_or(NONE);
            planes.reason[pixel] = Reason::Environment as u32;
        }
    }
}

/// Fills in what the surfels in `keys` say.
pub(crate) fn splat_planes(
    pass: &SplatPass<'_>,
    scene: &PreparedScene,
    visibility: &Visibility,
    landed: &[Vec<Landed>],
    planes: &mut Planes,
) {
    let mut keys = vec![EMPTY; visibility.size.pixels()];
    for pixel in landed.iter().flatten() {
        keys[pixel.pixel as usize] = pixel.key;
        planes.coverage[pixel.pixel as usize] = pixel.coverage;
    }
    let keys = &keys;
    let lists: Vec<Vec<Seen>> = (0..pass.patches.len())
        .into_par_iter()
        .map(|index| of_patch(pass, scene, visibility, keys, index))
        .collect();
    for seen in lists.into_iter().flatten() {
        let object = &scene.objects[seen.object as usize];
        let position = scene.surfels.position(seen.surfel as usize).as_dvec3();
        let normal = scene.surfels.normals[seen.surfel as usize].as_dvec3();
        let i = seen.pixel;
        let world = object.to_scene.point(position) + scene.origin;
        planes.position[i] = world.as_vec3().to_array();
        planes.normal[i] = object.to_scene.direction(normal).as_vec3().to_array();
        planes.lambda[i] = seen.lambda;
        planes.splat[i] = seen.splat;
        planes.object[i] = seen.object;
        planes.surfel[i] = seen.surfel;
        planes.images[i] = seen.images;
        planes.reason[i] = Reason::Object as u32;
    }
}

fn of_patch(
    pass: &SplatPass<'_>,
    scene: &PreparedScene,
    visibility: &Visibility,
    keys: &[u64],
    index: usize,
) -> Vec<Seen> {
    let patch = &pass.patches[index];
    let width = visibility.size.width;
    let cameras = pass.patch_cameras[index] as usize..pass.patch_cameras[index + 1] as usize;
    let mut list = Vec::new();
    for y in patch.rect.min[1]..patch.rect.max[1] {
        for x in patch.rect.min[0]..patch.rect.max[0] {
            let pixel = (y * width + x) as usize;
            let own = patch.owns(visibility, &pass.pixels.rows, x, y);
            let key = keys[pixel];
            if !own || key == EMPTY {
                continue;
            }
            let surfel = u32::try_from(key & u64::from(u32::MAX)).unwrap_or(NONE);
            let depth = u32::try_from((key & !FILLS) >> 32).unwrap_or(NONE);
            let object = scene.cloud_of_surfel(surfel);
            let camera = pass.cameras[cameras.clone()].iter().find(|c| c.object as usize == object);
            let Some(camera) = camera else { continue };
            let work = Projection { pass, surfels: &scene.surfels, camera, patch, stride: 0 };
            let q = scene.surfels.position(surfel as usize) - Vec3::from_array(camera.camera.v1);
            let mut seen = Seen {
                pixel,
                surfel,
                object: camera.object,
                lambda: 0.0,
                splat: [0.0; 2],
                images: 0,
            };
            let [lo, hi] = camera.lambda;
            let mut least = f32::INFINITY;
            for image in project(&camera.camera, q.to_array(), lo, hi).as_slice() {
                if !image.found || image.linear(camera.front) <= 0.0 {
                    continue;
                }
                seen.images += u32::from(work.is_valid(image));
                // Newton in the batch's narrower λ range may have ended on a neighbouring float: the nearest in
                // depth is the one.
                let apart =
                    (work.depth(image, work.direction(image)) - f32::from_bits(depth)).abs();
                if apart < least && image.within(camera.guard) {
                    least = apart;
                    let [x, y, _] = work.place(image, 0.0);
                    seen.lambda = image.lambda;
                    let [left, top] = patch.rect.min.map(|v| v as f32);
                    seen.splat = [x + left, y + top];
                }
            }
            // The one that is seen may lie beside the camera's part of the picture.
            seen.images = seen.images.max(1);
            list.push(seen);
        }
    }
    list
}
