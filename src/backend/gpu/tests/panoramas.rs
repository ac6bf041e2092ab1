//! Panoramas as environments against f64, and against the CPU's picture.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::super::environment::Panorama;
use super::super::records::Row;
use super::super::shaders;
use super::looks::{gpu, of_cells, picture, scene, verdict};
use super::pictures::SIZE;
use super::{device, run_with};
use crate::backend::cpu::Cpu;
use crate::camera::reflector::cube::FACES;
use crate::camera::three_ray::tests::Numbers;
use crate::context::Context;
use crate::frame::Renderer;
use crate::image::Picture;
use crate::methods::method;
use crate::scene::description::Environment;
use crate::scene::environment::image::{EnvironmentImage, Mounting};

/// Coloured noise, brighter than white at places.
fn panorama(width: u32, seed: u64) -> Arc<EnvironmentImage> {
    let mut numbers = Numbers(seed);
    let mut picture = Picture::black(width, width / 2);
    for pixel in &mut picture.rgb {
        *pixel = (numbers.point().as_vec3().abs() * 1.5).to_array();
    }
    let image = EnvironmentImage::new(&picture, Mounting::default(), &Context::default());
    Arc::new(image.expect("it is a panorama"))
}

/// By the table of the faces, in f64.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
fn oracle(image: &EnvironmentImage, direction: Vec3) -> DVec3 {
    let d = direction.as_dvec3();
    let along = |face: &[Vec3; 3]| d.dot(face[0].as_dvec3());
    let (k, face) = FACES
        .iter()
        .enumerate()
        .max_by(|a, b| along(a.1).total_cmp(&along(b.1)))
        .expect("there are six");
    let cells = f64::from(image.cells());
    let place = |axis: Vec3| (d.dot(axis.as_dvec3()) / along(face) + 1.0) * 0.5 * cells;
    let (x, y) = (place(face[1]), place(face[2]));
    let (i, j) = (x.floor().min(cells - 1.0), y.floor().min(cells - 1.0));
    let row = image.cells() as usize + 1;
    let node = |i: f64, j: f64| {
        let at = (k * row + j as usize) * row + i as usize;
        DVec3::from_array(image.nodes()[at].map(f64::from))
    };
    let upper = node(i, j).lerp(node(i + 1.0, j), x - i);
    let lower = node(i, j + 1.0).lerp(node(i + 1.0, j + 1.0), x - i);
    upper.lerp(lower, y - j)
}

fn by_shader(
    image: &Arc<EnvironmentImage>,
    directions: &[Vec3],
    change: impl Fn(String) -> String,
) -> Option<Vec<[f32; 4]>> {
    const ENTRY: &str = "
        @group(0) @binding(10) var<storage, read> inputs: array<vec4<f32>>;
        @group(0) @binding(20) var<storage, read_write> found: array<vec4<f32>>;
        @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x < arrayLength(&inputs) {
                found[id.x] = vec4(panorama_at(inputs[id.x].xyz), 0.0);
            }
        }";
    let gpu = device()?;
    let text = change(shaders::looks()[1].0.clone());
    // The entry point there has a buffer of the same number.
    let text = text.split("@group(0) @binding(7)").next().expect("a part").to_owned() + ENTRY;
    let environment = Environment::Image(Arc::clone(image));
    let panorama = Panorama::new(&gpu, &environment).expect("room for it");
    let inputs: Vec<Row> =
        directions.iter().map(|d| d.extend(0.0).to_array().map(f32::to_bits)).collect();
    let groups = u32::try_from(directions.len().div_ceil(64)).expect("few");
    let textures = [(11, &panorama.view)];
    Some(run_with(&gpu, &text, &[(10, &inputs)], &textures, directions.len(), groups))
}

#[test]
fn lookups_are_those_of_f64() {
    let image = panorama(97, 5);
    let mut numbers = Numbers(11);
    let mut directions: Vec<Vec3> =
        (0..20_000).map(|_| numbers.point().as_vec3()).filter(|d| d.length() > 1e-3).collect();
    for x in [-1.0, 0.0, 0.5, 1.0] {
        for y in [-1.0, 0.0, 0.5, 1.0] {
            directions.extend([-1.0, 1.0].map(|z| Vec3::new(x, y, z)));
        }
    }
    // Places between nodes are as exact as f32 can tell them in so many cells.
    let noise = f64::from(f32::EPSILON) * f64::from(image.cells()) * 1.5;
    let verdict = |found: &[[f32; 4]]| {
        let wrong = directions.iter().zip(found).filter(|(d, found)| {
            let exact = oracle(&image, **d);
            let own = Vec3::from(image.radiance_in(d.to_array())).as_dvec3();
            let [r, g, b, _] = found.map(f64::from);
            let allowed = 4.0 * (own - exact).abs().max_element().max(noise);
            let apart = (DVec3::new(r, g, b) - exact).abs().max_element();
            apart.is_nan() || apart > allowed
        });
        match wrong.count() {
            0 => Ok(()),
            wrong => Err(wrong),
        }
    };
    let own: Vec<[f32; 4]> = directions
        .iter()
        .map(|d| Vec3::from(image.radiance_in(d.to_array())).extend(0.0).to_array())
        .collect();
    let furthest = directions.iter().zip(&own).map(|(d, own)| {
        (oracle(&image, *d) - Vec3::from_slice(own).as_dvec3()).abs().max_element()
    });
    assert!(furthest.fold(0.0, f64::max) < 4.0 * noise, "f32 on the CPU");
    let Some(found) = by_shader(&image, &directions, |text| text) else { return };
    verdict(&found).unwrap_or_else(|wrong| panic!("{wrong} of {}", directions.len()));
    for [from, to] in [
        ["size.x >= size.y && size.x >= size.z", "size.x >= size.y"],
        ["size.y >= size.z", "size.y >= size.x"],
        ["vec2(side * direction.x, -direction.y)", "vec2(direction.x, -direction.y)"],
        ["along.x = -side * direction.z", "along.x = side * direction.z"],
        ["vec2(direction.x, side * direction.z)", "vec2(direction.x, direction.z)"],
        ["max(abs(front), 1e-37) + 1.0", "max(abs(front), 1e-37) + 1.01"],
        ["(0.5 * cells)", "(0.5 * cells + 0.5)"],
        ["first + vec2(1u, 0u)", "first + vec2(0u, 0u)"],
        ["first + vec2(1u, 1u)", "first + vec2(1u, 0u)"],
        ["select(0u, 1u, front < 0.0)", "0u"],
        ["return mix(upper, lower, between.y)", "return mix(lower, upper, between.y)"],
    ] {
        let found = by_shader(&image, &directions, |text| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        });
        assert!(found.is_some_and(|f| verdict(&f).is_err()), "{from} -> {to} goes unnoticed");
    }
}

#[test]
fn pictures_are_the_cpus_also_when_the_environment_changes() {
    if device().is_none() {
        return;
    }
    let constant = Environment::Constant(Vec3::new(0.4, 0.5, 0.6));
    let all = [
        Environment::Image(panorama(61, 1)),
        constant,
        Environment::Image(panorama(61, 2)),
        Environment::Image(panorama(201, 3)),
    ];
    let mut renderer = Renderer::on(gpu());
    renderer.keep_bright();
    let c3rc = method("c3rc").expect("it is there");
    let params = of_cells(c3rc);
    let mut scene = scene(all[0].clone());
    let eye = scene.eye_for(SIZE).expect("a view");
    let mut last: Option<Picture> = None;
    for environment in all {
        scene.environment = environment;
        renderer
            .render(&scene, &eye, c3rc, &params, false, &Context::default())
            .unwrap_or_else(|e| panic!("{e}"));
        let (cpu, _) = picture(Box::new(Cpu::default()), &scene, true);
        verdict(&cpu.rgb, &renderer.picture().rgb).unwrap_or_else(|e| panic!("{e}"));
        if let Some(last) = last.replace(cpu.clone()) {
            assert!(verdict(&last.rgb, &cpu.rgb).is_err(), "the change is not seen");
        }
    }
}
