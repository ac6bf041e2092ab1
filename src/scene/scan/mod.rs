//! Raw point clouds become surfels.
//!
//! ```text
//! file ─ gather ─► points ─ order ─► sorted, each place once ─ outliers ─► surfaces only ─ thin ─► as many as wanted
//!      ─ normals ─► without sign ─ orient, outward ─► with sign ─ normals::refine ─► sharp ─ spacing ─► Surfels ─ disks ─► Mesh
//! ```
//!
//! The same file, options and seed give the same surfels, however many threads there are.

mod disks;
mod gather;
mod neighbors;
mod normals;
mod order;
mod orient;
mod outliers;
mod outward;
mod spacing;
mod stage;
#[cfg(test)]
mod tests;
mod thin;

use std::path::Path;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

pub use self::disks::disks;
use self::gather::Points;
use self::neighbors::Neighbors;
use self::stage::Stage;
use crate::context::Context;
use crate::error::Result;
use crate::geometry::Surfels;
use crate::geometry::surfel::PADDING;

/// What is to be made of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudOptions {
    /// Surfels, at most: a denser cloud is thinned evenly. 0 is taken as 1.
    pub most: usize,
    /// Points that are read, at most: a file with more is refused. See [`BYTES_PER_POINT`].
    pub most_read: usize,
    /// What is random depends on it.
    pub seed: u64,
    /// In the file's coordinates: open sheets without normals face this way.
    pub up: Vec3,
}

impl Default for CloudOptions {
    fn default() -> Self {
        Self { most: MOST, most_read: MOST, seed: 1, up: Vec3::Y }
    }
}

/// The most points of one cloud: as many as there may be surfels of one object.
const MOST: usize = 1 << 28;
/// Memory that a point of a cloud takes while it becomes a surfel, at most, bytes. Measured with 50 million points: 117 without
/// normals and colours, which take 12 each, and 12 in addition while they are sorted.
pub const BYTES_PER_POINT: usize = 200;

/// A cloud as surfels.
#[derive(Clone, Debug)]
pub struct PointCloud {
    /// Added to the surfels' positions, it gives the file's coordinates. Zero unless the cloud is far from it for its size.
    pub offset: DVec3,
    /// Without radiance; white where there are no colours.
    pub surfels: Surfels,
    /// Whether the file has colours, or intensities, which are grey.
    pub has_colors: bool,
    /// Whether the file has normals; else they are estimated.
    pub has_normals: bool,
    /// What became of the points.
    pub counts: CloudCounts,
}

/// What became of the points of a cloud.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CloudCounts {
    /// Points of the file.
    pub read: usize,
    /// Dropped because another one is in exactly the same place.
    pub duplicates: usize,
    /// Dropped because they are far from all others, as things are around them.
    pub outliers: usize,
    /// Dropped because fewer were wanted.
    pub thinned: usize,
}

const CLEANING: &str = "cleaning the cloud";
const THINNING: &str = "thinning the cloud";
const NORMALS: &str = "normals of the cloud";

/// Neighbours that a normal is estimated from. Measured on scans and shapes of 5,000 to 100,000 points, evenly and randomly
/// sampled, with and without noise: with 12, half of the normals are off by a tenth more, with 16, twice as many are on the
/// wrong side.
const NEIGHBORS: usize = 14;
/// Those that normals have to agree with. Measured: from 8 to 12 it makes no difference.
const ORIENTED_BY: usize = 10;

/// Reads a cloud and makes surfels of it: without duplicates and outliers, at most so many as wanted, with unit normals, and
/// with extents by how far apart they are.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if the file cannot be read, is no cloud or has too many points,
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn cloud(path: &Path, wanted: &CloudOptions, cx: &Context) -> Result<PointCloud> {
    let points = gather::read(path, wanted.most_read.min(MOST), cx)?;
    surfels(points, wanted, cx)
}

fn surfels(mut points: Points, wanted: &CloudOptions, cx: &Context) -> Result<PointCloud> {
    let mut counts = CloudCounts { read: points.len(), ..CloudCounts::default() };
    let normals_stage = |from, to| Stage::new(cx, NORMALS, from, to);
    cx.step(CLEANING, 0.0)?;
    counts.duplicates = order::sort_and_dedupe(&mut points);
    let mut near =
        Neighbors::find(&points.positions, NEIGHBORS, Stage::new(cx, CLEANING, 0.1, 1.0))?;
    let kept = outliers::keep(&points.positions, &near);
    counts.outliers = points.len() - kept.len();
    if counts.outliers > 0 {
        points.pick(&kept);
        near.keep(&kept);
    }
    drop(kept);
    let before = points.len();
    let most = wanted.most.max(1);
    if before > most {
        drop(near);
        let kept = thin::thin(&points.positions, most, wanted.seed, cx)?;
        points.pick(&kept);
        near = Neighbors::find(&points.positions, NEIGHBORS, normals_stage(0.0, 0.4))?;
    }
    counts.thinned = before - points.len();
    let has_normals = normals::complete(&mut points.normals);
    let places = &points.positions;
    let normals = if has_normals {
        points.normals
    } else {
        let mut normals = normals::estimate(places, &near, normals_stage(0.4, 0.5))?;
        let pieces =
            orient::orient(places, &mut normals, &near, ORIENTED_BY, normals_stage(0.5, 0.75))?;
        outward::outward(places, &mut normals, &near, &pieces, wanted.up);
        normals::refine(places, &normals, &near, normals_stage(0.75, 0.85))?
    };
    let extent = spacing::extents(places, &normals, &near, normals_stage(0.85, 1.0))?;
    let axis = |axis: usize| {
        let mut list = Vec::with_capacity(places.len() + PADDING);
        list.par_extend(places.par_iter().map(|p| p[axis]));
        list.resize(places.len() + PADDING, places.last().map_or(0.0, |p| p[axis]));
        list
    };
    let has_colors = !points.colors.is_empty();
    let count = places.len();
    let surfels = Surfels {
        x: axis(0),
        y: axis(1),
        z: axis(2),
        albedo: if has_colors { points.colors } else { vec![Vec3::ONE; count] },
        radiance: vec![Vec3::ZERO; count],
        normals,
        extent,
    };
    cx.step(NORMALS, 1.0)?;
    Ok(PointCloud { offset: points.offset, surfels, has_colors, has_normals, counts })
}
