//! The gather kernel: samples, rays, hits, shading, average.

use std::time::Instant;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::super::FrameInput;
use super::trace::{
    MirrorOcclusion, PictureSample, reflected_rays, subpixel, trace_reflected, visible_mirrors,
};
use crate::accel::{Hit, Ray};
use crate::camera::mirror_ray::{MirrorTriangle, RayScale, RaySource, weights_on_line};
use crate::context::Context;
use crate::error::Result;
use crate::image::{Planes, Reason};
use crate::plan::{GatherKernel, GatherTimes, Reflection};
use crate::scene::prepared::milliseconds;
use crate::scene::shade::{Sun, SurfacePoint, shade};
use crate::visibility::NONE_ID;

/// Side of the tiles that rays are traced by: neighbours in the list are neighbours in the picture.
const TILE: usize = 16;

pub(super) struct Kernel<'a> {
    pub(super) frame: FrameInput<'a>,
    pub(super) source: RaySource,
    pub(super) scale: RayScale,
    pub(super) spp: u32,
    pub(super) mirror_occlusion: bool,
}

/// One mirror pixel under way.
#[derive(Clone, Copy)]
struct Sum {
    radiance: Vec3,
    samples: u32,
    hits: u32,
}

impl GatherKernel for Kernel<'_> {
    fn gather(&self, out: &mut Reflection, cx: &Context) -> Result<GatherTimes> {
        let size = self.frame.eye.size;
        let pixels = self.mirror_pixels();
        let mirrors: Vec<MirrorTriangle> = (0..self.frame.visibility.mirror_triangles())
            .map(|t| self.frame.scene.mirror_triangle(t))
            .collect();
        let mut sums = vec![Sum { radiance: Vec3::ZERO, samples: 0, hits: 0 }; pixels.len()];
        let mut times = GatherTimes::default();
        for k in 0..self.spp {
            cx.check()?;
            let samples = self.samples(&pixels, k);
            let (rays, hits, rays_ms) = self.trace(&samples, &mirrors);
            times.rays_ms += rays_ms;
            times.rays += rays.len();
            self.add(&samples, &rays, &hits, &mut sums);
            if let Some(planes) = out.planes.as_deref_mut().filter(|_| self.spp == 1) {
                self.describe(&pixels, &rays, &hits, planes);
            }
        }
        if let Some(planes) = out.planes.as_deref_mut().filter(|_| self.spp > 1) {
            let centres = Kernel { spp: 1, ..*self };
            let (rays, hits, _) = centres.trace(&centres.samples(&pixels, 0), &mirrors);
            self.describe(&pixels, &rays, &hits, planes);
        }
        out.radiance.clear();
        out.radiance.resize(size.pixels(), Vec3::ZERO);
        out.coverage.clear();
        out.coverage.resize(size.pixels(), 0.0);
        out.environment_included = true;
        for (&pixel, sum) in pixels.iter().zip(&sums) {
            let n = sum.samples.max(1) as f32;
            out.radiance[pixel as usize] = sum.radiance / n;
            out.coverage[pixel as usize] = sum.hits as f32 / n;
            if let Some(planes) = out.planes.as_deref_mut() {
                planes.coverage[pixel as usize] = sum.hits as f32 / n;
            }
        }
        Ok(times)
    }
}

impl Kernel<'_> {
    /// The pixels whose centre shows a mirror, tile by tile.
    fn mirror_pixels(&self) -> Vec<u32> {
        let (width, height) =
            (self.frame.eye.size.width as usize, self.frame.eye.size.height as usize);
        let ids = &self.frame.visibility.mirror_ids;
        let mut list = Vec::new();
        for top in (0..height).step_by(TILE) {
            for left in (0..width).step_by(TILE) {
                for y in top..(top + TILE).min(height) {
                    for x in left..(left + TILE).min(width) {
                        if ids[y * width + x] != NONE_ID {
                            list.push(u32::try_from(y * width + x).expect("pixels fit 32 bits"));
                        }
                    }
                }
            }
        }
        list
    }

    /// Sample `k` of each pixel; one that does not show a mirror names none.
    fn samples(&self, pixels: &[u32], k: u32) -> Vec<PictureSample> {
        let width = self.frame.eye.size.width;
        let offset = subpixel(k, self.spp);
        let at = |p: u32| Vec2::new((p % width) as f32, (p / width) as f32) + offset;
        if self.spp == 1 {
            let ids = &self.frame.visibility.mirror_ids;
            let sample = |&p: &u32| PictureSample { px: at(p), mirror_triangle: ids[p as usize] };
            return pixels.par_iter().map(sample).collect();
        }
        let positions: Vec<Vec2> = pixels.par_iter().map(|&p| at(p)).collect();
        let mut found = vec![None; positions.len()];
        let scene = self.frame.scene;
        visible_mirrors(
            self.frame.eye,
            &positions,
            &scene.mirror_triangles,
            &scene.triangles,
            &mut found,
        );
        positions
            .into_iter()
            .zip(found)
            .map(|(px, id)| PictureSample { px, mirror_triangle: id.unwrap_or(NONE_ID) })
            .collect()
    }

    fn trace(
        &self,
        samples: &[PictureSample],
        mirrors: &[MirrorTriangle],
    ) -> (Vec<Ray>, Vec<Option<Hit>>, f64) {
        let scene = self.frame.scene;
        let none = Ray { origin: Vec3::ZERO, direction: Vec3::ZERO, t_min: 0.0, t_max: -1.0 };
        let mut rays = vec![none; samples.len()];
        let mut hits = vec![None; samples.len()];
        reflected_rays(self.frame.eye, samples, mirrors, self.source, self.scale, &mut rays);
        if self.source == RaySource::Camera {
            self.cut_back_sides(samples, mirrors, &mut rays);
        }
        let occlusion = self.mirror_occlusion.then(|| MirrorOcclusion {
            mirrors: &scene.mirror_triangles,
            clearance: scene.mirror_clearance(),
        });
        let start = Instant::now();
        trace_reflected(&rays, &scene.triangles, occlusion, &mut hits);
        let rays_ms = milliseconds(start);
        (rays, hits, rays_ms)
    }

    /// The camera model sends no ray from where the smooth surface is not seen on the side of its flat triangle.
    fn cut_back_sides(
        &self,
        samples: &[PictureSample],
        mirrors: &[MirrorTriangle],
        rays: &mut [Ray],
    ) {
        let eye = self.frame.eye;
        samples.par_iter().zip(rays).for_each(|(sample, ray)| {
            let Some(mirror) = mirrors.get(sample.mirror_triangle as usize) else { return };
            let origin = eye.position.as_dvec3();
            let direction = eye.ray_through_px(sample.px).as_dvec3();
            let facing = mirror.facing_seen(eye.position);
            let front = weights_on_line(origin, direction, mirror.corners)
                .is_some_and(|w| (0..3).map(|i| w[i] * facing[i]).sum::<f64>() > 0.0);
            if !front {
                ray.t_max = -1.0;
            }
        });
    }

    fn add(&self, samples: &[PictureSample], rays: &[Ray], hits: &[Option<Hit>], sums: &mut [Sum]) {
        let scene = self.frame.scene;
        let sun = Sun::new(&scene.triangles, &scene.light);
        sums.par_iter_mut().zip(samples).zip(rays.par_iter().zip(hits)).for_each(
            |((sum, sample), (ray, hit))| {
                if sample.mirror_triangle == NONE_ID {
                    return;
                }
                sum.samples += 1;
                let Some(hit) = hit else {
                    let direction = ray.direction.normalize_or(Vec3::Y);
                    sum.radiance += scene.environment.radiance(direction, &scene.light);
                    return;
                };
                let (object, triangle) = scene.object_of_triangle(hit.triangle);
                let object = &scene.objects[object];
                let normal = object.normal(triangle, hit.barycentrics);
                let point = SurfacePoint { position: ray.at(hit.t), normal, extent: object.detail };
                let albedo = object.albedo(triangle, hit.barycentrics);
                sum.radiance += shade(albedo, normal, sun.visible_from(&point), &scene.light);
                sum.hits += 1;
            },
        );
    }

    fn describe(&self, pixels: &[u32], rays: &[Ray], hits: &[Option<Hit>], planes: &mut Planes) {
        let scene = self.frame.scene;
        let width = self.frame.eye.size.width;
        for ((&pixel, ray), hit) in pixels.iter().zip(rays).zip(hits) {
            let Some(hit) = hit else { continue };
            let i = pixel as usize;
            let (object, triangle) = scene.object_of_triangle(hit.triangle);
            let normal = scene.objects[object].normal(triangle, hit.barycentrics);
            let world = ray.at(hit.t).as_dvec3() + scene.origin;
            planes.position[i] = world.as_vec3().to_array();
            planes.normal[i] = normal.to_array();
            planes.lambda[i] = hit.t;
            planes.splat[i] = [(pixel % width) as f32 + 0.5, (pixel / width) as f32 + 0.5];
            planes.object[i] = u32::try_from(object).expect("fewer than 2^32 objects");
            planes.reason[i] = Reason::Object as u32;
        }
    }
}
