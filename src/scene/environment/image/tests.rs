use std::f32::consts::{FRAC_PI_2, PI, TAU};

use fearless_simd::{Simd, dispatch, f32x16};
use glam::{DQuat, Vec3};

use super::super::resample::MOST_CELLS;
use super::*;
use crate::geometry::lanes::{Vector, simd_level};

/// A panorama of a function of the direction, unturned.
fn panorama(width: u32, height: u32, color: impl Fn(Vec3) -> [f32; 3]) -> Picture {
    let mut picture = Picture::black(width, height);
    for (i, pixel) in picture.rgb.iter_mut().enumerate() {
        let (x, y) = (i % width as usize, i / width as usize);
        let east = ((x as f32 + 0.5) / width as f32 - 0.5) * TAU;
        let north = (0.5 - (y as f32 + 0.5) / height as f32) * PI;
        let direction = Vec3::new(east.sin() * north.cos(), north.sin(), -east.cos() * north.cos());
        *pixel = color(direction);
    }
    picture
}

fn image(panorama: &Picture) -> EnvironmentImage {
    EnvironmentImage::new(panorama, Mounting::default(), &Context::default()).unwrap()
}

fn at(image: &EnvironmentImage, direction: Vec3) -> Vec3 {
    image.radiance_in(direction.to_array()).into()
}

/// Directions all over, and those where faces, halves and pixels meet.
fn directions() -> Vec<Vec3> {
    let mut list: Vec<Vec3> = (0..20_000)
        .map(|k| {
            let k = k as f32;
            Vec3::new((k * 0.37).cos(), (k * 0.73).sin(), (k * 1.31).cos() + 0.1)
        })
        .collect();
    for x in [-1.0, -0.5, 0.0, 0.5, 1.0] {
        for y in [-1.0, -0.5, 0.0, 0.5, 1.0] {
            list.extend([-1.0, 0.0, 1.0].map(|z| Vec3::new(x, y, z)));
        }
    }
    list.retain(|d| d.length() > 0.01);
    list
}

fn smooth(d: Vec3) -> [f32; 3] {
    [0.5 + 0.4 * d.x, 0.5 + 0.3 * d.y - 0.2 * d.z * d.x, 3.0 + 2.0 * d.z + d.y * d.z]
}

fn furthest(image: &EnvironmentImage, expected: impl Fn(Vec3) -> Vec3) -> f32 {
    let off = |d: Vec3| (at(image, d) - expected(d.normalize_or(Vec3::X))).abs().max_element();
    directions().into_iter().map(off).fold(0.0, f32::max)
}

#[test]
fn a_function_comes_back_in_every_direction() {
    // Between pixels of 0.35 degrees, and after means over as much.
    const NEAR: f32 = 2e-4;
    let plain = image(&panorama(1024, 512, smooth));
    let off = furthest(&plain, |d| smooth(d).into());
    assert!(off < NEAR, "{off}");
    // Sides that are odd, and a row too few.
    let odd = image(&panorama(1023, 509, smooth));
    let off = furthest(&odd, |d| smooth(d).into());
    assert!(off < NEAR, "{off}");
    for rotate_deg in [90.0, -30.0, 725.5] {
        let mounting = Mounting { rotate_deg, exposure: -1.5 };
        let turned = panorama(1024, 512, smooth);
        let turned = EnvironmentImage::new(&turned, mounting, &Context::default()).unwrap();
        let back = DQuat::from_rotation_y(-rotate_deg.to_radians());
        let factor = 0.5_f32.powf(1.5);
        let expected = |d: Vec3| Vec3::from(smooth((back * d.as_dvec3()).as_vec3())) * factor;
        let off = furthest(&turned, expected);
        assert!(off < NEAR, "{rotate_deg}: {off}");
        assert!(furthest(&turned, |d| Vec3::from(smooth(d)) * factor) > 0.01, "it is turned");
    }
}

#[test]
fn the_middle_is_ahead_and_nothing_is_mirrored() {
    // Left to right: red, green, blue, white; their upper halves are ten times as bright.
    let mut picture = Picture::black(64, 32);
    for (i, pixel) in picture.rgb.iter_mut().enumerate() {
        let colors = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
        let bright = if i / 64 < 16 { 10.0 } else { 1.0 };
        *pixel = (colors[i % 64 / 16] * bright).to_array();
    }
    let image = image(&picture);
    // Seen from inside: behind the left shoulder, left ahead, right ahead, behind the right shoulder.
    for (x, z, color) in
        [(-1.0, 1.0, Vec3::X), (-1.0, -1.0, Vec3::Y), (1.0, -1.0, Vec3::Z), (1.0, 1.0, Vec3::ONE)]
    {
        for (y, bright) in [(0.7, 10.0), (-0.7, 1.0)] {
            let found = at(&image, Vec3::new(x, y, z));
            assert!(
                (found - color * bright).abs().max_element() < 0.02 * bright,
                "{x} {y} {z}: {found}"
            );
        }
    }
    // A quarter turn counterclockwise brings what was at the right ahead.
    let mounting = Mounting { rotate_deg: 90.0, exposure: 0.0 };
    let turned = EnvironmentImage::new(&picture, mounting, &Context::default()).unwrap();
    assert!((at(&turned, Vec3::new(-1.0, -0.7, -1.0)) - Vec3::Z).length() < 0.02);
}

/// Repeatable numbers from 0 to 1.
fn noise(d: Vec3) -> [f32; 3] {
    [d.x, d.y, d.z].map(|v| (v * 7919.0 + d.dot(Vec3::new(31.7, 57.1, 91.3)) * 533.0).sin().abs())
}

#[test]
fn faces_meet_without_a_seam() {
    let image = image(&panorama(256, 128, noise));
    let (mut largest, mut varies) = (0.0_f32, 0.0_f32);
    let mut last = Vec3::ZERO;
    for k in -1000..=1000 {
        let along = k as f32 / 1000.0;
        for edge in
            [Vec3::new(1.0, 1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(-1.0, -1.0, 0.0)]
        {
            for turn in 0..3 {
                let turned = |v: Vec3| match turn {
                    0 => v,
                    1 => Vec3::new(v.z, v.x, v.y),
                    _ => Vec3::new(v.y, v.z, v.x),
                };
                let on = turned(edge + Vec3::Z * along);
                let aside = turned(Vec3::new(edge.x, -edge.y, 0.0)) * 1e-6;
                let apart = (at(&image, on + aside) - at(&image, on - aside)).abs().max_element();
                largest = largest.max(apart);
            }
        }
        let now = at(&image, Vec3::new(1.0, 1.0, along));
        varies = varies.max((now - last).abs().max_element());
        last = now;
    }
    // Differences over a millionth of a radian, where neighbours differ by tenths over a hundredth.
    assert!(largest < 1e-4, "{largest}");
    assert!(varies > 0.01, "there is nothing to be cut");
}

#[test]
fn lanes_say_the_same_as_one_number() {
    #[inline(always)]
    fn sixteen<S: Simd>(simd: S, image: &EnvironmentImage, d: &[Vec3]) -> [[f32; 16]; 3] {
        let lanes = |k: usize| {
            let numbers: [f32; 16] = std::array::from_fn(|i| d[i][k]);
            f32x16::load(simd, &numbers)
        };
        let mut out = [[0.0; 16]; 3];
        for (found, out) in
            image.radiance_in([lanes(0), lanes(1), lanes(2)]).into_iter().zip(&mut out)
        {
            found.store(out);
        }
        out
    }
    let image = image(&panorama(64, 32, noise));
    for d in directions().chunks_exact(16) {
        let found = dispatch!(simd_level(), simd => sixteen(simd, &image, d));
        for (i, d) in d.iter().enumerate() {
            assert_eq!(found.map(|lanes| lanes[i]), at(&image, *d).to_array(), "{d}");
        }
    }
}

/// What all directions within `radius` of a place see together: radiance by solid angle.
fn gathered(image: &EnvironmentImage, east: f32, north: f32, radius: f32) -> f32 {
    let middle = Vec3::new(east.sin() * north.cos(), north.sin(), -east.cos() * north.cos());
    let (right, up) = middle.any_orthonormal_pair();
    let steps = 400;
    let mut sum = 0.0;
    for i in -steps..=steps {
        for j in -steps..=steps {
            let [x, y] = [i, j].map(|k| k as f32 / steps as f32 * radius);
            let weight = (1.0 + x * x + y * y).powf(-1.5);
            sum += at(image, middle + right * x + up * y).x * weight;
        }
    }
    sum * (radius / steps as f32).powi(2)
}

#[test]
fn one_bright_pixel_keeps_its_light_and_its_place() {
    const SUN: f32 = 1e5;
    let (width, height) = (512u32, 256u32);
    for row in [128, 64, 5, 0] {
        let mut picture = Picture::black(width, height);
        picture.rgb[row * width as usize + 300] = [SUN; 3];
        let image = image(&picture);
        let east = ((300.0 + 0.5) / width as f32 - 0.5) * TAU;
        let north = (0.5 - (row as f32 + 0.5) / height as f32) * PI;
        let angle = PI / height as f32;
        let sees = SUN * angle * angle * north.cos();
        let found = gathered(&image, east, north, 6.0 * angle);
        // Rows next to the pole share its light with the one below them.
        let off = if row == 0 { 0.12 } else { 0.04 };
        assert!((found / sees - 1.0).abs() < off, "row {row}: {found} instead of {sees}");
        // It is not spread beyond its neighbours.
        let near = gathered(&image, east, north, 2.0 * angle);
        assert!(row < 10 || near > 0.9 * found, "row {row}: {near} of {found}");
    }
}

#[test]
fn what_is_sharp_stays_sharp_and_what_is_too_fine_is_averaged() {
    let stripes = |wide: usize| {
        let mut picture = Picture::black(512, 256);
        for (i, pixel) in picture.rgb.iter_mut().enumerate() {
            *pixel = [if (i % 512 / wide).is_multiple_of(2) { 1.0 } else { 0.0 }; 3];
        }
        picture
    };
    let contrast = |image: &EnvironmentImage, north: f32| {
        let seen = (0..4000).map(|k| {
            let east = k as f32 / 4000.0 * 0.5 - 0.25;
            at(image, Vec3::new(east.sin() * north.cos(), north.sin(), -east.cos() * north.cos())).x
        });
        seen.fold([1.0, 0.0], |[low, high]: [f32; 2], v| [low.min(v), high.max(v)])
    };
    let [low, high] = contrast(&image(&stripes(3)), 0.0);
    assert!(low < 0.1 && high > 0.9, "{low} to {high}");
    // Where a pixel of the horizon is as wide as twelve, which are two periods.
    let [low, high] = contrast(&image(&stripes(3)), (1.0_f32 / 12.0).acos());
    assert!(low > 0.3 && high < 0.7, "{low} to {high}");
    // Narrow pixels of the last row are one colour at the pole.
    let top = image(&stripes(64));
    for k in 0..64 {
        let east = k as f32 * 0.1;
        let beside = Vec3::new(east.sin() * 1e-3, 1.0, east.cos() * 1e-3);
        assert!((at(&top, beside).x - at(&top, Vec3::Y).x).abs() < 0.2, "{k}");
    }
    // A panorama that is finer than the nodes may be.
    let width = 8192;
    let mut fine = Picture::black(width, width / 2);
    for (i, pixel) in fine.rgb.iter_mut().enumerate() {
        *pixel = [f32::from((i / width as usize + i).is_multiple_of(2)); 3];
    }
    let fine = image(&fine);
    assert_eq!(f64::from(fine.cells()), MOST_CELLS);
    assert!(size_of_val(fine.nodes()) <= 128 << 20);
    let off = directions().into_iter().map(|d| (at(&fine, d).x - 0.5).abs()).fold(0.0, f32::max);
    assert!(off < 0.06, "{off}");
}

#[test]
fn values_are_never_negative_and_never_infinite() {
    let mut picture = Picture::black(64, 32);
    for (i, pixel) in picture.rgb.iter_mut().enumerate() {
        *pixel = [[-5.0, f32::MAX, 1.0], [0.0, 1e30, -1e30], [1e-40, 0.0, f32::MAX]][i % 3];
    }
    let mounting = Mounting { rotate_deg: 1e300, exposure: MOST_EXPOSURE };
    let image = EnvironmentImage::new(&picture, mounting, &Context::default()).unwrap();
    for d in directions() {
        let found = at(&image, d);
        assert!(found.is_finite() && found.min_element() >= 0.0, "{d}: {found}");
    }
    // A panorama is no reason for NaN where a direction is none.
    assert!(at(&image, Vec3::ZERO).is_finite());
}

#[test]
fn what_is_no_panorama_is_refused() {
    let refused = |picture: &Picture, mounting: Mounting, expected: &str| {
        let error = EnvironmentImage::new(picture, mounting, &Context::default()).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    };
    let plain = Mounting::default();
    refused(&Picture::black(64, 64), plain, "64x64 pixels are no panorama, which is twice");
    refused(&Picture::black(0, 0), plain, "0x0 pixels are no panorama");
    refused(&Picture::black(64, 30), plain, "64x30 pixels are no panorama");
    image(&Picture::black(1024, 508));
    image(&Picture::black(2, 1));
    let mut holed = Picture::black(64, 32);
    holed.rgb[64 * 3 + 7][1] = f32::NAN;
    refused(&holed, plain, "pixel (7, 3): the value is not a finite number");
    let black = Picture::black(64, 32);
    refused(&black, Mounting { rotate_deg: f64::NAN, ..plain }, "a rotation of NaN degrees");
    refused(&black, Mounting { exposure: 33.0, ..plain }, "an exposure of 33 stops");
    let (problem, _) = misshapen(16_384, 8192).unwrap();
    assert!(problem.contains("16384x8192 pixels are more than"), "{problem}");
    assert_eq!(misshapen(8192, 4096), None);
    let cx = Context::default();
    cx.cancel_flag().store(true, std::sync::atomic::Ordering::Relaxed);
    let cancelled = EnvironmentImage::new(&black, plain, &cx);
    assert!(matches!(cancelled, Err(Error::Cancelled)));
}

#[test]
fn poles_and_horizon_are_where_they_belong() {
    let image = image(&panorama(512, 256, |d| [d.y.max(0.0), (-d.y).max(0.0), 0.0]));
    assert!((at(&image, Vec3::Y) - Vec3::X).length() < 1e-3);
    assert!((at(&image, Vec3::NEG_Y) - Vec3::Y).length() < 1e-3);
    let half = (FRAC_PI_2 / 3.0).sin();
    let found = at(&image, Vec3::new(0.0, half, (1.0 - half * half).sqrt()));
    assert!((found - Vec3::new(half, 0.0, 0.0)).length() < 1e-3, "{found}");
}
