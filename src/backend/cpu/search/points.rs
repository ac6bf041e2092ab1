//! Surfels on reflectors: the same that the 3-ray cameras project.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::Done;
use super::images::Reflecting;
use crate::error::Result;
use crate::image::{NONE, Reason};
use crate::plan::{Reflection, SplatShape};
use crate::visibility::Visibility;

/// No surfel.
const EMPTY: u64 = u64::MAX;

/// Draws the objects' surfels; of those on a pixel the nearest to the mirror, and among equals the first, is seen.
pub(super) fn draw(
    reflecting: &Reflecting<'_>,
    shape: SplatShape,
    visibility: &Visibility,
    out: &mut Reflection,
    done: &mut Done,
) -> Result<()> {
    let (scene, eye) = (reflecting.scene, reflecting.pass.eye);
    let size = visibility.size;
    let keys: Vec<AtomicU64> =
        (0..size.pixels()).into_par_iter().map(|_| AtomicU64::new(EMPTY)).collect();
    // By surfel, if somebody asks.
    let mut steps: Vec<u32> = Vec::new();
    for cloud in &scene.clouds[..scene.objects.len()] {
        let surfels: Vec<u32> = cloud.surfels.clone().collect();
        let place = |&i: &u32| {
            cloud.to_scene.point(scene.surfels.position(i as usize).as_dvec3()).as_vec3()
        };
        let positions: Vec<Vec3> = surfels.par_iter().map(place).collect();
        let images = reflecting.images(&positions, done)?;
        if out.planes.is_some() {
            steps.resize(cloud.surfels.end as usize, NONE);
            surfels
                .iter()
                .zip(&images)
                .for_each(|(&i, image)| steps[i as usize] = image.rounded_steps());
        }
        surfels.par_iter().zip(&images).for_each(|(&surfel, image)| {
            let Some(px) = eye.project_px(image.place).filter(|_| image.height > 0.0) else {
                return;
            };
            let key = u64::from(image.distance.to_bits()) << 32 | u64::from(surfel);
            for [x, y] in covered(px, shape) {
                if (0..i64::from(size.width)).contains(&x)
                    && (0..i64::from(size.height)).contains(&y)
                {
                    let pixel = usize::try_from(y * i64::from(size.width) + x).unwrap_or(0);
                    if reflecting.part.owns(visibility, pixel) {
                        keys[pixel].fetch_min(key, Ordering::Relaxed);
                    }
                }
            }
        });
    }
    for (pixel, key) in keys.into_iter().enumerate() {
        let key = key.into_inner();
        if key != EMPTY {
            let surfel = u32::try_from(key & u64::from(u32::MAX)).unwrap_or(NONE);
            let distance = f32::from_bits(u32::try_from(key >> 32).unwrap_or(0));
            show(reflecting, pixel, surfel, distance, out);
            if let Some(planes) = out.planes.as_deref_mut() {
                planes.steps[pixel] = steps[surfel as usize];
            }
        }
    }
    Ok(())
}

/// The pixels that a point covers.
#[expect(clippy::cast_possible_truncation, reason = "far pixels saturate and are off the picture")]
fn covered(px: Vec2, shape: SplatShape) -> impl Iterator<Item = [i64; 2]> {
    let one = shape == SplatShape::Square1;
    let first = if one { px.floor() } else { (px - 0.5).floor() };
    let side = if one { 1 } else { 2 };
    (0..side * side).map(move |k| [first.x as i64 + k % side, first.y as i64 + k / side])
}

fn show(
    reflecting: &Reflecting<'_>,
    pixel: usize,
    surfel: u32,
    distance: f32,
    out: &mut Reflection,
) {
    let scene = reflecting.scene;
    let i = surfel as usize;
    out.radiance[pixel] = scene.surfels.radiance[i];
    out.coverage[pixel] = 1.0;
    if let Some(planes) = out.planes.as_deref_mut() {
        let object = scene.cloud_of_surfel(surfel);
        let to_scene = &scene.clouds[object].to_scene;
        let position = to_scene.point(scene.surfels.position(i).as_dvec3()) + scene.origin;
        let normal = to_scene.direction(scene.surfels.normals[i].as_dvec3());
        planes.position[pixel] = position.as_vec3().to_array();
        planes.normal[pixel] = normal.as_vec3().to_array();
        planes.lambda[pixel] = distance;
        planes.object[pixel] = u32::try_from(object).unwrap_or(NONE);
        planes.surfel[pixel] = surfel;
        planes.coverage[pixel] = 1.0;
        planes.reason[pixel] = Reason::Object as u32;
    }
}
