//! Where points of the scene are seen in a part of a mirror.

use std::time::Instant;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Done, Job, SearchBackend};
use crate::camera::reflector::{Found, estalella};
use crate::camera::three_ray::Rays;
use crate::error::Result;
use crate::geometry::Similarity;
use crate::plan::search::{ReflectorPart, Search, SearchPass};
use crate::scene::prepared::{PreparedScene, milliseconds};

/// How zones are told: a property of the scene, whatever draws it.
const ZONES: Search = Search::Estalella(estalella::Ends { iterations: 20, epsilon: 0.0 });

/// The image of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Image {
    /// Where it is drawn, scene space: the virtual vertex (Estalella et al.), or the reflection point (Roger & Holzschuch).
    pub(super) place: Vec3,
    /// Positive in the reflected region: how far the point is before the reflector.
    pub(super) height: f32,
    /// From the reflection point, scene units.
    pub(super) distance: f32,
    /// Of the search.
    pub(super) steps: f32,
}

impl Image {
    /// For the integer planes.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "few")]
    pub(super) fn rounded_steps(&self) -> u32 {
        self.steps.round() as u32
    }
}

/// Where a part of a mirror is, and where it is seen from.
#[derive(Clone, Copy)]
struct Place {
    to_scene: Similarity,
    center: DVec3,
    /// Relative to the centre, local.
    eye: Vec3,
    /// See [`Reflecting::draws_virtual`].
    is_virtual: bool,
}

impl Place {
    /// From scene space to the mirror's, about the part's centre.
    fn local(&self, point: Vec3) -> Vec3 {
        (self.to_scene.inverse_point(point.as_dvec3()) - self.center).as_vec3()
    }

    fn scene(&self, point: Vec3) -> Vec3 {
        self.to_scene.point(point.as_dvec3() + self.center).as_vec3()
    }

    /// Where a reflected point seems to be: behind its reflection point as far as it is from there. Once the search has
    /// converged that is the point mirrored in the tangent plane (Estalella et al. section 3); before, an error of the normal
    /// would move that one by twice the point's distance.
    fn virtual_place(&self, point: Vec3, found: &Found) -> Vec3 {
        let sight = found.point - self.eye;
        let length = sight.length().max(f32::MIN_POSITIVE);
        found.point + sight * (point.distance(found.point) / length)
    }

    /// `point` is local.
    #[expect(clippy::cast_possible_truncation, reason = "lengths are f32 everywhere")]
    fn image(&self, point: Vec3, found: &Found) -> Image {
        let scale = self.to_scene.scale as f32;
        let place = match (self.is_virtual, found.hidden) {
            (true, false) => self.virtual_place(point, found),
            (true, true) => found.mirrored(point),
            (false, _) => found.point,
        };
        let height = found.height(point).abs();
        let height = if found.hidden { -height } else { height };
        Image {
            place: self.scene(place),
            height: height * scale,
            distance: point.distance(found.point) * scale,
            steps: found.steps as f32,
        }
    }
}

/// A part of a mirror, at work.
pub(super) struct Reflecting<'a> {
    pub(super) pass: &'a SearchPass<'a>,
    pub(super) part: &'a ReflectorPart,
    pub(super) scene: &'a PreparedScene,
    pub(super) backend: &'a dyn SearchBackend,
    place: Place,
}

impl<'a> Reflecting<'a> {
    pub(super) fn new(
        pass: &'a SearchPass<'a>,
        part: &'a ReflectorPart,
        scene: &'a PreparedScene,
        backend: &'a dyn SearchBackend,
    ) -> Self {
        let to_scene = scene.clouds[scene.objects.len() + part.mirror].to_scene;
        let is_virtual = matches!(pass.search, Search::Estalella(_));
        let center = part.center.as_dvec3();
        let mut place = Place { to_scene, center, eye: Vec3::ZERO, is_virtual };
        place.eye = place.local(pass.eye.position);
        Self { pass, part, scene, backend, place }
    }

    /// Whether virtual vertices are drawn, in their places behind the mirror, or reflection points on it.
    pub(super) fn draws_virtual(&self) -> bool {
        self.place.is_virtual
    }

    /// The images of points in scene space.
    pub(super) fn images(&self, points: &[Vec3], done: &mut Done) -> Result<Vec<Image>> {
        let (start, place) = (Instant::now(), self.place);
        let found = self.find_by(self.pass.search, points)?;
        done.search_ms += milliseconds(start);
        let image = |(&p, f): (&Vec3, &Found)| place.image(place.local(p), f);
        let images: Vec<Image> = points.par_iter().zip(&found).map(image).collect();
        done.searched += points.len() as u64;
        done.steps += found.par_iter().map(|found| u64::from(found.steps)).sum::<u64>();
        done.reflected += images.par_iter().filter(|image| image.height > 0.0).count() as u64;
        Ok(images)
    }

    /// The local reflection points of points in scene space.
    fn find_by(&self, search: Search, points: &[Vec3]) -> Result<Vec<Found>> {
        let place = self.place;
        let local: Vec<Vec3> = points.par_iter().map(|&p| place.local(p)).collect();
        let px = 1.0 / self.pass.eye.focal_px;
        let eye = place.eye;
        self.backend.find(&Job { part: self.part, search, eye, px, points: &local })
    }

    /// For each of some points in scene space that are reflected: the rays around its path, local, and the distance along
    /// them, λ.
    pub(super) fn paths(&self, points: &[Vec3]) -> Result<Vec<(Rays, f64)>> {
        let path = |(&point, found): (&Vec3, &Found)| {
            let point = self.place.local(point);
            let rays = self.rays_about(found);
            let length = rays.directions[0].length().max(f64::MIN_POSITIVE);
            let lambda = f64::from(point.distance(found.point)) / length;
            (!found.hidden).then_some((rays, lambda))
        };
        let found = self.find_by(ZONES, points)?;
        Ok(points.iter().zip(&found).filter_map(path).collect())
    }

    /// Reflected view rays a texel around a reflection point, local.
    fn rays_about(&self, found: &Found) -> Rays {
        let reach = 2.0 / self.part.map.radial.side() as f32;
        let middle = found.point.normalize_or(Vec3::Y);
        let (a, b) = middle.any_orthonormal_pair();
        let [x, y, z] = [a, b, -(a + b)].map(|offset| {
            let (point, normal) = self.part.map.surface_at(middle + offset * reach);
            let (view, normal) = ((point - self.place.eye).as_dvec3(), normal.as_dvec3());
            (point.as_dvec3(), view - normal * (2.0 * view.dot(normal)))
        });
        Rays { origins: [x.0, y.0, z.0], directions: [x.1, y.1, z.1] }
    }
}
