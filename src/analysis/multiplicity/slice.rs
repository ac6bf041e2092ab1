//! Numbers of images over a plane: the theory as a picture. Folds are where the number changes by two, walls of view volumes
//! where it changes by one.

use glam::DVec3;
use rayon::prelude::*;

use super::{FrontCamera, MirrorCameras};
use crate::camera::three_ray::multiplicity::Jacobian;
use crate::camera::three_ray::{Rays, ThreeRay};
use crate::context::Context;
use crate::error::Result;
use crate::image::Picture;
use crate::paths::PathFinder;
use crate::scene::PreparedScene;

/// A rectangle in scene space, and how many images its points have.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// The corner at the lower left, scene space.
    pub corner: DVec3,
    /// Its side to the right, and that upwards: directions and lengths.
    pub sides: [DVec3; 2],
    /// Columns and rows.
    pub pixels: [u32; 2],
    /// Images at the middle of each pixel, row by row from the top, each from the left.
    pub counts: Vec<u32>,
}

impl Slice {
    /// The rectangle without its counts.
    fn empty(corner: DVec3, sides: [DVec3; 2], pixels: [u32; 2]) -> Self {
        Self { corner, sides, pixels, counts: Vec::new() }
    }

    /// The middles of the pixels, in their order.
    fn points(&self) -> impl Iterator<Item = DVec3> + '_ {
        let [columns, rows] = self.pixels;
        (0..rows).flat_map(move |y| (0..columns).map(move |x| self.point(x, y)))
    }

    fn point(&self, x: u32, y: u32) -> DVec3 {
        let [columns, rows] = self.pixels.map(f64::from);
        let right = (f64::from(x) + 0.5) / columns;
        let up = 1.0 - (f64::from(y) + 0.5) / rows;
        self.corner + self.sides[0] * right + self.sides[1] * up
    }

    /// How many pixels have how many images: entry n is for n.
    pub fn histogram(&self) -> Vec<u32> {
        let most = self.counts.iter().copied().max().map_or(0, |most| most as usize + 1);
        let mut histogram = vec![0; most];
        self.counts.iter().for_each(|&n| histogram[n as usize] += 1);
        histogram
    }

    /// Coloured by [`count_color`](super::count_color).
    pub fn picture(&self) -> Picture {
        let [width, height] = self.pixels;
        Picture { width, height, rgb: self.counts.iter().map(|&n| super::count_color(n)).collect() }
    }
}

/// How far beyond its ends a mixed interval is shown, in its length.
const BEYOND: f64 = 0.6;

/// The images in one camera about its widest mixed interval, over the plane in which its rays cross: through the middle of
/// the fold halfway, with the ray there (to the right, away from the mirror) and the way along which neighbouring rays meet
/// it. `None` if the camera is not mixed up to its reach.
pub fn camera_slice(camera: &FrontCamera, pixels: [u32; 2]) -> Option<Slice> {
    let width = |[from, to]: [f64; 2]| to - from;
    // Of the part in front: elsewhere folds are not seen.
    let intervals = camera.parts().flat_map(|part| {
        let mixed = Jacobian::of(&part).mixed_intervals(0.0, camera.reach);
        mixed.as_slice().iter().map(|interval| (part, *interval)).collect::<Vec<_>>()
    });
    let (rays, widest) = intervals.max_by(|a, b| width(a.1).total_cmp(&width(b.1)))?;
    let lambda = 0.5 * (widest[0] + widest[1]);
    let [a, b] = Jacobian::of(&rays).fold(lambda)?;
    let w = (a + b) * 0.5;
    let beyond = BEYOND * (widest[1] - widest[0]);
    let (start, end) = ((widest[0] - beyond).max(0.0), (widest[1] + beyond).min(camera.reach));
    let (v, d) = rays.at(w);
    let along = d.try_normalize()?;
    let across = crossing(&rays, w, lambda)?;
    let across = (across - along * across.dot(along)).try_normalize()?;
    let steps = (0..=STEPS).map(|k| start + (end - start) * f64::from(k) / f64::from(STEPS));
    let widest = steps.flat_map(|lambda| {
        let corners = [0, 1, 2].map(|i| rays.origins[i] + rays.directions[i] * lambda - v);
        crossings(corners, along.cross(across)).map(|point| point.dot(across).abs())
    });
    let widest = widest.fold(0.0, f64::max);
    let sides = [d * (end - start), across * (2.0 * widest)];
    let mut slice = Slice::empty(v + d * start - across * widest, sides, pixels);
    let three_ray = ThreeRay::new(&camera.rays, &camera.rays);
    let points: Vec<DVec3> = slice.points().collect();
    let count = |point: &DVec3| u32::try_from(camera.images(&three_ray, *point)).unwrap_or(0);
    slice.counts = points.par_iter().map(count).collect();
    Some(slice)
}

/// How often a view volume's width is measured.
const STEPS: u32 = 32;

/// Where a triangle's edges cross the plane through the origin with this normal.
fn crossings(corners: [DVec3; 3], normal: DVec3) -> impl Iterator<Item = DVec3> {
    [(0, 1), (1, 2), (2, 0)].into_iter().filter_map(move |(i, j)| {
        let [a, b] = [corners[i], corners[j]].map(|p| p.dot(normal));
        ((a < 0.0) != (b < 0.0)).then(|| corners[i].lerp(corners[j], a / (a - b)))
    })
}

/// The way on the mirror along which rays meet the one at `w`, which touches the fold at λ: E(λ) turns it into d.
fn crossing(rays: &Rays, w: DVec3, lambda: f64) -> Option<DVec3> {
    let ([v1, v2, v3], [d1, d2, d3]) = (rays.origins, rays.directions);
    let (e1, e2) = (v2 - v1, v3 - v1);
    let (moved1, moved2) = (e1 + (d2 - d1) * lambda, e2 + (d3 - d1) * lambda);
    let n = moved1.cross(moved2);
    let (_, d) = rays.at(w);
    let along = e1 * d.cross(moved2).dot(n) + e2 * moved1.cross(d).dot(n);
    along.try_normalize()
}

/// The side of a mirror's slice, in diagonals of the mirrors' box.
const MIRROR_SIDE: f64 = 1.5;
/// Its middle lies so far from the box's along the rays' mean direction.
const MIRROR_SHIFT: f64 = 0.45;

/// The images over all cameras, on the plane through the middle of the mirrors and the eye that holds the eye's upward
/// direction; a square that extends to where the rays go.
///
/// # Errors
/// Cancelled.
pub fn mirror_slice(
    scene: &PreparedScene,
    cameras: &MirrorCameras,
    finder: &PathFinder<'_>,
    pixels: [u32; 2],
    cx: &Context,
) -> Result<Slice> {
    let bounds = scene.mirror_triangles.bounds();
    let (middle, size) = (bounds.center().as_dvec3(), f64::from(bounds.diagonal()));
    let up = scene.eye.up.normalize_or(DVec3::Y);
    let toward = scene.eye.position - scene.origin - middle;
    let level = toward - up * toward.dot(up);
    let beside = up.any_orthonormal_vector();
    let right = if level.length() > 1e-3 * toward.length() { level } else { beside };
    let right = right.normalize_or(beside);
    let mean: DVec3 = cameras
        .cameras
        .iter()
        .flat_map(|camera| camera.rays.directions)
        .map(|d| d.normalize_or_zero())
        .sum();
    let mean = (right * mean.dot(right) + up * mean.dot(up)).normalize_or_zero();
    let side = MIRROR_SIDE * size;
    let middle = middle + mean * (MIRROR_SHIFT * size);
    let aspect = f64::from(pixels[0]) / f64::from(pixels[1]);
    let sides = [right * (side * aspect), up * side];
    let mut slice = Slice::empty(middle - (sides[0] + sides[1]) * 0.5, sides, pixels);
    let points: Vec<DVec3> = slice.points().map(|p| p + scene.origin).collect();
    for (k, chunk) in points.chunks(CHUNK).enumerate() {
        cx.step("slicing", (k * CHUNK) as f64 / points.len() as f64)?;
        slice.counts.extend(finder.count(chunk, cx)?.iter().map(|count| count.images));
    }
    Ok(slice)
}

/// Points looked up between two reports of progress.
const CHUNK: usize = 1 << 13;
