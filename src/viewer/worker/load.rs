//! Loading on a thread of its own: first few surfels, for a picture soon, then all that were asked for.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use glam::DVec3;

use super::{Arrived, Event, Prepared, Shared};
use crate::context::{Context, MemoryLimit, Progress};
use crate::error::{Error, Result};
use crate::geometry::{Aabb, Similarity};
use crate::methods::{METHODS, Method, Params};
use crate::scene::arrange::{self, Request};
use crate::scene::builtin;
use crate::scene::description::{Scene, Source};
use crate::scene::prepared::{PrepareOptions, PreparedScene, milliseconds};

/// Surfels of the first picture: sampled, sorted and shaded in a fraction of a second.
const FIRST_SURFELS: usize = 300_000;
/// Things this many times as large as the mirrors are ground or walls: framing leaves them out.
const LARGE: f32 = 4.0;
/// Progress is told no more often.
const PAUSE: Duration = Duration::from_millis(50);

/// Where a scene comes from.
#[derive(Clone, Debug)]
pub(crate) enum What {
    /// Files and names.
    Request(Box<Request>),
    /// One that is open, with things where they were put.
    Open(Arc<Scene>),
}

/// A scene to be loaded.
#[derive(Clone, Debug)]
pub(crate) struct LoadRequest {
    pub(crate) what: What,
    pub(crate) prepare: PrepareOptions,
    /// Triangles of mirrors that are built-in shapes, if not as the scene says.
    pub(crate) mirror_triangles: Option<usize>,
    pub(crate) memory: Option<MemoryLimit>,
}

/// Starts; the flag cancels it.
pub(super) fn start(request: LoadRequest, generation: u64, shared: Arc<Shared>) -> Arc<AtomicBool> {
    let cx = Context::new(Arc::new(Teller {
        shared: Arc::clone(&shared),
        generation,
        last: Mutex::new(Instant::now() - PAUSE),
    }))
    .with_memory(request.memory);
    let flag = cx.cancel_flag();
    let run = move || {
        let done = load(&request, generation, &shared, &cx);
        if !shared.is_newest(generation) {
            return;
        }
        shared.tell(Event::Progress(None));
        match done {
            Ok(()) | Err(Error::Cancelled) => {}
            Err(error) => shared.tell(Event::Failed(error.to_string())),
        }
    };
    if std::thread::Builder::new().name("loader".into()).spawn(run).is_err() {
        // Out of threads: the window stays as it is, and says so by showing nothing new.
        flag.store(true, std::sync::atomic::Ordering::Relaxed);
    }
    flag
}

fn load(request: &LoadRequest, generation: u64, shared: &Shared, cx: &Context) -> Result<()> {
    let start = Instant::now();
    cx.step("reading", 0.0)?;
    let scene = match &request.what {
        What::Request(request) => arrange::scene(request, cx)?,
        What::Open(scene) => (**scene).clone(),
    };
    let scene = Arc::new(with_triangles(scene, request.mirror_triangles));
    let load_ms = milliseconds(start);
    let placements: Vec<Similarity> =
        scene.objects.iter().map(|o| o.transform).chain(mirrors(&scene)).collect();
    let placements = Arc::new(placements);
    let all = request.prepare.surfels;
    let first = (all > 2 * FIRST_SURFELS).then_some(FIRST_SURFELS);
    for surfels in first.into_iter().chain([all]) {
        let options = PrepareOptions { surfels, ..request.prepare };
        let ready = PreparedScene::new(&scene, &options, cx)?;
        let prepared = Prepared {
            generation,
            complete: surfels == all,
            name: ready.name.clone(),
            surfels: ready.surfel_count(),
            mirror_triangles: ready.mirror_triangle_count(),
            origin: ready.origin,
            bounds: bounds(&ready),
            times: ready.times,
            load_ms,
            refusals: refusals(&ready),
        };
        if !shared.is_newest(generation) {
            return Err(Error::Cancelled);
        }
        let (source, placements) = (Arc::clone(&scene), Arc::clone(&placements));
        let arrived = Arrived { scene: ready, source, prepared, placements };
        shared.post(|inbox| {
            inbox.scene = Some(Box::new(arrived));
            inbox.stop_drawing(|d| d.view.generation != generation);
        });
    }
    Ok(())
}

/// Which methods cannot draw a scene with their defaults, and why not.
fn refusals(scene: &PreparedScene) -> Vec<(&'static str, String)> {
    let refusal = |m: &&dyn Method| {
        let params = Params::defaults(m.info().params);
        m.qualify(scene, &params).err().map(|error| (m.info().id, error.to_string()))
    };
    METHODS.iter().filter_map(refusal).collect()
}

fn mirrors(scene: &Scene) -> impl Iterator<Item = Similarity> {
    scene.mirrors.iter().map(|m| m.transform)
}

/// Mirrors that are built-in shapes get about so many triangles.
fn with_triangles(mut scene: Scene, triangles: Option<usize>) -> Scene {
    for mirror in &mut scene.mirrors {
        if let (Some(n), Some(Source::Shape { name, triangles })) =
            (triangles, mirror.source.as_mut())
            && *triangles != Some(n)
            && let Some(mesh) = builtin::shape(name, Some(n))
        {
            mirror.mesh = Arc::new(mesh);
            *triangles = Some(n);
        }
    }
    scene
}

/// The mirrors and what is not much larger.
fn bounds(scene: &PreparedScene) -> [DVec3; 2] {
    let (objects, mirrors) = scene.clouds.split_at(scene.objects.len());
    let union = |a: Aabb, b: Aabb| Aabb { min: a.min.min(b.min), max: a.max.max(b.max) };
    let core = mirrors.iter().fold(Aabb::EMPTY, |all, cloud| union(all, cloud.bounds));
    let near = |cloud: &Aabb| cloud.diagonal() < LARGE * core.diagonal();
    let all = objects.iter().map(|c| c.bounds).filter(near).fold(core, union);
    [all.min, all.max].map(|corner| corner.as_dvec3() + scene.origin)
}

/// Tells the window how far a load is.
struct Teller {
    shared: Arc<Shared>,
    generation: u64,
    last: Mutex<Instant>,
}

impl Progress for Teller {
    fn report(&self, stage: &str, done: f64) {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.elapsed() >= PAUSE && self.shared.is_newest(self.generation) {
            *last = Instant::now();
            self.shared.tell(Event::Progress(Some((stage.to_owned(), done))));
        }
    }
}
