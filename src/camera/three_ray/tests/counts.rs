//! The projectors' counts of images against the search by subdivision, and how often a point has several images.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use super::mirrors::{KH, LAWS, SHAPES, Shape, camera, largest_lambda};
use super::subdivision::{Found, Root, search};
use super::{Numbers, images, long};
use crate::camera::three_ray::multiplicity::{Class, Jacobian};
use crate::camera::three_ray::{RayScale, Rays, ThreeRay};

/// Points a camera.
const POINTS: usize = 20;

/// Results of tasks with numbers of their own, in order.
pub(super) fn tasks<T: Send>(
    count: usize,
    seed: u64,
    task: impl Fn(&mut Numbers) -> T + Sync,
) -> Vec<T> {
    let run = |i: usize| task(&mut Numbers(seed.wrapping_mul(0x1234_5678_9ABC) + i as u64));
    (0..count).into_par_iter().map(run).collect()
}

/// Weights in the triangle, or in one three times as large about its first corner, second or third.
fn weights_about(numbers: &mut Numbers) -> DVec3 {
    let w = numbers.weights();
    match numbers.0 % 8 {
        0 => DVec3::new(3.0 * w.x - 2.0, 3.0 * w.y, 3.0 * w.z),
        1 => DVec3::new(3.0 * w.x, 3.0 * w.y - 2.0, 3.0 * w.z),
        2 => DVec3::new(3.0 * w.x, 3.0 * w.y, 3.0 * w.z - 2.0),
        _ => w,
    }
}

/// Bounds of |N·d| / (|N| |d|) by which images are told apart: from below the first (near a fold) to above the last.
const STEEP: [f64; 3] = [1e-3, 1e-2, 1e-1];

#[derive(Default)]
struct Tally {
    decided: usize,
    undecided: usize,
    /// Decided points that the f64 projector counts otherwise.
    wrong: usize,
    /// Images of decided points, and those that the f32 projector has not, by [`STEEP`].
    images: [usize; 4],
    lost: [usize; 4],
    /// Decided points by their number of images.
    points: [usize; 4],
    example: Option<String>,
}

impl Tally {
    fn add(mut self, other: Self) -> Self {
        self.decided += other.decided;
        self.undecided += other.undecided;
        self.wrong += other.wrong;
        for i in 0..4 {
            self.images[i] += other.images[i];
            self.lost[i] += other.lost[i];
            self.points[i] += other.points[i];
        }
        self.example = self.example.or(other.example);
        self
    }

    fn judge(
        &mut self,
        rays: &Rays,
        cameras: &(ThreeRay<f64>, ThreeRay<f32>),
        point: DVec3,
        hi: f64,
    ) {
        let found = search(rays, point, 0.0, hi);
        if !found.decided {
            self.undecided += 1;
            return;
        }
        self.decided += 1;
        self.points[found.count().min(3)] += 1;
        let exact = images(&cameras.0, point, [0.0, hi], 0.0);
        if exact.len() != found.count() {
            self.wrong += 1;
            self.example.get_or_insert_with(|| format!("{rays:?} {point:?} {found:?} {exact:?}"));
        }
        let of = |root: &Root| STEEP.partition_point(|bound| *bound <= root.sine.abs());
        found.images().for_each(|root| self.images[of(root)] += 1);
        lost(rays, &cameras.1, &found, point, hi).for_each(|root| self.lost[of(&root)] += 1);
    }
}

/// How far off, or outside the triangle, an image may lie in f32: half a pixel of a triangle of ten, the guard band.
const BAND: f64 = 0.05;
/// A ray of the f32 projector that passes the point within this share of its distance shows it: near a focus, where the
/// triangle T(λ) is small, many do.
const MISS: f64 = 1e-5;

/// The images that the f32 projector does not have: about there, or elsewhere in the band with a ray that passes the point. Each image of it answers for one.
fn lost(
    rays: &Rays,
    camera: &ThreeRay<f32>,
    found: &Found,
    point: DVec3,
    hi: f64,
) -> impl Iterator<Item = Root> {
    let mut rounded: Vec<[f64; 4]> = images(camera, point, [-1e-5, hi], BAND)
        .iter()
        .map(|i| [i.b1(), i.b2, i.b3, i.lambda].map(f64::from))
        .collect();
    let mut lost = Vec::new();
    for root in found.images() {
        let off =
            |[b1, b2, b3, _]: &[f64; 4]| (DVec3::new(*b1, *b2, *b3) - root.w).abs().max_element();
        let shows = |image: &[f64; 4]| {
            let (v, d) = rays.at(DVec3::from_slice(image));
            let miss = (v + d * image[3]).distance(point);
            off(image) < BAND || miss < MISS * point.distance(rays.origins[0])
        };
        let nearest = (0..rounded.len()).filter(|&i| shows(&rounded[i]));
        match nearest.min_by(|&a, &b| off(&rounded[a]).total_cmp(&off(&rounded[b]))) {
            Some(i) => drop(rounded.swap_remove(i)),
            None => lost.push(*root),
        }
    }
    lost.into_iter()
}

#[test]
fn projectors_count_as_subdivision_does() {
    let cameras = if long() { 520_000 } else { 6_000 };
    let tally = tasks(cameras, 1, |numbers| {
        let mut tally = Tally::default();
        let shape = numbers.one_of(&SHAPES);
        let kh = numbers.one_of(&KH);
        let law = numbers.one_of(&LAWS);
        let scale = if numbers.next() < 0.5 { RayScale::EyeDistance } else { RayScale::Unit };
        let rays = camera(numbers, shape, kh, scale);
        let most = largest_lambda(&rays, law);
        let both = (ThreeRay::new(&rays, &rays), ThreeRay::new(&rays, &rays));
        for _ in 0..POINTS {
            let (v, d) = rays.at(weights_about(numbers));
            let point = v + d * numbers.between(0.0, most);
            tally.judge(&rays, &both, point, 3.0 * most);
        }
        tally
    });
    let tally = tally.into_iter().fold(Tally::default(), Tally::add);
    let Tally { decided, undecided, wrong, images, lost, points, example } = tally;
    let total = decided + undecided;
    println!(
        "{total} pairs: {undecided} undecided, {wrong} wrong; f32 lost {lost:?} of {images:?}; {points:?}"
    );
    assert_eq!(wrong, 0, "of {decided}; {example:?}");
    assert!(undecided * 1000 <= total, "{undecided} of {total} undecided");
    let all = |of: &[usize]| of.iter().sum::<usize>();
    assert!(all(&lost) * 10_000 <= all(&images), "f32 lost {lost:?} of {images:?}");
    assert!(points.iter().all(|&n| n > total / 100_000), "all counts occur: {points:?}");
}

/// Shares of points on rays of one camera with 1, 2 and 3 images, and of cameras that are mixed up to the law's end.
fn shares(shape: Shape, kh: f64, law: f64, cameras: usize) -> [f64; 4] {
    let counts = tasks(cameras, 2, |numbers| {
        let rays = camera(numbers, shape, kh, RayScale::Unit);
        let most = largest_lambda(&rays, law);
        let exact = ThreeRay::<f64>::new(&rays, &rays);
        let mut counts = [0_usize; 4];
        for _ in 0..POINTS {
            let (v, d) = rays.at(numbers.weights());
            let found =
                images(&exact, v + d * numbers.between(0.0, most), [0.0, 100.0 * most], 0.0);
            counts[found.len().clamp(1, 3) - 1] += 1;
        }
        counts[3] = usize::from(Jacobian::of(&rays).class(0.0, most) == Class::Mixed);
        counts
    });
    let sum = |i: usize| counts.iter().map(|c| c[i]).sum::<usize>() as f64;
    let points = cameras as f64 * POINTS as f64;
    [sum(0) / points, sum(1) / points, sum(2) / points, sum(3) / cameras as f64]
}

#[test]
fn shares_of_several_images_grow_with_curvature() {
    let cameras = if long() { 200_000 } else { 2_000 };
    let mut table = BTreeMap::new();
    for (s, shape) in SHAPES.into_iter().enumerate() {
        for (l, law) in LAWS.into_iter().enumerate() {
            let row = KH.map(|kh| shares(shape, kh, law, cameras));
            let text = row.map(|[one, two, three, mixed]| {
                format!(
                    "{:.3}/{:.3}/{:.4}, {:.0} %",
                    100.0 * one,
                    100.0 * two,
                    100.0 * three,
                    100.0 * mixed
                )
            });
            println!("| {shape:?}, 0 to {law} | {} |", text.join(" | "));
            table.insert((s, l), row);
        }
    }
    for (l, law) in LAWS.into_iter().enumerate() {
        let several = |s: usize| table[&(s, l)].map(|row| row[1] + row[2]);
        let [convex, concave, saddle, flat] = [0, 1, 2, 3].map(several);
        assert!(concave[3] > concave[1] && saddle[3] > saddle[1], "{law}");
        assert!(
            concave[3] > 0.005 && concave[3] > 10.0 * convex[3],
            "{law}: {concave:?} {convex:?}"
        );
        assert_eq!(flat, [0.0; 4], "{law}");
    }
}
