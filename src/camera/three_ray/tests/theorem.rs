//! The theorem of [`multiplicity`](super::super::multiplicity), its converse at folds, and what follows for the roots of F.

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::mirrors::{KH, LAWS, SHAPES, camera, camera_of, largest_lambda};
use super::subdivision::{Root, search};
use super::{counts::tasks, images, long};
use crate::camera::three_ray::multiplicity::{Class, Jacobian};
use crate::camera::three_ray::{RayScale, Rays, ThreeRay};

/// Points a camera.
const POINTS: usize = 100;

#[test]
fn a_root_outside_the_mixed_intervals_is_the_only_image() {
    let cameras = if long() { 1_200_000 } else { 12_000 };
    let results = tasks(cameras, 3, |numbers| {
        let shape = numbers.one_of(&SHAPES);
        let kh = numbers.one_of(&KH);
        let law = numbers.one_of(&LAWS);
        let scale = if numbers.next() < 0.5 { RayScale::EyeDistance } else { RayScale::Unit };
        let rays = camera(numbers, shape, kh, scale);
        let most = largest_lambda(&rays, law);
        let mixed = Jacobian::of(&rays).mixed_intervals(0.0, 3.0 * most);
        let exact = ThreeRay::<f64>::new(&rays, &rays);
        let (mut decided, mut undecided, mut violation) = (0_usize, 0_usize, None);
        for _ in 0..POINTS {
            let (w, lambda) = (numbers.weights(), numbers.between(0.0, most));
            if mixed.as_slice().iter().any(|[from, to]| (*from..=*to).contains(&lambda)) {
                continue;
            }
            let (v, d) = rays.at(w);
            let point = v + d * lambda;
            if images(&exact, point, [0.0, 3.0 * most], 0.0).len() != 1 {
                // The subdivision says whether that can be told.
                let found = search(&rays, point, 0.0, 3.0 * most);
                if !found.decided {
                    undecided += 1;
                    continue;
                }
                violation.get_or_insert_with(|| format!("{rays:?} {w} {lambda} {found:?}"));
            }
            decided += 1;
        }
        (decided, undecided, violation)
    });
    let decided: usize = results.iter().map(|r| r.0).sum();
    let undecided: usize = results.iter().map(|r| r.1).sum();
    let violations: Vec<_> = results.iter().filter_map(|r| r.2.as_ref()).collect();
    println!("theorem: {decided} decided, {undecided} undecided, {} violations", violations.len());
    assert!(violations.is_empty(), "{:?}", violations[0]);
    assert!(decided > cameras * POINTS * 4 / 5, "only {decided} samples");
}

/// A camera of a paraboloid with curvatures up to 1, unit or eye-distance rays.
fn cameras() -> impl Strategy<Value = Rays> {
    let curvature = -1.0..1.0;
    let corner = || (0.7..1.3, -0.3..0.3);
    let eye = (-3.0..3.0, -3.0..3.0, 0.5..4.0);
    let place = (-0.7..0.7, -0.7..0.7, 0.0..6.3, 0.05..1.0);
    let corners = (corner(), corner(), corner());
    (curvature.clone(), curvature, eye, place, corners, any::<bool>()).prop_filter_map(
        "the triangle turns away from the eye",
        |(k1, k2, (x, y, z), (a, b, turn, kh), (c1, c2, c3), unit)| {
            let mut i = 0.0;
            let corners = [c1, c2, c3].map(|(share, slip): (f64, f64)| {
                i += 1.0;
                let angle = turn + (i + 0.5 * slip) * 2.094;
                DVec2::new(a, b) + DVec2::from_angle(angle) * (kh * 0.577 * share)
            });
            let scale = if unit { RayScale::Unit } else { RayScale::EyeDistance };
            camera_of(DVec2::new(k1, k2), corners, DVec3::new(x, y, z), scale)
        },
    )
}

fn weights() -> impl Strategy<Value = DVec3> {
    (0.0..1.0, 0.0..1.0).prop_map(|(b, c): (f64, f64)| {
        let (b, c) = if b + c > 1.0 { (1.0 - b, 1.0 - c) } else { (b, c) };
        DVec3::new(1.0 - b - c, b, c)
    })
}

fn config() -> ProptestConfig {
    let cases = if long() { 100_000 } else { 2_000 };
    ProptestConfig {
        cases,
        failure_persistence: None,
        max_global_rejects: 100 * cases,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config())]

    /// Completeness: the point of a ray has the image that made it, and no other outside the mixed intervals.
    #[test]
    fn a_point_has_the_image_that_made_it(rays in cameras(), w in weights(), share in 0.0..4.0) {
        let lambda = largest_lambda(&rays, share);
        let (v, d) = rays.at(w);
        let found = search(&rays, v + d * lambda, 0.0, largest_lambda(&rays, 20.0));
        prop_assume!(found.decided);
        prop_assert!(found.images().any(|root| (root.lambda - lambda).abs() < 1e-6 * (1.0 + lambda)
            && (root.w - w).abs().max_element() < 1e-4));
        let mixed = Jacobian::of(&rays).mixed_intervals(0.0, largest_lambda(&rays, 20.0));
        if !mixed.as_slice().iter().any(|[from, to]| (*from..=*to).contains(&lambda)) {
            prop_assert_eq!(found.count(), 1);
        }
    }

    /// Consecutive roots of F, in the triangle or not, have opposite parities; valid images alone need not.
    #[test]
    fn parities_alternate_along_the_roots(rays in cameras(), w in weights(), share in 0.0..4.0) {
        let (v, d) = rays.at(w);
        let reach = largest_lambda(&rays, 100.0);
        let found = search(&rays, v + d * largest_lambda(&rays, share), -reach, reach);
        prop_assume!(found.roots.iter().all(|root| root.sine.abs() > 1e-6));
        for pair in found.roots.windows(2) {
            prop_assert!(pair[0].sine * pair[1].sine < 0.0, "{:?}", found.roots);
        }
    }

    /// The fold of T(λ) lies where the determinant is 0, its ends on the triangle's edges; there is one iff signs are mixed.
    #[test]
    fn folds_are_where_the_determinant_vanishes(rays in cameras(), share in 0.0..8.0, t in 0.0..1.0) {
        let lambda = largest_lambda(&rays, share);
        let jacobian = Jacobian::of(&rays);
        let g = jacobian.at(lambda);
        let one_sign = (g.x > 0.0) == (g.y > 0.0) && (g.y > 0.0) == (g.z > 0.0);
        prop_assert_eq!(jacobian.fold(lambda).is_none(), one_sign);
        if let Some([a, b]) = jacobian.fold(lambda) {
            for end in [a, b] {
                prop_assert_eq!(end.min_element(), 0.0);
                prop_assert!(end.max_element() <= 1.0 && (end.element_sum() - 1.0).abs() < 1e-15);
            }
            let w = a.lerp(b, t);
            prop_assert!(g.dot(w).abs() <= 1e-14 * g.abs().max_element());
            let meets = jacobian.folds_on_ray(w);
            let near = |x: f64| (x - lambda).abs() < 1e-4 * (1.0 + lambda);
            prop_assert!(meets.into_iter().flatten().any(near), "{lambda} {meets:?}");
        }
        // And the intervals hold exactly those λ.
        let inside = jacobian.mixed_intervals(0.0, largest_lambda(&rays, 8.0));
        let inside = inside.as_slice().iter().any(|[from, to]| (*from..=*to).contains(&lambda));
        prop_assert_eq!(inside, !one_sign);
    }

    /// The converse of the theorem: off a fold, along N, lie points with two images more on one side than on the other.
    #[test]
    fn images_come_and_go_in_pairs_at_folds(rays in cameras(), t in 0.1..0.9, at in 0.1..0.9) {
        let jacobian = Jacobian::of(&rays);
        let reach = largest_lambda(&rays, 20.0);
        let mixed = jacobian.mixed_intervals(0.0, reach);
        let Some([from, to]) = mixed.as_slice().first() else {
            return Err(TestCaseError::reject("not mixed"));
        };
        let lambda = from + (to - from) * at;
        let [a, b] = jacobian.fold(lambda).expect("mixed");
        let w = a.lerp(b, t);
        let (v, d) = rays.at(w);
        let (e, f) = (
            [1, 2].map(|i| rays.origins[i] - rays.origins[0]),
            [1, 2].map(|i| rays.directions[i] - rays.directions[0]),
        );
        let moved = [0, 1].map(|k| e[k] + f[k] * lambda);
        let n = moved[0].cross(moved[1]);
        let area = n.length();
        let step = n * (1e-7 * area.sqrt() / area);
        // Near a cusp (F bends the other way close by) three images become one: F is bend·t² + twist·t³ about the fold.
        let n1 = moved[0].cross(f[1]) + f[0].cross(moved[1]);
        let n2 = f[0].cross(f[1]);
        let x = v + d * lambda - rays.origins[0] - rays.directions[0] * lambda;
        let (bend, twist) = (n2.dot(x) - n1.dot(rays.directions[0]), -n2.dot(rays.directions[0]));
        let apart = (step.dot(n) / bend.abs()).sqrt();
        prop_assume!((twist * apart).abs() < 0.1 * bend.abs());
        let count = |side: f64| search(&rays, v + d * lambda + step * side, 0.0, reach);
        let (over, under) = (count(1.0), count(-1.0));
        prop_assume!(over.decided && under.decided && apart < lambda);
        // Near the triangle's rim one of the two may lie outside.
        let both = if over.roots.len() > under.roots.len() { &over } else { &under };
        let pair = both.roots.iter().filter(|root| (root.lambda - lambda).abs() < 1.5 * apart);
        let inside = |root: &&Root| (root.w - w).abs().max_element() < 0.5 * w.min_element();
        prop_assume!(pair.clone().all(|root| inside(&root)));
        prop_assert_eq!(pair.count(), 2, "{:?} {:?}", over, under);
        prop_assert_eq!(over.count().abs_diff(under.count()), 2, "{:?} {:?}", over, under);
    }
}

/// The two cameras of Mei et al.'s Fig. 4, as far as its text says: rays of unit length; one whose sweeping triangle first
/// shrinks and never meets itself, and one with the mixed interval [0.98, 1.49]. Their coordinates are ours: a twisted bundle,
/// and a triangle of edge 1.22 on a bowl with curvature 0.49.
fn figure_4() -> [Rays; 2] {
    let corners = [0.6_f64, 0.6 + 2.0944, 0.6 + 4.1888].map(DVec2::from_angle);
    let twisted = corners.map(|p| {
        let origin = (p * 0.7).extend(0.0);
        (origin, (p.perp() * 0.45 - p * 0.35).extend(1.0).normalize_or(DVec3::Z))
    });
    let left = Rays { origins: twisted.map(|r| r.0), directions: twisted.map(|r| r.1) };
    let bowl = DVec2::splat(-0.49);
    let corners = corners.map(|p| p * (1.22 / 3.0_f64.sqrt()));
    let right = camera_of(bowl, corners, DVec3::new(2.0, 1.0, 6.0), RayScale::Unit);
    [left, right.expect("it faces the eye")]
}

#[test]
fn the_cameras_of_figure_4() {
    let [left, right] = figure_4();
    for d in left.directions.into_iter().chain(right.directions) {
        assert!((d.length() - 1.0).abs() < 1e-12);
    }
    assert_eq!(Jacobian::of(&left).class(0.0, 10.0), Class::ConvergentThenDivergent);
    assert!(Jacobian::of(&left).mixed_intervals(0.0, 10.0).as_slice().is_empty());
    assert_eq!(Jacobian::of(&left).class(3.0, 10.0), Class::Divergent, "behind its waist");

    let jacobian = Jacobian::of(&right);
    assert_eq!(jacobian.class(0.0, 10.0), Class::Mixed);
    let &[[from, to]] = jacobian.mixed_intervals(0.0, 10.0).as_slice() else {
        panic!("not one interval: {:?}", jacobian.mixed_intervals(0.0, 10.0));
    };
    assert!((from - 0.98).abs() < 0.005 && (to - 1.49).abs() < 0.005, "{from} to {to}");
    assert_eq!(jacobian.class(1.5, 10.0), Class::Divergent);
    // T(1.1) meets others: points beside its fold have two images, on the other side none.
    let [a, b] = jacobian.fold(1.1).expect("mixed");
    let (v, d) = right.at((a + b) * 0.5);
    let n = (right.origins[1] - right.origins[0]
        + (right.directions[1] - right.directions[0]) * 1.1)
        .cross(
            right.origins[2] - right.origins[0] + (right.directions[2] - right.directions[0]) * 1.1,
        );
    let mut counts = [1e-4, -1e-4].map(|s| search(&right, v + d * 1.1 + n * s, 0.0, 10.0).count());
    counts.sort_unstable();
    assert_eq!(counts[1], counts[0] + 2);
}
