//! Executes search passes: points are searched for on reflectors, then drawn as triangles or squares.
//!
//! `images` says where points are seen, `pieces` cuts triangles that are seen in part, `triangles` and `points` draw.

mod images;
mod pieces;
mod points;
pub(crate) mod raster;
mod tessellate;
#[cfg(test)]
mod tests;
mod triangles;
mod zones;

use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

use self::images::Reflecting;
use self::raster::{Drawing, Hit};
use crate::backend::ExecuteReport;
use crate::camera::reflector::{Found, estalella, roger};
use crate::context::Context;
use crate::error::Result;
use crate::plan::Reflection;
use crate::plan::search::{Primitive, ReflectorPart, Search, SearchPass};
use crate::scene::prepared::{PreparedScene, milliseconds};
use crate::visibility::Visibility;

/// What a search pass did and took.
#[derive(Clone, Debug, Default)]
pub(crate) struct Done {
    /// Points searched for, over all parts.
    pub(crate) searched: u64,
    /// Those that are reflected.
    pub(crate) reflected: u64,
    /// Of all searches together.
    pub(crate) steps: u64,
    /// Wall time of the searches, milliseconds.
    pub(crate) search_ms: f64,
    /// Wall time of drawing and shading, milliseconds.
    pub(crate) draw_ms: f64,
    /// What could not be shown, a sentence each.
    pub(crate) notes: Vec<String>,
}

impl Done {
    /// Enters it into a report.
    pub(crate) fn enter(self, report: &mut ExecuteReport) {
        report.project_ms = Some(self.search_ms);
        report.splat_ms = Some(self.draw_ms);
        report.projections = Some(self.searched);
        report.valid = Some(self.reflected);
        report.steps = Some(self.steps);
        report.notes.extend(self.notes);
    }
}

/// One search on one reflector; everything relative to its centre, in its mirror's local space.
pub(crate) struct Job<'a> {
    /// What is searched on.
    pub(crate) part: &'a ReflectorPart,
    /// How.
    pub(crate) search: Search,
    /// The eye.
    pub(crate) eye: Vec3,
    /// A pixel as an angle, radians.
    pub(crate) px: f32,
    /// What is searched for.
    pub(crate) points: &'a [Vec3],
}

/// What a search pass leaves to a device, which may fail.
pub(crate) trait SearchBackend {
    /// Finds the reflection points of a job's points.
    fn find(&self, job: &Job<'_>) -> Result<Vec<Found>>;

    /// Says which triangle each pixel shows, by rising pixels.
    fn rasterise(&self, drawing: &Drawing<'_>) -> Result<Vec<Hit>>;
}

/// Does both here, until it is cancelled.
pub(crate) struct OnCpu<'a>(pub(crate) &'a Context);

impl SearchBackend for OnCpu<'_> {
    fn find(&self, job: &Job<'_>) -> Result<Vec<Found>> {
        find(job, self.0)
    }

    fn rasterise(&self, drawing: &Drawing<'_>) -> Result<Vec<Hit>> {
        Ok(raster::rasterise(drawing))
    }
}

fn find(job: &Job<'_>, cx: &Context) -> Result<Vec<Found>> {
    /// Points a task: untuned.
    const CHUNK: usize = 256;
    let map = &job.part.map;
    let find = |&point: &Vec3| {
        cx.check()?;
        let hidden = map.hides(job.eye, point);
        let found = match job.search {
            Search::Estalella(ends) => estalella::search(map, job.eye, point, hidden, ends),
            Search::Roger { iterations, px } => {
                let ends = roger::Ends { iterations, angle: px * job.px };
                Found { hidden, ..roger::search(map, job.eye, point, ends) }
            }
        };
        Ok(map.settled(found, point))
    };
    job.points.par_iter().with_min_len(CHUNK).map(find).collect()
}

/// Executes the pass.
///
/// # Errors
/// The backend failed.
pub(crate) fn search(
    pass: &SearchPass<'_>,
    scene: &PreparedScene,
    visibility: &Visibility,
    backend: &dyn SearchBackend,
    out: &mut Reflection,
) -> Result<Done> {
    let pixels = visibility.size.pixels();
    out.radiance.clear();
    out.radiance.resize(pixels, Vec3::ZERO);
    out.coverage.clear();
    out.coverage.resize(pixels, 0.0);
    let mut done = Done::default();
    for part in &*pass.parts {
        let start = Instant::now();
        let searched = done.search_ms;
        let reflecting = Reflecting::new(pass, part, scene, backend);
        match pass.primitive {
            Primitive::Triangles { longest_px } => {
                let meshes = triangles::meshes(&reflecting, longest_px, visibility, &mut done)?;
                triangles::draw(&reflecting, &meshes, visibility, out)?;
            }
            Primitive::Points(shape) => {
                points::draw(&reflecting, shape, visibility, out, &mut done)?;
            }
        }
        done.draw_ms += milliseconds(start) - (done.search_ms - searched);
    }
    Ok(done)
}
