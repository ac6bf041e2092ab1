//! Clouds of points as things to be shown.

use std::path::Path;
use std::sync::Arc;

use glam::{DQuat, Vec3};

use super::model::{Model, Part};
use super::{ReadOptions, UpAxis, Z_TO_Y};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::Similarity;
use crate::scene::description::Paint;
use crate::scene::scan::{self, CloudOptions, PointCloud};

/// Squares that stand for a cloud in the direct view, in shadows and for rays, at most: more would cost more than the
/// reflection (untuned).
const MOST_DISKS: usize = 400_000;

/// Reads a file of points.
pub(super) fn read(path: &Path, options: &ReadOptions, cx: &Context) -> Result<Model> {
    let usual = UpAxis::usual(path);
    let up = match options.up.unwrap_or(usual) {
        UpAxis::Y => Vec3::Y,
        UpAxis::Z => Vec3::Z,
    };
    let wanted =
        CloudOptions { most: options.points, seed: options.seed, up, ..CloudOptions::default() };
    let cloud = scan::cloud(path, &wanted, cx)?;
    let mesh = scan::disks(&cloud.surfels, MOST_DISKS, cloud.has_colors, cx)?;
    let turn = if usual == UpAxis::Z { Z_TO_Y } else { DQuat::IDENTITY };
    let upright = Similarity { rotation: turn, ..Similarity::IDENTITY };
    let notes = vec![format!("{}: {}", path.display(), told(&cloud))];
    let part = Part {
        name: String::new(),
        mesh: Arc::new(mesh),
        paint: cloud.has_colors.then_some(Paint::Vertex),
        points: Some(Arc::new(cloud.surfels)),
        mirror: None,
        own: Similarity { translation: cloud.offset, ..Similarity::IDENTITY }.then(&upright),
    };
    Ok(Model { parts: vec![part], eye: None, notes })
}

/// What became of the points, for people.
fn told(cloud: &PointCloud) -> String {
    let c = cloud.counts;
    let mut told = format!("a cloud of {} points", c.read);
    for (count, what) in [
        (c.duplicates, "in places that others have"),
        (c.outliers, "far from all others"),
        (c.thinned, "more than wanted (--surfels)"),
    ] {
        if count > 0 {
            told += &format!(", {count} {what} left out");
        }
    }
    told + if cloud.has_normals { "" } else { "; normals estimated" }
}
