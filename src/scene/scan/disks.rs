//! Surfels as a mesh: what the direct view, shadows and rays see of a cloud.

use glam::Vec3;
use rayon::prelude::*;

use crate::context::Context;
use crate::error::Result;
use crate::geometry::{Mesh, Surfels};

/// Half the edge of a square by the extent. Measured: less than 0.01 % of an evenly sampled plane is bare then, and 0.3 % of a
/// randomly sampled one; with 1.2, 0.8 % and 1.7 %.
const MARGIN: f32 = 1.4;

/// One square for each surfel, facing along its normal, or for an even part of the surfels and as much larger where there are
/// more than `most`. They overlap, so that no holes are left. Colours are the albedo if `colored`.
///
/// # Errors
/// If it is cancelled.
pub fn disks(surfels: &Surfels, most: usize, colored: bool, cx: &Context) -> Result<Mesh> {
    let places: Vec<Vec3> =
        (0..surfels.len()).into_par_iter().map(|i| surfels.position(i)).collect();
    let which = super::thin::thin(&places, most.max(1), 1, cx)?;
    #[expect(clippy::cast_possible_truncation, reason = "rounded")]
    let larger = (surfels.len() as f64 / which.len().max(1) as f64).sqrt() as f32;
    let corners = |&i: &u32| {
        let i = i as usize;
        let (right, up) = surfels.normals[i].any_orthonormal_pair();
        let half = (surfels.extent[i] * MARGIN * larger).max(f32::MIN_POSITIVE);
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, y]| places[i] + (right * x + up * y) * half)
    };
    let of = |list: &[Vec3]| which.par_iter().flat_map_iter(|&i| [list[i as usize]; 4]).collect();
    let positions = which.par_iter().flat_map_iter(corners).collect();
    let colors = if colored { of(&surfels.albedo) } else { Vec::new() };
    let triangles = (0..crate::scene::sample::index(which.len())).into_par_iter();
    let triangles =
        triangles.flat_map_iter(|k| [[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]]);
    let mesh = Mesh::new(positions, of(&surfels.normals), colors, triangles.collect());
    // Only if they are all too small to have an area.
    Ok(mesh.unwrap_or_else(|_| Mesh::none()))
}
