//! The window's state, and one pass over it: events in, panels and canvas, wishes out.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use eframe::egui::{self, TextureHandle, TextureOptions};
use glam::DVec3;

use super::blit::Blit;
use super::dialog::Kind;
use super::gizmo::Handles;
use super::placing::Moves;
use super::settings::{MirrorColors, Settings, Shown};
use super::worker::{
    Errors, Event, LoadRequest, Map, Prepared, Probe, Probed, Save, Saved, Shot, Thing, View, What,
    Worker,
};
use super::{Opening, canvas, navigation, panels};
use crate::camera::eye::ImageSize;
use crate::context::MemoryLimit;
use crate::frame::FrameReport;
use crate::geometry::Similarity;
use crate::scene::arrange::Request;
use crate::scene::description::{EyeDescription, Scene};
use crate::scene::fit::world_bounds;
use crate::scene::prepared::PrepareOptions;

/// After so long without a change, pictures are full again and shadows follow.
const REST: Duration = Duration::from_millis(120);
/// When to show what has arrived: egui paints once for a delay and twice for none, and where there is no graphics card the
/// second painting takes time from the next picture.
const SOON: Duration = Duration::from_nanos(1);
/// What a picture may take while something moves, milliseconds.
const BUDGET_MS: f64 = 33.0;
/// Whoever waits longer is told so.
const SLOW: Duration = Duration::from_millis(400);
/// Pictures shrink by no more than this per axis while something moves.
const LEAST_SCALE: f64 = 0.5;
/// Reports that are kept for the plot.
const HISTORY: usize = 120;
const NO_DIALOG: &str = "this system shows no file dialog (Linux: install zenity or xdg-desktop-portal); \
                         drop files on the window, or name them: catoptric view FILE";
/// How long a message stays.
const MESSAGE: Duration = Duration::from_secs(6);

/// What a dialog gave.
pub(super) enum Chosen {
    Open(Vec<PathBuf>),
    Picture(PathBuf),
    Aov(PathBuf),
    Scene(PathBuf),
    /// The system had none to show.
    NoDialog(Kind),
}

/// A side's picture.
pub(super) enum OnScreen {
    /// Pixel by pixel.
    Whole(Blit),
    /// Stretched: it was made smaller, to keep up with what moves.
    Scaled(TextureHandle),
}

/// What was drawn last, as the window has it.
pub(super) struct Display {
    /// One for each side.
    pub(super) pictures: Vec<OnScreen>,
    pub(super) map: Option<TextureHandle>,
    pub(super) view: Arc<View>,
    pub(super) reports: Vec<FrameReport>,
    pub(super) errors: Option<Errors>,
    /// What the brightest colour of the map stands for.
    pub(super) most: Option<f32>,
    pub(super) complete: bool,
    /// Straight lines on the caustic surface, scene space.
    pub(super) caustic: Vec<[glam::Vec3; 2]>,
}

/// The whole window.
pub(super) struct Viewer {
    pub(super) worker: Worker,
    pub(super) settings: Settings,
    memory: Option<MemoryLimit>,
    /// How scenes are prepared; what the sliders say, which is used from the next load on.
    pub(super) prepare: PrepareOptions,
    pub(super) mirror_triangles: Option<usize>,
    /// What the last load was told.
    loaded: (PrepareOptions, Option<usize>),
    /// The open scene has been sampled again: things lie where they were put.
    is_prepared_anew: bool,
    /// Where the scene came from, and what is to be opened instead.
    pub(super) request: Request,
    opened: Option<Request>,
    /// As it was read.
    pub(super) scene: Option<Arc<Scene>>,
    /// Where its objects, then its mirrors are now.
    pub(super) placements: Arc<Vec<Similarity>>,
    pub(super) prepared: Option<Prepared>,
    pub(super) eye: EyeDescription,
    /// Whether the next scene that is read brings its own eye.
    takes_eye: bool,
    pub(super) display: Option<Display>,
    pub(super) history: VecDeque<FrameReport>,
    pub(super) progress: Option<(String, f64)>,
    /// For people: what happened, and whether it is bad.
    pub(super) message: Option<(String, bool, Instant)>,
    pub(super) selected: Option<Thing>,
    pub(super) handles: Handles,
    pub(super) moves: Moves,
    /// Where the pointer was when it was last asked what is there, and of which picture.
    pub(super) asked: Option<(egui::Pos2, u64)>,
    /// Under the pointer, and where it was clicked.
    pub(super) probed: Option<Probed>,
    pub(super) pinned: Option<Probed>,
    pub(super) help: bool,
    pub(super) chosen: (Sender<Chosen>, Receiver<Chosen>),
    /// Where to save if the system has no dialog to ask with.
    pub(super) folder: PathBuf,
    /// The canvas in pixels.
    pub(super) size: ImageSize,
    /// Where it begins in the window, pixels.
    pub(super) canvas: [u32; 2],
    posted: Option<View>,
    /// When.
    posted_at: Instant,
    /// Eye, places and canvas of the last pass.
    wished: Option<(EyeDescription, Arc<Vec<Similarity>>, ImageSize)>,
    changed: Instant,
    /// What a full picture in motion takes, milliseconds; a running mean.
    moving_ms: f64,
    /// Frames are drawn as they are at rest: for measurements.
    pub(super) steady: bool,
    /// Pictures that were taken over from the worker.
    pub(super) shots: u64,
    /// Longest side of pictures that the window can show as [`Blit`]s, px: 0 where it cannot.
    pub(super) blits: u32,
    /// What is behind the panels has their colour.
    pub(super) is_cleared: bool,
}

impl Viewer {
    /// Starts loading.
    pub(super) fn new(context: &egui::Context, opening: &Opening, settings: Settings) -> Self {
        let waker = context.clone();
        let mut worker = Worker::new(move || waker.request_repaint_after(SOON));
        worker.load(LoadRequest {
            what: What::Request(Box::new(opening.request.clone())),
            prepare: opening.prepare,
            mirror_triangles: None,
            memory: opening.memory,
        });
        Self {
            worker,
            memory: opening.memory,
            settings,
            prepare: opening.prepare,
            mirror_triangles: None,
            loaded: (opening.prepare, None),
            is_prepared_anew: false,
            request: opening.request.clone(),
            opened: None,
            scene: None,
            placements: Arc::default(),
            prepared: None,
            eye: EyeDescription {
                position: glam::DVec3::Z,
                target: glam::DVec3::ZERO,
                up: glam::DVec3::Y,
                fov_y: 0.8,
            },
            takes_eye: true,
            display: None,
            history: VecDeque::new(),
            progress: None,
            message: None,
            selected: None,
            handles: Handles::default(),
            moves: Moves::default(),
            asked: None,
            probed: None,
            pinned: None,
            help: false,
            chosen: channel(),
            folder: std::env::current_dir().unwrap_or_default(),
            size: ImageSize { width: 1, height: 1 },
            canvas: [0; 2],
            posted: None,
            posted_at: Instant::now(),
            wished: None,
            changed: Instant::now(),
            moving_ms: 0.0,
            steady: false,
            shots: 0,
            blits: 0,
            is_cleared: false,
        }
    }

    /// One pass.
    pub(super) fn ui(&mut self, ui: &mut egui::Ui) {
        self.receive(ui.ctx());
        panels::keys(self, ui.ctx());
        panels::show(self, ui);
        canvas::show(self, ui);
        self.wish(ui.ctx());
    }

    fn receive(&mut self, context: &egui::Context) {
        for event in self.worker.events() {
            match event {
                Event::Progress(progress) => self.progress = progress,
                Event::Failed(what) => self.tell(what, true),
                Event::Ready(prepared, scene) => {
                    if self.generation() != Some(prepared.generation) {
                        self.read(scene);
                    }
                    self.prepared = Some(*prepared);
                    // Even if nothing moved, there is something new to draw.
                    self.posted = None;
                }
                Event::Shot(shot) => self.take(context, *shot),
                // The next ones are to be smaller, and drafts.
                Event::GivenUp(ms) => self.moving_ms = self.moving_ms.max(ms),
                Event::Compared(view, errors) => {
                    if let Some(display) =
                        self.display.as_mut().filter(|d| Arc::ptr_eq(&d.view, &view))
                    {
                        display.errors = Some(errors);
                    }
                }
                Event::Probed(probed) => self.probed(*probed),
                Event::Saved(path) => self.tell(format!("saved {}", path.display()), false),
            }
        }
        let dropped: Vec<PathBuf> =
            context.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect());
        if !dropped.is_empty() {
            self.open(&dropped);
        }
        while let Ok(chosen) = self.chosen.1.try_recv() {
            match chosen {
                Chosen::Open(files) => self.open(&files),
                Chosen::Picture(path) => self.save(Saved::Picture, path),
                Chosen::Aov(path) => self.save(Saved::Planes, path),
                Chosen::Scene(path) => self.save_scene(&path),
                Chosen::NoDialog(kind) => self.without_dialog(kind),
            }
        }
    }

    /// Saves into a folder that nobody chose.
    fn without_dialog(&mut self, kind: Kind) {
        match (kind, kind.instead(&self.folder)) {
            (Kind::Picture, Some(path)) => self.save(Saved::Picture, path),
            (Kind::Aov, Some(path)) => self.save(Saved::Planes, path),
            (Kind::Scene, Some(path)) => self.save_scene(&path),
            _ => self.tell(NO_DIALOG.to_owned(), true),
        }
    }

    pub(super) fn tell(&mut self, what: String, is_bad: bool) {
        self.message = Some((what, is_bad, Instant::now()));
    }

    /// Whether a message is still to be shown. Bad ones stay until they are closed.
    pub(super) fn message_is_fresh(&self) -> bool {
        self.message.as_ref().is_some_and(|(_, is_bad, at)| *is_bad || at.elapsed() < MESSAGE)
    }

    /// Which of the loaded scenes is shown.
    fn generation(&self) -> Option<u64> {
        self.prepared.as_ref().map(|p| p.generation)
    }

    /// Another scene is there.
    fn read(&mut self, scene: Arc<Scene>) {
        if let Some(request) = self.opened.take() {
            self.request = request;
            self.is_prepared_anew = false;
            self.mirror_triangles = None;
        }
        if self.takes_eye {
            self.eye = scene.eye;
        }
        self.takes_eye = false;
        self.selected = None;
        self.moves.clear();
        (self.probed, self.pinned) = (None, None);
        self.scene = Some(scene);
        self.placements = Arc::new(self.own_places());
    }

    /// Opens a scene file, or models beside the teapot.
    pub(super) fn open(&mut self, files: &[PathBuf]) {
        let inputs = files.iter().map(|f| f.to_string_lossy().into_owned()).collect();
        self.takes_eye = true;
        // What is open stays, and keeps its name, until the other is there.
        let request = Request { inputs, read: self.request.read, ..Request::default() };
        self.opened = Some(request.clone());
        self.load(What::Request(Box::new(request)), None);
    }

    /// Samples the open scene anew, with what the sliders say.
    pub(super) fn prepare_again(&mut self) {
        if let Some(scene) = self.as_placed() {
            self.is_prepared_anew = self.is_changed();
            (self.takes_eye, self.opened) = (false, None);
            self.load(What::Open(Arc::new(scene)), self.mirror_triangles);
        }
    }

    fn load(&mut self, what: What, mirror_triangles: Option<usize>) {
        self.message = None;
        let prepare = self.prepare;
        self.loaded = (prepare, mirror_triangles);
        let memory = self.memory;
        self.worker.load(LoadRequest { what, prepare, mirror_triangles, memory });
    }

    /// Ends the load under way. Should it be ready in this very moment, it is shown all the same.
    pub(super) fn cancel_load(&mut self) {
        self.worker.cancel_load();
        self.tell("loading was cancelled".to_owned(), false);
    }

    /// The scene as it is seen now.
    pub(super) fn as_placed(&self) -> Option<Scene> {
        let mut scene = (**self.scene.as_ref()?).clone();
        let objects = scene.objects.len();
        for (object, place) in scene.objects.iter_mut().zip(self.placements.iter()) {
            object.transform = *place;
        }
        for (mirror, place) in scene.mirrors.iter_mut().zip(&self.placements[objects..]) {
            mirror.transform = *place;
        }
        scene.eye = self.eye;
        Some(scene)
    }

    fn save_scene(&mut self, path: &std::path::Path) {
        let Some(scene) = self.as_placed() else { return };
        let text = crate::scene::file::to_toml(&scene);
        let done = text.and_then(|text| crate::image::io::write_bytes(path, text.as_bytes()));
        match done {
            Ok(()) => self.tell(format!("saved {}", path.display()), false),
            Err(error) => self.tell(error.to_string(), true),
        }
    }

    pub(super) fn save(&mut self, what: Saved, path: PathBuf) {
        let view = self.wanted(true, 1.0);
        self.worker.save(Save { what, path, view });
    }

    fn take(&mut self, context: &egui::Context, shot: Shot) {
        self.shots += 1;
        let ms: f64 = shot.ms;
        if !shot.view.rest {
            let share = shot.view.size.pixels() as f64 / self.size.pixels().max(1) as f64;
            let full = ms / share.clamp(0.1, 1.0);
            self.moving_ms =
                if self.moving_ms == 0.0 { full } else { 0.7 * self.moving_ms + 0.3 * full };
        } else if self.moving_ms == 0.0 {
            self.moving_ms = ms;
        }
        if let Some(report) = shot.reports.first() {
            self.history.push_back(report.clone());
            if self.history.len() > HISTORY {
                self.history.pop_front();
            }
        }
        let side = shot.view.size.width.max(shot.view.size.height);
        let is_whole = shot.view.size == self.size && side <= self.blits;
        let version = self.shots;
        let mut before = self.display.take().map(|display| display.pictures.into_iter());
        let show = |(i, picture)| {
            let before = before.as_mut().and_then(Iterator::next);
            if is_whole {
                return OnScreen::Whole(Blit::new(i, version, picture));
            }
            let options = TextureOptions::LINEAR;
            OnScreen::Scaled(match before {
                Some(OnScreen::Scaled(mut texture)) => {
                    texture.set(picture, options);
                    texture
                }
                _ => context.load_texture(format!("side {i}"), picture, options),
            })
        };
        let pictures = shot.pictures.into_iter().enumerate().map(show).collect();
        let load = |map| context.load_texture("map", map, TextureOptions::NEAREST);
        self.display = Some(Display {
            pictures,
            map: shot.map.map(load),
            view: shot.view,
            reports: shot.reports,
            errors: shot.errors,
            most: shot.most,
            complete: shot.complete,
            caustic: shot.caustic,
        });
    }

    fn probed(&mut self, probed: Probed) {
        if probed.probe.pick {
            // Handles would lie over what is looked into.
            if self.settings.inspect || self.settings.paths {
                let kept = probed.reflected.is_some() || probed.point.is_some();
                self.pinned = kept.then(|| probed.clone());
            } else {
                self.selected = probed.thing;
            }
        }
        self.probed = Some(probed);
    }

    /// Asks what is at a place of the canvas, as shares of its size.
    pub(super) fn ask(&mut self, at: egui::Vec2, pick: bool) {
        let at = glam::Vec2::new(at.x, at.y);
        self.worker.probe(Probe {
            at,
            pick,
            trace: self.settings.inspect,
            paths: pick && self.settings.paths,
        });
    }

    fn wanted(&self, rest: bool, scale: f64) -> View {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most a side"
        )]
        let side = |px: u32| ((f64::from(px) * scale).round() as u32).max(1);
        let mut sides = vec![self.settings.sides[0].side()];
        if self.settings.compare {
            sides.push(self.settings.sides[1].side());
        }
        if !rest && self.settings.adapt && self.moving_ms > BUDGET_MS && !self.steady {
            for (side, settings) in sides.iter_mut().zip(&self.settings.sides) {
                let mut draft = settings.clone();
                draft.set_quality("draft");
                *side = draft.side();
            }
        }
        let map = match (self.settings.compare, self.settings.shown) {
            (true, Shown::Difference) if rest => Map::Difference,
            (true, Shown::Flip) if rest => Map::Flip,
            (false, _) if rest => match self.settings.mirror {
                MirrorColors::Reflection => Map::None,
                MirrorColors::Cost => Map::Cost,
                MirrorColors::Class => Map::Class,
            },
            _ => Map::None,
        };
        View {
            generation: self.generation().unwrap_or(0),
            eye: self.eye,
            size: ImageSize { width: side(self.size.width), height: side(self.size.height) },
            sides,
            placements: Arc::clone(&self.placements),
            rest,
            map,
            planes: rest && (self.settings.inspect || self.settings.paths),
            caustic: rest && self.settings.caustic,
        }
    }

    /// The scale at which pictures keep up with what moves.
    pub(super) fn scale(&self) -> f64 {
        if !self.settings.adapt || self.steady {
            return 1.0;
        }
        let scale = (BUDGET_MS / self.moving_ms.max(1.0)).sqrt();
        // In steps, so that it does not flicker.
        ((scale * 8.0).floor() / 8.0).clamp(LEAST_SCALE, 1.0)
    }

    /// Posts what is to be seen, if that is news.
    pub(super) fn wish(&mut self, context: &egui::Context) {
        if self.prepared.is_none() {
            return;
        }
        let now = (self.eye, Arc::clone(&self.placements), self.size);
        let moved = self.wished.as_ref().is_some_and(|before| *before != now);
        self.wished = Some(now);
        if moved {
            self.changed = Instant::now();
        }
        let since = self.changed.elapsed();
        let rest = self.posted.is_none() || since >= REST;
        let view = if rest { self.wanted(true, 1.0) } else { self.wanted(false, self.scale()) };
        if !rest && !self.steady {
            context.request_repaint_after(REST - since);
        }
        // While something moves, only that is news.
        let news = if rest { self.posted.as_ref() != Some(&view) } else { moved };
        if news {
            self.worker.view(view.clone());
            self.posted = Some(view);
            self.posted_at = Instant::now();
        }
        if self.is_waiting() && since >= REST {
            // It may have to say so.
            context.request_repaint_after(SLOW);
        }
    }

    /// Whether the picture that is wished for has not come yet.
    fn is_waiting(&self) -> bool {
        let shown = self.display.as_ref().map(|display| &*display.view);
        self.posted.is_some() && self.posted.as_ref() != shown
    }

    /// Whether to say that a picture is being drawn.
    pub(super) fn is_slow(&self) -> bool {
        self.is_waiting() && self.posted_at.elapsed() >= SLOW && !self.steady
    }
}

/// What menus, keys and panels do.
impl Viewer {
    /// The scene's size, for what is relative to it.
    pub(super) fn scene_size(&self) -> f64 {
        self.prepared.as_ref().map_or(1.0, |p| (p.bounds[1] - p.bounds[0]).length().max(1e-9))
    }

    fn aspect(&self) -> f64 {
        f64::from(self.size.width) / f64::from(self.size.height)
    }

    pub(super) fn frame_all(&mut self) {
        if let Some(prepared) = &self.prepared {
            self.eye = navigation::frame(&self.eye, prepared.bounds, self.aspect());
        }
    }

    pub(super) fn frame_selected(&mut self) {
        let (Some(thing), Some(scene)) = (self.selected, &self.scene) else { return };
        let mesh = match thing {
            Thing::Object(i) => &scene.objects[i].mesh,
            Thing::Mirror(i) => &scene.mirrors[i].mesh,
        };
        let Some(place) = self.placements.get(thing.placement(scene.objects.len())) else { return };
        let (min, max) = world_bounds(mesh, place);
        self.eye = navigation::frame(&self.eye, [min, max], self.aspect());
    }

    /// The scene's own view.
    pub(super) fn go_home(&mut self) {
        if let Some(scene) = &self.scene {
            self.eye = scene.eye;
        }
    }

    pub(super) fn undo(&mut self) {
        if !self.moves.undo(&mut self.placements) {
            self.tell("nothing was moved".to_owned(), false);
        }
    }

    pub(super) fn redo(&mut self) {
        if !self.moves.redo(&mut self.placements) {
            self.tell("no move was undone".to_owned(), false);
        }
    }

    /// Where the scene has its things.
    pub(super) fn own_places(&self) -> Vec<Similarity> {
        let Some(scene) = &self.scene else { return Vec::new() };
        let objects = scene.objects.iter().map(|o| o.transform);
        objects.chain(scene.mirrors.iter().map(|m| m.transform)).collect()
    }

    pub(super) fn put_all_back(&mut self) {
        self.moves.begin(&self.placements);
        self.placements = Arc::new(self.own_places());
        self.moves.end(&self.placements);
    }

    pub(super) fn look_from(&mut self, direction: DVec3) {
        self.eye = navigation::from_direction(&self.eye, direction);
    }

    /// Whether the command line's words alone do not make what is seen.
    pub(super) fn is_changed(&self) -> bool {
        self.scene.is_some()
            && (self.own_places() != *self.placements
                || self.mirror_triangles.is_some()
                || self.is_prepared_anew)
    }

    /// Whether the sliders say something else than what was prepared.
    pub(super) fn prepare_differs(&self) -> bool {
        (self.prepare, self.mirror_triangles) != self.loaded
    }
}
