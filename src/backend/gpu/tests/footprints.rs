//! What is drawn of an image: the shader, f32 and f64, over the plans of real scenes.

use glam::{DVec2, DVec3};

use super::super::records::Records;
use super::super::shaders;
use super::pictures::{eye, scene, seen};
use super::twins::unpacked_normal;
use super::{device, run};
use crate::backend::cpu::splat::projection as constants;
use crate::context::Context;
use crate::geometry::lanes::{Real, Scalar, cross, dot};
use crate::geometry::look::packed_normal;
use crate::methods::{FrameInput, Params, method};
use crate::plan::{CameraInstance, LARGEST_ELLIPSE, Pass, Plan, SplatPass, SplatShape, kernel};
use crate::scene::PreparedScene;

/// Of one surfel: what the shader says of its first image that is drawn.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    surfel: usize,
    camera: usize,
    stride: f64,
    /// λ, b2, b3.
    image: [f64; 3],
    values: [f64; VALUES],
}

/// Middle (2), form (3), half (2), weight, range, depth.
const VALUES: usize = 10;
const NAMES: [&str; VALUES] = [
    "middle x",
    "middle y",
    "a",
    "b",
    "c",
    "half width",
    "half height",
    "weight",
    "range",
    "depth",
];

/// Runs the plan of a frame through the shader.
fn drawn(scene: &PreparedScene, pass: &SplatPass<'_>) -> Option<Vec<Drawn>> {
    const ENTRY: &str = "
        @group(0) @binding(20) var<storage, read_write> found: array<vec4<f32>>;
        @compute @workgroup_size(64)
        fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
            let job = job_of(group.x, lane, 0u);
            if !job.exists { return; }
            let place = vec3(surfel_x[job.surfel], surfel_y[job.surfel], surfel_z[job.surfel]);
            let images = images_of(job.camera, place - row(job.camera + V1).xyz, job.lambda);
            for (var piece = 0u; piece < images.pieces.count; piece++) {
                let image = project(job.camera, images, piece);
                let s = splat_of(job, image);
                if s.drawn {
                    let at = 5u * (group.x * 64u + lane);
                    found[at] = vec4(1.0, bitcast<f32>(s.surfel), f32(job.stride),
                        bitcast<f32>((job.camera - frame.cameras) / CAMERA_ROWS));
                    found[at + 1u] = vec4(image.lambda, image.b2, image.b3, s.depth);
                    found[at + 2u] = vec4(s.middle, s.half);
                    found[at + 3u] = vec4(s.form, s.weight);
                    found[at + 4u] = vec4(s.range);
                    return;
                }
            }
        }";
    let gpu = device()?;
    let mut records = Records::default();
    records.fill(pass, &seen(scene), u32::MAX).expect("few rows");
    let few = records.chunks().all() / 2;
    assert!(Records::default().fill(pass, &seen(scene), few).is_none(), "too many are noticed");
    let text = shaders::projection_for_tests(SplatShape::Ellipse) + ENTRY;
    let chunks = records.chunks().all().min(2000);
    let frame = records.frame(0, false);
    let frame: &[[u32; 4]] = bytemuck::cast_slice(bytemuck::bytes_of(&frame));
    let s = &scene.surfels;
    let padded = |list: &[f32]| -> Vec<[u32; 4]> {
        let bits: Vec<u32> = list.iter().map(|v| v.to_bits()).collect();
        bits.chunks(4).map(|c| [0, 1, 2, 3].map(|i| c.get(i).copied().unwrap_or(0))).collect()
    };
    let normals: Vec<f32> = s.normals.iter().map(|n| f32::from_bits(packed_normal(*n))).collect();
    let [x, y, z, extent, normals] =
        [&s.x, &s.y, &s.z, &s.extent, &normals].map(|list| padded(list));
    let lists: [(u32, &[[u32; 4]]); 7] =
        [(0, frame), (1, records.rows()), (2, &x), (3, &y), (4, &z), (5, &extent), (6, &normals)];
    let found = run(&gpu, &text, &lists, 5 * 64 * chunks as usize, chunks);
    let of = |f: &[[f32; 4]]| {
        let [head, image, place, form, range] = [f[0], f[1], f[2], f[3], f[4]];
        (head[0] == 1.0).then(|| Drawn {
            surfel: head[1].to_bits() as usize,
            stride: f64::from(head[2]),
            camera: head[3].to_bits() as usize,
            image: [image[0], image[1], image[2]].map(f64::from),
            values: [
                place[0], place[1], form[0], form[1], form[2], place[2], place[3], form[3],
                range[0], image[3],
            ]
            .map(f64::from),
        })
    };
    Some(found.chunks_exact(5).filter_map(of).collect())
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number")]
fn index(v: f64) -> usize {
    v as usize
}

/// The same from the camera's constants and the image, in any precision.
fn by_hand<T: Scalar + Real<Scalar = T, Mask = bool>>(
    scene: &PreparedScene,
    pass: &SplatPass<'_>,
    drawn: &Drawn,
) -> [f64; VALUES] {
    let c: &CameraInstance = &pass.cameras[drawn.camera];
    let t = |v: f32| T::from_f64(f64::from(v));
    let three = |v: [f32; 3]| v.map(t);
    let [lambda, b2, b3] = drawn.image.map(T::from_f64);
    let linear = |form: [f32; 3]| t(form[0]) + b2 * t(form[1]) + b3 * t(form[2]);
    let scaled = |v: [T; 3], by: T| v.map(|v| v * by);
    let minus = |a: [T; 3], b: [T; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let plus = |a: [T; 3], b: [T; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
    let d = c.direction.map(linear);
    let w = linear(c.screen[2]);
    let mut middle =
        [linear(c.screen[0]) / w + T::from_f64(1.0), linear(c.screen[1]) / w + T::from_f64(1.0)];
    // Across the ray: what is left of a step without its part along d.
    let [base, per_lambda] = c.per_px;
    let across = |k: usize| {
        let step = plus(three(base[k]), scaled(three(per_lambda[k]), lambda));
        minus(step, scaled(d, dot(step, d) / dot(d, d)))
    };
    let (right, down) = (across(0), across(1));
    let patch = &pass.patches[c.patch as usize];
    if let Some(own) = patch.own {
        let clamped =
            |v: T, most: u32| index((v.to_f64() - 1.0).floor().clamp(0.0, f64::from(most - 1)));
        let (width, height) = (patch.rect.width(), patch.rect.height());
        let at = clamped(middle[1], height) * width as usize + clamped(middle[0], width);
        let deviation = pass.pixels.deviations[own.first_pixel as usize + at];
        let apart = scaled(three(deviation), lambda / t(c.radius));
        // Least squares: right x + down y = -apart.
        let (rr, rd, dd) = (dot(right, right), dot(right, down), dot(down, down));
        let (u, v) = (dot(right, apart), dot(down, apart));
        let turned = cross(right, down);
        let det = dot(turned, turned);
        let limit = |v: T| {
            T::from_f64(v.to_f64().clamp(
                -f64::from(constants::MOST_CORRECTION_PX),
                f64::from(constants::MOST_CORRECTION_PX),
            ))
        };
        middle = [
            middle[0] + limit((v * rd - u * dd) / det),
            middle[1] + limit((u * rd - v * rr) / det),
        ];
    }
    let surfel = drawn.surfel;
    let normal = unpacked_normal(packed_normal(scene.surfels.normals[surfel])).to_array();
    let normal = normal.map(T::from_f64);
    let normal = c.rotation.map(|row| dot(normal, three(row)));
    let along = dot(normal, d);
    let length = dot(d, d).sqrt();
    let facing = (along / length).to_f64().abs();
    let least = f64::from(kernel::LEAST_FACING);
    // Steps on the surfel's plane, which is not taken for steeper than `least`.
    let steep = if facing < least { along * T::from_f64(least / facing) } else { along };
    let on = |step: [T; 3]| minus(step, scaled(d, dot(normal, step) / steep));
    let (right, down) = (on(right), on(down));
    let share = f64::from(c.extent) / f64::from(scene.surfels.extent[surfel]);
    let size = T::from_f64(share.powi(2) / drawn.stride);
    let (a, b, e) = (dot(right, right) * size, dot(right, down) * size, dot(down, down) * size);
    // The disk's ellipse, no longer than the largest, wider by SPREAD, and the pixel's.
    let limit = T::from_f64(f64::from(LARGEST_ELLIPSE).powi(-2));
    let turned = cross(right, down);
    let own = dot(turned, turned) * (size * size);
    let area = T::from_f64(1.0) / own.max(limit * limit * limit);
    // Every axis with 1 / r² = v becomes v + l² / (v + l): the form plus l² times the inverse of itself plus l.
    let trace = a + e;
    let added = own + trace * limit + limit * limit;
    let per = limit * limit / added;
    let (a, b, e) = (a + (e + limit) * per, b - b * per, e + (a + limit) * per);
    let own = (own + trace * limit) * (own / added)
        + (trace * trace - own + trace * limit + limit * limit) * per;
    let spread = T::from_f64(f64::from(kernel::SPREAD).powi(2)) / own;
    let pixel = T::from_f64(f64::from(kernel::PIXEL).powi(2));
    let (xx, xy, yy) = (e * spread + pixel, b * spread, a * spread + pixel);
    let det = spread * spread * own + spread * (a + e) * pixel + pixel * pixel;
    let thin = facing / facing.max(least);
    let weight = (area / det).sqrt() * T::from_f64(3.0 * thin * f64::from(kernel::PER_DISK));
    let range = T::from_f64(f64::from(kernel::SAME_SURFACE_RADII * c.radius)) / size.sqrt();
    let depth = lambda * length;
    [middle[0], middle[1], yy / det, xy / det, xx / det, xx.sqrt(), yy.sqrt(), weight, range, depth]
        .map(Scalar::to_f64)
}

/// Over 4 times what f32 does, or this share of the value: rounding.
const TIMES: f64 = 4.0;
const ROUNDING: f64 = 2e-5;
/// Of surfels at the border of two pixels' deviations, or where a correction is not determined.
const UNDECIDED: f64 = 0.01;

fn planned<'a>(frame: FrameInput<'a>, cameras: &str) -> Plan<'a> {
    let (c3rc, mut plan) = (method("c3rc").expect("it is there"), Plan::default());
    let mut params = Params::defaults(c3rc.info().params);
    params.set(c3rc.info().param("cameras"), cameras).expect("it has this value");
    let made = c3rc.prepare(frame.scene, &params, &Context::default()).expect("no one cancels");
    c3rc.plan(frame, &made, &params, &mut plan).expect("it can draw it");
    plan
}

fn splats<'a, 'b>(plan: &'b Plan<'a>) -> &'b SplatPass<'a> {
    let Pass::Splat(pass) = &plan.passes[0] else { panic!("splats come first") };
    pass
}

#[test]
fn the_shader_draws_what_f64_says() {
    for (shape, cameras) in [("sphere", "triangles"), ("sphere", "cells"), ("goblet", "cells")] {
        let scene = scene(shape);
        let (eye, visibility) = (eye(&scene), seen(&scene));
        let plan =
            planned(FrameInput { scene: &scene, eye: &eye, visibility: &visibility }, cameras);
        let pass = splats(&plan);
        let Some(list) = drawn(&scene, pass) else { return };
        assert!(list.len() > 1000, "{shape}: {}", list.len());
        let (mut off, mut noticed) = ([0; VALUES], [0; VALUES]);
        for drawn in &list {
            let exact = by_hand::<f64>(&scene, pass, drawn);
            let single = by_hand::<f32>(&scene, pass, drawn);
            for k in 0..VALUES {
                let scale = exact[k].abs().max(if k < 2 { 30.0 } else { 1e-3 });
                let allowed = TIMES * (single[k] - exact[k]).abs().max(ROUNDING * scale);
                let is_off = |value: f64| {
                    let apart = (value - exact[k]).abs();
                    usize::from(apart.is_nan() || apart > allowed)
                };
                off[k] += is_off(drawn.values[k]);
                noticed[k] += is_off(drawn.values[k] * 1.01);
            }
        }
        for (k, name) in NAMES.iter().enumerate() {
            let [off, noticed] = [off[k], noticed[k]].map(|n| n as f64 / list.len() as f64);
            assert!(off <= UNDECIDED, "{shape} {cameras}, {name}: {off} of {}", list.len());
            // A hundredth more would be wrong.
            assert!(noticed > 0.5, "{shape} {cameras}, {name}: only {noticed} noticed");
        }
    }
}

/// Of a flat mirror the picture is known: that of the mirrored eye.
#[test]
fn a_flat_mirror_is_exact_to_a_thousandth_of_a_pixel() {
    const BAR_PX: f64 = 1e-3;
    let scene = scene("plane");
    let (eye, visibility) = (eye(&scene), seen(&scene));
    for cameras in ["triangles", "cells"] {
        let plan =
            planned(FrameInput { scene: &scene, eye: &eye, visibility: &visibility }, cameras);
        let pass = splats(&plan);
        let Some(list) = drawn(&scene, pass) else { return };
        // The shape lies in z = 0 of its space, which is the world's; the other mirror is a ball.
        let flat = |drawn: &Drawn| {
            let patch = &pass.patches[pass.cameras[drawn.camera].patch as usize];
            scene.mirror_of(patch.triangle.0).0 == 0
        };
        let (mut worst, mut count, mut off) = (0.0, 0, 0.0);
        for drawn in list.iter().filter(|d| flat(d)) {
            let camera = &pass.cameras[drawn.camera];
            let local = scene.surfels.position(drawn.surfel).as_dvec3();
            let point = scene.clouds[camera.object as usize].to_scene.point(local);
            let zero = scene.mirror_triangle(0).corners[0].as_dvec3().z;
            let seen = |zero: f64| {
                let mirrored = DVec3::new(point.x, point.y, 2.0 * zero - point.z);
                let p = mirrored - eye.position.as_dvec3();
                let across = DVec2::new(p.dot(eye.right.as_dvec3()), -p.dot(eye.up.as_dvec3()));
                let size = DVec2::new(eye.size.width.into(), eye.size.height.into());
                across * (f64::from(eye.focal_px) / p.dot(eye.forward.as_dvec3())) + 0.5 * size
            };
            let min = pass.patches[camera.patch as usize].rect.min.map(f64::from);
            let found = DVec2::new(drawn.values[0], drawn.values[1]) + DVec2::from_array(min) - 1.0;
            worst = f64::max(worst, (found - seen(zero)).length());
            off = f64::max(off, (found - seen(zero + 1e-3)).length());
            count += 1;
        }
        assert!(count > 500, "{count}");
        assert!(worst <= BAR_PX, "{cameras}: {worst} pixels");
        assert!(off > 10.0 * BAR_PX, "a mirror elsewhere is noticed: {off}");
    }
}
