//! The reflections of a frame by every method, on the CPU. The naive version beside: every point in every camera.

use catoptric::Context;
use catoptric::camera::eye::ImageSize;
use catoptric::frame::Renderer;
use catoptric::methods::{METHODS, Method, Params, method};
use catoptric::scene::PreparedScene;
use catoptric::scene::arrange::{self, Request};
use catoptric::scene::prepared::PrepareOptions;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const SIZE: ImageSize = ImageSize { width: 640, height: 360 };

fn frames(criterion: &mut Criterion) {
    let cx = Context::default();
    // A mirror that every method can draw.
    let request = Request {
        mirrors: vec!["sphere".into()],
        objects: vec!["knot".into()],
        ..Request::default()
    };
    let described = arrange::scene(&request, &cx).expect("they are built in");
    let options = PrepareOptions { surfels: 100_000, ..PrepareOptions::default() };
    let scene = PreparedScene::new(&described, &options, &cx).expect("it is a scene");
    let eye = scene.eye_for(SIZE).expect("it has a view");
    let mut group = criterion.benchmark_group("frames");
    group.sample_size(20);
    let mut bench = |name: String, method: &'static dyn Method, params: &Params| {
        let mut renderer = Renderer::new();
        renderer.see(&scene, &eye);
        let made = method.prepare(&scene, params, &cx).expect("it can draw this");
        let mut frame = || {
            let drawn = renderer.reflect(&scene, &eye, method, &made, params, false, &cx);
            drawn.expect("it draws the scene").0.mirror_pixels
        };
        group.throughput(Throughput::Elements(frame() as u64));
        group.bench_function(name, |b| b.iter(&mut frame));
    };
    for method in METHODS {
        let info = method.info();
        let defaults = Params::defaults(info.params);
        bench(info.id.to_owned(), method, &defaults);
        for quality in info.qualities {
            let mut params = defaults.clone();
            for (id, value) in quality.params {
                params.set(info.param(id), value).expect("it is in range");
            }
            bench(format!("{}, {}", info.id, quality.id), method, &params);
        }
    }
    let c3rc = method("c3rc").expect("it is in the registry");
    let mut params = Params::defaults(c3rc.info().params);
    for (id, value) in
        [("cameras", "triangles"), ("splat", "square1"), ("detail", "0"), ("test", "none")]
    {
        params.set(c3rc.info().param(id), value).expect("it is in range");
    }
    bench("naive: c3rc, every point in every camera".to_owned(), c3rc, &params);
    group.finish();
}

criterion_group!(benches, frames);
criterion_main!(benches);
