//! Classes, caustics and counts of the built-in mirrors.

use std::sync::Arc;

use glam::DVec2;

use super::*;
use crate::camera::eye::ImageSize;
use crate::context::Context;
use crate::geometry::Similarity;
use crate::paths::{PathFinder, PathOptions, PathScene};
use crate::scene::description::{Environment, EyeDescription, Light, Mirror, Object, Paint, Scene};
use crate::scene::{PrepareOptions, builtin};
use crate::visibility::{Scratch, SurfaceMesh, Visibility};

/// A mirror at the origin with a small knot before it, seen from `eye`.
fn described(mirror: &str, triangles: usize, eye: DVec3) -> Scene {
    let at =
        |translation: DVec3, scale: f64| Similarity { translation, scale, ..Similarity::IDENTITY };
    Scene {
        name: mirror.into(),
        eye: EyeDescription { position: eye, target: DVec3::Y * 0.5, up: DVec3::Y, fov_y: 0.7 },
        mirrors: vec![Mirror {
            name: mirror.into(),
            mesh: Arc::new(builtin::shape(mirror, Some(triangles)).unwrap()),
            source: None,
            transform: Similarity::IDENTITY,
            tint: Vec3::ONE,
            proxy: None,
        }],
        objects: vec![Object {
            name: "knot".into(),
            mesh: Arc::new(builtin::shape("knot", Some(2000)).unwrap()),
            source: None,
            points: None,
            transform: at(DVec3::new(0.3, 0.5, 0.9), 0.3),
            paint: Paint::Constant(Vec3::splat(0.5)),
            density: 1.0,
        }],
        environment: Environment::Constant(Vec3::ONE),
        light: Light { to_sun: Vec3::Y, sun: Vec3::ONE, ambient: Vec3::ONE },
        notes: vec![],
    }
}

fn prepared(scene: &Scene) -> PreparedScene {
    let options = PrepareOptions { surfels: 3000, ..PrepareOptions::default() };
    PreparedScene::new(scene, &options, &Context::default()).unwrap()
}

fn cameras(scene: &PreparedScene) -> MirrorCameras {
    let eye = (scene.eye.position - scene.origin).as_vec3();
    MirrorCameras::new(scene, eye, RayScale::EyeDistance)
}

const EYE: DVec3 = DVec3::new(0.3, 2.4, 3.0);

#[test]
fn flat_mirrors_diverge_and_goblets_fold() {
    let flat = prepared(&described("plane", 32, EYE));
    let flat = cameras(&flat);
    assert_eq!(flat.classes(), vec![Some(Class::Divergent); flat.triangles]);
    assert!(flat.caustic().strips.is_empty());
    assert!(flat.sampled_images(16).iter().all(|s| s.points == [16, 0, 0]));

    let goblet = prepared(&described("goblet", 1000, EYE));
    let goblet = cameras(&goblet);
    let classes = goblet.classes();
    let mixed = classes.iter().filter(|class| **class == Some(Class::Mixed)).count();
    let away = classes.iter().filter(|class| class.is_none()).count();
    assert!(away > 50, "its far side turns away: {away}");
    assert!(mixed > 50, "{mixed} of {}", classes.len());
    assert_eq!(classes.len() - away, goblet.cameras.len());
}

/// The shares of the cameras of a class other than mixed are those of the theorem, which the samples confirm here.
#[test]
fn sampled_points_of_unmixed_cameras_have_one_image() {
    let scene = prepared(&described("wave", 400, EYE));
    let list = cameras(&scene);
    let (mut single, mut several) = (0, 0);
    for camera in &list.cameras {
        for i in 0..64 {
            let (w, share) = even(i);
            if w.min_element() < 1e-6 || w.dot(DVec3::from_array(camera.facing)) < 1e-6 {
                continue;
            }
            let (v, d) = camera.rays.at(w);
            let images = camera.images_of(v + d * (share * camera.reach));
            match camera.class() {
                Class::Mixed => several += usize::from(images > 1),
                class => {
                    assert_eq!(images, 1, "{class:?} {camera:?}");
                    single += 1;
                }
            }
        }
    }
    assert!(single > 1000 && several > 20, "{single} {several}");
}

#[test]
fn fronts_are_cut_at_the_silhouette() {
    for facing in [[1.0, 1.0, -2.0], [-1.0, 3.0, 0.5], [-1.0, -0.5, 2.0], [1.0, 2.0, 3.0]] {
        let area = |[a, b, c]: [DVec3; 3]| {
            let flat = |w: DVec3| DVec2::new(w.y, w.z);
            (flat(b) - flat(a)).perp_dot(flat(c) - flat(a)) * 0.5
        };
        let whole = [DVec3::X, DVec3::Y, DVec3::Z];
        let parts: Vec<_> = front_parts(facing).map(|part| part.unwrap_or(whole)).collect();
        for w in parts.iter().flatten() {
            assert!(
                w.dot(DVec3::from_array(facing)) > -1e-12 && w.min_element() >= 0.0,
                "{facing:?}"
            );
        }
        assert!(parts.iter().all(|part| area(*part) > 0.0), "turned over: {facing:?}");
        let total: f64 = parts.into_iter().map(area).sum();
        let inside = (0..40_000).filter(|i| even(*i).0.dot(DVec3::from_array(facing)) >= 0.0);
        let expected = 0.5 * inside.count() as f64 / 40_000.0;
        assert!((total - expected).abs() < 2e-3, "{facing:?}: {total} {expected}");
    }
    assert_eq!(front_parts([-1.0, -1.0, -1.0]).count(), 0);
}

#[test]
fn the_caustic_is_a_surface_where_images_come_in_pairs() {
    let scene = prepared(&described("bowl", 400, EYE));
    let list = cameras(&scene);
    let caustic = list.caustic();
    let (positions, triangles) = caustic.triangles();
    let rulings: usize = caustic.strips.iter().map(|s| s.rulings.len()).sum();
    assert_eq!(positions.len(), 2 * rulings);
    assert_eq!(triangles.len(), 2 * (rulings - caustic.strips.len()));
    assert!(triangles.iter().flatten().all(|i| (*i as usize) < positions.len()));
    assert!(positions.iter().all(|p| p.is_finite()));
    // Across the strips' middles the number of images in the strip's camera changes by two.
    let (mut steps, mut tried) = (0, 0);
    for strip in caustic.strips.iter().step_by(3) {
        let camera = list.cameras.iter().find(|c| c.triangle == strip.triangle).unwrap();
        let length = |k: &usize| strip.rulings[*k][0].distance(strip.rulings[*k][1]);
        let longest = (0..strip.rulings.len()).max_by(|a, b| length(a).total_cmp(&length(b)));
        let k = longest.unwrap();
        let middle = |k: usize| (strip.rulings[k][0] + strip.rulings[k][1]).as_dvec3() * 0.5;
        let lambda = f64::from(strip.lambdas[k]);
        let corner = |i: usize| camera.rays.origins[i] + camera.rays.directions[i] * lambda;
        let n = (corner(1) - corner(0)).cross(corner(2) - corner(0));
        // Near enough to the fold, and far enough for f32.
        let comes_in_pairs = |share: f64| {
            let step = n.normalize_or_zero() * (share * n.length().sqrt());
            let counts = [step, -step].map(|step| camera.images_of(middle(k) + step));
            counts[0].abs_diff(counts[1]) == 2
        };
        tried += 1;
        steps += usize::from([1e-2, 1e-3, 1e-4].into_iter().any(comes_in_pairs));
    }
    assert!(tried > 20 && steps * 2 > tried, "{steps} of {tried}");
}

#[test]
fn points_have_several_images_over_all_cameras_of_a_wave() {
    let described = described("wave", 1000, DVec3::new(-0.6, 0.9, 2.9));
    let scene = prepared(&described);
    let paths = PathScene::new(&described);
    let options = PathOptions { occlusion: false, ..PathOptions::default() };
    let finder = PathFinder::new(&paths, scene.eye.position, options).unwrap();
    let cx = Context::default();
    let list = cameras(&scene);
    let points = surfel_points(&scene, 500);
    assert!((400..=500).contains(&points.len()), "{}", points.len());
    let objects = image_histogram(&finder, &points, "", &cx).unwrap();
    assert_eq!(objects.points() as usize, points.len());
    assert_eq!(objects.in_one_camera.iter().sum::<u32>(), objects.points());
    assert!(objects.over_all.len() > 3, "{objects:?}");

    // Every point of a ray has its own image at least; rounding may lose a few on edges.
    let on_rays = ray_points(&list, 1000);
    let rays = image_histogram(&finder, &on_rays, "", &cx).unwrap();
    assert!(on_rays.len() > 400 && rays.share(0) < 0.005, "{rays:?}");
    assert!(rays.share(3) + rays.share(2) > 0.02, "{rays:?}");
    let shares: f64 = (0..rays.over_all.len()).map(|n| rays.share(n)).sum();
    assert!((shares - 1.0).abs() < 1e-12);

    let plane = mirror_slice(&scene, &list, &finder, [48, 40], &cx).unwrap();
    assert_eq!(plane.counts.len(), 48 * 40);
    assert_eq!(plane.histogram().iter().sum::<u32>(), 48 * 40);
    assert!(plane.histogram()[1] > 0 && plane.counts.iter().any(|n| *n >= 3));
    let corner = plane.corner - (scene.eye.position - scene.origin);
    let normal = plane.sides[0].cross(plane.sides[1]);
    assert!(corner.dot(normal).abs() < 1e-6 * normal.length(), "the eye lies in the plane");
    assert_eq!((plane.picture().width, plane.picture().rgb.len()), (48, 48 * 40));
}

#[test]
fn a_slice_shows_the_fold_of_one_camera() {
    let scene = prepared(&described("bowl", 400, EYE));
    let list = cameras(&scene);
    let shares = list.sampled_images(128);
    let best = (0..shares.len())
        .max_by(|&a, &b| shares[a].several_share().total_cmp(&shares[b].several_share()));
    let best = best.unwrap();
    assert!(shares[best].several_share() > 0.0);
    let slice = camera_slice(&list.cameras[best], [64, 40]).unwrap();
    let histogram = slice.histogram();
    assert!(histogram.len() > 2 && histogram[2] > 10 && histogram[0] > 0, "{histogram:?}");
    let flat = prepared(&described("plane", 2, EYE));
    assert!(camera_slice(&cameras(&flat).cameras[0], [8, 8]).is_none());
}

#[test]
fn pictures_colour_the_mirror_only() {
    let described = described("wave", 400, DVec3::new(-0.6, 0.9, 2.9));
    let scene = prepared(&described);
    let size = ImageSize { width: 160, height: 120 };
    let eye = scene.eye_for(size).unwrap();
    let mirror = &scene.mirrors[0];
    let mesh = SurfaceMesh {
        positions: &mirror.positions,
        triangles: mirror.mesh.triangles(),
        encloses: None,
    };
    let mut visibility = Visibility::default();
    visibility.update(&eye, &[mesh], &[], &mut Scratch::default());
    let list = MirrorCameras::new(&scene, eye.position, RayScale::EyeDistance);
    let classes = class_picture(&scene, &eye, &visibility, &list.classes());
    let paths = PathScene::new(&described);
    let finder = PathFinder::new(&paths, scene.eye.position, PathOptions::default()).unwrap();
    let (scale, cx) = (RayScale::EyeDistance, Context::default());
    let images = double_image_picture(&scene, &eye, &visibility, scale, &finder, &cx).unwrap();
    let none = classes.rgb[0];
    let dark = count_color(0);
    let hue = |rgb: [f32; 3]| rgb.map(|c| c / rgb[2]);
    let near = |a: [f32; 3], b: [f32; 3]| (0..3).all(|k| (hue(a)[k] - hue(b)[k]).abs() < 1e-3);
    let mut seen = [0; 3];
    for (i, id) in visibility.mirror_ids.iter().enumerate() {
        if *id == crate::visibility::NONE_ID {
            assert_eq!((classes.rgb[i], images.rgb[i]), (none, none));
        } else {
            seen[0] += usize::from(near(classes.rgb[i], class_color(Some(Class::Mixed))));
            seen[1] += usize::from(near(images.rgb[i], dark));
            seen[2] += usize::from((2..8).any(|n| near(images.rgb[i], count_color(n))));
        }
    }
    assert!(seen.iter().all(|n| *n > 10), "{seen:?}");
}
