use std::sync::Arc;

use glam::DVec3;

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
    }
}

fn shape(name: &str, triangles: usize) -> PathScene {
    PathScene::new(&scene(&[(name, triangles, Similarity::IDENTITY)]))
}

fn finder(scene: &PathScene, ray_scale: RayScale) -> PathFinder<'_> {
    PathFinder::new(scene, EYE, PathOptions { ray_scale, ..PathOptions::default() }).unwrap()
}

#[test]
fn paths_are_those_of_all_cameras_asked_one_by_one() {
    for (name, triangles, half) in
        [("teapot", 2_000, 2.0), ("bowl", 500, 3.0), ("wave", 600, 2.5), ("torus", 800, 6.0)]
    {
        let scene = shape(name, triangles);
        for scale in [RayScale::EyeDistance, RayScale::Unit] {
            let finder = finder(&scene, scale);
            let mut random = Random::new(7);
            let points: Vec<DVec3> = (0..2_000).map(|_| random.point(half)).collect();
            let set = finder.find(&points, &Context::default()).unwrap();
            let counts = finder.count(&points, &Context::default()).unwrap();
            let mut images = 0;
            for (i, point) in points.iter().enumerate() {
                let mut brute = Vec::new();
                for (index, camera) in (0..).zip(&finder.cameras) {
                    camera.images(index, *point - scene.origin, |image| {
                        brute.push((camera.triangle, image.lambda.to_bits()));
                    });
                }
                let found: Vec<(u32, u64)> =
                    set.of(i).iter().map(|p| (p.triangle, p.lambda.to_bits())).collect();
                assert_eq!(found, brute, "{name} {scale:?} {point}");
                assert_eq!(counts[i].images as usize, found.len());
                images += found.len();
            }
            println!("{name} {scale:?} {images}");
            assert!(images > 1_000, "{name}: only {images}");
        }
    }
}
