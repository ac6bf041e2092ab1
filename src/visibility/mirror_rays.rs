//! The exact rays of one tile: for every pixel the view ray, reflected at the interpolated normal.

#![expect(clippy::needless_range_loop, reason = "compilers see through indices best")]

use fearless_simd::{Simd, SimdBase, SimdMask, u32x16};
use glam::{DVec3, Vec3};

use super::{NONE_ID, Visibility};
use crate::camera::Eye;
use crate::scene::prepared::PreparedScene;

/// Columns and rows of a tile. A row is a word of bits.
pub(crate) const TILE_PX: u32 = 32;
/// The same for indices.
pub(crate) const TILE: usize = TILE_PX as usize;
/// Elements of a tile, by row.
pub(crate) const AREA: usize = TILE * TILE;

/// Quantities that are linear over the picture, at (x, y) pixels from the middle of the tile.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Linear<const N: usize> {
    pub(crate) at: [f32; N],
    pub(crate) right: [f32; N],
    pub(crate) down: [f32; N],
}

impl<const N: usize> Default for Linear<N> {
    fn default() -> Self {
        Self { at: [0.0; N], right: [0.0; N], down: [0.0; N] }
    }
}

impl<const N: usize> Linear<N> {
    #[inline(always)]
    pub(crate) fn get(&self, k: usize, x: f32, y: f32) -> f32 {
        self.at[k] + x * self.right[k] + y * self.down[k]
    }
}

/// The position of the centre of column or row `i`, relative to the middle of its tile.
#[inline(always)]
pub(crate) fn centre(i: usize) -> f32 {
    i as f32 + 0.5 - TILE as f32 * 0.5
}

/// A mirror triangle as a tile sees it: both quantities are linear in the picture.
#[derive(Clone, Copy)]
struct Facet {
    id: u32,
    /// A multiple of the interpolated normal, and the inverse depth along the eye's `forward`.
    normal_and_inverse: Linear<4>,
}

/// Facets that a tile keeps at hand, by the low bits of their ids.
const FACETS: usize = 64;

/// One quantity a pixel. A ray that leaves the mirror at depth z runs along z · (`field[0]`, `field[1]`, `field[2]`);
/// `field[3]` is 1/z.
pub(crate) struct RayField {
    pub(crate) field: [[f32; AREA]; 4],
    pub(crate) ids: [u32; AREA],
    view: Linear<3>,
    /// Of the tile, in pixels.
    middle: [f32; 2],
    facets: [Facet; FACETS],
}

impl RayField {
    pub(crate) fn new() -> Box<Self> {
        let facet = Facet { id: NONE_ID, normal_and_inverse: Linear::default() };
        Box::new(Self {
            field: [[0.0; AREA]; 4],
            ids: [NONE_ID; AREA],
            view: Linear::default(),
            middle: [0.0; 2],
            facets: [facet; FACETS],
        })
    }

    /// Goes to the tile whose first pixel is (`left`, `top`); returns by row which pixels show a mirror.
    #[inline(always)]
    pub(crate) fn enter<S: Simd>(
        &mut self,
        simd: S,
        eye: &Eye,
        visibility: &Visibility,
        [left, top]: [u32; 2],
    ) -> [u32; TILE] {
        let mut shown = [0u32; TILE];
        let size = eye.size;
        let columns = (size.width - left).min(TILE_PX) as usize;
        let rows = (size.height - top).min(TILE_PX) as usize;
        self.ids.fill(NONE_ID);
        for (y, shown) in shown.iter_mut().enumerate().take(rows) {
            let from = (top as usize + y) * size.width as usize + left as usize;
            let ids = &visibility.mirror_ids[from..from + columns];
            self.ids[y * TILE..y * TILE + columns].copy_from_slice(ids);
            for half in 0..2 {
                let ids = &self.ids[y * TILE + 16 * half..][..16];
                let none = u32x16::from_slice(simd, ids).simd_eq(NONE_ID);
                #[expect(clippy::cast_possible_truncation, reason = "sixteen bits")]
                let some = !none.to_bitmask() as u32 & 0xffff;
                *shown |= some << (16 * half);
            }
        }
        if shown == [0; TILE] {
            return shown;
        }
        let half = TILE as f32 * 0.5;
        let middle = [left as f32 + half, top as f32 + half];
        let (right, down) = (eye.right / eye.focal_px, -eye.up / eye.focal_px);
        self.view = Linear {
            at: eye.ray_through_px(middle.into()).to_array(),
            right: right.to_array(),
            down: down.to_array(),
        };
        for i in 0..FACETS {
            self.facets[i].id = NONE_ID;
        }
        self.middle = middle;
        shown
    }

    /// Fills in the rays of the pixels of `mask`, of which all must show a mirror.
    #[inline(always)]
    pub(crate) fn fill(&mut self, eye: &Eye, scene: &PreparedScene, mask: &[u32; TILE]) {
        for y in 0..TILE {
            let mut left = mask[y];
            while left != 0 {
                let from = left.trailing_zeros() as usize;
                let id = self.ids[y * TILE + from];
                let facet = self.facet(eye, scene, id);
                let mut to = from;
                while to < TILE && left >> to & 1 != 0 && self.ids[y * TILE + to] == id {
                    to += 1;
                }
                left &= if to < TILE { u32::MAX << to } else { 0 };
                let (view, cy) = (self.view, centre(y));
                let [a, b, c, q] = &mut self.field;
                let row = y * TILE + from..y * TILE + to;
                let rows = a[row.clone()].iter_mut().zip(&mut b[row.clone()]);
                let rows = rows.zip(&mut c[row.clone()]).zip(&mut q[row]);
                // Nothing depends on the pixel before: compilers take several at once.
                for (i, (((a, b), c), q)) in rows.enumerate() {
                    let ray = reflected(&view, &facet, centre(from + i), cy);
                    (*a, *b, *c, *q) = (ray[0], ray[1], ray[2], ray[3]);
                }
            }
        }
    }

    /// The field at a pixel.
    #[inline(always)]
    pub(crate) fn at(&self, [x, y]: [usize; 2]) -> [f32; 4] {
        let at = y * TILE + x;
        [self.field[0][at], self.field[1][at], self.field[2][at], self.field[3][at]]
    }

    /// Along the view ray of a pixel, 1 along the eye's `forward`.
    pub(crate) fn view_at(&self, [x, y]: [usize; 2]) -> Vec3 {
        let (x, y) = (centre(x), centre(y));
        Vec3::new(self.view.get(0, x, y), self.view.get(1, x, y), self.view.get(2, x, y))
    }

    /// How that moves with the pixel, one to the right and one down.
    pub(crate) fn view_steps(&self) -> [Vec3; 2] {
        [self.view.right.into(), self.view.down.into()]
    }

    /// The field at the 4 x 4 pixels from a column and row on, by row; any numbers where nothing was filled in.
    pub(crate) fn block(&self, [x, y]: [usize; 2]) -> [[f32; 16]; 4] {
        let mut block = [[0.0; 16]; 4];
        for (block, field) in block.iter_mut().zip(&self.field) {
            for row in 0..4 {
                let from = (y + row) * TILE + x;
                block[4 * row..4 * row + 4].copy_from_slice(&field[from..from + 4]);
            }
        }
        block
    }

    /// The field about a pixel as its own triangle continues it.
    pub(crate) fn tangent(
        &mut self,
        eye: &Eye,
        scene: &PreparedScene,
        [x, y]: [usize; 2],
    ) -> Linear<4> {
        let facet = self.facet(eye, scene, self.ids[y * TILE + x]);
        let (x, y) = (centre(x), centre(y));
        let at = |dx: f32, dy: f32| reflected(&self.view, &facet, x + dx, y + dy);
        let [a, b, c, d] = [at(-0.5, 0.0), at(0.5, 0.0), at(0.0, -0.5), at(0.0, 0.5)];
        let own = at(0.0, 0.0);
        let mut tangent = Linear::default();
        for k in 0..4 {
            tangent.right[k] = b[k] - a[k];
            tangent.down[k] = d[k] - c[k];
            tangent.at[k] = own[k] - x * tangent.right[k] - y * tangent.down[k];
        }
        tangent
    }

    fn facet(&mut self, eye: &Eye, scene: &PreparedScene, id: u32) -> Facet {
        let middle = self.middle;
        let slot = id as usize % FACETS;
        if self.facets[slot].id != id {
            self.facets[slot] =
                Facet { id, normal_and_inverse: of_triangle(eye, scene, id, middle) };
        }
        self.facets[slot]
    }
}

#[inline(always)]
fn reflected(view: &Linear<3>, facet: &Facet, x: f32, y: f32) -> [f32; 4] {
    let v = [view.get(0, x, y), view.get(1, x, y), view.get(2, x, y)];
    let of = &facet.normal_and_inverse;
    let n = [of.get(0, x, y), of.get(1, x, y), of.get(2, x, y)];
    let along = v[0] * n[0] + v[1] * n[1] + v[2] * n[2];
    let squared = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    let twice = 2.0 * along / squared.max(f32::MIN_POSITIVE);
    [v[0] - n[0] * twice, v[1] - n[1] * twice, v[2] - n[2] * twice, of.get(3, x, y)]
}

/// The weights of the corners at a picture position are proportional to linear functions of it.
#[expect(clippy::cast_possible_truncation, reason = "rounded once")]
fn of_triangle(eye: &Eye, scene: &PreparedScene, id: u32, middle: [f32; 2]) -> Linear<4> {
    let mirror = scene.mirror_triangle(id);
    let position = eye.position.as_dvec3();
    let [a, b, c] = mirror.corners.map(|v| v.as_dvec3() - position);
    // The volume that the view ray spans with two corners is its third weight, times the inverse depth, times the
    // volume of all three.
    let volume = a.dot(b.cross(c));
    let planes = [b.cross(c), c.cross(a), a.cross(b)].map(|n| n / volume);
    let view = eye.ray_through_px(middle.into()).as_dvec3();
    let (right, down) =
        ((eye.right / eye.focal_px).as_dvec3(), (-eye.up / eye.focal_px).as_dvec3());
    let weighted = |direction: DVec3| {
        let w = planes.map(|plane| plane.dot(direction));
        let mut normal = DVec3::ZERO;
        for (w, n) in w.iter().zip(mirror.normals) {
            normal += *w * n.as_dvec3();
        }
        (normal, w[0] + w[1] + w[2])
    };
    let (at, along_right, along_down) = (weighted(view), weighted(right), weighted(down));
    // Only the direction of the normal matters: numbers near 1 for f32.
    let scale = 1.0 / at.0.length().max(f64::MIN_POSITIVE);
    let four = |(n, q): (DVec3, f64)| {
        let n: Vec3 = (n * scale).as_vec3();
        [n.x, n.y, n.z, q as f32]
    };
    Linear { at: four(at), right: four(along_right), down: four(along_down) }
}
