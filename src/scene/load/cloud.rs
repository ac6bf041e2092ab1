//! Clouds of points as things to be shown.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;

use super::model::{Model, Part};
use super::{ReadOptions, Z_TO_Y};
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
    let turned = options.turn(path) == Z_TO_Y;
    let wanted = CloudOptions {
        most: options.points,
        seed: options.seed,
        up: if turned { Vec3::Z } else { Vec3::Y },
        ..CloudOptions::default()
    };
    let cloud = scan::cloud(path, &wanted, cx)?;
    let mesh = scan::disks(&cloud.surfels, MOST_DISKS, cloud.has_colors, cx)?;
    let notes = vec![format!("{}: {}", path.display(), told(&cloud))];
    let part = Part {
        name: String::new(),
        mesh: Arc::new(mesh),
        paint: cloud.has_colors.then_some(Paint::Vertex),
        points: Some(Arc::new(cloud.surfels)),
        mirror: None,
        own: Similarity { translation: cloud.offset, ..Similarity::IDENTITY },
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
