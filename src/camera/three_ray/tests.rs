//! Cameras of random curved mirrors, convex, concave and saddle, against points whose images are known.

mod caustics;
mod counts;
mod disks;
mod mirrors;
mod slope;
mod subdivision;
mod theorem;

use fearless_simd::{Level, Simd, dispatch, f32x8, f32x16};
use glam::{DVec2, DVec3};

use super::multiplicity::{Jacobian, mixed_sign_range};
use super::volume::{BoxTest, Boxes};
use super::*;
use crate::geometry::lanes::{Real, Vector};

/// SplitMix64 as numbers in 0..1.
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.next()
    }

    /// One of these.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below the length")]
    pub(crate) fn one_of<T: Copy>(&mut self, list: &[T]) -> T {
        list[(self.next() * list.len() as f64) as usize]
    }

    pub(crate) fn point(&mut self) -> DVec3 {
        DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    /// A triangle of a paraboloid z = -(k1 x² + k2 y²)/2 with edges of about `edge`, seen from above.
    pub(crate) fn camera(&mut self, edge: f64, scale: RayScale) -> Rays {
        let (k1, k2) = (self.between(-1.0, 1.0), self.between(-1.0, 1.0));
        let eye =
            DVec3::new(self.between(-2.0, 2.0), self.between(-2.0, 2.0), self.between(1.0, 4.0));
        let turn = self.between(0.0, 6.3);
        let corner = |i: f64| {
            let p = DVec2::from_angle(turn + i * 2.094) * edge * 0.577;
            let v = DVec3::new(p.x, p.y, -0.5 * (k1 * p.x * p.x + k2 * p.y * p.y));
            let n = DVec3::new(k1 * p.x, k2 * p.y, 1.0).normalize_or(DVec3::Z);
            let view = v - eye;
            let reflected = view - n * (2.0 * n.dot(view));
            let unit = reflected.normalize_or(DVec3::Z);
            (v, if scale == RayScale::Unit { unit } else { reflected })
        };
        let rays = [corner(0.0), corner(1.0), corner(2.0)];
        Rays { origins: rays.map(|r| r.0), directions: rays.map(|r| r.1) }
    }

    pub(crate) fn weights(&mut self) -> DVec3 {
        let (mut b, mut c) = (self.next(), self.next());
        if b + c > 1.0 {
            (b, c) = (1.0 - b, 1.0 - c);
        }
        DVec3::new(1.0 - b - c, b, c)
    }
}

/// Whether tests shall take minutes where they take seconds.
fn long() -> bool {
    std::env::var_os("CATOPTRIC_LONG_TESTS").is_some()
}

fn images<T: Scalar + Real<Scalar = T, Mask = bool>>(
    camera: &ThreeRay<T>,
    point: DVec3,
    [lo, hi]: [f64; 2],
    margin: f64,
) -> Vec<Image<T>> {
    let v1 = DVec3::from_array(camera.v1.map(Scalar::to_f64));
    let q: [T; 3] = array(point - v1);
    let mut list = Vec::new();
    for image in project(camera, q, T::from_f64(lo), T::from_f64(hi)).as_slice() {
        if image.within([T::from_f64(margin); 3]) {
            list.push(*image);
        }
    }
    list
}

#[test]
fn finds_the_image_that_made_the_point() {
    let mut numbers = Numbers(1);
    let (mut lost, mut blurred) = (0, 0);
    let total = 40_000;
    for i in 0..total {
        let scale = if i % 2 == 0 { RayScale::EyeDistance } else { RayScale::Unit };
        let edge = numbers.between(0.02, 0.5);
        let rays = numbers.camera(edge, scale);
        let (w, lambda) = (numbers.weights(), numbers.between(0.0, 3.0));
        let (v, d) = rays.at(w);
        let point = v + d * lambda;
        // Near the caustic T(λ) is a sliver or the point has a double root: there the weights are not
        // determined by the point (see `hard_points_keep_their_position`).
        let jacobian = Jacobian::of(&rays);
        if jacobian.at(lambda).dot(w).abs() < 1e-2 * jacobian.g[0][0].abs() {
            continue;
        }
        let exact = ThreeRay::<f64>::new(&rays, &rays);
        let error = |b2: f64, b3: f64, l: f64| {
            (b2 - w.y).abs().max((b3 - w.z).abs()).max((l - lambda).abs() / (1.0 + lambda))
        };
        let least = |errors: Vec<f64>| errors.into_iter().fold(f64::INFINITY, f64::min);
        let found = images(&exact, point, [-1e-5, 10.0], 1e-3);
        let e64 = least(found.iter().map(|i| error(i.b2, i.b3, i.lambda)).collect());
        lost += usize::from(e64 > 1e-6);
        let rounded = ThreeRay::<f32>::new(&rays, &rays);
        let found = images(&rounded, point, [-1e-5, 10.0], 1e-3);
        let e32 =
            least(found.iter().map(|i| error(i.b2.into(), i.b3.into(), i.lambda.into())).collect());
        blurred += usize::from(e32 > 2e-2);
    }
    assert_eq!(lost, 0, "images lost in f64");
    assert!(blurred * 1000 < total, "{blurred} of {total} images lost in f32");
}

#[test]
fn hard_points_keep_their_position() {
    // On the caustic the root is double: judged by where the image's ray passes the point.
    let mut numbers = Numbers(2);
    let (mut tried, mut far) = (0, 0);
    while tried < 5000 {
        let rays = numbers.camera(0.3, RayScale::EyeDistance);
        let w = numbers.weights();
        let g = Jacobian::of(&rays).g;
        let c: [f64; 3] = [0, 1, 2].map(|k| DVec3::new(g[0][k], g[1][k], g[2][k]).dot(w));
        let disc = c[1] * c[1] - 4.0 * c[0] * c[2];
        let lambda = (-c[1] - disc.max(0.0).sqrt()) / (2.0 * c[2]);
        if disc < 0.0 || !(0.01..5.0).contains(&lambda) {
            continue;
        }
        tried += 1;
        let (v, d) = rays.at(w);
        let point = v + d * (lambda * (1.0 + 1e-4));
        let camera = ThreeRay::<f32>::new(&rays, &rays);
        let near = images(&camera, point, [-1e-5, 10.0], 1e-3).iter().any(|i| {
            let w = DVec3::new(i.b1().into(), i.b2.into(), i.b3.into());
            let (v, d) = rays.at(w);
            (v + d * f64::from(i.lambda)).distance(point) < 1e-4 * point.length()
        });
        far += usize::from(!near);
    }
    // Half of the points just beyond a fold have no image at all; the others must be met.
    assert!(far * 20 < tried * 11, "{far} of {tried} points near the caustic were not met");
}

#[test]
fn plane_mirror_is_exact_with_eye_distance_rays() {
    let mut numbers = Numbers(3);
    for _ in 0..1000 {
        let eye = DVec3::new(numbers.between(-1.0, 1.0), 0.3, numbers.between(1.0, 3.0));
        let corners =
            [0; 3].map(|_| DVec3::new(numbers.between(-1.0, 1.0), numbers.between(-1.0, 1.0), 0.0));
        let directions = corners.map(|v| (v - eye) * DVec3::new(1.0, 1.0, -1.0));
        let rays = Rays { origins: corners, directions };
        let w = numbers.weights();
        let (v, d) = rays.at(w);
        let lambda = numbers.between(0.01, 4.0);
        let point = v + d * lambda;
        let mirrored = eye * DVec3::new(1.0, 1.0, -1.0);
        let camera = ThreeRay::<f64>::new(&rays, &rays);
        let found = images(&camera, point, [-1e-5, 20.0], 1e-3);
        let image = found.iter().find(|i| (i.lambda - lambda).abs() < 1e-6).expect("an image");
        let hit = rays.at(DVec3::new(image.b1(), image.b2, image.b3)).0;
        let along = (point - mirrored).normalize_or(DVec3::Z);
        assert!((hit - mirrored).cross(along).length() < 1e-7);
    }
}

#[test]
fn every_lane_width_gives_the_same_bits() {
    fn lanes<S: Simd, V: Vector<S>>(
        simd: S,
        camera: &ThreeRay<f32>,
        points: &[[f32; 16]; 3],
    ) -> Vec<[u32; 4]> {
        let mut list = Vec::new();
        for at in (0..16).step_by(V::LANES as usize) {
            let q = [0, 1, 2].map(|k| V::load(simd, &points[k][at..]));
            let (lo, hi) = (V::broadcast(simd, 0.0), V::broadcast(simd, 8.0));
            for image in project(camera, q, lo, hi).as_slice() {
                let (mut l, mut b, mut c) = ([0.0; 16], [0.0; 16], [0.0; 16]);
                image.lambda.store(&mut l);
                image.b2.store(&mut b);
                image.b3.store(&mut c);
                let bits = V::bits(image.found);
                for i in (0..V::LANES as usize).filter(|i| bits >> i & 1 == 1) {
                    #[expect(clippy::cast_possible_truncation)]
                    list.push([(at + i) as u32, l[i].to_bits(), b[i].to_bits(), c[i].to_bits()]);
                }
            }
        }
        list.sort_unstable();
        list
    }
    let mut numbers = Numbers(4);
    let level = Level::new();
    let mut compared = 0;
    for _ in 0..2000 {
        let rays = numbers.camera(0.4, RayScale::EyeDistance);
        let camera = ThreeRay::<f32>::new(&rays, &rays);
        let mut points = [[0.0f32; 16]; 3];
        #[expect(clippy::needless_range_loop)]
        for i in 0..16 {
            let (w, l) = (numbers.weights(), numbers.between(0.0, 4.0));
            let (v, d) = rays.at(w);
            let q: [f32; 3] = array(v + d * l - rays.origins[0]);
            (0..3).for_each(|k| points[k][i] = q[k]);
        }
        let wide = dispatch!(level, simd => lanes::<_, f32x16<_>>(simd, &camera, &points));
        let eight = dispatch!(level, simd => lanes::<_, f32x8<_>>(simd, &camera, &points));
        assert_eq!(wide, eight);
        #[cfg(target_arch = "x86_64")]
        {
            let sse = Level::Sse2(level.as_sse2().expect("x86-64 has SSE2"));
            let low = dispatch!(sse, simd => lanes::<_, f32x8<_>>(simd, &camera, &points));
            assert_eq!(wide, low);
        }
        let mut scalar = Vec::new();
        #[expect(clippy::needless_range_loop)]
        for i in 0..16 {
            let q = [0, 1, 2].map(|k| points[k][i]);
            for image in project(&camera, q, 0.0f32, 8.0).as_slice() {
                if image.found {
                    #[expect(clippy::cast_possible_truncation)]
                    scalar.push([
                        i as u32,
                        image.lambda.to_bits(),
                        image.b2.to_bits(),
                        image.b3.to_bits(),
                    ]);
                }
            }
        }
        scalar.sort_unstable();
        assert_eq!(wide, scalar);
        compared += wide.len();
    }
    assert!(compared > 10_000);
}

#[test]
fn outside_the_mixed_range_a_point_has_one_image() {
    let mut numbers = Numbers(5);
    let (mut alone, mut several) = (0, 0);
    for _ in 0..40_000 {
        let rays = numbers.camera(0.8, RayScale::EyeDistance);
        let (w, lambda) = (numbers.weights(), numbers.between(0.0, 4.0));
        let (v, d) = rays.at(w);
        let camera = ThreeRay::<f64>::new(&rays, &rays);
        let mut found = images(&camera, v + d * lambda, [-1e-5, 1e3], 1e-3);
        found.retain(|i| i.within([0.0; 3]));
        let mixed = mixed_sign_range(&rays, 0.0, 1e3);
        if mixed.is_some_and(|(lo, hi)| (lo..=hi).contains(&lambda)) {
            several += usize::from(found.len() > 1);
        } else {
            assert!(found.len() <= 1, "{found:?} outside {mixed:?}, λ = {lambda}");
            alone += 1;
        }
    }
    assert!(alone > 10_000 && several > 50, "{alone} {several}");
}

/// Boxes that contain a point which the camera sees: no conservative test may refuse one.
#[test]
fn conservative_tests_miss_no_box_and_the_papers_does() {
    let pairs = 10_240_000;
    let tests = [BoxTest::Interval, BoxTest::Sweep, BoxTest::Slab, BoxTest::Paper];
    let level = Level::new();
    let chunk = 256 * 64;
    let missed = std::sync::Mutex::new([0usize; 4]);
    rayon::scope(|scope| {
        for part in 0..pairs / chunk {
            let missed = &missed;
            scope.spawn(move |_| {
                let mut numbers = Numbers(1000 + part as u64);
                let mut own = [0usize; 4];
                for _ in 0..chunk / 64 {
                    let own_missed = one_camera(&mut numbers, level, &tests);
                    (0..4).for_each(|t| own[t] += own_missed[t]);
                }
                let mut all = missed.lock().unwrap();
                (0..4).for_each(|t| all[t] += own[t]);
            });
        }
    });
    let missed = missed.into_inner().unwrap();
    assert_eq!(missed[..3], [0, 0, 0], "boxes missed by interval, sweep, slab");
    assert!(missed[3] > pairs / 1000, "the paper's test missed only {} boxes", missed[3]);
}

/// 64 boxes against one camera by each test: four times 64 pairs.
fn one_camera(numbers: &mut Numbers, level: Level, tests: &[BoxTest; 4]) -> [usize; 4] {
    let edge = 10f64.powf(numbers.between(-2.5, 0.0));
    let scale = if numbers.next() < 0.5 { RayScale::EyeDistance } else { RayScale::Unit };
    let mut rays = numbers.camera(edge, scale);
    if numbers.next() < 0.3 {
        // Far from the origin.
        let offset = numbers.point() * 100.0;
        rays.origins = rays.origins.map(|v| v + offset);
    }
    let volume = ViewVolume::<f32>::new(&rays);
    let mut missed = [0; 4];
    for _ in 0..8 {
        let (mut center, mut half) = ([[0.0f32; 8]; 3], [[0.0f32; 8]; 3]);
        for slot in 0..8 {
            let w = numbers.weights();
            let lambda = match numbers.0 % 4 {
                0 => numbers.between(0.0, 0.01), // straddles the base
                1 => caustic(&rays, w).unwrap_or(1.0),
                _ => 10f64.powf(numbers.between(-2.0, 1.3)),
            };
            let (v, d) = rays.at(w);
            let inside = v + d * lambda;
            let size = 10f64.powf(numbers.between(-4.0, 0.5));
            let h = DVec3::new(numbers.next(), numbers.next(), numbers.next()) * size
                + 1e-6 * inside.length();
            // The point lies within the box by a share of its size.
            let c = inside + numbers.point() * h * 0.99;
            for k in 0..3 {
                #[expect(clippy::cast_possible_truncation)]
                {
                    center[k][slot] = (c[k] - rays.origins[0][k]) as f32;
                    half[k][slot] = (h[k] * (1.0 + 1e-6)) as f32;
                }
            }
        }
        for (t, &test) in tests.iter().enumerate() {
            missed[t] += dispatch!(level, simd => refused(simd, &volume, test, &center, &half));
        }
    }
    missed
}

#[test]
fn the_volume_of_a_parallelogram_refuses_no_box_of_its_own() {
    let mut numbers = Numbers(77);
    let level = Level::new();
    let tests = [BoxTest::Interval, BoxTest::Sweep, BoxTest::Slab];
    let (mut missed, mut refused_outside) = ([0; 3], 0);
    for _ in 0..3_000 {
        let edge = 10f64.powf(numbers.between(-2.5, 0.0));
        let rays = numbers.camera(edge, RayScale::EyeDistance);
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let at = |s: f64, t: f64| DVec3::new(1.0 - s - t, s, t);
        let volume = ViewVolume::<f32, 4>::new(&rays.part(corners.map(|(s, t)| at(s, t))));
        for inside in [true, false] {
            let (mut center, mut half) = ([[0.0f32; 8]; 3], [[0.0f32; 8]; 3]);
            for slot in 0..8 {
                let far = if inside { 0.0 } else { 3.0 };
                let (v, d) = rays.at(at(numbers.next() + far, numbers.next()));
                let point = v + d * 10f64.powf(numbers.between(-2.0, 1.3));
                let size =
                    edge * 10f64.powf(numbers.between(-3.0, if inside { 0.5 } else { -1.0 }));
                let h = DVec3::new(numbers.next(), numbers.next(), numbers.next()) * size
                    + 1e-6 * point.length();
                let c = point + numbers.point() * h * 0.99;
                for k in 0..3 {
                    #[expect(clippy::cast_possible_truncation)]
                    {
                        center[k][slot] = (c[k] - rays.origins[0][k]) as f32;
                        half[k][slot] = (h[k] * (1.0 + 1e-6)) as f32;
                    }
                }
            }
            for (missed, test) in missed.iter_mut().zip(tests) {
                let n = dispatch!(level, simd => refused(simd, &volume, test, &center, &half));
                match inside {
                    true => *missed += n,
                    false if test == BoxTest::Slab => refused_outside += n,
                    false => {}
                }
            }
        }
    }
    assert_eq!(missed, [0; 3]);
    assert!(refused_outside > 12_000, "only {refused_outside} of 24,000 outside are refused");
}

#[inline(always)]
fn refused<S: Simd, const N: usize>(
    simd: S,
    volume: &ViewVolume<f32, N>,
    test: BoxTest,
    center: &[[f32; 8]; 3],
    half: &[[f32; 8]; 3],
) -> usize {
    let boxes = Boxes {
        center: [0, 1, 2].map(|k| f32x8::load(simd, &center[k])),
        half: [0, 1, 2].map(|k| f32x8::load(simd, &half[k])),
    };
    let (lo, hi) = (f32x8::broadcast(simd, 0.0), f32x8::broadcast(simd, 1e3));
    let meets = volume.meets(test, &boxes, lo, hi).meets;
    8 - f32x8::bits(meets).count_ones() as usize
}

/// The λ in 0..20 at which the ray `w` meets the caustic.
fn caustic(rays: &Rays, w: DVec3) -> Option<f64> {
    let g = Jacobian::of(rays).g;
    let c: [f64; 3] = [0, 1, 2].map(|k| DVec3::new(g[0][k], g[1][k], g[2][k]).dot(w));
    let disc = c[1] * c[1] - 4.0 * c[0] * c[2];
    let lambda = (-c[1] - disc.max(0.0).sqrt()) / (2.0 * c[2]);
    (disc >= 0.0 && (0.0..20.0).contains(&lambda)).then_some(lambda)
}

#[test]
fn bounds_a_lambda_range() {
    // A narrow camera along z: a box at distance 2..3 leaves about that.
    let rays = Rays {
        origins: [DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * 0.1],
        directions: [DVec3::Z, DVec3::new(0.05, 0.0, 1.0), DVec3::new(0.0, 0.05, 1.0)],
    };
    let volume = ViewVolume::<f64>::new(&rays);
    let boxes = Boxes::<f64> { center: [0.1, 0.1, 2.5], half: [0.01, 0.01, 0.5] };
    for test in [BoxTest::Interval, BoxTest::Sweep, BoxTest::Slab] {
        let Verdict { lo, hi, meets, .. } = volume.meets(test, &boxes, 0.0, 100.0);
        assert!(
            meets && (1.9..=2.0).contains(&lo) && (3.0..=3.1).contains(&hi),
            "{test:?} {lo} {hi}"
        );
        let aside = Boxes { center: [0.9, 0.1, 2.5], ..boxes };
        assert!(!volume.meets::<f64>(test, &aside, 0.0, 100.0).meets, "{test:?}");
    }
}

/// Points of boxes that lie inside, by the slab test, have images in the camera; some boxes do lie inside, none that
/// straddles a wall does.
#[test]
fn boxes_inside_hold_points_with_images() {
    let mut numbers = Numbers(12);
    let (mut boxes_inside, mut points, mut seen) = (0, 0, 0);
    for _ in 0..20_000 {
        let edge = 10f64.powf(numbers.between(-2.0, -0.3));
        let rays = numbers.camera(edge, RayScale::EyeDistance);
        let volume = ViewVolume::<f64>::new(&rays);
        let camera = ThreeRay::<f64>::new(&rays, &rays);
        let (v, d) = rays.at(numbers.weights());
        let center = v + d * numbers.between(0.2, 3.0) - rays.origins[0];
        let half = DVec3::splat(10f64.powf(numbers.between(-4.0, -1.0)));
        let boxes = Boxes::<f64> { center: center.to_array(), half: half.to_array() };
        if !volume.meets(BoxTest::Slab, &boxes, 0.0, 100.0).inside {
            continue;
        }
        boxes_inside += 1;
        for _ in 0..8 {
            let q = center + numbers.point() * half;
            let images = project(&camera, q.to_array(), 0.0, 100.0);
            points += 1;
            seen += usize::from(images.as_slice().iter().any(|i| i.within([1e-3; 3])));
        }
    }
    assert!(boxes_inside > 4000, "only {boxes_inside} boxes inside");
    assert!(seen * 1000 >= points * 995, "{seen} of {points} points have an image");
}

/// The solver against the bracketed method of Brent in the `roots` crate, on the same monotone pieces, and no root
/// missed where F changes sign.
#[test]
fn roots_agree_with_brent() {
    let mut numbers = Numbers(6);
    let mut compared = 0;
    for _ in 0..20_000 {
        let rays = numbers.camera(0.4, RayScale::EyeDistance);
        let (w, lambda) = (numbers.weights(), numbers.between(0.0, 3.0));
        let (v, d) = rays.at(w);
        let camera = ThreeRay::<f64>::new(&rays, &rays);
        let q = (v + d * lambda - rays.origins[0]).to_array();
        let cubic = camera.cubic::<f64>(q);
        let (lo, hi) = (0.0, 8.0);
        let found = cubic.roots_between(lo, hi, |_| 0.0);
        let found: Vec<f64> =
            found.root[..found.count].iter().filter(|r| r.1).map(|r| r.0).collect();
        let [p, q] = cubic.critical_points(lo, hi);
        let mut expected = Vec::new();
        for (from, to) in [(lo, p), (p, q), (q, hi)] {
            if cubic.value(from) * cubic.value(to) < 0.0 {
                let f = |x: f64| cubic.value(x);
                let root = roots::find_root_brent(from, to, f, &mut 1e-10f64);
                expected.push(root.expect("the sign changes"));
            }
        }
        let scale = cubic.c.iter().fold(0.0f64, |m, c| m.max(c.abs()));
        for root in &expected {
            let near = found
                .iter()
                .any(|x| (x - root).abs() < 1e-6 || cubic.value(*x).abs() < 1e-13 * scale);
            assert!(near, "{root} is not among {found:?}");
            compared += 1;
        }
        assert!(found.len() >= expected.len());
    }
    assert!(compared > 15_000);
}
