//! Completeness, ties, folds, exact reflections, occlusion and refinement.

mod completeness;
mod folds;
mod legs;
mod smooth;

use std::sync::Arc;

use glam::DVec3;

use super::cameras::Camera;
use super::*;
use crate::camera::RayScale;
use crate::context::Context;
use crate::geometry::Similarity;
use crate::scene::builtin;
use crate::scene::description::{Environment, EyeDescription, Light, Mirror, Scene, Source};

/// Numbers from 0 to 1, the same every run.
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub(super) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In the cube from -half to half.
    pub(super) fn point(&mut self, half: f64) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next()) * (2.0 * half) - half
    }
}

pub(super) const EYE: DVec3 = DVec3::new(0.7, 1.3, 3.1);

/// A scene of built-in shapes as mirrors, each with its place, and no objects.
pub(super) fn scene(mirrors: &[(&str, usize, Similarity)]) -> Scene {
    let mirror = |(name, triangles, transform): &(&str, usize, Similarity)| Mirror {
        name: (*name).into(),
        mesh: Arc::new(builtin::shape(name, Some(*triangles)).unwrap()),
        source: Some(Source::Shape { name: (*name).into(), triangles: Some(*triangles) }),
        transform: *transform,
        tint: glam::Vec3::ONE,
        proxy: None,
    };
    let (up, fov_y) = (DVec3::Y, 0.8);
    let light = Light { to_sun: glam::Vec3::Y, sun: glam::Vec3::ONE, ambient: glam::Vec3::ONE };
    Scene {
        name: "paths".into(),
        eye: EyeDescription { position: EYE, target: DVec3::ZERO, up, fov_y },
        mirrors: mirrors.iter().map(mirror).collect(),
        objects: Vec::new(),
        environment: Environment::Constant(glam::Vec3::ONE),
        light,
        notes: vec![],
    }
}

fn shape(name: &str, triangles: usize) -> PathScene {
    PathScene::new(&scene(&[(name, triangles, Similarity::IDENTITY)]))
}

fn finder(scene: &PathScene, ray_scale: RayScale) -> PathFinder<'_> {
    PathFinder::new(scene, EYE, PathOptions { ray_scale, ..PathOptions::default() }).unwrap()
}

/// All images of a point, camera by camera: triangle and λ.
fn one_by_one(finder: &PathFinder, point: DVec3) -> Vec<(u32, u64)> {
    let mut list = Vec::new();
    for (index, camera) in (0..).zip(&finder.cameras) {
        camera.images(index, point - finder.scene.origin, |image| {
            list.push((camera.triangle, image.lambda.to_bits()));
        });
    }
    list
}

#[test]
fn paths_are_those_of_all_cameras_asked_one_by_one() {
    let mut several = 0;
    for (name, triangles, half) in
        [("teapot", 2_000, 2.0), ("bowl", 500, 3.0), ("wave", 600, 2.5), ("torus", 800, 6.0)]
    {
        let scene = shape(name, triangles);
        for scale in [RayScale::EyeDistance, RayScale::Unit] {
            let finder = finder(&scene, scale);
            let mut random = Random::new(7);
            // Not a multiple of anything; one is no point at all.
            let mut points: Vec<DVec3> = (0..2_003).map(|_| random.point(half)).collect();
            points[77].y = f64::NAN;
            // Beside folds there are several images in one camera.
            for camera in &finder.cameras {
                for (lambda, w) in folds::folds(camera, &mut random) {
                    let (start, d) = camera.rays.at(DVec3::from_array(w));
                    points.push(start + d * lambda + random.point(1e-4) + scene.origin);
                }
            }
            let set = finder.find(&points, &Context::default()).unwrap();
            let counts = finder.count(&points, &Context::default()).unwrap();
            assert_eq!((set.points(), counts.len()), (points.len(), points.len()));
            assert!(set.of(77).is_empty());
            let mut images = 0;
            for (i, point) in points.iter().enumerate().filter(|(i, _)| *i != 77) {
                let found: Vec<(u32, u64)> =
                    set.of(i).iter().map(|p| (p.triangle, p.lambda.to_bits())).collect();
                assert_eq!(found, one_by_one(&finder, *point), "{name} {scale:?} {point}");
                assert_eq!(counts[i].images as usize, found.len());
                images += found.len();
                several += found.windows(2).filter(|pair| pair[0].0 == pair[1].0).count();
            }
            assert!(images > 1_000, "{name}: only {images}");
        }
    }
    assert!(several > 100, "only {several} second images in one camera");
}

#[test]
fn every_path_is_a_ray_of_its_camera() {
    let place =
        Similarity { translation: DVec3::new(-2.0, 0.0, -1.0), scale: 1.5, ..Similarity::IDENTITY };
    let scene =
        PathScene::new(&scene(&[("torus", 500, Similarity::IDENTITY), ("bowl", 300, place)]));
    let finder = finder(&scene, RayScale::EyeDistance);
    let mut random = Random::new(2);
    let points: Vec<DVec3> = (0..3_000).map(|_| random.point(4.0)).collect();
    let set = finder.find(&points, &Context::default()).unwrap();
    let mut seen = [0, 0];
    for (i, point) in points.iter().enumerate() {
        let order = |p: &Path| (p.mirror, p.triangle, p.lambda);
        assert!(set.of(i).is_sorted_by(|a, b| order(a) < order(b)));
        for path in set.of(i) {
            seen[path.mirror as usize] += 1;
            let of = |c: &&Camera| (c.mirror, c.triangle) == (path.mirror, path.triangle);
            let rays = finder.cameras.iter().find(of).unwrap().rays;
            let (start, d) = rays.at(DVec3::from_array(path.weights));
            assert!((start + scene.origin - path.mirror_point).length() < 1e-12);
            let missed = start + scene.origin + d * path.lambda - *point;
            assert!(missed.length() < 1e-10, "{missed}");
            assert!(path.weights.iter().all(|w| *w >= -TIE) && path.lambda > 0.0);
            assert!((path.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let legs = [path.mirror_point - EYE, *point - path.mirror_point].map(DVec3::length);
            assert!((path.length - legs[0] - legs[1]).abs() < 1e-12);
            let [to_mirror, to_point] = path.directions(EYE, *point);
            assert!((EYE + to_mirror * legs[0] - path.mirror_point).length() < 1e-12);
            assert!((path.mirror_point + to_point * legs[1] - *point).length() < 1e-12);
            let ghost = path.ghost(EYE);
            assert!((ghost.distance(EYE) - path.length).abs() < 1e-12);
            assert!((ghost - EYE).cross(to_mirror).length() < 1e-12);
            // By differences: the map (b2, b3, λ) ↦ Q.
            let at = |b: [f64; 2], l: f64| {
                let (v, d) = rays.at(DVec3::new(1.0 - b[0] - b[1], b[0], b[1]));
                v + d * l
            };
            let ([_, b2, b3], l, e) = (path.weights, path.lambda, 1e-6);
            let slopes = [
                at([b2 + e, b3], l) - at([b2 - e, b3], l),
                at([b2, b3 + e], l) - at([b2, b3 - e], l),
                at([b2, b3], l + e) - at([b2, b3], l - e),
            ]
            .map(|s| s / (2.0 * e));
            let det = slopes[0].cross(slopes[1]).dot(slopes[2]);
            let size = slopes.map(DVec3::length).iter().product::<f64>();
            assert!((det - path.det_j).abs() < 1e-7 * size, "{det} {}", path.det_j);
            assert_eq!(f64::from(path.parity()), path.det_j.signum());
        }
    }
    assert!(seen[0] > 1_000 && seen[1] > 300, "{seen:?}");
}

#[test]
fn a_plane_mirror_has_one_image_before_it_and_its_ghost_behind() {
    // z = 0, 4 wide, 4 high, facing +z.
    let place =
        Similarity { translation: DVec3::new(0.0, -2.0, 0.0), scale: 4.0, ..Similarity::IDENTITY };
    let scene = PathScene::new(&scene(&[("plane", 50, place)]));
    let finder = finder(&scene, RayScale::EyeDistance);
    let mut random = Random::new(5);
    let points: Vec<DVec3> = (0..500).map(|_| random.point(1.0)).collect();
    let set = finder.find(&points, &Context::default()).unwrap();
    let mut before = 0;
    for (i, point) in points.iter().enumerate() {
        let mirrored = *point * DVec3::new(1.0, 1.0, -1.0);
        assert_eq!(set.of(i).len(), usize::from(point.z > 0.0), "{point}");
        for path in set.of(i) {
            before += 1;
            assert!((path.ghost(EYE) - mirrored).length() < 1e-12);
            // With rays as long as the eye's distance λ is the ratio of the distances.
            assert!((path.lambda - point.z / EYE.z).abs() < 1e-12);
            assert_eq!((path.parity(), path.near_caustic()), (1, false));
            assert!(path.miss < 1e-12, "{}", path.miss);
        }
    }
    assert!(before > 200);
}

#[test]
fn bad_eyes_and_cancelled_work_are_refused() {
    let scene = shape("sphere", 80);
    for bad in [DVec3::NAN, DVec3::X * f64::INFINITY, DVec3::Y * 2e15] {
        assert!(PathFinder::new(&scene, bad, PathOptions::default()).is_err());
    }
    let finder = finder(&scene, RayScale::EyeDistance);
    let cx = Context::default();
    cx.cancel_flag().store(true, std::sync::atomic::Ordering::Relaxed);
    assert!(matches!(finder.find(&[EYE], &cx), Err(crate::Error::Cancelled)));
    assert!(matches!(finder.count(&[EYE], &cx), Err(crate::Error::Cancelled)));
    assert_eq!(finder.find(&[], &Context::default()).unwrap().points(), 0);
}

#[test]
fn far_from_the_worlds_origin_nothing_is_lost() {
    let far = DVec3::new(4e6, -3e6, 1e6);
    let near = shape("torus", 500);
    let place = Similarity { translation: far, ..Similarity::IDENTITY };
    let there = PathScene::new(&scene(&[("torus", 500, place)]));
    let mut random = Random::new(9);
    let points: Vec<DVec3> = (0..500).map(|_| random.point(3.0)).collect();
    let moved: Vec<DVec3> = points.iter().map(|p| *p + far).collect();
    let options = PathOptions { refine: true, ..PathOptions::default() };
    let cx = Context::default();
    let a = PathFinder::new(&near, EYE, options).unwrap().find(&points, &cx).unwrap();
    let b = PathFinder::new(&there, EYE + far, options).unwrap().find(&moved, &cx).unwrap();
    for i in 0..points.len() {
        assert_eq!(a.of(i).len(), b.of(i).len());
        for (a, b) in a.of(i).iter().zip(b.of(i)) {
            // A billionth is what f64 leaves of positions so far away.
            assert!((a.mirror_point + far - b.mirror_point).length() < 1e-6);
            assert!((a.length - b.length).abs() < 1e-6);
        }
    }
}
