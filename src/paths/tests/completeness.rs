//! Every root is found: points made from rays of cameras far more curved than meshes have.

use super::*;
use crate::camera::three_ray::Rays;

/// A triangle about one unit large with rays that open by about `spread`, which 1 makes wider than any bound on λ.
fn camera(random: &mut Random, spread: f64) -> Camera {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|v| v + random.point(0.2));
    let directions = [0; 3].map(|_| DVec3::Z + random.point(2.0 * spread));
    Camera::alone(Rays { origins: corners, directions })
}

fn images(camera: &Camera, point: DVec3) -> Vec<(f64, [f64; 3])> {
    let mut list = Vec::new();
    camera.images(0, point, |image| list.push((image.lambda, image.weights)));
    list
}

#[test]
fn every_ray_through_a_point_is_among_its_images() {
    let mut random = Random::new(12);
    let (mut wide, mut several, mut tried) = (0, [0; 4], 0);
    for round in 0..20_000 {
        let camera = camera(&mut random, [0.01, 0.1, 0.5, 1.0][round % 4]);
        let mut w = [random.next(), random.next(), 0.0];
        if w[0] + w[1] > 1.0 {
            w = [1.0 - w[0], 1.0 - w[1], 0.0];
        }
        w[2] = 1.0 - w[0] - w[1];
        let lambda = 10.0f64.powf(random.next() * 6.0 - 3.0);
        let (start, d) = camera.rays.at(DVec3::from_array(w));
        let point = start + d * lambda;
        let normal = camera.normal(lambda);
        if normal.dot(d).abs() < 1e-6 * normal.length() * d.length() {
            continue;
        }
        tried += 1;
        wide += usize::from(camera.three_ray.wide);
        let found = images(&camera, point);
        several[found.len()] += 1;
        for (lambda, w) in &found {
            let (v, d) = camera.rays.at(DVec3::from_array(*w));
            let missed = (v + d * *lambda - point).length();
            assert!(missed <= 1e-6 * (1.0 + point.length()), "{round}: {missed}");
        }
        // Where the point moves little, the ray's end must.
        let same = |(l, b): &&(f64, [f64; 3])| {
            let apart = (camera.rays.at(DVec3::from_array(*b)).0 - start).length();
            apart < 1e-5 && (l / lambda - 1.0).abs() < 1e-5
        };
        assert_eq!(
            found.iter().filter(same).count(),
            1,
            "{round}: λ {lambda} w {w:?} in {found:?}"
        );
        assert!(found.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }
    assert!(tried > 19_000 && wide > 1_000, "{tried} {wide}");
    assert!(several[2] > 100 && several[3] > 10, "{several:?}");
}

/// Against all sign changes of F on a fine grid.
#[test]
fn no_image_is_missed_or_made_up() {
    let mut random = Random::new(13);
    let mut several = [0; 4];
    for round in 0..2_000 {
        let camera = camera(&mut random, [0.3, 0.8][round % 2]);
        let w = DVec3::new(random.next(), random.next(), random.next());
        let (start, d) = camera.rays.at(w / w.element_sum());
        let point = start + d * (3.0 * random.next()) + random.point(0.1);
        let f = |l: f64| {
            let ([v, ..], [d, ..]) = (camera.rays.origins, camera.rays.directions);
            camera.normal(l).dot(point - v - d * l)
        };
        // Even steps of λ / (1 + λ).
        const STEPS: u32 = 4_000;
        let at = |i: u32| f64::from(i) / f64::from(STEPS - i);
        let (mut expected, mut doubtful) = (0, false);
        for i in 0..STEPS - 1 {
            let (mut lo, mut hi) = (at(i), at(i + 1));
            if f(lo).signum() == f(hi).signum() {
                continue;
            }
            for _ in 0..60 {
                let middle = 0.5 * (lo + hi);
                if f(middle).signum() == f(hi).signum() { hi = middle } else { lo = middle }
            }
            let q = (point - camera.rays.origins[0]).to_array();
            let image = camera.three_ray.image_at(q, lo, true);
            let least = image.b1().min(image.b2).min(image.b3);
            expected += usize::from(least > 0.0);
            doubtful |= least.abs() < 1e-6;
        }
        let found = images(&camera, point).len();
        several[found] += 1;
        assert!(found == expected || doubtful, "{round}: {found} for {expected}");
    }
    assert!(several[0] > 20 && several[1] > 100 && several[2] > 20, "{several:?}");
}
