//! The cameras that see for one pixel, and all that they look at.

use glam::{Vec2, Vec3};

use super::replay::{CloudTrace, Replay};
use super::splat_pass;
use crate::camera::Eye;
use crate::error::Result;
use crate::methods::{Params, c3rc, ray_scale};
use crate::plan::{CameraInstance, SplatPass};
use crate::scene::PreparedScene;
use crate::visibility::{NONE_ID, Visibility, barycentrics};

/// What sees for a mirror pixel: one continuous 3-ray camera, replayed for every object that it may see and every mirror
/// that may hide one.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraTrace {
    /// Index of the mirror that the pixel shows.
    pub mirror: usize,
    /// Index, in that mirror's mesh, of the triangle at the pixel's centre.
    pub triangle: usize,
    /// Barycentrics of the pixel's centre in that triangle; they sum to 1.
    pub weights: [f32; 3],
    /// The camera's base triangle, scene space: the mirror's triangle or a part of it, or three corners of a rectangle
    /// about a cell's pixels, about where these see the mirror.
    pub corners: [Vec3; 3],
    /// Its rays at these corners, scene space. Their lengths matter: λ counts in them.
    pub directions: [Vec3; 3],
    /// How many pixels it draws; 0 if there is no camera, because no object can be seen from here.
    pub pixels: u32,
    /// By object, then by mirror, those that it may see at all.
    pub clouds: Vec<CloudTrace>,
}

/// Replays the camera that draws a mirror pixel ([column, row]) in a frame by the method c3rc; `None` if the pixel's
/// centre shows no mirror, or lies outside the picture. It costs about as much as planning that frame.
///
/// # Errors
/// The method refuses its parameters.
///
/// # Panics
/// If the parameters are another method's, or `visibility` is not what `eye` sees of `scene`.
pub fn trace_camera(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    params: &Params,
    pixel: [u32; 2],
) -> Result<Option<CameraTrace>> {
    let [x, y] = pixel;
    let size = visibility.size;
    if x >= size.width || y >= size.height {
        return Ok(None);
    }
    let id = visibility.mirror_ids[(y * size.width + x) as usize];
    if id == NONE_ID {
        return Ok(None);
    }
    let (mirror, triangle) = scene.mirror_of(id);
    let surface = scene.mirror_triangle(id);
    let centre = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
    // Seen edge-on.
    let weights = barycentrics(eye, surface.corners, centre).unwrap_or([1.0 / 3.0; 3]);
    let pass = splat_pass(scene, eye, visibility, params)?;
    let patch = pass.patches.iter().position(|patch| {
        let ([left, top], [right, bottom]) = (patch.rect.min, patch.rect.max);
        let inside = (left..right).contains(&x) && (top..bottom).contains(&y);
        inside && patch.owns(visibility, &pass.pixels.rows, x, y)
    });
    let patch = patch.filter(|&patch| !cameras_of(&pass, patch).is_empty());
    let (corners, directions) = match patch {
        Some(patch) => base(eye, &cameras_of(&pass, patch)[0]),
        None => {
            let scale = ray_scale(params.choice("ray-scale"));
            (surface.corners, surface.corner_directions(eye.position, scale).map(|d| d.as_vec3()))
        }
    };
    Ok(Some(CameraTrace {
        mirror,
        triangle,
        weights,
        corners,
        directions,
        pixels: patch.map_or(0, |patch| pass.patches[patch].pixels),
        clouds: patch.map_or(Vec::new(), |patch| replays(scene, &pass, params, patch)),
    }))
}

/// The cameras of a patch.
pub(super) fn cameras_of<'a>(pass: &'a SplatPass<'_>, patch: usize) -> &'a [CameraInstance] {
    let [from, to] = [0, 1].map(|k| pass.patch_cameras[patch + k] as usize);
    &pass.cameras[from..to]
}

/// What each of a patch's cameras visits.
pub(super) fn replays(
    scene: &PreparedScene,
    pass: &SplatPass<'_>,
    params: &Params,
    patch: usize,
) -> Vec<CloudTrace> {
    let culler = c3rc::culler(scene, params);
    let of = |camera| Replay { scene, pass, culler: &culler, camera }.run().0;
    cameras_of(pass, patch).iter().map(of).collect()
}

/// Origins and directions of the rays at the corners of a camera's base.
fn base(eye: &Eye, camera: &CameraInstance) -> ([Vec3; 3], [Vec3; 3]) {
    let corners = |forms: &[[f32; 3]; 3]| {
        let [a, b, c] = [0, 1, 2].map(|i| Vec3::from_array(forms.map(|form| form[i])));
        [a, a + b, a + c]
    };
    (corners(&camera.from_eye).map(|v| eye.position + v), corners(&camera.direction))
}
