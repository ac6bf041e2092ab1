//! No holes, however large or small a mirror shows things.

use catoptric::scene::PreparedScene;
use glam::DVec3;

use super::{BLUE, RED, looks, moved, object, prepared, rendered_with, scene, shape};

const SIZE: [u32; 2] = [480, 270];

struct Found {
    /// Pixels of the reference's mask, eroded by one.
    inner: usize,
    /// Share of these that are covered.
    covered: f64,
    /// Pixels covered outside the mask, dilated by one, by the mask's size.
    outside: f64,
}

fn found(scene: &PreparedScene, detail: &str) -> Found {
    let coverage = |id: &str, settings: &[(&str, &str)]| {
        rendered_with(scene, id, settings, SIZE[0], SIZE[1]).1.coverage
    };
    let truth = coverage("raytrace", &[("spp", "16")]);
    let ours = coverage("c3rc", &[("detail", detail)]);
    let (width, height) = (SIZE[0] as usize, SIZE[1] as usize);
    let (mut inner, mut covered, mut mask, mut outside) = (0, 0, 0, 0);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let around =
                || (y - 1..=y + 1).flat_map(move |v| (x - 1..=x + 1).map(move |u| v * width + u));
            let i = y * width + x;
            mask += usize::from(truth[i] > 0.0);
            if around().all(|k| truth[k] == 1.0) {
                inner += 1;
                covered += usize::from(ours[i] >= 0.5);
            } else if around().all(|k| truth[k] == 0.0) {
                outside += usize::from(ours[i] >= 0.5);
            }
        }
    }
    let covered = f64::from(u32::try_from(covered).unwrap()) / inner as f64;
    Found { inner, covered, outside: outside as f64 / mask as f64 }
}

/// A mirror in the origin and a torus knot of a size, seen from before.
fn setting(mirror: &str, scale: f64, at: DVec3, eye: DVec3, target: DVec3) -> PreparedScene {
    let mut knot = object("knot", shape("knot", 20_000), moved(at), RED);
    knot.transform.scale = scale;
    prepared(
        &scene((shape(mirror, 8000), moved(DVec3::ZERO)), vec![knot], looks(eye, target)),
        400_000,
    )
}

#[test]
fn nothing_shines_through_at_any_magnification() {
    let settings = [
        // Far from a ball: a tenth of its size in a plane mirror.
        (
            "sphere",
            2.0,
            DVec3::new(1.0, 0.6, 8.0),
            DVec3::new(0.0, 0.9, 1.9),
            DVec3::new(0.0, 0.6, 0.0),
        ),
        ("plane", 0.8, DVec3::new(0.5, 0.0, 1.0), DVec3::new(-0.5, 0.3, 2.5), DVec3::ZERO),
        // Towards a bowl's focus: many times that.
        (
            "bowl",
            0.06,
            DVec3::new(0.1, 0.5, 0.1),
            DVec3::new(0.0, 2.2, 0.6),
            DVec3::new(0.0, 0.2, 0.0),
        ),
    ];
    for (mirror, scale, at, eye, target) in settings {
        let scene = setting(mirror, scale, at, eye, target);
        for detail in ["2", "4"] {
            let Found { inner, covered, outside } = found(&scene, detail);
            println!(
                "{mirror}, detail {detail}: {inner} pixels, {covered:.5} covered, {outside:.5} outside"
            );
            assert!(inner > 300, "{mirror}: {inner}");
            assert!(covered >= 0.999, "{mirror}, detail {detail}: {covered} of {inner} covered");
            assert!(outside <= 0.002, "{mirror}, detail {detail}: {outside} outside");
        }
    }
}

#[test]
fn few_surfels_hide_what_is_behind_them() {
    // A red ball before a blue one; surfels are some four pixels apart.
    let ball = |name: &str, paint, at: DVec3, scale: f64| {
        let mut ball = object(name, shape("sphere", 4000), moved(at), paint);
        ball.transform.scale = scale;
        ball
    };
    let objects = vec![
        ball("near", RED, DVec3::new(0.72, 0.22, 1.23), 0.4),
        ball("far", BLUE, DVec3::new(2.2, 0.6, 3.6), 2.0),
    ];
    let looks = looks(DVec3::new(-0.8, 0.4, 2.2), DVec3::new(0.25, 0.08, 0.8));
    let scene = scene((shape("sphere", 8000), moved(DVec3::ZERO)), objects, looks);
    let scene = prepared(&scene, 16_000);
    let radiance = |id: &str, settings: &[(&str, &str)]| {
        rendered_with(&scene, id, settings, SIZE[0], SIZE[1]).1.radiance
    };
    let truth = radiance("raytrace", &[("spp", "16")]);
    let ours = radiance("c3rc", &[]);
    let is_red = |[r, _, b]: [f32; 3]| r > 2.0 * b;
    let (mut inner, mut wrong) = (0, 0);
    let (width, height) = (SIZE[0] as usize, SIZE[1] as usize);
    for y in 2..height - 2 {
        for x in 2..width - 2 {
            let mut around =
                (y - 2..=y + 2).flat_map(|v| (x - 2..=x + 2).map(move |u| v * width + u));
            if around.all(|k| is_red(truth[k])) {
                inner += 1;
                wrong += usize::from(ours[y * width + x][2] > truth[y * width + x][2] + 0.05);
            }
        }
    }
    println!("{wrong} of {inner} pixels");
    assert!(inner > 1000, "{inner}");
    assert!(wrong * 160 <= inner, "what is behind shows in {wrong} of {inner} pixels");
}
