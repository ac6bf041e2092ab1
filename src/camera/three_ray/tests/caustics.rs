//! The caustic as strips against the folds of rays, found one by one.

use glam::DVec3;

use super::counts::tasks;
use super::mirrors::{KH, Shape, camera, largest_lambda};
use crate::camera::three_ray::caustic::{Ruling, caustic};
use crate::camera::three_ray::multiplicity::Jacobian;
use crate::camera::three_ray::{RayScale, Rays};

/// In longest edges of T(λ).
const PROMISED: f64 = 0.01;

/// Rays each way across a triangle.
const GRID: u32 = 24;

fn longest_edge(rays: &Rays, lambda: f64) -> f64 {
    let p = [0, 1, 2].map(|i| rays.origins[i] + rays.directions[i] * lambda);
    p[0].distance(p[1]).max(p[1].distance(p[2])).max(p[2].distance(p[0]))
}

/// The distance of a point from a triangle.
fn distance(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let edge = |a: DVec3, b: DVec3| {
        let along = b - a;
        let t = (p - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
        p.distance(a + along * t.clamp(0.0, 1.0))
    };
    let n = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(a, b)| (b - a).cross(p - a).dot(n) >= 0.0);
    let rim = edge(a, b).min(edge(b, c)).min(edge(c, a));
    if inside && n.length() > 0.0 { (p - a).dot(n).abs() / n.length() } else { rim }
}

/// The two triangles between neighbouring rulings.
fn facets(strip: &[Ruling]) -> impl Iterator<Item = [DVec3; 3]> + '_ {
    strip.windows(2).flat_map(|pair| {
        let ([a, b], [c, d]) = (pair[0].points, pair[1].points);
        [[a, b, d], [a, d, c]]
    })
}

/// Points of the fold: where each ray of a grid, rim included, touches the caustic.
fn sampled_fold(rays: &Rays, reach: f64) -> Vec<(f64, DVec3)> {
    let jacobian = Jacobian::of(rays);
    let grid = (0..=GRID).flat_map(|i| (0..=GRID - i).map(move |j| (i, j)));
    let on_ray = |(i, j): (u32, u32)| {
        let [b, c] = [i, j].map(|k| f64::from(k) / f64::from(GRID));
        let w = DVec3::new(1.0 - b - c, b, c);
        let (v, d) = rays.at(w);
        let roots = jacobian.folds_on_ray(w).into_iter().flatten();
        roots.filter(move |l| (0.0..=reach).contains(l)).map(move |l| (l, v + d * l))
    };
    grid.flat_map(on_ray).collect()
}

/// The largest distance of a sampled fold from the strips, and of the strips' facets from the fold, both in longest edges;
/// and how many rulings there are.
fn hausdorff(rays: &Rays, reach: f64) -> (f64, f64, usize) {
    let strips = caustic(rays, 0.0, reach);
    let off = |(lambda, point): &(f64, DVec3)| {
        let nearest = strips
            .iter()
            .flat_map(|strip| facets(strip))
            .map(|facet| distance(*point, facet))
            .fold(f64::INFINITY, f64::min);
        nearest / longest_edge(rays, *lambda)
    };
    let there = sampled_fold(rays, reach).iter().map(off).fold(0.0, f64::max);
    let mut back: f64 = 0.0;
    for pair in strips.iter().flat_map(|strip| strip.windows(2)) {
        for (s, t) in [(0.5, 0.5), (0.0, 0.5), (1.0, 0.5), (0.25, 0.25), (0.75, 0.75)] {
            let [a, b] = [0, 1].map(|k| pair[k].points[0].lerp(pair[k].points[1], s));
            let lambda = pair[0].lambda + (pair[1].lambda - pair[0].lambda) * t;
            back = back
                .max(off_surface(rays, a.lerp(b, t), lambda, pair) / longest_edge(rays, lambda));
        }
    }
    (there, back, strips.iter().map(Vec::len).sum())
}

/// The distance of a point from the rulings between two, by steps that narrow.
fn off_surface(rays: &Rays, point: DVec3, guess: f64, pair: &[Ruling]) -> f64 {
    let jacobian = Jacobian::of(rays);
    let off = |lambda: f64| {
        let [a, b] = jacobian.fold(lambda)?.map(|w| {
            let (v, d) = rays.at(w);
            v + d * lambda
        });
        Some(distance(point, [a, b, b]))
    };
    let (mut best, mut at) = (off(guess).unwrap_or(f64::INFINITY), guess);
    let mut step = 0.25 * (pair[1].lambda - pair[0].lambda);
    for _ in 0..40 {
        for lambda in [at - step, at + step] {
            let found = off(lambda).unwrap_or(f64::INFINITY);
            if found < best {
                (best, at) = (found, lambda);
            }
        }
        step *= 0.8;
    }
    best
}

#[test]
fn strips_lie_on_sampled_folds() {
    let results = tasks(600, 4, |numbers| {
        let shape = numbers.one_of(&[Shape::Convex, Shape::Concave, Shape::Saddle]);
        let kh = numbers.one_of(&KH);
        let scale = if numbers.next() < 0.5 { RayScale::EyeDistance } else { RayScale::Unit };
        let rays = camera(numbers, shape, kh, scale);
        hausdorff(&rays, largest_lambda(&rays, 8.0))
    });
    let worst = |of: fn(&(f64, f64, usize)) -> f64| results.iter().map(of).fold(0.0, f64::max);
    let (there, back) = (worst(|r| r.0), worst(|r| r.1));
    let rulings: usize = results.iter().map(|r| r.2).sum();
    let folded = results.iter().filter(|r| r.2 > 0).count();
    println!(
        "caustics: {folded} of {} cameras, {rulings} rulings, off by {there:.2e} and {back:.2e}",
        results.len()
    );
    assert!(there <= PROMISED && back <= PROMISED, "{there} and {back} longest edges");
    assert!(folded > 200, "only {folded} cameras have a caustic");
}

#[test]
fn rulings_rise_and_stay_in_range() {
    let results = tasks(300, 5, |numbers| {
        let rays = camera(numbers, Shape::Concave, 0.5, RayScale::Unit);
        let strips = caustic(&rays, 0.2, 1.5);
        for strip in &strips {
            assert!(strip.len() >= 2 && strip.windows(2).all(|p| p[0].lambda < p[1].lambda));
            assert!(strip[0].lambda >= 0.2 && strip[strip.len() - 1].lambda <= 1.5);
        }
        let intervals = Jacobian::of(&rays).mixed_intervals(0.2, 1.5);
        assert_eq!(strips.len(), intervals.as_slice().len());
        strips.len()
    });
    assert!(results.iter().sum::<usize>() > 150);
}
