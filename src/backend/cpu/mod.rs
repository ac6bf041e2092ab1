//! The CPU backend: all cores, SIMD, the same bits every run.

pub mod direct;
pub mod finish;
mod look;
pub(crate) mod lookup;
pub(crate) mod planes;
pub(crate) mod search;
pub mod splat;

use std::time::Instant;

use glam::Vec3;

use self::splat::Landed;
use super::{Backend, ExecuteReport};
use crate::error::Result;
use crate::image::Planes;
use crate::plan::pool::Pool;
use crate::plan::{Pass, Plan, Reflection};
use crate::scene::prepared::{PreparedScene, milliseconds};
use crate::visibility::Visibility;

/// Executes plans; keeps its memory between frames.
#[derive(Default)]
pub struct Cpu {
    landed: Vec<Vec<Landed>>,
    scratch: Pool<splat::Scratch>,
}

impl Backend for Cpu {
    fn id(&self) -> &'static str {
        "cpu"
    }

    fn execute(
        &mut self,
        plan: &Plan<'_>,
        scene: &PreparedScene,
        visibility: &Visibility,
        planes: bool,
        out: &mut Reflection,
    ) -> Result<ExecuteReport> {
        assert_eq!(plan.missing_resource(), None, "the plan's passes are out of order");
        let size = visibility.size;
        out.planes = planes.then(|| {
            let mut planes = Box::new(Planes::empty(size.width, size.height));
            self::planes::mark_mirrors(scene, visibility, &mut planes);
            planes
        });
        out.environment_included = false;
        let mut report = ExecuteReport::default();
        let add = |to: &mut Option<f64>, ms: f64| *to = Some(to.unwrap_or(0.0) + ms);
        for pass in &plan.passes {
            let start = Instant::now();
            match pass {
                Pass::Splat(pass) => {
                    let (done, landed) =
                        splat::splat(pass, &scene.surfels, visibility, &self.scratch, &plan.cx);
                    plan.cx.check()?;
                    self.landed = landed;
                    add(&mut report.passes_ms, milliseconds(start));
                    report.cameras = Some(pass.cameras.len());
                    report.patches += pass.patches.len();
                    report.batches = Some(done.batches);
                    report.projections = Some(done.projections);
                    report.valid = Some(report.valid.unwrap_or(0) + done.valid);
                    let per_thread = 1e-6 / rayon::current_num_threads() as f64;
                    add(&mut report.cull_ms, done.cull_ns as f64 * per_thread);
                    add(&mut report.project_ms, done.project_ns as f64 * per_thread);
                    add(&mut report.splat_ms, done.splat_ns as f64 * per_thread);
                    if let Some(planes) = &mut out.planes {
                        self::planes::splat_planes(pass, scene, visibility, &self.landed, planes);
                    }
                }
                Pass::Resolve => {
                    resolve(size.pixels(), &self.landed, out);
                    add(&mut report.passes_ms, milliseconds(start));
                }
                Pass::Gather(pass) => {
                    let done = pass.kernel.gather(out, &plan.cx)?;
                    match done.surfels {
                        None => add(&mut report.rays_ms, done.rays_ms),
                        Some(counts) => {
                            add(&mut report.passes_ms, milliseconds(start));
                            report.cameras = Some(counts.cameras);
                            report.patches += counts.patches;
                            report.batches = Some(counts.batches);
                            report.projections = Some(counts.projections);
                            report.valid = Some(counts.valid);
                            let per_thread = 1e-6 / rayon::current_num_threads() as f64;
                            add(&mut report.cameras_ms, counts.cameras_ns as f64 * per_thread);
                            add(&mut report.cull_ms, counts.walk_ns as f64 * per_thread);
                            add(&mut report.splat_ms, counts.splat_ns as f64 * per_thread);
                        }
                    }
                }
                Pass::Lookup(pass) => {
                    lookup::lookup(pass, scene, visibility, &lookup::by_cpu, out)?;
                    add(&mut report.passes_ms, milliseconds(start));
                }
                Pass::Search(pass) => {
                    let here = search::OnCpu(&plan.cx);
                    let done = search::search(pass, scene, visibility, &here, out)?;
                    add(&mut report.passes_ms, milliseconds(start));
                    done.enter(&mut report);
                }
            }
        }
        Ok(report)
    }
}

/// Puts the pixels that something landed on into the reflection. Where nothing did the coverage is 0, and the
/// radiance whatever it was.
fn resolve(pixels: usize, landed: &[Vec<Landed>], out: &mut Reflection) {
    out.radiance.resize(pixels, Vec3::ZERO);
    out.coverage.resize(pixels, 0.0);
    out.coverage.fill(0.0);
    for pixel in landed.iter().flatten() {
        out.radiance[pixel.pixel as usize] = pixel.radiance;
        out.coverage[pixel.pixel as usize] = pixel.coverage;
    }
}
