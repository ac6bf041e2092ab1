//! The mirrors as the eye sees them, coloured by what its cameras do.

use glam::{DVec3, Vec3};

use crate::camera::Eye;
use crate::camera::RayScale;
use crate::camera::mirror_ray::weights_on_line;
use crate::camera::three_ray::multiplicity::Class;
use crate::context::Context;
use crate::error::Result;
use crate::image::Picture;
use crate::image::color::srgb8_to_linear;
use crate::paths::PathFinder;
use crate::scene::PreparedScene;
use crate::visibility::{NONE_ID, Visibility};

/// What numbers of images look like, as 8-bit sRGB: 0 to 11, and the last for more.
pub const COUNT_COLORS: [[u8; 3]; 13] = [
    [0x22, 0x26, 0x2e],
    [0x4a, 0x7f, 0xc1],
    [0xf2, 0xc1, 0x4e],
    [0xe4, 0x57, 0x3d],
    [0x9a, 0xd1, 0x8b],
    [0x8d, 0x4f, 0xb3],
    [0xf4, 0xa6, 0xd7],
    [0x2b, 0xb3, 0xa3],
    [0xc7, 0xa0, 0x7a],
    [0x6b, 0x5b, 0x95],
    [0xd9, 0xe2, 0x84],
    [0x9c, 0x2f, 0x45],
    [0xf7, 0xf3, 0xe3],
];

/// Where no mirror is seen.
const NO_MIRROR: [u8; 3] = [0xf4, 0xf4, 0xf1];

/// The colour of a number of images, linear RGB.
pub fn count_color(images: u32) -> [f32; 3] {
    linear(COUNT_COLORS[(images as usize).min(COUNT_COLORS.len() - 1)])
}

/// The colour of a class, linear RGB: blue, green or orange; grey for `None`.
pub fn class_color(class: Option<Class>) -> [f32; 3] {
    linear(match class {
        None => [0x80, 0x80, 0x80],
        Some(Class::Divergent) => [0x4a, 0x7f, 0xc1],
        Some(Class::ConvergentThenDivergent) => [0x6a, 0xb1, 0x6f],
        Some(Class::Mixed) => [0xee, 0x8a, 0x3c],
    })
}

fn linear(srgb: [u8; 3]) -> [f32; 3] {
    srgb.map(srgb8_to_linear)
}

/// Each mirror pixel in the colour of its triangle's class, `classes` by mirror triangle.
///
/// # Panics
/// If `visibility` is not what `eye` sees of `scene`, or a class is lacking.
pub fn class_picture(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    classes: &[Option<Class>],
) -> Picture {
    mirror_picture(scene, eye, visibility, |_, id| class_color(classes[id as usize]))
}

/// Each mirror pixel in the colour of the number of images, over all cameras, of the point of an object that is seen
/// there; dark where none is.
///
/// # Errors
/// Cancelled.
///
/// # Panics
/// If `visibility` is not what `eye` sees of `scene`.
pub fn double_image_picture(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    scale: RayScale,
    finder: &PathFinder<'_>,
    cx: &Context,
) -> Result<Picture> {
    let width = visibility.size.width;
    let mut places = Vec::new();
    let mut points = Vec::new();
    for (i, &id) in (0_u32..).zip(&visibility.mirror_ids).filter(|(_, id)| **id != NONE_ID) {
        let (x, y) = (i % width, i / width);
        if let Some(point) = seen_point(scene, eye, id, [x, y], scale) {
            places.push(i as usize);
            points.push(point + scene.origin);
        }
    }
    let mut counts = vec![0; visibility.mirror_ids.len()];
    for (k, (points, places)) in points.chunks(CHUNK).zip(places.chunks(CHUNK)).enumerate() {
        cx.step("double images", k as f64 * CHUNK as f64 / counts.len() as f64)?;
        for (place, count) in places.iter().zip(finder.count(points, cx)?) {
            // The mirror's point is of f32: at an edge its own image may be missed.
            counts[*place] = count.images.max(1);
        }
    }
    Ok(mirror_picture(scene, eye, visibility, |i, _| count_color(counts[i])))
}

/// Points looked up between two reports of progress.
const CHUNK: usize = 1 << 13;

/// The point of an object that the camera of a mirror triangle shows at a pixel's centre, scene space.
fn seen_point(
    scene: &PreparedScene,
    eye: &Eye,
    id: u32,
    [x, y]: [u32; 2],
    scale: RayScale,
) -> Option<DVec3> {
    let surface = scene.mirror_triangle(id);
    let px = glam::Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
    let toward = eye.ray_through_px(px).as_dvec3();
    let w = weights_on_line(eye.position.as_dvec3(), toward, surface.corners)?;
    let rays = surface.corner_directions(eye.position, scale);
    let d = rays[0] * w[0] + rays[1] * w[1] + rays[2] * w[2];
    let d = d.try_normalize()?;
    let v = surface.corners.map(|v| v.as_dvec3());
    let v = v[0] * w[0] + v[1] * w[1] + v[2] * w[2];
    let hit = scene.triangles.closest(v.as_vec3(), d.as_vec3(), 0.0, f32::INFINITY)?;
    Some(v + d * f64::from(hit.t))
}

/// Colours by pixel and mirror triangle, darker where the mirror is seen at a slant.
fn mirror_picture(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    color: impl Fn(usize, u32) -> [f32; 3],
) -> Picture {
    let mut picture = Picture::black(visibility.size.width, visibility.size.height);
    for (i, (pixel, &id)) in picture.rgb.iter_mut().zip(&visibility.mirror_ids).enumerate() {
        *pixel = match id {
            NONE_ID => linear(NO_MIRROR),
            id => {
                let surface = scene.mirror_triangle(id);
                let normal = surface.normals.iter().sum::<Vec3>().normalize_or_zero();
                let view = (surface.corners[0] - eye.position).normalize_or_zero();
                let light = 0.35 + 0.65 * normal.dot(view).abs();
                color(i, id).map(|c| c * light)
            }
        };
    }
    picture
}
