//! From an equirectangular panorama to the nodes of a cube map, filtered by area.
//!
//! The panorama is first averaged to pixels that see about as much in both directions: along each row over the width that one of
//! the horizon's pixels has there, so that the poles are smooth; and over a node's spacing, where nodes lie farther apart
//! than pixels. At the horizon of a panorama that is not too large nothing is averaged. Nodes then interpolate between four pixels.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::image::Mounting;
use crate::context::Context;
use crate::error::Result;
use crate::image::Picture;

/// Cells a side per pixel across. 1/π would give a face's middle, where nodes lie farthest apart, the panorama's resolution at
/// the horizon; a quarter more, so that interpolating twice takes little of what is sharp (untuned).
const CELLS_PER_PIXEL: f64 = 0.4;
/// With fewer, what lies between a tiny picture's pixels would not be their interpolation.
const LEAST_CELLS: f64 = 16.0;
/// 6 · 1365² nodes of 12 bytes are 128 MiB, but for a few.
pub(super) const MOST_CELLS: f64 = 1364.0;
/// Radiance beyond this is cut: sums of many stay finite in f32.
pub(super) const BRIGHTEST: f64 = 1e30;

/// What the progress says.
const STAGE: &str = "placing the environment";

/// Cells a side of a face, and its nodes (see [`EnvironmentImage::nodes`](super::image::EnvironmentImage::nodes)).
pub(super) fn resample(
    panorama: &Picture,
    mounting: Mounting,
    cx: &Context,
) -> Result<(u32, Vec<[f32; 3]>)> {
    use crate::camera::reflector::cube::FACES;
    let cells = cells(panorama.width);
    cx.step(STAGE, 0.0)?;
    let smooth = Smooth::new(panorama, f64::from(panorama.width) / (PI * f64::from(cells)), cx)?;
    let (sin, cos) = mounting.rotate_deg.to_radians().sin_cos();
    let factor = mounting.exposure.exp2();
    let row = cells as usize + 1;
    let mut nodes = vec![[0.0; 3]; 6 * row * row];
    // The same numbers on both sides of an edge, so that shared nodes are the same.
    let along = |k: usize| (2.0 * k as f64 - f64::from(cells)) / f64::from(cells);
    for (face, (nodes, axes)) in nodes.chunks_mut(row * row).zip(FACES).enumerate() {
        cx.step(STAGE, (face as f64 + 1.0) / 7.0)?;
        let [front, columns, rows] = axes.map(glam::Vec3::as_dvec3);
        nodes.par_chunks_mut(row).enumerate().for_each(|(j, nodes)| {
            for (i, node) in nodes.iter_mut().enumerate() {
                let d = front + columns * along(i) + rows * along(j);
                // Where the panorama shows it, before it was turned.
                let (x, z) = (d.x * cos - d.z * sin, d.x * sin + d.z * cos);
                let east = x.atan2(-z);
                let north = d.y.atan2(x.hypot(z));
                *node = smooth.at(east, north).map(|v| exposed(v, factor));
            }
        });
    }
    cx.step(STAGE, 1.0)?;
    Ok((cells, nodes))
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
fn cells(width: u32) -> u32 {
    (CELLS_PER_PIXEL * f64::from(width)).ceil().clamp(LEAST_CELLS, MOST_CELLS) as u32
}

#[expect(clippy::cast_possible_truncation, reason = "the one rounding")]
fn exposed(value: f64, factor: f64) -> f32 {
    (value * factor).min(BRIGHTEST) as f32
}

type Color = [f64; 3];

/// A panorama whose pixels have been averaged, none of them negative.
struct Smooth {
    width: usize,
    height: usize,
    rgb: Vec<[f32; 3]>,
}

impl Smooth {
    /// `spacing`: of nodes, in pixels at the horizon.
    fn new(panorama: &Picture, spacing: f64, cx: &Context) -> Result<Self> {
        let (width, height) = (panorama.width as usize, panorama.height as usize);
        let spacing = spacing.max(1.0);
        let mut rgb = vec![[0.0; 3]; width * height];
        rgb.par_chunks_mut(width).enumerate().try_for_each(|(y, out)| {
            cx.check()?;
            let north = PI * (0.5 - (y as f64 + 0.5) / height as f64);
            let window = Window::new((spacing / north.cos()).min(width as f64));
            let row = &panorama.rgb[y * width..(y + 1) * width];
            for (x, color) in out.iter_mut().enumerate() {
                let wrap = |step: isize| (x.wrapping_add_signed(step)).wrapping_add(width) % width;
                *color = window.mean(|step| row[wrap(step)]);
            }
            Ok::<(), crate::Error>(())
        })?;
        if spacing > 1.0 {
            let window = Window::new(spacing);
            let rows = rgb;
            rgb = vec![[0.0; 3]; width * height];
            rgb.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
                for (x, color) in out.iter_mut().enumerate() {
                    let row = |step: isize| y.saturating_add_signed(step).min(height - 1);
                    *color = window.mean(|step| rows[row(step) * width + x]);
                }
            });
        }
        Ok(Self { width, height, rgb })
    }

    /// Between four pixels. `east`: from the middle to the right, -π to π; `north`: from the horizon upwards; radians.
    #[expect(clippy::cast_possible_truncation, reason = "a row or column")]
    fn at(&self, east: f64, north: f64) -> Color {
        let x = (0.5 + east / TAU) * self.width as f64 - 0.5;
        let y = (0.5 - north / PI) * self.height as f64 - 0.5;
        let above = y.floor();
        let (upper, lower) = (self.on_row(above as isize, x), self.on_row(above as isize + 1, x));
        mix(upper, lower, y - above)
    }

    /// Between two pixels of a row; rows beyond a pole are those on its other side.
    #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "sides")]
    fn on_row(&self, y: isize, x: f64) -> Color {
        let (width, height) = (self.width, self.height as isize);
        let half = 0.5 * width as f64;
        let (y, x) = match y {
            y if y < 0 => (-1 - y, x + half),
            y if y >= height => (2 * height - 1 - y, x + half),
            y => (y, x),
        };
        let left = x.floor();
        let column = |c: isize| c.rem_euclid(width as isize).unsigned_abs();
        let pixel = |c: isize| {
            self.rgb[y.clamp(0, height - 1).unsigned_abs() * width + column(c)].map(f64::from)
        };
        mix(pixel(left as isize), pixel(left as isize + 1), x - left)
    }
}

fn mix(a: Color, b: Color, share: f64) -> Color {
    std::array::from_fn(|k| a[k] * (1.0 - share) + b[k] * share)
}

/// A mean over a width of 1 pixel or more around a pixel's middle.
struct Window {
    /// Whole pixels on either side, beside the own one.
    whole: isize,
    /// Of the next one on either side.
    part: f64,
    width: f64,
}

impl Window {
    #[expect(clippy::cast_possible_truncation, reason = "no wider than the picture")]
    fn new(width: f64) -> Self {
        let side = 0.5 * (width - 1.0);
        Self { whole: side.floor() as isize, part: side.fract(), width }
    }

    /// Summed one by one: a running sum would lose what is dark beside the sun.
    #[expect(clippy::cast_possible_truncation, reason = "the one rounding")]
    fn mean(&self, color: impl Fn(isize) -> [f32; 3]) -> [f32; 3] {
        let mut sum = [0.0; 3];
        let mut add = |step: isize, weight: f64| {
            for (sum, value) in sum.iter_mut().zip(color(step)) {
                *sum += f64::from(value.max(0.0)) * weight;
            }
        };
        for step in -self.whole..=self.whole {
            add(step, 1.0);
        }
        if self.part > 0.0 {
            add(-self.whole - 1, self.part);
            add(self.whole + 1, self.part);
        }
        sum.map(|sum| (sum / self.width).min(BRIGHTEST) as f32)
    }
}
