//! From mirror ids to patches: the visible part of a mirror triangle that one camera sees for.
//!
//! A large triangle is cut into cells of its barycentric grid. v(w) and d(w) are linear, so the cells' cameras
//! see exactly what the whole triangle's camera sees; they only bound the work and the tile of one task.

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::{NONE_ID, Visibility};
use crate::camera::Eye;

/// Index of a triangle over all mirrors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MirrorTriangleIndex(pub u32);

/// A rectangle of pixels; `max` is exclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelRect {
    /// Left, top.
    pub min: [u32; 2],
    /// Right, bottom, exclusive.
    pub max: [u32; 2],
}

impl PixelRect {
    const EMPTY: Self = Self { min: [u32::MAX; 2], max: [0; 2] };

    fn add_run(&mut self, from: u32, to: u32, y: u32) {
        self.min = [self.min[0].min(from), self.min[1].min(y)];
        self.max = [self.max[0].max(to), self.max[1].max(y + 1)];
    }

    fn union(self, o: Self) -> Self {
        Self {
            min: [self.min[0].min(o.min[0]), self.min[1].min(o.min[1])],
            max: [self.max[0].max(o.max[0]), self.max[1].max(o.max[1])],
        }
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.max[0] - self.min[0]
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.max[1] - self.min[1]
    }
}

/// A visible mirror triangle, or one cell of it.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// Over all mirrors.
    pub triangle: MirrorTriangleIndex,
    /// Barycentrics of the patch's corners in the triangle.
    pub corners: [DVec3; 3],
    /// The pixels lie in here.
    pub rect: PixelRect,
    /// Number of pixels.
    pub pixels: u32,
    /// Which pixels of the triangle are the patch's; `None`: all.
    pub cell: Option<Cell>,
    /// For a cell of the picture: where its pixels are given one by one.
    pub own: Option<OwnPixels>,
}

impl Patch {
    /// Whether a pixel of its rectangle is the patch's own. `rows`: the masks that its `own` points into.
    pub fn owns(&self, visibility: &Visibility, rows: &[u32], x: u32, y: u32) -> bool {
        if let Some(own) = self.own {
            return rows[(own.first_row + y - self.rect.min[1]) as usize] >> (x - self.rect.min[0])
                & 1
                != 0;
        }
        visibility.mirror_ids[(y * visibility.size.width + x) as usize] == self.triangle.0
            && self.cell.is_none_or(|cell| cell.contains(x, y))
    }
}

/// Where lists by patch begin with one's.
#[derive(Clone, Copy, Debug)]
pub struct OwnPixels {
    /// Its first row's mask.
    pub first_row: u32,
    /// What its rectangle's first pixel has.
    pub first_pixel: u32,
}

/// A cell of a triangle's barycentric grid.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    grid: Grid,
    index: u32,
}

impl Cell {
    /// Whether a pixel of the triangle belongs to the cell.
    pub fn contains(&self, x: u32, y: u32) -> bool {
        self.grid.cell_at(x, y) == self.index
    }
}

/// Patches have at most about so many pixels, so that their tile stays in a cache. Measured: of 2048, 4096 and 8192 the
/// last is the fastest at 3840 x 2160, and at 1280 x 720 there is no difference.
const PATCH_PIXELS: u32 = 8192;
/// Cells along an edge at most.
const MAX_GRID: u32 = 64;

#[derive(Clone, Copy, Debug)]
struct Extent {
    pixels: u32,
    rect: PixelRect,
}

const NO_EXTENT: Extent = Extent { pixels: 0, rect: PixelRect::EMPTY };

/// Buffers that are reused from frame to frame.
#[derive(Default)]
pub struct PatchScratch {
    extents: Vec<Vec<Extent>>,
    visible: Vec<u32>,
}

/// Lists the patches of all visible mirror triangles, by triangle and cell. `corners(t)` are the corners of
/// mirror triangle t in scene space.
pub fn patches(
    eye: &Eye,
    visibility: &Visibility,
    corners: impl Fn(MirrorTriangleIndex) -> [Vec3; 3] + Sync,
    scratch: &mut PatchScratch,
    out: &mut Vec<Patch>,
) {
    out.clear();
    let (width, height) = (eye.size.width as usize, eye.size.height as usize);
    let triangles = visibility.mirror_triangles() as usize;
    let bands = rayon::current_num_threads().min(height);
    let rows = height.div_ceil(bands);
    scratch.extents.resize_with(bands, Vec::new);
    scratch.extents.par_iter_mut().enumerate().for_each(|(band, extents)| {
        extents.clear();
        extents.resize(triangles, NO_EXTENT);
        for y in band * rows..((band + 1) * rows).min(height) {
            let row = &visibility.mirror_ids[y * width..(y + 1) * width];
            count_row(row, y, extents);
        }
    });
    let (first, others) = scratch.extents.split_at_mut(1);
    let first = &mut first[0];
    for extents in others {
        for (a, b) in first.iter_mut().zip(extents.iter()).filter(|(_, b)| b.pixels > 0) {
            *a = Extent { pixels: a.pixels + b.pixels, rect: a.rect.union(b.rect) };
        }
    }
    scratch.visible.clear();
    let seen = (0u32..).zip(first.iter()).filter(|(_, e)| e.pixels > 0).map(|(t, _)| t);
    scratch.visible.extend(seen);
    let first = &*first;
    let lists = scratch.visible.par_chunks(16).map(|triangles| {
        let mut list = Vec::new();
        for &t in triangles {
            let extent = first[t as usize];
            let triangle = MirrorTriangleIndex(t);
            if extent.pixels <= PATCH_PIXELS {
                list.push(Patch {
                    triangle,
                    corners: [DVec3::X, DVec3::Y, DVec3::Z],
                    rect: extent.rect,
                    pixels: extent.pixels,
                    cell: None,
                    own: None,
                });
            } else {
                let grid = Grid::new(eye, corners(triangle), extent.pixels);
                cells(visibility, width, triangle, extent.rect, grid, &mut list);
            }
        }
        list
    });
    let lists: Vec<Vec<Patch>> = lists.collect();
    out.extend(lists.into_iter().flatten());
}

fn count_row(row: &[u32], y: usize, extents: &mut [Extent]) {
    let index = |i: usize| u32::try_from(i).expect("pictures have fewer than 2^32 columns");
    let mut x = 0;
    while x < row.len() {
        let id = row[x];
        let from = x;
        while x < row.len() && row[x] == id {
            x += 1;
        }
        if id != NONE_ID {
            let extent = &mut extents[id as usize];
            extent.pixels += index(x - from);
            extent.rect.add_run(index(from), index(x), index(y));
        }
    }
}

/// Shares out a triangle's pixels over the cells of its grid.
fn cells(
    visibility: &Visibility,
    width: usize,
    triangle: MirrorTriangleIndex,
    rect: PixelRect,
    grid: Grid,
    out: &mut Vec<Patch>,
) {
    let count = (grid.n * grid.n * 2) as usize;
    let rows: Vec<u32> = (rect.min[1]..rect.max[1]).collect();
    let extents = rows
        .par_chunks(32)
        .map(|rows| {
            let mut extents = vec![NO_EXTENT; count];
            for &y in rows {
                for x in rect.min[0]..rect.max[0] {
                    if visibility.mirror_ids[y as usize * width + x as usize] == triangle.0 {
                        let extent = &mut extents[grid.cell_at(x, y) as usize];
                        extent.pixels += 1;
                        extent.rect.add_run(x, x + 1, y);
                    }
                }
            }
            extents
        })
        .reduce(
            || vec![NO_EXTENT; count],
            |mut a, b| {
                for (a, b) in a.iter_mut().zip(b) {
                    *a = Extent { pixels: a.pixels + b.pixels, rect: a.rect.union(b.rect) };
                }
                a
            },
        );
    for (index, extent) in (0u32..).zip(extents).filter(|(_, e)| e.pixels > 0) {
        out.push(Patch {
            triangle,
            corners: grid.corners(index),
            rect: extent.rect,
            pixels: extent.pixels,
            cell: Some(Cell { grid, index }),
            own: None,
        });
    }
}

/// n × n cells along the edges of a triangle, each cut in two: 2n² slots of which n² are in the triangle.
#[derive(Clone, Copy, Debug)]
struct Grid {
    n: u32,
    /// b2 and b3 of the view ray through (x, y) are (row·(x, y, 1)) / (sum row·(x, y, 1)).
    b2: Vec3,
    b3: Vec3,
    sum: Vec3,
}

impl Grid {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small count")]
    fn new(eye: &Eye, corners: [Vec3; 3], pixels: u32) -> Self {
        let n = (f64::from(pixels / PATCH_PIXELS).sqrt().ceil() as u32 + 1).min(MAX_GRID);
        // The ray's barycentrics are proportional to the volumes that it spans with two corners.
        let p = corners.map(|c| (c - eye.position).as_dvec3());
        let normals = [p[1].cross(p[2]), p[2].cross(p[0]), p[0].cross(p[1])];
        let (at, dx, dy) = (
            eye.ray_through_px(Vec2::new(0.5, 0.5)).as_dvec3(),
            (eye.right / eye.focal_px).as_dvec3(),
            (-eye.up / eye.focal_px).as_dvec3(),
        );
        let rows = normals.map(|n| DVec3::new(n.dot(dx), n.dot(dy), n.dot(at)));
        let sum = rows[0] + rows[1] + rows[2];
        let scale = 1.0 / sum.abs().max_element().max(f64::MIN_POSITIVE);
        Self {
            n,
            b2: (rows[1] * scale).as_vec3(),
            b3: (rows[2] * scale).as_vec3(),
            sum: (sum * scale).as_vec3(),
        }
    }

    /// The slot of the pixel's centre: a function of the pixel alone, so that cells never share one.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    fn cell_at(&self, x: u32, y: u32) -> u32 {
        let p = Vec3::new(x as f32, y as f32, 1.0);
        let sum = self.sum.dot(p);
        let n = self.n as f32;
        let (b2, b3) = (self.b2.dot(p) / sum * n, self.b3.dot(p) / sum * n);
        let (i, j) = (b2.clamp(0.0, n - 1.0).floor(), b3.clamp(0.0, n - 1.0).floor());
        let i = i.min(n - 1.0);
        let j = j.min(n - 1.0 - i);
        let upper = (b2 - i) + (b3 - j) > 1.0 && i + j < n - 1.0;
        2 * (j as u32 * self.n + i as u32) + u32::from(upper)
    }

    fn corners(&self, index: u32) -> [DVec3; 3] {
        let n = f64::from(self.n);
        let (i, j) = (f64::from(index / 2 % self.n), f64::from(index / 2 / self.n));
        let at = |i: f64, j: f64| DVec3::new(1.0 - (i + j) / n, i / n, j / n);
        if index.is_multiple_of(2) {
            [at(i, j), at(i + 1.0, j), at(i, j + 1.0)]
        } else {
            [at(i + 1.0, j), at(i + 1.0, j + 1.0), at(i, j + 1.0)]
        }
    }
}
