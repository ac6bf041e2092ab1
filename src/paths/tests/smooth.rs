//! Paths on smooth surfaces: against exact reflections, and by the law of reflection.

use super::*;

/// The point of the unit sphere about the origin where it reflects `eye` to `point`, by bisection in their plane: Alhazen's
/// problem for a convex mirror. `None` if the point is in its shadow.
fn alhazen(eye: DVec3, point: DVec3) -> Option<DVec3> {
    let x = eye.normalize_or_zero();
    let y = (point - x * point.dot(x)).normalize_or_zero();
    let angle = point.dot(y).atan2(point.dot(x));
    let at = |t: f64| x * t.cos() + y * t.sin();
    // The normal turns from one to the other; what it has more of the eye than of the point changes sign.
    let tilt = |t: f64| {
        let (n, side) = (at(t), y * t.cos() - x * t.sin());
        let [a, b] = [eye, point].map(|end| (end - n).normalize_or_zero().dot(side));
        a + b
    };
    let (mut low, mut high) = (0.0, angle);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if tilt(middle) > 0.0 { low = middle } else { high = middle }
    }
    let p = at(0.5 * (low + high));
    let faces = |end: DVec3| (end - p).normalize_or_zero().dot(p) > 0.05;
    (faces(eye) && faces(point)).then_some(p)
}

/// Points around the unit sphere with their exact reflections, away from its silhouette.
fn around_a_sphere(count: usize) -> (Vec<DVec3>, Vec<DVec3>) {
    let mut random = Random::new(21);
    let points = std::iter::repeat_with(|| random.point(4.0)).filter(|p| p.length() > 1.2);
    points.filter_map(|p| Some((p, alhazen(EYE, p)?))).take(count).unzip()
}

/// Largest and mean error of the ghosts, as shares of the paths' lengths.
fn ghost_errors(triangles: usize, refine: bool) -> [f64; 2] {
    let scene = shape("sphere", triangles);
    let options = PathOptions { refine, ..PathOptions::default() };
    let finder = PathFinder::new(&scene, EYE, options).unwrap();
    let (points, exact) = around_a_sphere(2_000);
    let set = finder.find(&points, &Context::default()).unwrap();
    let (mut largest, mut sum) = (0.0f64, 0.0);
    for (i, (point, p)) in points.iter().zip(&exact).enumerate() {
        assert_eq!(set.of(i).len(), 1, "{triangles} {point}");
        let path = &set.of(i)[0];
        assert_eq!(path.refinement, if refine { Refinement::Surface } else { Refinement::Camera });
        let length = p.distance(EYE) + p.distance(*point);
        let ghost = EYE + (*p - EYE).normalize_or_zero() * length;
        let error = path.ghost(EYE).distance(ghost) / length;
        if refine {
            assert!(path.miss < 1e-12 * length, "{}", path.miss);
        }
        largest = largest.max(error);
        sum += error;
    }
    [largest, sum / points.len() as f64]
}

#[test]
fn ghosts_of_a_sphere_converge_with_its_triangles() {
    let counts = [1_000, 4_000, 16_000, 64_000, 250_000];
    let errors = counts.map(|n| ghost_errors(n, false));
    assert!(errors[4][0] <= 2e-5, "{errors:?}");
    for k in [0, 1] {
        let slope = (errors[4][k] / errors[0][k]).ln() / (250_000.0f64 / 1_000.0).ln();
        assert!((slope + 1.0).abs() <= 0.1, "slope {slope} of {errors:?}");
    }
}

#[test]
fn refined_ghosts_of_a_sphere_are_exact() {
    for triangles in [500, 4_000] {
        let [largest, _] = ghost_errors(triangles, true);
        assert!(largest <= 1e-9, "{triangles}: {largest}");
    }
}

#[test]
fn a_sphere_has_one_image_of_what_it_does_not_hide() {
    let scene = shape("sphere", 2_000);
    let finder = finder(&scene, RayScale::EyeDistance);
    let (points, _) = around_a_sphere(4_000);
    let counts = finder.count(&points, &Context::default()).unwrap();
    assert!(counts.iter().all(|c| c.images == 1));
    // In its shadow: behind it, between the tangents.
    let mut random = Random::new(3);
    let behind: Vec<DVec3> =
        (0..500).map(|_| -EYE * (0.5 + random.next()) + random.point(0.2)).collect();
    let counts = finder.count(&behind, &Context::default()).unwrap();
    assert!(counts.iter().all(|c| c.images == 0));
}

/// By how much the angles at P on the surface differ, and how far P is from it.
fn law(point: DVec3, path: &Path, normal: DVec3) -> f64 {
    let [in_, out] = path.directions(EYE, point);
    (out - crate::camera::mirror_ray::reflect(in_, normal)).length()
}

#[test]
fn refined_paths_obey_the_law_of_reflection() {
    for (name, triangles, closed) in [
        ("ellipsoid", 1_000, true),
        ("torus", 2_000, true),
        ("bowl", 1_000, true),
        ("wave", 2_000, true),
        ("cylinder", 2_000, true),
        ("teapot", 4_000, false),
        ("goblet", 4_000, false),
    ] {
        let turn = glam::DQuat::from_rotation_y(0.4);
        let place =
            Similarity { rotation: turn, translation: DVec3::new(0.3, -0.2, 0.1), scale: 1.3 };
        let mut scene = scene(&[(name, triangles, place)]);
        let scene_with = PathScene::new(&scene);
        scene.mirrors[0].source = None;
        let scene_without = PathScene::new(&scene);
        for (paths, analytic) in [(&scene_with, closed), (&scene_without, false)] {
            let options = PathOptions { refine: true, ..PathOptions::default() };
            let finder = PathFinder::new(paths, EYE, options).unwrap();
            let mut random = Random::new(6);
            let points: Vec<DVec3> = (0..2_000).map(|_| random.point(2.5)).collect();
            let set = finder.find(&points, &Context::default()).unwrap();
            let plain = PathFinder::new(paths, EYE, PathOptions::default()).unwrap();
            let plain = plain.find(&points, &Context::default()).unwrap();
            let (mut done, mut failed, mut better) = (0, 0, 0);
            for (i, point) in points.iter().enumerate() {
                for (path, before) in set.of(i).iter().zip(plain.of(i)) {
                    if path.refinement != Refinement::Surface {
                        assert_eq!(path.mirror_point, before.mirror_point);
                        failed += 1;
                        continue;
                    }
                    done += 1;
                    assert!(path.miss < 1e-9, "{name}: {}", path.miss);
                    better += usize::from(path.miss <= before.miss.max(1e-12));
                    let size = finder.cameras[0].size * 8.0;
                    assert!(path.mirror_point.distance(before.mirror_point) < size);
                    if analytic {
                        let local = place.inverse_point(path.mirror_point);
                        let surface = builtin::smooth(name, Some(triangles)).unwrap();
                        // The cylinder's ends are flat.
                        let at = surface.derivatives(local);
                        if at.value.abs() < 1e-3 {
                            assert!(at.value.abs() < 1e-12, "{name}: {}", at.value);
                            let normal = place.direction(at.gradient.normalize_or_zero());
                            assert!(law(*point, path, normal) < 1e-9, "{name}");
                        }
                    }
                }
            }
            // The goblet's stem has few triangles about it: its paths are far from the camera's.
            let most = if name == "goblet" { done / 4 } else { done / 20 };
            assert!(done > 300 && failed < most, "{name}: {done} refined, {failed} not");
            assert!(better * 100 > done * 99, "{name}: {better} of {done}");
        }
    }
}
