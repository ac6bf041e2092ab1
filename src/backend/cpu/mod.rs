//! The CPU backend: all cores, SIMD, the same bits every run.

pub mod direct;
pub mod finish;
mod planes;
pub mod pool;
pub mod splat;

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

use self::pool::Pool;
use self::splat::EMPTY;
use super::{Backend, ExecuteReport};
use crate::error::Result;
use crate::image::Planes;
use crate::plan::{Pass, Plan, Reflection};
use crate::scene::prepared::{PreparedScene, milliseconds};
use crate::visibility::{NONE_ID, Visibility};

/// Executes plans; keeps its memory between frames.
#[derive(Default)]
pub struct Cpu {
    keys: Vec<AtomicU64>,
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
                    self.clear(size.pixels());
                    let done =
                        splat::splat(pass, &scene.surfels, visibility, &self.scratch, &self.keys);
                    add(&mut report.passes_ms, milliseconds(start));
                    report.cameras += pass.cameras.len();
                    report.patches += pass.patches.len();
                    report.batches += done.batches;
                    report.projections += done.projections;
                    report.valid += done.valid;
                    let per_thread = 1e-6 / rayon::current_num_threads() as f64;
                    add(&mut report.cull_ms, done.cull_ns as f64 * per_thread);
                    add(&mut report.project_ms, done.project_ns as f64 * per_thread);
                    add(&mut report.splat_ms, done.splat_ns as f64 * per_thread);
                    if let Some(planes) = &mut out.planes {
                        self::planes::splat_planes(pass, scene, visibility, &self.keys, planes);
                    }
                }
                Pass::Resolve => {
                    resolve(visibility, &self.keys, &scene.surfels.radiance, out);
                    add(&mut report.passes_ms, milliseconds(start));
                }
                Pass::Gather(pass) => {
                    add(&mut report.rays_ms, pass.kernel.gather(out).rays_ms);
                }
            }
        }
        Ok(report)
    }
}

impl Cpu {
    fn clear(&mut self, pixels: usize) {
        self.keys.resize_with(pixels, || AtomicU64::new(EMPTY));
        self.keys.par_iter_mut().with_min_len(1 << 14).for_each(|key| *key.get_mut() = EMPTY);
    }
}

/// The nearest surfel's radiance at every pixel where one landed. Pixels that are no mirror's are left alone.
fn resolve(visibility: &Visibility, keys: &[AtomicU64], radiance: &[Vec3], out: &mut Reflection) {
    out.radiance.resize(keys.len(), Vec3::ZERO);
    out.coverage.resize(keys.len(), 0.0);
    let chunk = 1 << 14;
    out.radiance
        .par_chunks_mut(chunk)
        .zip(out.coverage.par_chunks_mut(chunk))
        .zip(keys.par_chunks(chunk))
        .zip(visibility.mirror_ids.par_chunks(chunk))
        .for_each(|(((colors, coverage), keys), ids)| {
            let pixels = colors.iter_mut().zip(coverage).zip(keys).zip(ids);
            for (((color, covered), key), _) in pixels.filter(|(_, id)| **id != NONE_ID) {
                let key = key.load(Ordering::Relaxed);
                // The low half of a key is its surfel.
                #[expect(clippy::cast_possible_truncation, reason = "takes the low half")]
                let surfel = key as u32 as usize;
                let landed = key != EMPTY;
                *color = if landed { radiance[surfel] } else { Vec3::ZERO };
                *covered = f32::from(u8::from(landed));
            }
        });
}
