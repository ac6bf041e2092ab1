//! The rasteriser: chunks of triangles are sorted into tiles, then the tiles are drawn row by row.
//!
//! Every sample keeps the nearest triangle and, among equals, the first; triangles reach every tile in the
//! order of their ids. So neither the threads nor the chunks nor the tiles can be seen in the result.

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::fill::{Pixel, draw_triangle};
use super::project::{Corner, Projection};
use super::tiles::{Chunk, Grid, Source, TILE_HEIGHT, TILE_PIXELS, TILE_WIDTH};
use super::{NONE_ID, SAMPLES, SurfaceMesh, Visibility};
use crate::camera::Eye;
use crate::geometry::Aabb;

/// Triangles a chunk: what one thread sorts at a time. Untuned.
const CHUNK: usize = 8_192;

/// Memory that frames reuse, and the instruction set to use.
#[derive(Debug)]
pub struct Scratch {
    level: Level,
    corners: Vec<Corner>,
    first_corners: Vec<usize>,
    chunks: Vec<Chunk>,
}

impl Scratch {
    /// Empty, for one instruction set. It changes the speed, not the result.
    pub fn new(level: Level) -> Self {
        Self { level, corners: Vec::new(), first_corners: Vec::new(), chunks: Vec::new() }
    }
}

impl Default for Scratch {
    fn default() -> Self {
        Self::new(Level::new())
    }
}

/// Fills the planes of `out`, whose size and ids are set.
pub(super) fn draw(
    eye: &Eye,
    mirrors: &[SurfaceMesh],
    objects: &[SurfaceMesh],
    scratch: &mut Scratch,
    out: &mut Visibility,
) {
    let surfaces: Vec<SurfaceMesh> = mirrors.iter().chain(objects).copied().collect();
    let projection = Projection::new(eye, bounds(&surfaces).diagonal());
    project(&projection, &surfaces, scratch);

    let Scratch { level, corners, first_corners, chunks } = scratch;
    let grid = Grid::new(eye.size);
    let triangles: usize = surfaces.iter().map(|s| s.triangles.len()).sum();
    chunks.resize_with(triangles.div_ceil(CHUNK), Chunk::default);
    let outside = |s: &SurfaceMesh| s.encloses.is_some_and(|held| !held.contains(eye.position));
    let fronts_only = surfaces.iter().map(outside).collect();
    let source = Source { projection, surfaces: &surfaces, corners, first_corners, fronts_only };
    chunks.par_iter_mut().enumerate().for_each(|(i, chunk)| {
        let first = i * CHUNK;
        dispatch!(*level, _simd => {
            chunk.collect(&source, &grid, &out.first_ids, first..(first + CHUNK).min(triangles));
            chunk.sort(&grid);
        });
    });

    let mirror_triangles = out.mirror_triangles();
    let band = (eye.size.width as usize * TILE_HEIGHT as usize).max(1);
    out.samples
        .par_chunks_mut(band)
        .zip(out.mirror_ids.par_chunks_mut(band))
        .zip(out.mirror_depth.par_chunks_mut(band))
        .enumerate()
        .for_each(|(row, ((samples, mirror_ids), mirror_depth))| {
            let mut planes = Band { samples, mirror_ids, mirror_depth, mirror_triangles };
            for column in 0..grid.columns {
                dispatch!(*level, simd => draw_tile(simd, chunks, &grid, column, row, &mut planes));
            }
        });
}

fn bounds(surfaces: &[SurfaceMesh]) -> Aabb {
    surfaces
        .par_iter()
        .flat_map(|surface| surface.positions.par_chunks(CHUNK))
        .map(|positions| Aabb::of(positions.iter().copied().filter(|p| p.is_finite())))
        .reduce(|| Aabb::EMPTY, Aabb::union)
}

/// Moves all corners to the picture plane.
fn project(projection: &Projection, surfaces: &[SurfaceMesh], scratch: &mut Scratch) {
    let Scratch { level, corners, first_corners, .. } = scratch;
    let level = *level;
    first_corners.clear();
    let mut total = 0;
    for surface in surfaces {
        first_corners.push(total);
        total += surface.positions.len();
    }
    corners.resize(total, Corner::default());
    let mut rest = corners.as_mut_slice();
    let mut jobs = Vec::new();
    for surface in surfaces {
        let (own, others) = std::mem::take(&mut rest).split_at_mut(surface.positions.len());
        rest = others;
        jobs.extend(surface.positions.chunks(CHUNK).zip(own.chunks_mut(CHUNK)));
    }
    jobs.into_par_iter().for_each(|(points, corners)| {
        dispatch!(level, _simd => for (corner, &point) in corners.iter_mut().zip(points) {
            *corner = projection.corner(point);
        });
    });
}

/// The rows of the result that a row of tiles covers.
struct Band<'a> {
    samples: &'a mut [[u32; SAMPLES]],
    mirror_ids: &'a mut [u32],
    mirror_depth: &'a mut [f32],
    mirror_triangles: u32,
}

#[inline(always)]
fn draw_tile<S: Simd>(
    simd: S,
    chunks: &[Chunk],
    grid: &Grid,
    column: usize,
    row: usize,
    planes: &mut Band,
) {
    let mut pixels = [Pixel::EMPTY; TILE_PIXELS];
    let (window, mirror_triangles) = (grid.window(column, row), planes.mirror_triangles);
    for chunk in chunks {
        for triangle in chunk.in_tile(grid, column, row) {
            draw_triangle(simd, triangle, grid, window, &mut pixels);
        }
    }
    let [left, right] = [window.first[0], window.last[0] + 1].map(|x| x.unsigned_abs() as usize);
    let height = (window.last[1] - window.first[1] + 1).unsigned_abs() as usize;
    for (y, pixels) in pixels.chunks(TILE_WIDTH as usize).take(height).enumerate() {
        let own = y * grid.size.width as usize + left..y * grid.size.width as usize + right;
        let planes = (planes.samples[own.clone()].iter_mut())
            .zip(&mut planes.mirror_ids[own.clone()])
            .zip(&mut planes.mirror_depth[own]);
        for (((samples, mirror_id), mirror_depth), pixel) in planes.zip(pixels) {
            samples.copy_from_slice(&pixel.id[..SAMPLES]);
            let is_mirror = pixel.id[0] < mirror_triangles;
            *mirror_id = if is_mirror { pixel.id[0] } else { NONE_ID };
            *mirror_depth = if is_mirror { 1.0 / pixel.inverse_depth[0] } else { f32::INFINITY };
        }
    }
}
