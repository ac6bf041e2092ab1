//! The final picture: what the eye sees directly, with the reflected layer on the mirrors, antialiased.
//!
//! A pixel is the average of its samples in linear light. Every sample is clamped to the display range
//! *before* that: next to something brighter than white, an edge would otherwise be as jagged as without
//! antialiasing, since a fifth of the pixel would already turn all of it white.

mod painter;
mod spots;

use fearless_simd::{Simd, dispatch, f32x16};
use glam::Vec3;
use rayon::prelude::*;

use self::painter::Painter;
pub use self::spots::{Colors, CornerValues, LANES, Spots, VALUES};
use crate::camera::Eye;
use crate::geometry::lanes::{Real, Vector, simd_level};
use crate::visibility::{SAMPLES, SurfaceMesh, Visibility};

/// A point of an object that the eye sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the object.
    pub object: usize,
    /// Index of the triangle within it.
    pub triangle: usize,
    /// Barycentric weights in that triangle; not negative, sum 1.
    pub weights: [f32; 3],
    /// The same point in scene space.
    pub point: Vec3,
}

/// What surfaces and sky look like: the scene's side of [`compose`]. Colours are linear RGB.
///
/// What is asked for in lanes has a default that asks for single points.
pub trait Appearance: Sync {
    /// Reflectance at a point: asked for at every sample, so that patterns are antialiased as well.
    fn albedo(&self, hit: &Hit) -> Vec3;

    /// The light that the reflectance is multiplied by: asked for once for what a pixel shows of a smooth surface, since it
    /// may cost a shadow ray.
    fn light(&self, hit: &Hit) -> Vec3;

    /// Radiance from a direction (unit, scene space, away from the eye).
    fn sky(&self, direction: Vec3) -> Vec3;

    /// Factor of what a mirror reflects.
    fn tint(&self, mirror: usize) -> Vec3;

    /// Whether the reflectance of an object depends on the place.
    fn varies(&self, _object: usize) -> bool {
        true
    }

    /// What [`Appearance::paint`] wants to have interpolated over a triangle.
    fn corner_values(&self, _object: usize, _triangle: usize) -> CornerValues {
        [[0.0; VALUES]; 3]
    }

    /// The sum over the samples of each of `spots` of what they show of an object, each of them clamped to `white`.
    #[inline(always)]
    fn paint<S: Simd>(
        &self,
        _simd: S,
        mesh: &SurfaceMesh,
        object: usize,
        spots: &Spots,
        white: f32,
        out: &mut Colors,
    ) {
        for lane in 0..spots.len {
            let light = self.light(&spots.own_hit(mesh, object, lane));
            let mut sum = Vec3::ZERO;
            for sample in (0..SAMPLES).filter(|&s| spots.samples[s][lane] > 0.0) {
                let albedo = self.albedo(&spots.sample_hit(mesh, object, lane, sample));
                sum += (albedo * light).clamp(Vec3::ZERO, Vec3::splat(white));
            }
            for (lanes, value) in out.iter_mut().zip(sum.to_array()) {
                lanes[lane] = value;
            }
        }
    }

    /// [`Appearance::sky`], in lanes.
    #[inline(always)]
    fn sky_in<S: Simd>(&self, simd: S, direction: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
        let [mut x, mut y, mut z] = [[0.0; 16]; 3];
        direction[0].store(&mut x);
        direction[1].store(&mut y);
        direction[2].store(&mut z);
        for ((x, y), z) in x.iter_mut().zip(&mut y).zip(&mut z) {
            [*x, *y, *z] = self.sky(Vec3::new(*x, *y, *z)).to_array();
        }
        [f32x16::load(simd, &x), f32x16::load(simd, &y), f32x16::load(simd, &z)]
    }
}

/// What [`compose`] puts together.
#[derive(Clone, Copy, Debug)]
pub struct DirectView<'a> {
    /// As given to [`Visibility::update`].
    pub eye: &'a Eye,
    /// As given to [`Visibility::update`].
    pub mirrors: &'a [SurfaceMesh<'a>],
    /// As given to [`Visibility::update`].
    pub objects: &'a [SurfaceMesh<'a>],
    /// What they look like from the eye.
    pub visibility: &'a Visibility,
    /// Per pixel: what the mirror at its centre reflects, linear RGB with the tint applied. Read where
    /// `visibility.mirror_ids` is set.
    pub reflection: &'a [Vec3],
    /// The display's white, to which every channel of every sample is clamped; infinity for pictures that
    /// keep brighter values.
    pub white: f32,
}

/// Rows a task: what it shows of one object is painted together, in lanes.
const BAND: usize = 8;

/// Puts the picture together: `out` is row by row from the top left, linear RGB.
///
/// Objects get one reflectance a sample and one light a smooth surface; the sky gets one value. A mirror's samples get the
/// pixel's own reflection, or, if another surface is at its centre, the mean of the neighbours that show
/// the mirror at theirs, or, if there are none, the sky by the triangle's flat reflection.
///
/// # Panics
/// If a plane has another size than the picture, or the surfaces are not those of the visibility.
pub fn compose(view: &DirectView, appearance: &impl Appearance, out: &mut [[f32; 3]]) {
    let pixels = view.visibility.size.pixels();
    assert_eq!((view.reflection.len(), out.len()), (pixels, pixels), "planes of one size");
    let width = view.visibility.size.width as usize;
    let level = simd_level();
    out.par_chunks_mut((BAND * width).max(1)).enumerate().for_each_init(
        painter::Scratch::default,
        |scratch, (i, band)| {
            let mut painter = Painter::new(view, appearance, i * BAND * width, band, scratch);
            dispatch!(level, simd => painter.paint(simd));
        },
    );
}

/// As the display shows it: see [`DirectView::white`].
#[inline(always)]
pub fn clamped<R: Real<Scalar = f32>>(radiance: R, white: f32) -> R {
    radiance.max(radiance.splat(0.0)).min(radiance.splat(white))
}

#[cfg(test)]
mod tests;
