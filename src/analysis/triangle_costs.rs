//! What each mirror triangle costs in a frame.

use rayon::prelude::*;

use super::splat_pass;
use super::trace_camera::cameras_of;
use crate::camera::Eye;
use crate::error::Result;
use crate::methods::Params;
use crate::scene::PreparedScene;
use crate::visibility::Visibility;

/// How many surfels are projected for each mirror triangle (over all mirrors) in a frame by the method c3rc. Together
/// they are the frame's projections: what a camera costs is shared by the pixels that it draws.
///
/// # Errors
/// The method refuses its parameters.
///
/// # Panics
/// If the parameters are another method's, or `visibility` is not what `eye` sees of `scene`.
pub fn triangle_costs(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    params: &Params,
) -> Result<Vec<u32>> {
    let pass = splat_pass(scene, eye, visibility, params)?;
    let cost = |patch| -> u64 {
        let mut batches = Vec::new();
        for camera in cameras_of(&pass, patch) {
            pass.batches.cull(camera, &mut batches);
        }
        batches.iter().map(|batch| u64::from(batch.count)).sum()
    };
    let costs: Vec<u64> = (0..pass.patches.len()).into_par_iter().map(cost).collect();
    let mut of_triangles = vec![0_u32; scene.mirror_triangle_count()];
    for (patch, cost) in pass.patches.iter().zip(costs) {
        let pixels = u64::from(patch.pixels);
        let mut done = 0;
        for y in patch.rect.min[1]..patch.rect.max[1] {
            for x in patch.rect.min[0]..patch.rect.max[0] {
                if !patch.owns(visibility, &pass.pixels.rows, x, y) {
                    continue;
                }
                // Whole numbers whose sum is the cost.
                let share = cost * (done + 1) / pixels - cost * done / pixels;
                done += 1;
                let id = visibility.mirror_ids[(y * visibility.size.width + x) as usize];
                let of = &mut of_triangles[id as usize];
                *of = of.saturating_add(u32::try_from(share).unwrap_or(u32::MAX));
            }
        }
    }
    Ok(of_triangles)
}
