//! From positions in the picture to what their reflected rays meet.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::accel::{Hit, Ray, TriangleBvh, triangle_bvh::CHUNK};
use crate::camera::Eye;
use crate::camera::mirror_ray::{MirrorTriangle, RayScale, RaySource, reflected_ray};

/// A position in the picture at which a mirror is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureSample {
    /// In pixels; (0.5, 0.5) is the centre of the first.
    pub px: Vec2,
    /// Index of the mirror triangle.
    pub mirror_triangle: u32,
}

/// Position `k` of `count` (at least 1) within a pixel, 0 to 1: the Hammersley set, each point in the middle of its
/// column and (nearly) of its row. A single one is the pixel's centre; for a power of two the mean is, too.
pub fn subpixel(k: u32, count: u32) -> Vec2 {
    let rows = count.max(1).next_power_of_two();
    let row = f64::from(k.reverse_bits()) / 2f64.powi(32) + 0.5 / f64::from(rows);
    Vec2::new((k as f32 + 0.5) / count.max(1) as f32, row_px(row))
}

#[expect(clippy::cast_possible_truncation, reason = "positions are f32 everywhere")]
fn row_px(row: f64) -> f32 {
    row as f32
}

/// The mirror triangle that is seen at each picture position, if a mirror is what is seen there.
///
/// # Panics
/// If the slices differ in length.
pub fn visible_mirrors(
    eye: &Eye,
    positions: &[Vec2],
    mirrors: &TriangleBvh,
    objects: &TriangleBvh,
    found: &mut [Option<u32>],
) {
    assert_eq!(positions.len(), found.len(), "an answer for every position");
    let rays: Vec<Ray> =
        positions.par_iter().map(|&px| Ray::new(eye.position, eye.ray_through_px(px))).collect();
    let mut hits = vec![None; rays.len()];
    mirrors.trace_closest(&rays, &mut hits);
    let to_mirrors: Vec<Ray> = rays
        .par_iter()
        .zip(&hits)
        .map(|(&ray, hit)| Ray { t_max: hit.map_or(-1.0, |hit| hit.t), ..ray })
        .collect();
    let mut hidden = vec![false; rays.len()];
    objects.trace_occluded(&to_mirrors, &mut hidden);
    for ((found, hit), hidden) in found.iter_mut().zip(hits).zip(hidden) {
        *found = hit.filter(|_| !hidden).map(|hit| hit.triangle);
    }
}

/// [`reflected_ray`] of each sample; empty rays (see [`Ray`]) where there is none, or the sample names no triangle of
/// `mirrors`.
///
/// # Panics
/// If the slices differ in length.
pub fn reflected_rays(
    eye: &Eye,
    samples: &[PictureSample],
    mirrors: &[MirrorTriangle],
    source: RaySource,
    scale: RayScale,
    rays: &mut [Ray],
) {
    assert_eq!(samples.len(), rays.len(), "a ray for every sample");
    let none = Ray { origin: Vec3::ZERO, direction: Vec3::ZERO, t_min: 0.0, t_max: -1.0 };
    samples.par_iter().with_min_len(CHUNK).zip(rays).for_each(|(sample, ray)| {
        let mirror = mirrors.get(sample.mirror_triangle as usize);
        let made = mirror.and_then(|m| reflected_ray(eye, sample.px, m, source, scale));
        *ray = made.map_or(none, |(origin, direction)| Ray::new(origin, direction));
    });
}

/// What hides objects from reflected rays: the mirrors.
#[derive(Clone, Copy)]
pub struct MirrorOcclusion<'a> {
    /// All mirrors.
    pub mirrors: &'a TriangleBvh,
    /// The mirror itself does not count up to this distance (scene units), in which its flat triangles stand in the way of
    /// rays that its smooth surface sends on.
    pub clearance: f32,
}

/// The first thing that each reflected ray meets: an object's triangle, or `None` for the environment. With `occlusion`,
/// rays that meet a mirror before that see the environment, too (one bounce only).
///
/// # Panics
/// If the slices differ in length.
pub fn trace_reflected(
    rays: &[Ray],
    objects: &TriangleBvh,
    occlusion: Option<MirrorOcclusion<'_>>,
    hits: &mut [Option<Hit>],
) {
    objects.trace_closest(rays, hits);
    let Some(MirrorOcclusion { mirrors, clearance }) = occlusion else { return };
    rays.par_chunks(CHUNK).zip(hits.par_chunks_mut(CHUNK)).for_each(|(rays, hits)| {
        let to_objects: Vec<Ray> = rays
            .iter()
            .zip(&*hits)
            .map(|(&ray, hit)| Ray {
                t_min: clearance / ray.direction.length(),
                t_max: hit.map_or(-1.0, |hit| hit.t),
                ..ray
            })
            .collect();
        let mut hidden = vec![false; rays.len()];
        mirrors.occluded_in_turn(&to_objects, &mut hidden);
        for (hit, _) in hits.iter_mut().zip(hidden).filter(|(_, hidden)| *hidden) {
            *hit = None;
        }
    });
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::camera::eye::ImageSize;
    use crate::camera::mirror_ray::weights_on_line;

    fn eye() -> Eye {
        let size = ImageSize { width: 64, height: 48 };
        Eye::new(DVec3::new(0.2, 0.1, 3.0), DVec3::ZERO, DVec3::Y, 0.7, size).unwrap()
    }

    /// In the plane z = `z`, facing the eye.
    fn triangle(z: f32, half: f32) -> [Vec3; 3] {
        [Vec3::new(-half, -half, z), Vec3::new(half, -half, z), Vec3::new(0.0, half, z)]
    }

    #[test]
    fn samples_fill_a_pixel_evenly() {
        assert_eq!(subpixel(0, 1), Vec2::splat(0.5));
        for count in [4, 16, 256] {
            let points: Vec<Vec2> = (0..count).map(|k| subpixel(k, count)).collect();
            let mean = points.iter().sum::<Vec2>() / count as f32;
            assert!((mean - 0.5).abs().max_element() < 1e-6, "{mean} of {count}");
            for axis in 0..2 {
                let mut cells: Vec<f32> = points.iter().map(|p| p[axis] * count as f32).collect();
                cells.sort_by(f32::total_cmp);
                assert!((0..count).zip(cells).all(|(k, cell)| cell.floor() == k as f32));
            }
        }
    }

    #[test]
    fn the_ray_starts_where_the_pixel_looks() {
        let eye = eye();
        let normals = [Vec3::new(0.2, 0.1, 0.97), Vec3::Z, Vec3::new(-0.1, 0.3, 0.95)];
        let mirror = MirrorTriangle {
            corners: [Vec3::new(-1., -1., 0.3), Vec3::new(1., -0.8, 0.), Vec3::new(0., 1., -0.2)],
            normals: normals.map(|n| n.normalize_or(Vec3::Z)),
        };
        for source in [RaySource::Surface, RaySource::Camera] {
            for px in [Vec2::new(32.5, 20.5), Vec2::new(30.12, 27.9)] {
                let ray = reflected_ray(&eye, px, &mirror, source, RayScale::default()).unwrap();
                let seen = eye.project_px(ray.0).unwrap();
                assert!(seen.distance(px) < 1e-4, "{seen} instead of {px}");
                let weights =
                    weights_on_line(ray.0.as_dvec3(), mirror.normals[0].as_dvec3(), mirror.corners);
                let exact = match source {
                    RaySource::Surface => mirror.surface_direction(eye.position, weights.unwrap()),
                    RaySource::Camera => Some(mirror.camera_direction(
                        eye.position,
                        weights.unwrap(),
                        RayScale::EyeDistance,
                    )),
                };
                assert!(ray.1.distance(exact.unwrap().as_vec3()) < 1e-5);
            }
        }
        let edge_on = MirrorTriangle { corners: [eye.position, Vec3::ZERO, Vec3::X], ..mirror };
        let px = Vec2::new(1.5, 1.5);
        let ray = reflected_ray(&eye, px, &edge_on, RaySource::Surface, RayScale::Unit);
        assert!(ray.is_none(), "no point to start from");
    }

    #[test]
    fn what_stands_before_a_mirror_hides_it() {
        let eye = eye();
        let mirrors = TriangleBvh::build(&[triangle(0.0, 1.0), triangle(-1.0, 1.0)]);
        let middle = eye.project_px(Vec3::ZERO).unwrap();
        let look = |objects: &[[Vec3; 3]]| {
            let mut found = [None; 2];
            let objects = TriangleBvh::build(objects);
            visible_mirrors(&eye, &[middle, Vec2::ZERO], &mirrors, &objects, &mut found);
            found
        };
        assert_eq!(look(&[]), [Some(0), None]);
        assert_eq!(look(&[triangle(-0.5, 1.0)]), [Some(0), None]);
        assert_eq!(look(&[triangle(0.5, 1.0)]), [None, None]);
    }

    #[test]
    fn mirrors_hide_objects_from_reflected_rays() {
        // Rays of length 2 up the z axis, with the mirror's own surface 0.01 above the start.
        let ray = Ray::new(Vec3::ZERO, Vec3::Z * 2.0);
        let objects = TriangleBvh::build(&[triangle(4.0, 1.0)]);
        let trace = |mirrors: &[[Vec3; 3]]| {
            let mirrors = TriangleBvh::build(mirrors);
            let mut hits = [None];
            let occlusion = MirrorOcclusion { mirrors: &mirrors, clearance: 0.02 };
            trace_reflected(&[ray], &objects, Some(occlusion), &mut hits);
            hits[0].map(|hit: Hit| hit.t)
        };
        let own = triangle(0.01, 1.0);
        assert_eq!(trace(&[own]), Some(2.0));
        assert_eq!(trace(&[own, triangle(5.0, 1.0)]), Some(2.0), "behind the object");
        assert_eq!(trace(&[own, triangle(3.0, 1.0)]), None, "before it");
        let mut hits = [None];
        trace_reflected(&[ray], &objects, None, &mut hits);
        assert!(hits[0].is_some());
    }

    #[test]
    fn batches_are_the_single_rays() {
        let eye = eye();
        let mirrors = [triangle(0.0, 1.0), triangle(-1.0, 3.0)]
            .map(|corners| MirrorTriangle { corners, normals: [Vec3::Z; 3] });
        let samples: Vec<PictureSample> = (0..3_000u32)
            .map(|k| PictureSample { px: 40.0 * subpixel(k, 3_000), mirror_triangle: k % 2 })
            .collect();
        let none = Ray::new(Vec3::NAN, Vec3::NAN);
        let (source, scale) = (RaySource::Camera, RayScale::Unit);
        let mut rays = vec![none; samples.len()];
        reflected_rays(&eye, &samples, &mirrors, source, scale, &mut rays);
        for (sample, ray) in samples.iter().zip(rays) {
            let mirror = &mirrors[sample.mirror_triangle as usize];
            let alone = reflected_ray(&eye, sample.px, mirror, source, scale);
            assert_eq!(Some((ray.origin, ray.direction)), alone);
        }
    }
}
