//! The pieces of the method, each beside a naive version of itself: solver, box tests, tree, culling, projection, splatting.

use std::hint::black_box;

use catoptric::Context;
use catoptric::accel::kd_tree::CHILDREN;
use catoptric::accel::{KdTree, KdTreeLimits};
use catoptric::backend::cpu::Cpu;
use catoptric::camera::Eye;
use catoptric::camera::eye::ImageSize;
use catoptric::camera::three_ray::solve::Cubic;
use catoptric::camera::three_ray::{BoxTest, Boxes, project};
use catoptric::frame::Renderer;
use catoptric::geometry::Surfels;
use catoptric::geometry::lanes::{Pair, Real, Vector, simd_level};
use catoptric::methods::{FrameInput, Params, method};
use catoptric::plan::{Batch, CameraInstance, Pass, Plan, SplatPass, Volume};
use catoptric::scene::PreparedScene;
use catoptric::scene::arrange::{self, Request};
use catoptric::scene::prepared::PrepareOptions;
use catoptric::visibility::Visibility;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use fearless_simd::{Simd, dispatch, f32x8, f32x16};

/// As the paper's middle scene.
const SURFELS: usize = 147_000;
const SIZE: ImageSize = ImageSize { width: 1280, height: 720 };

/// The built-in knot before the teapot, and who looks at it.
struct Setup {
    scene: PreparedScene,
    eye: Eye,
    renderer: Renderer,
}

impl Setup {
    fn new() -> Self {
        let request = Request { inputs: vec!["knot".into()], ..Request::default() };
        let described = arrange::scene(&request, &Context::default()).expect("it is built in");
        let tree = KdTreeLimits { leaf_points: 32, leaf_size: 0.0 };
        let options = PrepareOptions { surfels: SURFELS, tree, ..PrepareOptions::default() };
        let scene =
            PreparedScene::new(&described, &options, &Context::default()).expect("it is a scene");
        let eye = scene.eye_for(SIZE).expect("it has a view");
        let mut renderer = Renderer::new();
        renderer.see(&scene, &eye);
        Self { scene, eye, renderer }
    }

    fn visibility(&self) -> &Visibility {
        self.renderer.visibility()
    }
}

/// A camera a triangle, every point: what the paper balances.
fn published(test: &str, splat: &str) -> Params {
    let info = method("c3rc").expect("it is in the registry").info();
    let mut params = Params::defaults(info.params);
    for (id, value) in [("cameras", "triangles"), ("detail", "0"), ("test", test), ("splat", splat)]
    {
        params.set(info.param(id), value).expect("it is in range");
    }
    params
}

fn splat_pass<'a>(setup: &'a Setup, test: &str) -> Box<SplatPass<'a>> {
    let Setup { scene, eye, .. } = setup;
    let frame = FrameInput { scene, eye, visibility: setup.visibility() };
    let c3rc = method("c3rc").expect("it is in the registry");
    let params = published(test, "square1");
    let made = c3rc.prepare(scene, &params, &Context::default()).expect("there is nothing to make");
    let mut plan = Plan::default();
    c3rc.plan(frame, &made, &params, &mut plan).expect("it draws the scene");
    let splat = plan.passes.into_iter().find_map(|pass| match pass {
        Pass::Splat(pass) => Some(pass),
        _ => None,
    });
    splat.expect("the method splats")
}

/// Numbers between -1 and 1 that are the same every time.
fn numbers(count: usize) -> Vec<f32> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / (1 << 23) as f32 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

/// Cubics with a root or more between 0 and 1, most of them.
fn solver(criterion: &mut Criterion) {
    const COUNT: usize = 1 << 14;
    let c: [Vec<f32>; 4] = [0, 1, 2, 3].map(|k| numbers(COUNT * (k + 1)).split_off(COUNT * k));
    #[inline(always)]
    fn lanes<S: Simd, V: Vector<S>>(simd: S, c: &[Vec<f32>; 4]) -> u32 {
        let (lo, hi) = (V::broadcast(simd, 0.0), V::broadcast(simd, 1.0));
        let mut found = 0;
        for i in (0..COUNT).step_by(V::LANES as usize) {
            let cubic = Cubic { c: [0, 1, 2, 3].map(|k| V::load(simd, &c[k][i..])) };
            let roots = cubic.roots_between(lo, hi, |_| lo);
            for (_, mask) in &roots.root[..roots.count] {
                found += V::bits(*mask).count_ones();
            }
        }
        found
    }
    let one = || {
        let root_count = |i: usize| {
            let cubic = Cubic { c: [0, 1, 2, 3].map(|k| c[k][i]) };
            let roots = cubic.roots_between(0.0, 1.0, |_| 0.0);
            roots.root[..roots.count].iter().filter(|(_, there)| *there).count()
        };
        (0..COUNT).map(root_count).sum::<usize>()
    };
    let closed_form = || {
        let root_count = |i: usize| {
            let roots = roots::find_roots_cubic(c[3][i], c[2][i], c[1][i], c[0][i]);
            roots.as_ref().iter().filter(|root| (0.0..=1.0).contains(*root)).count()
        };
        (0..COUNT).map(root_count).sum::<usize>()
    };
    let level = simd_level();
    let found = dispatch!(level, simd => lanes::<_, Pair<f32x16<_>>>(simd, &c)) as usize;
    assert!(found.abs_diff(closed_form()) * 1000 < found, "{found} and {}", closed_form());
    let mut group = criterion.benchmark_group("solver");
    group.throughput(Throughput::Elements(COUNT as u64));
    group.bench_function("in lanes", |b| {
        b.iter(|| dispatch!(level, simd => lanes::<_, Pair<f32x16<_>>>(simd, black_box(&c))));
    });
    group.bench_function("one at a time", |b| b.iter(|| black_box(one())));
    group.bench_function("naive: closed form", |b| b.iter(|| black_box(closed_form())));
    group.finish();
}

/// The boxes of all leaves as a structure of arrays, in a camera's object's space.
struct LeafBoxes {
    center: [Vec<f32>; 3],
    half: [Vec<f32>; 3],
}

impl LeafBoxes {
    fn new(tree: &KdTree) -> Self {
        let slots =
            || tree.wide().iter().flat_map(|node| (0..CHILDREN).map(move |slot| (node, slot)));
        let leaves = || {
            let used = slots().filter(|(node, slot)| node.used >> slot & 1 != 0);
            used.filter(|(node, slot)| node.child[*slot] == 0).map(|(n, slot)| n.get_box(slot))
        };
        let padded = |mut list: Vec<f32>| {
            list.resize(list.len().next_multiple_of(8), 0.0);
            list
        };
        let center = [0, 1, 2].map(|k| padded(leaves().map(|b| b.center()[k]).collect()));
        let half = [0, 1, 2].map(|k| padded(leaves().map(|b| 0.5 * b.extent()[k]).collect()));
        Self { center, half }
    }
}

/// Cameras of the triangles that see the object.
fn cameras<'a>(pass: &'a SplatPass<'_>) -> Vec<&'a CameraInstance> {
    pass.cameras.iter().filter(|camera| camera.object == 0).collect()
}

/// How many boxes the cameras meet, one box at a time.
fn meetings(boxes: &LeafBoxes, cameras: &[&CameraInstance], test: BoxTest) -> usize {
    let mut met = 0;
    for camera in cameras {
        let Volume::Three(volume) = &camera.volume else { continue };
        let (origin, [lo, hi]) = (volume.origin(), camera.lambda);
        for i in 0..boxes.center[0].len() {
            let one = Boxes {
                center: [0, 1, 2].map(|k| boxes.center[k][i] - origin[k]),
                half: [0, 1, 2].map(|k| boxes.half[k][i]),
            };
            met += usize::from(volume.meets(test, &one, lo, hi).meets);
        }
    }
    met
}

/// All leaves of the tree against some cameras, without walking it.
fn box_tests(criterion: &mut Criterion) {
    let setup = Setup::new();
    let pass = splat_pass(&setup, "slab");
    let some: Vec<&CameraInstance> = cameras(&pass).into_iter().step_by(16).collect();
    let boxes = LeafBoxes::new(&setup.scene.clouds[0].tree);
    #[inline(always)]
    fn lanes<S: Simd>(
        simd: S,
        boxes: &LeafBoxes,
        cameras: &[&CameraInstance],
        test: BoxTest,
    ) -> u32 {
        type V<S> = f32x8<S>;
        let mut met = 0;
        for camera in cameras {
            let Volume::Three(volume) = &camera.volume else { continue };
            let origin = volume.origin();
            let (lo, hi) =
                (V::broadcast(simd, camera.lambda[0]), V::broadcast(simd, camera.lambda[1]));
            for i in (0..boxes.center[0].len()).step_by(8) {
                let eight = Boxes {
                    center: [0, 1, 2].map(|k| V::load(simd, &boxes.center[k][i..]) - origin[k]),
                    half: [0, 1, 2].map(|k| V::load(simd, &boxes.half[k][i..])),
                };
                met += V::<S>::bits(volume.meets(test, &eight, lo, hi).meets).count_ones();
            }
        }
        met
    }
    let level = simd_level();
    let mut group = criterion.benchmark_group("box tests");
    group.throughput(Throughput::Elements((some.len() * boxes.center[0].len()) as u64));
    for (name, test) in [
        ("interval", BoxTest::Interval),
        ("paper", BoxTest::Paper),
        ("sweep", BoxTest::Sweep),
        ("slab", BoxTest::Slab),
    ] {
        group.bench_function(name, |b| {
            b.iter(|| dispatch!(level, simd => lanes(simd, black_box(&boxes), &some, test)));
        });
        group.bench_function(format!("naive: {name}, one box at a time"), |b| {
            b.iter(|| meetings(black_box(&boxes), &some, test));
        });
    }
    group.finish();
}

/// Sorts each node along its longest side, on one thread.
fn naive_tree(points: &mut [[f32; 3]], leaf: usize) -> usize {
    if points.len() <= leaf {
        return 1;
    }
    let mut ends = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    for point in points.iter() {
        for k in 0..3 {
            ends[0][k] = ends[0][k].min(point[k]);
            ends[1][k] = ends[1][k].max(point[k]);
        }
    }
    let side = |k: &usize| ends[1][*k] - ends[0][*k];
    let axis = (0..3).max_by(|a, b| side(a).total_cmp(&side(b))).unwrap_or(0);
    points.sort_by(|a, b| a[axis].total_cmp(&b[axis]));
    let (left, right) = points.split_at_mut(points.len() / 2);
    naive_tree(left, leaf) + naive_tree(right, leaf)
}

fn tree(criterion: &mut Criterion) {
    let setup = Setup::new();
    let surfels = setup.scene.surfels_of(0);
    let points: Vec<[f32; 3]> =
        (0..surfels.len()).map(|i| surfels.position(i).to_array()).collect();
    let mut group = criterion.benchmark_group("tree");
    group.throughput(Throughput::Elements(surfels.len() as u64)).sample_size(20);
    for leaf in [8, 122] {
        let limits = KdTreeLimits { leaf_points: leaf, leaf_size: 0.0 };
        let build = |mut surfels: Surfels| KdTree::build(&mut surfels, limits);
        group.bench_function(format!("leaves of {leaf}"), |b| {
            b.iter_batched(|| surfels.clone(), build, criterion::BatchSize::LargeInput);
        });
        let naive = |mut points: Vec<[f32; 3]>| naive_tree(&mut points, leaf as usize);
        group.bench_function(
            format!("naive: sorted, leaves of {leaf}, without boxes and cones"),
            |b| {
                b.iter_batched(|| points.clone(), naive, criterion::BatchSize::LargeInput);
            },
        );
    }
    group.finish();
}

fn culling(criterion: &mut Criterion) {
    let setup = Setup::new();
    let mut group = criterion.benchmark_group("culling");
    for test in ["interval", "paper", "sweep", "slab"] {
        let pass = splat_pass(&setup, test);
        let all = cameras(&pass);
        let mut batches: Vec<Batch> = Vec::new();
        group.throughput(Throughput::Elements(all.len() as u64)).sample_size(20);
        group.bench_function(test, |b| {
            b.iter(|| {
                batches.clear();
                all.iter().for_each(|camera| pass.batches.cull(camera, &mut batches));
                batches.len()
            });
        });
    }
    // Every leaf of every camera, by the slab test.
    let pass = splat_pass(&setup, "slab");
    let (all, boxes) = (cameras(&pass), LeafBoxes::new(&setup.scene.clouds[0].tree));
    group.bench_function("naive: slab on every leaf", |b| {
        b.iter(|| meetings(black_box(&boxes), &all, BoxTest::Slab));
    });
    group.finish();
}

fn projection(criterion: &mut Criterion) {
    let setup = Setup::new();
    let pass = splat_pass(&setup, "slab");
    let some: Vec<&CameraInstance> = cameras(&pass).into_iter().step_by(32).collect();
    let surfels = &setup.scene.surfels;
    const POINTS: usize = 1 << 14;
    #[inline(always)]
    fn lanes<S: Simd, V: Vector<S>>(
        simd: S,
        surfels: &Surfels,
        cameras: &[&CameraInstance],
    ) -> u32 {
        let mut valid = 0;
        for camera in cameras {
            let v1 = camera.camera.v1;
            let (lo, hi) =
                (V::broadcast(simd, camera.lambda[0]), V::broadcast(simd, camera.lambda[1]));
            for i in (0..POINTS).step_by(V::LANES as usize) {
                let q = [&surfels.x, &surfels.y, &surfels.z];
                let q = [0, 1, 2].map(|k| V::load(simd, &q[k][i..]) - v1[k]);
                for image in project(&camera.camera, q, lo, hi).as_slice() {
                    valid += V::bits(image.within([1e-3; 3])).count_ones();
                }
            }
        }
        valid
    }
    fn scalar<R: Real<Mask = bool>>(
        surfels: &Surfels,
        cameras: &[&CameraInstance],
        camera_of: impl Fn(&CameraInstance) -> catoptric::camera::three_ray::ThreeRay<R::Scalar>,
        number: impl Fn(f32) -> R,
        margin: [R::Scalar; 3],
    ) -> usize {
        let mut valid = 0;
        for camera in cameras {
            let (own, v1) = (camera_of(camera), camera.camera.v1);
            let [lo, hi] = camera.lambda.map(&number);
            for i in 0..POINTS {
                let q = [surfels.x[i] - v1[0], surfels.y[i] - v1[1], surfels.z[i] - v1[2]];
                let images = project(&own, q.map(&number), lo, hi);
                valid += images.as_slice().iter().filter(|image| image.within(margin)).count();
            }
        }
        valid
    }
    let level = simd_level();
    let mut group = criterion.benchmark_group("projection");
    group.throughput(Throughput::Elements((some.len() * POINTS) as u64)).sample_size(20);
    group.bench_function("in lanes", |b| {
        b.iter(|| dispatch!(level, simd => lanes::<_, Pair<f32x16<_>>>(simd, black_box(surfels), &some)));
    });
    group.bench_function("naive: one point at a time", |b| {
        b.iter(|| scalar(black_box(surfels), &some, |c| c.camera, |x| x, [1e-3_f32; 3]));
    });
    group.finish();
}

/// Everything of the layer on the CPU: what splats differ in.
fn splatting(criterion: &mut Criterion) {
    let Setup { scene, eye, .. } = Setup::new();
    let c3rc = method("c3rc").expect("it is in the registry");
    let mut group = criterion.benchmark_group("splatting");
    group.sample_size(20);
    for splat in ["square1", "square2", "ellipse"] {
        let params = published("slab", splat);
        let mut renderer = Renderer::on(Box::new(Cpu::default()));
        renderer.see(&scene, &eye);
        let made =
            c3rc.prepare(&scene, &params, &Context::default()).expect("there is nothing to make");
        let mut frame = || {
            let drawn =
                renderer.reflect(&scene, &eye, c3rc, &made, &params, false, &Context::default());
            drawn.expect("it draws the scene").0.projections.unwrap_or(0)
        };
        group.throughput(Throughput::Elements(frame()));
        group.bench_function(format!("layer with {splat}"), |b| b.iter(&mut frame));
    }
    group.finish();
}

criterion_group!(pieces, solver, box_tests, tree, culling, projection, splatting);
criterion_main!(pieces);
