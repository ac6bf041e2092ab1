//! From the reflected objects to the final picture: environment where nothing landed, tint, direct view.

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::direct::{Appearance, DirectView, Hit, compose};
use crate::camera::Eye;
use crate::image::Picture;
use crate::plan::Reflection;
use crate::scene::prepared::PreparedScene;
use crate::scene::shade;
use crate::visibility::{NONE_ID, SurfaceMesh, Visibility, barycentrics};

/// Completes `reflection` (environment, tint) and draws the picture of what the eye sees.
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
    let width = eye.size.width as usize;
    reflection
        .radiance
        .par_chunks_mut(width)
        .zip(reflection.coverage.par_chunks(width))
        .enumerate()
        .for_each(|(y, (row, coverage))| {
            for (x, (radiance, &covered)) in row.iter_mut().zip(coverage).enumerate() {
                let id = visibility.mirror_ids[y * width + x];
                if id != NONE_ID {
                    let (mirror, triangle) = scene.mirror_of(id);
                    if covered < 1.0 {
                        let px = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                        let sky = reflected_sky(scene, eye, mirror, triangle, px);
                        *radiance += sky * (1.0 - covered);
                    }
                    *radiance *= scene.mirrors[mirror].tint;
                }
            }
        });
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
    let mut colors = vec![Vec3::ZERO; eye.size.pixels()];
    compose(&view, &Look(scene), &mut colors);
    picture.rgb.clear();
    picture.rgb.extend(colors.iter().map(|c| c.to_array()));
}

/// The mirrors as the rasteriser takes them.
pub fn mirror_surfaces(scene: &PreparedScene) -> Vec<SurfaceMesh<'_>> {
    let surface = |m| -> SurfaceMesh<'_> {
        let m: &crate::scene::prepared::PreparedMirror = m;
        SurfaceMesh { positions: &m.positions, triangles: m.mesh.triangles() }
    };
    scene.mirrors.iter().map(surface).collect()
}

/// The objects as the rasteriser takes them.
pub fn object_surfaces(scene: &PreparedScene) -> Vec<SurfaceMesh<'_>> {
    let surface = |o| -> SurfaceMesh<'_> {
        let o: &crate::scene::prepared::PreparedObject = o;
        SurfaceMesh { positions: &o.positions, triangles: o.mesh.triangles() }
    };
    scene.objects.iter().map(surface).collect()
}

/// The environment in the direction of the view ray reflected at the interpolated normal.
fn reflected_sky(
    scene: &PreparedScene,
    eye: &Eye,
    mirror: usize,
    triangle: usize,
    px: Vec2,
) -> Vec3 {
    let mirror = &scene.mirrors[mirror];
    let corner = mirror.mesh.triangles()[triangle];
    let positions = corner.map(|i| mirror.positions[i as usize]);
    let weights = barycentrics(eye, positions, px).unwrap_or([1.0, 0.0, 0.0]);
    let mix = |list: &[Vec3]| -> Vec3 { (0..3).map(|k| list[corner[k] as usize] * weights[k]).sum() };
    let normal = mix(&mirror.normals).normalize_or(Vec3::Y);
    let view = eye.ray_through_px(px);
    let reflected = view - normal * (2.0 * view.dot(normal));
    scene.environment.radiance(reflected.normalize_or(Vec3::Y), &scene.light)
}

/// What the scene's surfaces and sky look like.
struct Look<'a>(&'a PreparedScene);

impl Look<'_> {
    fn normal(&self, hit: &Hit) -> Vec3 {
        let object = &self.0.objects[hit.object];
        let corner = object.mesh.triangles()[hit.triangle];
        let normals = corner.map(|i| object.mesh.normals()[i as usize]);
        let local: Vec3 = (0..3).map(|k| normals[k] * hit.weights[k]).sum();
        object.to_scene.direction(local.as_dvec3()).as_vec3().normalize_or(Vec3::Y)
    }
}

impl Appearance for Look<'_> {
    fn albedo(&self, hit: &Hit) -> Vec3 {
        let object = &self.0.objects[hit.object];
        let corner = object.mesh.triangles()[hit.triangle];
        let local: Vec3 =
            (0..3).map(|k| object.mesh.positions()[corner[k] as usize] * hit.weights[k]).sum();
        object.paint.color(&object.mesh, hit.triangle, hit.weights, local)
    }

    fn light(&self, hit: &Hit) -> Vec3 {
        let scene = self.0;
        let normal = self.normal(hit);
        let visible = shade::sun_visible(&scene.triangles, hit.point, normal, &scene.light);
        shade::shade(Vec3::ONE, normal, visible, &scene.light)
    }

    fn sky(&self, direction: Vec3) -> Vec3 {
        self.0.environment.radiance(direction, &self.0.light)
    }

    fn tint(&self, mirror: usize) -> Vec3 {
        self.0.mirrors[mirror].tint
    }
}
