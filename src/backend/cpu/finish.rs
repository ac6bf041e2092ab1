//! From the reflected objects to the final picture: environment where nothing landed, tint, direct view.

use fearless_simd::{Simd, dispatch, f32x16};
use glam::Vec3;
use rayon::prelude::*;

use super::direct::{DirectView, compose};
use super::look::Look;
use crate::camera::Eye;
use crate::geometry::Aabb;
use crate::geometry::lanes::{Real, Vector, dot, simd_level};
use crate::image::Picture;
use crate::plan::Reflection;
use crate::scene::prepared::{Cloud, PreparedMirror, PreparedObject, PreparedScene};
use crate::visibility::mirror_rays::{RayField, TILE, TILE_PX};
use crate::visibility::{NONE_ID, SurfaceMesh, Visibility};

/// Completes `reflection` (environment, tint; its planes' radiance, where there are planes) and draws the picture of what the eye sees.
///
/// `white`: see [`DirectView::white`].
pub fn finish(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    reflection: &mut Reflection,
    white: f32,
    picture: &mut Picture,
) {
    let level = simd_level();
    let rows = (eye.size.width * TILE_PX).max(1) as usize;
    let behind = !reflection.environment_included;
    reflection
        .radiance
        .par_chunks_mut(rows)
        .zip(reflection.coverage.par_chunks(rows))
        .enumerate()
        .for_each_init(RayField::new, |field, (row, (radiance, coverage))| {
            let top = u32::try_from(row).unwrap_or(u32::MAX) * TILE_PX;
            let mut band = Band { scene, eye, visibility, top, radiance, coverage, behind };
            dispatch!(level, simd => band.finish(simd, field));
        });
    if let Some(planes) = &mut reflection.planes {
        let seen = visibility.mirror_ids.iter().zip(&reflection.radiance);
        let of_mirror = |(&id, radiance): (&u32, &Vec3)| {
            if id == NONE_ID { [0.0; 3] } else { radiance.to_array() }
        };
        planes.radiance = seen.map(of_mirror).collect();
    }
    let mirrors = mirror_surfaces(scene);
    let objects = object_surfaces(scene);
    let view = DirectView {
        eye,
        mirrors: &mirrors,
        objects: &objects,
        visibility,
        reflection: &reflection.radiance,
        white,
    };
    picture.width = eye.size.width;
    picture.height = eye.size.height;
    picture.rgb.resize(eye.size.pixels(), [0.0; 3]);
    compose(&view, &Look::new(scene), &mut picture.rgb);
}

/// The mirrors as the rasteriser takes them.
pub fn mirror_surfaces<'a>(scene: &'a PreparedScene) -> Vec<SurfaceMesh<'a>> {
    let clouds = &scene.clouds[scene.objects.len()..];
    let surface = |(m, cloud): (&'a PreparedMirror, &Cloud)| SurfaceMesh {
        positions: &m.positions,
        triangles: m.mesh.triangles(),
        encloses: cloud.closed.then(|| held(cloud)),
    };
    scene.mirrors.iter().zip(clouds).map(surface).collect()
}

/// The objects as the rasteriser takes them.
pub fn object_surfaces<'a>(scene: &'a PreparedScene) -> Vec<SurfaceMesh<'a>> {
    let surface = |(o, cloud): (&'a PreparedObject, &Cloud)| SurfaceMesh {
        positions: &o.positions,
        triangles: o.mesh.triangles(),
        encloses: (cloud.closed && !o.is_cloud).then(|| held(cloud)),
    };
    scene.objects.iter().zip(&scene.clouds).map(surface).collect()
}

/// A box that holds a cloud's surface: the surfels stay a little within it.
#[expect(clippy::cast_possible_truncation, reason = "lengths are f32 everywhere")]
fn held(cloud: &Cloud) -> Aabb {
    let margin = Vec3::splat(cloud.extent * cloud.to_scene.scale as f32);
    Aabb { min: cloud.bounds.min - margin, max: cloud.bounds.max + margin }
}

/// The reflection in a row of tiles.
struct Band<'a> {
    scene: &'a PreparedScene,
    eye: &'a Eye,
    visibility: &'a Visibility,
    /// Its first row of pixels.
    top: u32,
    radiance: &'a mut [Vec3],
    coverage: &'a [f32],
    /// Whether the environment shows behind what landed.
    behind: bool,
}

impl Band<'_> {
    #[inline(always)]
    fn finish<S: Simd>(&mut self, simd: S, field: &mut RayField) {
        let width = self.eye.size.width;
        // The mirror of the last pixel: its ids and its tint.
        let mut mirror = (0..0, Vec3::ONE);
        for left in (0..width).step_by(TILE) {
            let shown = field.enter(simd, self.eye, self.visibility, [left, self.top]);
            if shown == [0; TILE] {
                continue;
            }
            if self.behind {
                self.add_environment(simd, field, left, &shown);
            }
            for (y, &bits) in shown.iter().enumerate() {
                let mut bits = bits;
                while bits != 0 {
                    let x = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let id = field.ids[y * TILE + x];
                    if !mirror.0.contains(&id) {
                        let of = self.scene.mirror_of(id).0;
                        mirror = (self.visibility.ids(of), self.scene.mirrors[of].tint);
                    }
                    self.radiance[y * width as usize + left as usize + x] *= mirror.1;
                }
            }
        }
    }

    /// The environment along the view rays, reflected at the interpolated normals, where what landed leaves room.
    #[inline(always)]
    fn add_environment<S: Simd>(
        &mut self,
        simd: S,
        field: &mut RayField,
        left: u32,
        shown: &[u32; TILE],
    ) {
        let at = |x: usize, y: usize| y * self.eye.size.width as usize + left as usize + x;
        let mut open = *shown;
        for (y, bits) in open.iter_mut().enumerate() {
            for x in (0..TILE).filter(|x| shown[y] >> x & 1 != 0) {
                *bits &= !(u32::from(self.coverage[at(x, y)] >= 1.0) << x);
            }
        }
        field.fill(self.eye, self.scene, &open);
        for (y, open) in open.into_iter().enumerate() {
            for half in (0..TILE).step_by(16).filter(|half| open >> half & 0xffff != 0) {
                let ray: [f32x16<S>; 3] =
                    [0, 1, 2].map(|k| Vector::load(simd, &field.field[k][y * TILE + half..]));
                let squared = dot(ray, ray).max(f32x16::broadcast(simd, f32::MIN_POSITIVE));
                let inverse = squared.splat(1.0) / Real::sqrt(squared);
                let sky =
                    self.scene.environment.radiance_in(ray.map(|d| d * inverse), &self.scene.light);
                let mut lanes = [[0.0; 16]; 3];
                lanes.iter_mut().zip(sky).for_each(|(lanes, sky)| sky.store(lanes));
                for i in (0..16).filter(|i| open >> (half + i) & 1 != 0) {
                    let at = at(half + i, y);
                    let covered = self.coverage[at];
                    let sky = Vec3::from(lanes.map(|lane| lane[i])) * (1.0 - covered);
                    // Where nothing landed the radiance is an older picture's.
                    let landed = if covered > 0.0 { self.radiance[at] } else { Vec3::ZERO };
                    self.radiance[at] = landed + sky;
                }
            }
        }
    }
}
