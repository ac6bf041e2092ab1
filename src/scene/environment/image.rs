//! An environment from a panorama: a cube map whose lookup needs no trigonometry.

#[cfg(feature = "cli")]
use std::path::PathBuf;

use super::resample::resample;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::lanes::gather::Gather;
use crate::image::Picture;

/// How a panorama hangs around the scene.
///
/// Unturned, its middle is straight ahead along -z, its right half towards +x, its upper edge at +y: seen from inside with y
/// up, it is not mirrored.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mounting {
    /// How far it is turned about +y, counterclockwise seen from above; degrees. With 90 its middle is at -x.
    pub rotate_deg: f64,
    /// Radiance is multiplied by 2 to the power of this; at most [`MOST_EXPOSURE`] up or down.
    pub exposure: f64,
}

/// Stops: more would make any picture black or white.
pub const MOST_EXPOSURE: f64 = 32.0;
/// A panorama is twice as wide as high, to this share of its width: a row or two may be cut off.
const OUT_OF_SHAPE: f64 = 0.01;
/// Pixels of a panorama at most: 512 MiB of linear RGB, 9458 x 4729.
const MOST_PIXELS: u64 = (512 << 20) / 12;

/// Radiance by direction, kept at nodes on the faces of a cube, with bilinear interpolation between them. Faces share the
/// nodes on their common edges, so there are no seams.
///
/// Nodes lie about as close as a panorama's pixels at its horizon, up to 1364 cells a side of a face (128 MiB, what a
/// binding of WebGPU may hold), which is what a panorama of 4285 pixels across has. Wider ones are averaged by area, and so are the rows near
/// the poles, where pixels crowd. There are no smaller copies of it: what reads it knows directions, not how much a pixel sees, so
/// strongly curved mirrors alias in a detailed panorama unless there are several rays a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentImage {
    cells: u32,
    /// Face by face as in [`FACES`](crate::camera::reflector::cube::FACES), row by row, `cells` + 1 a row.
    nodes: Vec<[f32; 3]>,
    mounting: Mounting,
    /// The file that it was read from, if it was.
    #[cfg(feature = "cli")]
    pub source: Option<PathBuf>,
}

impl EnvironmentImage {
    /// Of a panorama: equirectangular, linear RGB. Negative values count as 0, those beyond 1e30 as that.
    ///
    /// # Errors
    /// [`Error::Input`] if its shape or size is none of a panorama, a value is not finite, or the mounting is out of range;
    /// [`Error::Cancelled`].
    ///
    /// # Panics
    /// If it has another number of pixels than it says.
    pub fn new(panorama: &Picture, mounting: Mounting, cx: &Context) -> Result<Self> {
        const NAME: &str = "the environment's picture";
        let &Picture { width, height, ref rgb } = panorama;
        assert_eq!(rgb.len(), width as usize * height as usize, "pixels of {width}x{height}");
        if let Some((problem, remedy)) = misshapen(width, height) {
            return Err(Error::input(NAME, "", problem, remedy));
        }
        if let Some(i) = rgb.iter().flatten().position(|v| !v.is_finite()) {
            let (x, y) = (i / 3 % width as usize, i / 3 / width as usize);
            let problem = "the value is not a finite number";
            return Err(Error::input(NAME, format!("pixel ({x}, {y})"), problem, "mend it"));
        }
        if let Some(problem) = mounting.defect() {
            return Err(Error::input(NAME, "", problem, "choose another one"));
        }
        let (cells, nodes) = resample(panorama, mounting, cx)?;
        Ok(Self {
            cells,
            nodes,
            mounting,
            #[cfg(feature = "cli")]
            source: None,
        })
    }

    /// How it hangs.
    pub fn mounting(&self) -> Mounting {
        self.mounting
    }

    /// Cells along a side of a face: one less than nodes.
    pub fn cells(&self) -> u32 {
        self.cells
    }

    /// Linear RGB: face +x, -x, +y, -y, +z, -z, each row by row with [`Self::cells`] + 1 nodes a row. Twins read it.
    pub fn nodes(&self) -> &[[f32; 3]] {
        &self.nodes
    }

    /// Radiance from a direction of any length but zero, in lanes; world axes.
    #[inline(always)]
    pub fn radiance_in<R: Gather>(&self, [x, y, z]: [R; 3]) -> [R; 3] {
        let (zero, one) = (x.splat(0.0), x.splat(1.0));
        let (wide, high, deep) = (x.abs(), y.abs(), z.abs());
        let across = !(wide.lt(high) | wide.lt(deep));
        let upright = !across & !high.lt(deep);
        let front = R::select(across, x, R::select(upright, y, z));
        let behind = front.lt(zero);
        let sign = R::select(behind, -one, one);
        // Along the columns and rows of that face.
        let column = R::select(across, -(sign * z), R::select(upright, x, sign * x));
        let row = R::select(upright, sign * z, -y);
        let face = R::select(across, zero, R::select(upright, x.splat(2.0), x.splat(4.0)))
            + R::select(behind, one, zero);

        let depth = front.abs().max(x.splat(f32::MIN_POSITIVE));
        let cells = self.cells as f32;
        let place = |along: R| (along / depth + 1.0) * (0.5 * cells);
        let cell = |place: R| place.floor().max(zero).min(x.splat(cells - 1.0));
        let (px, py) = (place(column), place(row));
        let (i, j) = (cell(px), cell(py));
        // Whole numbers below 2^24: exact.
        let stride = cells + 1.0;
        let corners = ((face * stride + j) * stride + i).gather(|at| self.corners(at));

        let (right, below) = (px - i, py - j);
        let (left, above) = (one - right, one - below);
        let mut radiance = [zero; 3];
        for (k, radiance) in radiance.iter_mut().enumerate() {
            let upper = corners[k] * left + corners[3 + k] * right;
            let lower = corners[6 + k] * left + corners[9 + k] * right;
            *radiance = upper * above + lower * below;
        }
        radiance
    }

    /// A node, the next one of its row, and the two below them.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
    #[inline(always)]
    fn corners(&self, first: f32) -> [f32; 12] {
        let at = first as usize;
        let below = at + self.cells as usize + 1;
        let [[a, b, c], [d, e, f]] = [self.nodes[at], self.nodes[at + 1]];
        let [[g, h, i], [j, k, l]] = [self.nodes[below], self.nodes[below + 1]];
        [a, b, c, d, e, f, g, h, i, j, k, l]
    }
}

impl Mounting {
    /// What is wrong with it, if anything is.
    pub(crate) fn defect(&self) -> Option<String> {
        let Self { rotate_deg, exposure } = *self;
        if !rotate_deg.is_finite() {
            Some(format!("a rotation of {rotate_deg} degrees is not a finite number"))
        } else if !(-MOST_EXPOSURE..=MOST_EXPOSURE).contains(&exposure) {
            let most = MOST_EXPOSURE;
            Some(format!("an exposure of {exposure} stops is not between -{most} and {most}"))
        } else {
            None
        }
    }
}

/// Why a picture of this size is no panorama, and what to do; `None` if it is one.
pub(crate) fn misshapen(width: u32, height: u32) -> Option<(String, &'static str)> {
    let size = format!("{width}x{height} pixels");
    let (w, h) = (f64::from(width), f64::from(height));
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        let problem = format!("{size} are more than an environment may have");
        Some((problem, "scale it down: 8192x4096 is enough for any"))
    } else if width == 0 || height == 0 || (w - 2.0 * h).abs() > (OUT_OF_SHAPE * w).max(1.0) {
        let problem = format!("{size} are no panorama, which is twice as wide as high");
        Some((problem, "give an equirectangular picture of all directions"))
    } else {
        None
    }
}

#[cfg(test)]
mod tests;
