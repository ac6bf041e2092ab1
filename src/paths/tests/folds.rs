//! Points on shared edges, corners and folds: every image is found, and counted once.

use super::*;
use crate::camera::three_ray::multiplicity::{Jacobian, mixed_sign_range};

/// Images whose mirror points are nearer than this to a place, and whose λ is, are that place's.
const HERE: f64 = 1e-6;

fn meshes() -> Vec<PathScene> {
    [("teapot", 1_992), ("bowl", 200), ("wave", 400), ("torus", 300), ("goblet", 1_000)]
        .map(|(name, triangles)| shape(name, triangles))
        .into()
}

/// How many paths of a point start within [`HERE`] of `start` (relative to the origin), with about this way to go.
fn paths_from(set: &[Path], scene: &PathScene, start: DVec3) -> usize {
    set.iter().filter(|p| (p.mirror_point - scene.origin - start).length() < HERE).count()
}

#[test]
fn points_on_shared_edges_and_corners_are_counted_once() {
    for scene in meshes() {
        for scale in [RayScale::EyeDistance, RayScale::Unit] {
            let finder = finder(&scene, scale);
            let mut random = Random::new(11);
            let (mut points, mut starts) = (Vec::new(), Vec::new());
            for (i, camera) in finder.cameras.iter().enumerate() {
                let k = i % 3;
                let mut w = [0.0; 3];
                w[k] = match i % 5 {
                    0 => 1.0,
                    _ => random.next(),
                };
                w[(k + 1) % 3] = 1.0 - w[k];
                if !camera.faces(w) {
                    continue;
                }
                let (start, d) = camera.rays.at(DVec3::from_array(w));
                // Near and far.
                let lambda = 10.0f64.powf(random.next() * 3.0 - 2.0) / d.length();
                points.push(start + d * lambda + scene.origin);
                starts.push(start);
            }
            let set = finder.find(&points, &Context::default()).unwrap();
            for (i, start) in starts.iter().enumerate() {
                assert_eq!(paths_from(set.of(i), &scene, *start), 1, "{:?}", points[i]);
            }
            assert!(starts.len() > 60, "{}", starts.len());
        }
    }
}

/// λ and weights of points of the caustic in a camera: within, and on edge 1–2.
pub(super) fn folds(camera: &Camera, random: &mut Random) -> Vec<(f64, [f64; 3])> {
    let g = Jacobian::of(&camera.rays).g;
    let mut found = Vec::new();
    let Some((lo, hi)) = mixed_sign_range(&camera.rays, 1e-3, 8.0) else { return found };
    for _ in 0..4 {
        let lambda = lo + (hi - lo) * random.next();
        let at = g.map(|c| c[0] + lambda * (c[1] + lambda * c[2]));
        let cut = |i: usize, j: usize| at[j] / (at[j] - at[i]);
        let inside = |t: f64| (0.0..=1.0).contains(&t);
        let (on_12, on_13) = (cut(0, 1), cut(0, 2));
        if inside(on_12) {
            found.push((lambda, [on_12, 1.0 - on_12, 0.0]));
            if inside(on_13) {
                // Between the two ends of the fold.
                let t = 0.2 + 0.6 * random.next();
                let w1 = on_12 * t + on_13 * (1.0 - t);
                found.push((lambda, [w1, (1.0 - on_12) * t, (1.0 - on_13) * (1.0 - t)]));
            }
        }
    }
    found
}

#[test]
fn points_on_folds_are_found_and_counted_once() {
    let (mut inner, mut edges) = (0, 0);
    for scene in meshes() {
        let finder = finder(&scene, RayScale::EyeDistance);
        let mut random = Random::new(4);
        let (mut points, mut places) = (Vec::new(), Vec::new());
        for (index, camera) in (0..).zip(&finder.cameras) {
            for (lambda, w) in folds(camera, &mut random) {
                let (start, d) = camera.rays.at(DVec3::from_array(w));
                // T(λ) must not be a point there: that is a cusp, where any w is an image.
                let size = camera.normal(lambda).length();
                if camera.faces(w) && size > 1e-6 * camera.size.powi(2) {
                    points.push(start + d * lambda + scene.origin);
                    places.push((index, lambda, w));
                }
            }
        }
        let set = finder.find(&points, &Context::default()).unwrap();
        for (i, (index, lambda, w)) in places.iter().enumerate() {
            let camera: &Camera = &finder.cameras[*index];
            let start = camera.rays.at(DVec3::from_array(*w)).0;
            let near: Vec<&Path> = set
                .of(i)
                .iter()
                .filter(|p| (p.mirror_point - scene.origin - start).length() < HERE * camera.size)
                .collect();
            assert_eq!(near.len(), 1, "{:?} λ {lambda} w {w:?}: {near:?}", camera.triangle);
            // On an edge the image may be that of the neighbour, which need not fold there; where T(λ) is nearly a
            // point, its normal turns about within a rounding.
            let solid = camera.normal(*lambda).length() > 1e-2 * camera.size.powi(2);
            let told = w[2] == 0.0 || near[0].near_caustic() || !solid;
            assert!(told, "λ {lambda} w {w:?} {:?}", near[0]);
            if w[2] == 0.0 { edges += 1 } else { inner += 1 }
        }
    }
    assert!(inner > 500 && edges > 500, "{inner} within, {edges} on edges");
}

/// Beside a fold there are two images or none, at a distance that rounding cannot bridge.
#[test]
fn beside_a_fold_images_come_in_pairs() {
    let scene = shape("bowl", 200);
    let finder = finder(&scene, RayScale::EyeDistance);
    let mut random = Random::new(8);
    let mut pairs = 0;
    for (index, camera) in (0..).zip(&finder.cameras) {
        for (lambda, w) in folds(camera, &mut random) {
            if w.iter().any(|w| *w < 0.05) || !camera.faces(w) {
                continue;
            }
            let (start, d) = camera.rays.at(DVec3::from_array(w));
            let across = camera.normal(lambda).normalize_or_zero();
            let counts = [1.0, -1.0].map(|side| {
                let mut count = 0;
                let point = start + d * lambda + across * (side * 1e-9);
                camera.images(index, point, |_| count += 1);
                count
            });
            let [few, many] = [counts[0].min(counts[1]), counts[0].max(counts[1])];
            pairs += usize::from(many == few + 2);
            assert!(
                many == few + 2 || many <= 1 || camera.normal(lambda).length() < 1e-6,
                "{counts:?}"
            );
        }
    }
    assert!(pairs > 100, "{pairs}");
}
