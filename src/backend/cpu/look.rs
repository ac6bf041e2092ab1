//! What a prepared scene's surfaces and sky look like.

use fearless_simd::{Simd, f32x16};
use glam::Vec3;

use super::direct::{Appearance, Colors, CornerValues, Hit, Spots, clamped};
use crate::geometry::lanes::{Real, Vector, dot_const};
use crate::scene::description::{Paint, PatternKind};
use crate::scene::materials::Materials;
use crate::scene::prepared::PreparedScene;
use crate::scene::shade::{Sun, SurfacePoint, shade};
use crate::visibility::{SAMPLES, SurfaceMesh};

/// Where the corner values start: normals (object space), places in the sun's map, and what the paint depends on.
const NORMAL: usize = 0;
const PLACE: usize = 3;
const PAINT: usize = 6;

/// A scene as [`super::direct::compose`] asks for it.
pub(super) struct Look<'a> {
    scene: &'a PreparedScene,
    sun: Sun<'a>,
    /// The direction to the sun in the space of each object.
    to_sun: Vec<Vec3>,
}

impl<'a> Look<'a> {
    pub(super) fn new(scene: &'a PreparedScene) -> Self {
        let to_sun = scene.light.to_sun.as_dvec3();
        let local =
            |transform: &crate::geometry::Similarity| transform.inverse_direction(to_sun).as_vec3();
        Self {
            scene,
            sun: Sun::new(&scene.triangles, &scene.light),
            to_sun: scene.objects.iter().map(|o| local(&o.to_scene)).collect(),
        }
    }

    /// Whether the sun lights a point of an object, by rays.
    #[inline(always)]
    fn sees_sun(&self, hit: &Hit) -> bool {
        let object = &self.scene.objects[hit.object];
        let normal = object.normal(hit.triangle, hit.weights);
        self.sun.visible_from(&SurfacePoint { position: hit.point, normal, extent: object.detail })
    }

    /// What is seen of a channel of a reflectance.
    #[inline(always)]
    fn displayed<R: Real<Scalar = f32>>(&self, albedo: R, sunlight: R, k: usize, white: f32) -> R {
        let light = &self.scene.light;
        clamped(albedo * (sunlight * light.sun[k] + light.ambient[k]), white)
    }

    /// n·l in the lanes from `at` on; 0 where the sun does not shine.
    #[inline(always)]
    fn sunlight<S: Simd>(
        &self,
        simd: S,
        mesh: &SurfaceMesh,
        object: usize,
        spots: &Spots,
        at: usize,
    ) -> f32x16<S> {
        let weights: [f32x16<S>; 3] = spots.own_weights(simd, at);
        let normal = spots.values(simd, at, weights, NORMAL);
        let square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
        let tiny = square.splat(f32::MIN_POSITIVE);
        let facing =
            dot_const(normal, self.to_sun[object].to_array()) / Real::max(square, tiny).sqrt();
        let mut facings = [0.0; 16];
        Real::max(facing, facing.splat(0.0)).store(&mut facings);
        let mut places = [[0.0; 16]; 3];
        let [dx, dy] = self.scene.sun_map.offset();
        let [x, y, height] = spots.values(simd, at, weights, PLACE);
        (x + dx).store(&mut places[0]);
        (y + dy).store(&mut places[1]);
        height.store(&mut places[2]);
        for (i, facing) in facings.iter_mut().enumerate().take(spots.len - at) {
            if *facing > 0.0 {
                let place = places.map(|lanes| lanes[i]);
                let known = self.scene.sun_map.lights(place, *facing);
                if !known.unwrap_or_else(|| self.sees_sun(&spots.own_hit(mesh, object, at + i))) {
                    *facing = 0.0;
                }
            }
        }
        f32x16::load(simd, &facings)
    }
}

/// How many of the samples show the second colour of a pattern.
#[inline(always)]
fn odd_samples<S: Simd>(simd: S, kind: PatternKind, spots: &Spots, at: usize) -> f32x16<S> {
    let zero = f32x16::broadcast(simd, 0.0);
    let mut odd = zero;
    for sample in 0..SAMPLES {
        let weights: [f32x16<S>; 3] = spots.sample_weights(simd, at, sample);
        let position = spots.values(simd, at, weights, PAINT);
        let covered = f32x16::load(simd, &spots.samples[sample][at..]);
        odd += f32x16::select(kind.is_odd(position), covered, zero);
    }
    odd
}

/// What materials show, averaged over a pixel. `weights`: in its middle, and a pixel to the right and below.
#[inline(always)]
fn textured<S: Simd>(
    simd: S,
    materials: &Materials,
    spots: &Spots,
    at: usize,
    weights: [[f32x16<S>; 3]; 3],
) -> [f32x16<S>; 3] {
    let mut lanes = [[[0.0; 16]; 3]; 3];
    for (place, weights) in lanes.iter_mut().zip(weights) {
        place.iter_mut().zip(weights).for_each(|(to, weight)| weight.store(to));
    }
    let mut colors = [[0.0; 16]; 3];
    for lane in 0..16.min(spots.len - at) {
        let triangle = spots.triangle[at + lane] as usize;
        let [here, right, below] = lanes.map(|weights| weights.map(|of_corner| of_corner[lane]));
        let texels = materials.texels_across(triangle, here, [right, below]);
        let color = materials.color(triangle, here, texels);
        (0..3).for_each(|k| colors[k][lane] = color[k]);
    }
    colors.map(|color| f32x16::load(simd, &color))
}

impl Appearance for Look<'_> {
    #[inline(always)]
    fn albedo(&self, hit: &Hit) -> Vec3 {
        self.scene.objects[hit.object].albedo(hit.triangle, hit.weights)
    }

    #[inline(always)]
    fn light(&self, hit: &Hit) -> Vec3 {
        let normal = self.scene.objects[hit.object].normal(hit.triangle, hit.weights);
        shade(Vec3::ONE, normal, self.sees_sun(hit), &self.scene.light)
    }

    fn sky(&self, direction: Vec3) -> Vec3 {
        self.scene.environment.radiance(direction, &self.scene.light)
    }

    fn tint(&self, mirror: usize) -> Vec3 {
        self.scene.mirrors[mirror].tint
    }

    fn varies(&self, object: usize) -> bool {
        !matches!(self.scene.objects[object].paint, Paint::Constant(_))
    }

    #[inline(always)]
    fn corner_values(&self, object: usize, triangle: usize) -> CornerValues {
        let object = &self.scene.objects[object];
        let axes = self.scene.sun_map.axes();
        object.mesh.triangles()[triangle].map(|corner| {
            let corner = corner as usize;
            let normal = object.mesh.normals()[corner];
            let position = match object.is_cloud {
                false => object.positions[corner],
                true => SurfacePoint {
                    position: object.positions[corner],
                    normal: object.to_scene.direction(normal.as_dvec3()).as_vec3(),
                    extent: object.detail,
                }
                .lifted(),
            };
            let place = axes.map(|axis| axis.dot(position));
            let paint = match &object.paint {
                Paint::Pattern { period, .. } => object.mesh.positions()[corner] / *period,
                Paint::Vertex | Paint::Materials(_) => {
                    object.mesh.colors().get(corner).copied().unwrap_or(Vec3::ONE)
                }
                Paint::Constant(_) => Vec3::ZERO,
            };
            let mut values = [0.0; 9];
            values[NORMAL..PLACE].copy_from_slice(&normal.to_array());
            values[PLACE..PAINT].copy_from_slice(&place);
            values[PAINT..].copy_from_slice(&paint.to_array());
            values
        })
    }

    #[inline(always)]
    fn paint<S: Simd>(
        &self,
        simd: S,
        mesh: &SurfaceMesh,
        object: usize,
        spots: &Spots,
        white: f32,
        out: &mut Colors,
    ) {
        for at in (0..spots.len).step_by(16) {
            let sunlight = self.sunlight(simd, mesh, object, spots, at);
            let count = f32x16::load(simd, &spots.count[at..]);
            match &self.scene.objects[object].paint {
                Paint::Constant(albedo) => {
                    for k in 0..3 {
                        let color = self.displayed(count.splat(albedo[k]), sunlight, k, white);
                        (color * count).store(&mut out[k][at..]);
                    }
                }
                // Their mean is that in the middle, or almost.
                Paint::Vertex => {
                    let weights: [f32x16<S>; 3] = spots.own_weights(simd, at);
                    let albedo = spots.values(simd, at, weights, PAINT);
                    for k in 0..3 {
                        let color = self.displayed(albedo[k], sunlight, k, white);
                        (color * count).store(&mut out[k][at..]);
                    }
                }
                Paint::Materials(materials) => {
                    let weights: [[f32x16<S>; 3]; 3] = spots.pixel_weights(simd, at);
                    let vertex = spots.values(simd, at, weights[0], PAINT);
                    let albedo = textured(simd, materials, spots, at, weights);
                    for k in 0..3 {
                        let color = self.displayed(albedo[k] * vertex[k], sunlight, k, white);
                        (color * count).store(&mut out[k][at..]);
                    }
                }
                Paint::Pattern { kind, colors, .. } => {
                    let odd = odd_samples(simd, *kind, spots, at);
                    for k in 0..3 {
                        let of = |i: usize| count.splat(colors[i][k]);
                        let one = self.displayed(of(0), sunlight, k, white);
                        let other = self.displayed(of(1), sunlight, k, white);
                        (one * (count - odd) + other * odd).store(&mut out[k][at..]);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn sky_in<S: Simd>(&self, _simd: S, direction: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
        self.scene.environment.radiance_in(direction, &self.scene.light)
    }
}
