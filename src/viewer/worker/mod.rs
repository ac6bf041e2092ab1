//! The thread that renders. The window posts what it wants to see, the latest wish wins; pictures come back as
//! events. Scenes are loaded and shaded on threads of their own, so that what is there can be seen meanwhile.

mod draw;
mod load;
mod probe;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use eframe::egui::ColorImage;
use glam::{DVec3, Vec3};

pub(super) use draw::{Errors, heat};
pub(super) use load::{LoadRequest, What};
pub(super) use probe::{Probe, Probed, SeenPath, Thing, class_colors};

use crate::camera::eye::ImageSize;
use crate::frame::FrameReport;
use crate::geometry::Similarity;
use crate::methods::Params;
use crate::scene::description::{EyeDescription, Scene};
use crate::scene::prepared::{PrepareTimes, PreparedScene};

/// Where a method runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
pub enum BackendChoice {
    /// Whatever is fastest here.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// Through wgpu.
    Gpu,
}

impl BackendChoice {
    /// All, with the words after `--backend`.
    pub const ALL: [(Self, &'static str); 3] =
        [(Self::Auto, "auto"), (Self::Cpu, "cpu"), (Self::Gpu, "gpu")];

    /// As after `--backend`.
    pub fn word(self) -> &'static str {
        Self::ALL.iter().find(|(choice, _)| *choice == self).map_or("auto", |(_, word)| word)
    }
}

/// A method, where it runs and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Side {
    /// Method id.
    pub method: &'static str,
    /// Where it runs.
    pub backend: BackendChoice,
    /// Its parameters.
    pub params: Params,
}

/// What is drawn over the picture, or instead of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Map {
    #[default]
    None,
    /// Absolute difference of the two sides.
    Difference,
    /// FLIP of the two sides.
    Flip,
    /// The mirror coloured by what its triangles cost.
    Cost,
    /// The mirror coloured by how its triangles' rays run.
    Class,
}

/// What is to be seen.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct View {
    /// Of which scene: see [`Prepared::generation`]. A wish for another is out of date.
    pub(super) generation: u64,
    pub(super) eye: EyeDescription,
    pub(super) size: ImageSize,
    pub(super) sides: Vec<Side>,
    /// Where the scene's objects, then its mirrors are: local to world.
    pub(super) placements: Arc<Vec<Similarity>>,
    /// Nothing moves: time for figures, and for shadows of what was moved.
    pub(super) rest: bool,
    pub(super) map: Map,
    /// What every pixel shows is wanted too.
    pub(super) planes: bool,
    /// The caustic surface is wanted too.
    pub(super) caustic: bool,
}

/// What was drawn.
pub(super) struct Shot {
    pub(super) view: Arc<View>,
    /// One for each side.
    pub(super) pictures: Vec<ColorImage>,
    pub(super) reports: Vec<FrameReport>,
    pub(super) map: Option<ColorImage>,
    /// Straight lines on the caustic surface, scene space.
    pub(super) caustic: Vec<[Vec3; 2]>,
    /// Of the two sides, where they were needed for the map.
    pub(super) errors: Option<Errors>,
    /// What the brightest colour of the map stands for, where that is not always the same.
    pub(super) most: Option<f32>,
    /// Of the scene's last load, everything is there.
    pub(super) complete: bool,
    /// What all of it took.
    pub(super) ms: f64,
}

/// What is known of a scene that is ready to be drawn.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// Counts what was loaded.
    pub generation: u64,
    /// Whether all surfels that were asked for are there, not just enough for a first picture.
    pub complete: bool,
    /// As in the scene.
    pub name: String,
    /// Surfels over all objects.
    pub surfels: usize,
    /// Triangles over all mirrors.
    pub mirror_triangles: usize,
    /// World position of scene space's zero.
    pub origin: DVec3,
    /// A box about mirrors and what is near them, world space.
    pub bounds: [DVec3; 2],
    /// What preparing took.
    pub times: PrepareTimes,
    /// Reading files and making shapes, milliseconds.
    pub load_ms: f64,
    /// Methods that cannot draw it, and why not.
    pub refusals: Vec<(&'static str, String)>,
}

/// What comes back.
pub(super) enum Event {
    /// Something takes long: what, and how much of it is done; `None` once it has ended.
    Progress(Option<(String, f64)>),
    /// From now on this is drawn, made from that.
    Ready(Box<Prepared>, Arc<Scene>),
    /// For people: what failed.
    Failed(String),
    Shot(Box<Shot>),
    /// How far the two sides of a view are apart: comes after its picture.
    Compared(Arc<View>, Errors),
    /// A moving picture was given up after so many milliseconds.
    GivenUp(f64),
    Probed(Box<Probed>),
    Saved(PathBuf),
}

/// What of a picture is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Saved {
    Picture,
    /// What every mirror pixel shows.
    Planes,
}

/// A picture to be written.
#[derive(Clone, Debug)]
pub(super) struct Save {
    pub(super) what: Saved,
    pub(super) path: PathBuf,
    pub(super) view: View,
}

/// A scene on its way to the renderer.
struct Arrived {
    scene: PreparedScene,
    /// What it was made from.
    source: Arc<Scene>,
    prepared: Prepared,
    placements: Arc<Vec<Similarity>>,
}

/// Where wishes wait. Of each kind there is one at most, saves aside: the latest.
#[derive(Default)]
struct Inbox {
    scene: Option<Box<Arrived>>,
    /// A copy of the scene of that generation with light as things are placed there.
    shaded: Option<(u64, Box<PreparedScene>, Arc<Vec<Similarity>>)>,
    view: Option<Arc<View>>,
    probe: Option<Probe>,
    saves: Vec<Save>,
    /// The picture under way.
    drawing: Option<Drawing>,
    quit: bool,
}

/// A picture under way.
struct Drawing {
    cancel: Arc<AtomicBool>,
    begun: Instant,
    view: Arc<View>,
}

/// While things move, pictures are drawn to their end, else a fast hand would see none; unless they take longer.
const QUICK: Duration = Duration::from_millis(500);

impl Inbox {
    /// Cancels the picture under way if nobody wants it any more.
    fn stop_drawing(&mut self, is_unwanted: impl Fn(&Drawing) -> bool) {
        if let Some(drawing) = self.drawing.take_if(|d| is_unwanted(d)) {
            drawing.cancel.store(true, Ordering::Relaxed);
        }
    }
}

struct Shared {
    inbox: Mutex<Inbox>,
    posted: Condvar,
    /// Wakes the window.
    wake: Box<dyn Fn() + Send + Sync>,
    events: Mutex<Sender<Event>>,
    /// Of the newest load.
    generation: std::sync::atomic::AtomicU64,
}

impl Shared {
    fn inbox(&self) -> MutexGuard<'_, Inbox> {
        // What panicked meanwhile held no half-written state.
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn post(&self, write: impl FnOnce(&mut Inbox)) {
        write(&mut self.inbox());
        self.posted.notify_one();
    }

    fn tell(&self, event: Event) {
        let events = self.events.lock().unwrap_or_else(PoisonError::into_inner);
        // Nobody listens any more while the window closes.
        let _ = events.send(event);
        (self.wake)();
    }

    fn is_newest(&self, generation: u64) -> bool {
        self.generation.load(Ordering::Relaxed) == generation
    }
}

/// The window's end of it. Dropping it ends the threads.
pub(super) struct Worker {
    shared: Arc<Shared>,
    events: Receiver<Event>,
    thread: Option<JoinHandle<()>>,
    /// Cancels the load under way.
    loading: Option<Arc<AtomicBool>>,
}

impl Worker {
    /// Starts the thread. `wake` is called when there are events.
    pub(super) fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        let (sender, events) = channel();
        let shared = Arc::new(Shared {
            inbox: Mutex::default(),
            posted: Condvar::new(),
            wake: Box::new(wake),
            events: Mutex::new(sender),
            generation: 0.into(),
        });
        let own = Arc::clone(&shared);
        let run = move || draw::Artist::new(own).run();
        let thread = std::thread::Builder::new().name("renderer".into()).spawn(run).ok();
        Self { shared, events, thread, loading: None }
    }

    /// Loads a scene, instead of any that is being loaded. What is shown stays until it is there.
    pub(super) fn load(&mut self, request: LoadRequest) {
        self.cancel_load();
        let generation = self.shared.generation.fetch_add(1, Ordering::Relaxed) + 1;
        self.loading = Some(load::start(request, generation, Arc::clone(&self.shared)));
    }

    /// Ends the load under way, if any.
    pub(super) fn cancel_load(&mut self) {
        if let Some(flag) = self.loading.take() {
            flag.store(true, Ordering::Relaxed);
        }
    }

    /// Wishes to see this; what was wished before and is not yet drawn never will be.
    pub(super) fn view(&self, view: View) {
        self.shared.post(|inbox| {
            let rest = view.rest;
            inbox.view = Some(Arc::new(view));
            inbox.stop_drawing(|d| rest || d.view.rest || d.begun.elapsed() > QUICK);
        });
    }

    /// Asks what is at a pixel of the last picture.
    pub(super) fn probe(&self, probe: Probe) {
        self.shared.post(|inbox| {
            // Clicks are not lost to the pointer's next move.
            if !inbox.probe.as_ref().is_some_and(|waiting| waiting.pick && !probe.pick) {
                inbox.probe = Some(probe);
            }
        });
    }

    /// Writes a picture.
    pub(super) fn save(&self, save: Save) {
        self.shared.post(|inbox| inbox.saves.push(save));
    }

    /// What has happened since.
    pub(super) fn events(&self) -> Vec<Event> {
        self.events.try_iter().collect()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.cancel_load();
        self.shared.post(|inbox| {
            inbox.quit = true;
            inbox.stop_drawing(|_| true);
        });
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
