//! What the eye sees directly: which surface triangle each sample of each pixel shows. Made once a frame
//! on the CPU and used by every method and backend.
//!
//! The data flow, led by `raster`: `project` moves the corners onto a fixed-point picture plane and clips the
//! triangles that leave it, `tiles` sorts them, `fill` decides the samples. Apart from that, `weights` says
//! where on a triangle a view ray meets it, and `mirror_rays` how the mirrors' pixels send their rays on.

mod fill;
pub(crate) mod mirror_rays;
mod patches;
mod project;
mod raster;
mod tiles;
mod weights;

use glam::Vec3;

use crate::camera::Eye;
use crate::camera::eye::ImageSize;
use crate::geometry::Aabb;

pub use patches::{Cell, MirrorTriangleIndex, OwnPixels, Patch, PatchScratch, PixelRect, patches};
pub use project::MAX_SIDE;
pub use raster::Scratch;
pub use weights::{RayWeights, barycentrics};

/// Marks a sample that shows no triangle.
pub const NONE_ID: u32 = u32::MAX;

/// Samples a pixel.
pub const SAMPLES: usize = 5;

/// Where the samples lie in their pixel, in eighths of it from its top left corner: the centre, then a
/// rotated grid of four, no two of the five in one row or column.
pub const SAMPLE_EIGHTHS: [[u8; 2]; SAMPLES] = [[4, 4], [3, 1], [7, 3], [5, 7], [1, 5]];

/// The triangles of one mirror or object in scene space. Indices are trusted.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceMesh<'a> {
    /// Vertex positions, scene space. Triangles with one that is not finite are not drawn.
    pub positions: &'a [Vec3],
    /// Vertex indices of each triangle; both of its sides are visible.
    pub triangles: &'a [[u32; 3]],
    /// Of a surface that encloses something, with its triangles counter-clockwise from outside: a box that holds it. From outside
    /// of that, sides that are seen from behind are hidden by others and left out.
    pub encloses: Option<Aabb>,
}

impl SurfaceMesh<'_> {
    /// Corner positions of a triangle, scene space.
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
    }
}

/// Which triangles are seen, row by row from the top left. Triangle ids count through the mirrors'
/// triangles first, in their order, then through the objects'.
#[derive(Clone, Debug, PartialEq)]
pub struct Visibility {
    /// Picture size.
    pub size: ImageSize,
    /// Per pixel: the id of the triangle that each sample shows, or [`NONE_ID`]. See [`SAMPLE_EIGHTHS`].
    pub samples: Vec<[u32; SAMPLES]>,
    /// Per pixel: the id of the mirror triangle seen at its centre, or [`NONE_ID`].
    pub mirror_ids: Vec<u32>,
    /// Per pixel: the depth of that mirror point along the eye's `forward`, or infinity.
    pub mirror_depth: Vec<f32>,
    /// The first id of each surface, mirrors first; behind them the number of all triangles.
    first_ids: Vec<u32>,
    mirrors: usize,
}

impl Default for Visibility {
    /// An empty picture, to be filled by [`Visibility::update`].
    fn default() -> Self {
        Self {
            size: ImageSize { width: 0, height: 0 },
            samples: Vec::new(),
            mirror_ids: Vec::new(),
            mirror_depth: Vec::new(),
            first_ids: vec![0],
            mirrors: 0,
        }
    }
}

impl Visibility {
    /// Sees the surfaces from `eye`. Reuses the memory of the last frame; the result depends on nothing
    /// but `eye` and the surfaces.
    ///
    /// Nearest wins, ties go to the lower id. What is nearer along `forward` than a millionth of the
    /// scene's diagonal is not seen. A picture side beyond [`MAX_SIDE`] stays empty there.
    ///
    /// # Panics
    /// If there are 2³² - 1 triangles or more, or a vertex index is out of range.
    pub fn update(
        &mut self,
        eye: &Eye,
        mirrors: &[SurfaceMesh],
        objects: &[SurfaceMesh],
        scratch: &mut Scratch,
    ) {
        self.mirrors = mirrors.len();
        self.first_ids.clear();
        let mut total = 0_usize;
        for surface in mirrors.iter().chain(objects) {
            self.first_ids.push(id(total));
            total += surface.triangles.len();
        }
        self.first_ids.push(id(total));

        self.size = eye.size;
        let pixels = eye.size.pixels();
        self.samples.resize(pixels, [NONE_ID; SAMPLES]);
        self.mirror_ids.resize(pixels, NONE_ID);
        self.mirror_depth.resize(pixels, f32::INFINITY);
        raster::draw(eye, mirrors, objects, scratch, self);
    }

    /// The first id of each surface, mirrors first; behind them the number of all triangles.
    pub fn first_ids(&self) -> &[u32] {
        &self.first_ids
    }

    /// How many surfaces are mirrors: surfaces 0 to this.
    pub fn mirrors(&self) -> usize {
        self.mirrors
    }

    /// How many triangles the mirrors have together: ids below this are mirrors'.
    pub fn mirror_triangles(&self) -> u32 {
        self.first_ids[self.mirrors]
    }

    /// The ids of one surface's triangles; surfaces are numbered mirrors first.
    ///
    /// # Panics
    /// If there is no such surface.
    pub fn ids(&self, surface: usize) -> std::ops::Range<u32> {
        self.first_ids[surface]..self.first_ids[surface + 1]
    }

    /// The surface (mirrors first) and the triangle within it that `id` stands for. `None` for
    /// [`NONE_ID`] and every other id that no triangle has.
    pub fn locate(&self, id: u32) -> Option<(usize, usize)> {
        // An empty surface shares its first id with the next one: the last one with it has the triangle.
        let surface = self.first_ids.partition_point(|&first| first <= id).checked_sub(1)?;
        (surface + 1 < self.first_ids.len())
            .then(|| (surface, (id - self.first_ids[surface]) as usize))
    }
}

#[expect(clippy::cast_possible_truncation, reason = "checked against the largest id")]
fn id(count: usize) -> u32 {
    assert!(count < NONE_ID as usize, "{count} triangles are more than there are ids");
    count as u32
}

#[cfg(test)]
mod tests;
