//! Points that stand for disks, beyond the caustic.

use glam::DVec3;

use super::{Numbers, caustic, images};
use crate::camera::three_ray::{RayScale, ThreeRay};

/// Of a point that lies a little beyond the caustic, so that it has no image there, the disk has: on the caustic, if it
/// reaches over it.
#[test]
fn disks_reach_over_the_caustic() {
    let mut numbers = Numbers(23);
    let mut tried = 0;
    for _ in 0..4_000 {
        let rays = numbers.camera(0.3, RayScale::EyeDistance);
        let w = numbers.weights();
        let Some(lambda) = caustic(&rays, w) else { continue };
        let (v, d) = rays.at(w);
        let point = ThreeRay::<f64>::new(&rays, &rays);
        let normal = (0..3).map(|k| lambda * (lambda * point.n2[k] + point.n1[k]) + point.n0[k]);
        let normal = DVec3::from_slice(&normal.collect::<Vec<f64>>()).normalize_or_zero();
        let near = |disk: f64, q: DVec3| {
            let camera = ThreeRay { disk, ..point };
            let found = images(&camera, q, [-1e-5, 25.0], 0.2);
            found.iter().filter(|i| (i.lambda - lambda).abs() < 0.02 * (1.0 + lambda)).count()
        };
        let off = normal * 1e-7;
        let sides = [off, -off].map(|off| v + d * lambda + off);
        // Two images on one side and none on the other: neither a cusp nor at the triangle's edge.
        let Some(beyond) = (0..2).find(|&i| near(0.0, sides[i]) == 0) else { continue };
        if near(0.0, sides[1 - beyond]) != 2 {
            continue;
        }
        tried += 1;
        assert_eq!(near(0.9e-7, sides[beyond]), 0, "{rays:?}");
        assert_eq!(near(1.2e-7, sides[beyond]), 2, "{rays:?}");
    }
    assert!(tried > 200, "{tried}");
}
