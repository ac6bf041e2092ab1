//! The renderer's thread: takes the latest wish, brings the scene to it and draws it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use eframe::egui::{Color32, ColorImage};
use rayon::prelude::*;

use super::{
    Arrived, BackendChoice, Drawing, Event, Inbox, Map, Prepared, Save, Saved, Shared, Shot, Side,
    View, probe,
};
use crate::backend::{Backend, cpu::Cpu, fastest, gpu};
use crate::camera::Eye;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::frame::Renderer;
use crate::geometry::Similarity;
use crate::image::Picture;
use crate::image::aov::write_aov;
use crate::image::color::{linear_to_srgb8, linear_to_srgb8_rgb};
use crate::image::compare::{self, Comparison, Set};
use crate::image::io::write_picture;
use crate::methods::{Method, method};
use crate::paths::PathScene;
use crate::scene::description::Scene;
use crate::scene::prepared::{PreparedScene, milliseconds};

/// Everything that the thread owns.
pub(super) struct Artist {
    shared: Arc<Shared>,
    scene: Option<Stage>,
    /// One for each method and backend that is in use.
    renderers: Vec<(&'static str, BackendChoice, Renderer)>,
    /// Drawn last.
    last: Option<Arc<View>>,
}

/// The scene that is shown. Behind an `Arc`, since a copy of it may be being shaded.
struct Stage {
    scene: Arc<PreparedScene>,
    prepared: Prepared,
    placements: Arc<Vec<Similarity>>,
    /// Where things were when the light was computed.
    lit: Arc<Vec<Similarity>>,
    /// As it was read.
    source: Arc<Scene>,
    /// For paths, with things in these places.
    paths: Option<(Arc<Vec<Similarity>>, PathScene)>,
    /// Places that are being shaded, and what cancels that.
    shading: Option<(Arc<Vec<Similarity>>, Arc<AtomicBool>)>,
}

impl Artist {
    pub(super) fn new(shared: Arc<Shared>) -> Self {
        Self { shared, scene: None, renderers: Vec::new(), last: None }
    }

    /// Until the window is gone.
    pub(super) fn run(mut self) {
        loop {
            let shared = Arc::clone(&self.shared);
            let mut inbox = shared.inbox();
            let work = loop {
                let waiting = &mut *inbox;
                if waiting.quit {
                    return self.end();
                }
                if let Some(work) = self.next(waiting) {
                    break work;
                }
                inbox = match shared.posted.wait(inbox) {
                    Ok(inbox) => inbox,
                    Err(poisoned) => poisoned.into_inner(),
                };
            };
            drop(inbox);
            // A bug of ours must not take the window and the user's scene with it.
            let done = catch_unwind(AssertUnwindSafe(|| self.work(work)));
            if done.is_err() {
                self.renderers.clear();
                self.shared.tell(Event::Failed(
                    "an error inside the renderer (a bug): the last wish was dropped".into(),
                ));
            }
            self.shared.inbox().drawing = None;
        }
    }

    fn end(mut self) {
        if let Some(stage) = &mut self.scene {
            stage.stop_shading();
        }
    }

    fn next(&self, inbox: &mut Inbox) -> Option<Work> {
        if let Some(arrived) = inbox.scene.take() {
            return Some(Work::Scene(arrived));
        }
        if let Some((generation, scene, lit)) = inbox.shaded.take() {
            return Some(Work::Shaded(generation, scene, lit));
        }
        self.scene.as_ref()?;
        if let Some(view) = inbox.view.take() {
            let flag = Arc::<AtomicBool>::default();
            let cancel = Arc::clone(&flag);
            let (begun, own) = (Instant::now(), Arc::clone(&view));
            inbox.drawing = Some(Drawing { cancel, begun, view: own });
            return Some(Work::View(view, flag));
        }
        if let Some(probe) = inbox.probe.take() {
            return Some(Work::Probe(probe));
        }
        (!inbox.saves.is_empty()).then(|| Work::Save(Box::new(inbox.saves.remove(0))))
    }

    fn work(&mut self, work: Work) {
        let done = match work {
            Work::Scene(arrived) => {
                self.arrive(*arrived);
                Ok(())
            }
            Work::Shaded(generation, scene, lit) => {
                self.relight(generation, *scene, lit);
                Ok(())
            }
            Work::View(view, flag) => {
                let (begun, rest) = (Instant::now(), view.rest);
                let done = self.draw(view, &Context::cancelled_by(flag));
                if !rest && matches!(done, Err(Error::Cancelled)) {
                    self.shared.tell(Event::GivenUp(milliseconds(begun)));
                }
                done
            }
            Work::Probe(probe) => {
                let found = self.probe(&probe);
                found.map(|found| self.shared.tell(Event::Probed(Box::new(found))))
            }
            Work::Save(save) => self.save(*save),
        };
        match done {
            Ok(()) | Err(Error::Cancelled) => {}
            Err(error) => self.shared.tell(Event::Failed(error.to_string())),
        }
    }

    fn arrive(&mut self, arrived: Arrived) {
        let Arrived { scene, source, prepared, placements } = arrived;
        if let Some(stage) = &mut self.scene {
            stage.stop_shading();
        }
        self.scene = Some(Stage {
            scene: Arc::new(scene),
            prepared: prepared.clone(),
            lit: Arc::clone(&placements),
            placements,
            source: Arc::clone(&source),
            paths: None,
            shading: None,
        });
        self.last = None;
        self.shared.tell(Event::Ready(Box::new(prepared), source));
    }

    fn relight(&mut self, generation: u64, scene: PreparedScene, lit: Arc<Vec<Similarity>>) {
        let Some(stage) = &mut self.scene else { return };
        stage.shading = None;
        if stage.prepared.generation != generation || stage.prepared.surfels != scene.surfel_count()
        {
            return;
        }
        stage.scene = Arc::new(scene);
        stage.placements = Arc::clone(&lit);
        stage.lit = lit;
        self.shared.tell(Event::Progress(None));
        // The same wish, in the new light, unless there is a newer one.
        if let Some(view) = self.last.take() {
            self.shared.post(|inbox| {
                inbox.view.get_or_insert(view);
            });
        }
    }

    fn draw(&mut self, view: Arc<View>, cx: &Context) -> Result<()> {
        let Some(stage) = &mut self.scene else { return Ok(()) };
        if view.generation != stage.prepared.generation {
            return Ok(());
        }
        stage.place(&view.placements);
        let start = Instant::now();
        let eye = view_eye(&stage.scene, &view)?;
        let mut shot = Shot {
            ms: 0.0,
            pictures: Vec::new(),
            reports: Vec::new(),
            map: None,
            caustic: Vec::new(),
            errors: None,
            most: None,
            complete: stage.prepared.complete,
            view: Arc::clone(&view),
        };
        let mut used = Vec::new();
        for (i, side) in view.sides.iter().enumerate() {
            let at = renderer_for(&mut self.renderers, i, side)?;
            used.push(at);
            let renderer = &mut self.renderers[at].2;
            let planes = view.planes && i == 0;
            let how = chosen(side)?;
            let report = renderer.render(&stage.scene, &eye, how, &side.params, planes, cx)?;
            shot.reports.push(report);
            shot.pictures.push(displayed(renderer.picture()));
        }
        match (view.map, used.as_slice()) {
            (Map::Difference | Map::Flip, &[a, b]) => {
                let (a, b) = (self.renderers[a].2.picture(), self.renderers[b].2.picture());
                let found = compared(a, b)?;
                shot.errors = Some((found.rmse, found.psnr, found.flip));
                shot.map = Some(match view.map {
                    Map::Flip => heat_map(&found, [a.width, a.height]),
                    _ => difference(a, b),
                });
            }
            (Map::Cost, &[first, ..]) => {
                let visibility = self.renderers[first].2.visibility();
                if let Some((map, most)) =
                    probe::costs(&stage.scene, &eye, visibility, &view.sides[0])?
                {
                    (shot.map, shot.most) = (Some(map), Some(most));
                }
            }
            (Map::Class, &[first, ..]) => {
                let visibility = self.renderers[first].2.visibility();
                shot.map = Some(probe::classes(&stage.scene, &eye, visibility, &view.sides[0]));
            }
            _ => {}
        }
        if view.caustic {
            shot.caustic = probe::caustic(&stage.scene, &eye, &view.sides[0]);
        }
        if view.rest {
            stage.light(&self.shared);
        }
        self.last = Some(Arc::clone(&view));
        shot.ms = milliseconds(start);
        let known = shot.errors.is_some();
        self.shared.tell(Event::Shot(Box::new(shot)));
        // Figures can wait: not for them is a picture late.
        if let (true, false, &[a, b]) = (view.rest, known, used.as_slice())
            && self.shared.inbox().view.is_none()
        {
            let found = compared(self.renderers[a].2.picture(), self.renderers[b].2.picture())?;
            self.shared.tell(Event::Compared(view, (found.rmse, found.psnr, found.flip)));
        }
        Ok(())
    }

    fn probe(&mut self, asked: &probe::Probe) -> Result<probe::Probed> {
        let (Some(stage), Some(view)) = (&mut self.scene, &self.last) else {
            return Err(Error::Cancelled);
        };
        let at = renderer_for(&mut self.renderers, 0, &view.sides[0])?;
        let eye = view_eye(&stage.scene, view)?;
        let renderer = &self.renderers[at].2;
        let mut found = probe::probe(&stage.scene, &eye, view, renderer, asked)?;
        if asked.paths
            && let Some(point) = found.point
        {
            found.paths = probe::paths(stage.path_scene(), view, point)?;
        }
        Ok(found)
    }

    /// Draws it anew, to its end: the picture of a file is no preview.
    fn save(&mut self, save: Save) -> Result<()> {
        let Save { what, path, view } = save;
        let (Some(stage), Some(side)) = (&mut self.scene, view.sides.first()) else {
            return Ok(());
        };
        if view.generation != stage.prepared.generation {
            return Ok(());
        }
        stage.place(&view.placements);
        let eye = view_eye(&stage.scene, &view)?;
        let mut renderer = Renderer::on(backend(side)?);
        if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            renderer.keep_bright();
        }
        let (how, planes) = (chosen(side)?, what == Saved::Planes);
        renderer.render(&stage.scene, &eye, how, &side.params, planes, &Context::default())?;
        match (what, renderer.planes()) {
            (Saved::Planes, Some(planes)) => {
                let objects = &stage.scene.objects;
                let names: Vec<String> = objects.iter().map(|o| o.name.clone()).collect();
                write_aov(&path, planes, &names)?;
            }
            _ => write_picture(&path, renderer.picture())?,
        }
        self.shared.tell(Event::Saved(path));
        Ok(())
    }
}

/// RMSE, PSNR (dB, none if equal) and mean FLIP of two pictures.
pub(in super::super) type Errors = (f64, Option<f64>, f64);

fn compared(a: &Picture, b: &Picture) -> Result<Comparison> {
    let side = |picture| compare::Side { picture, planes: None };
    compare::compare(side(a), side(b), &Set::All)
}

/// What there is to do.
enum Work {
    Scene(Box<Arrived>),
    Shaded(u64, Box<PreparedScene>, Arc<Vec<Similarity>>),
    View(Arc<View>, Arc<AtomicBool>),
    Probe(probe::Probe),
    Save(Box<Save>),
}

impl Stage {
    /// What paths run between, with things where they are now.
    fn path_scene(&mut self) -> &PathScene {
        let here = Arc::clone(&self.placements);
        if self.paths.as_ref().is_some_and(|(places, _)| *places != here) {
            self.paths = None;
        }
        let source = &self.source;
        let make = || {
            let mut scene = Scene::clone(source);
            let objects = scene.objects.iter_mut().map(|o| &mut o.transform);
            let all = objects.chain(scene.mirrors.iter_mut().map(|m| &mut m.transform));
            all.zip(here.iter()).for_each(|(transform, place)| *transform = *place);
            (Arc::clone(&here), PathScene::new(&scene))
        };
        &self.paths.get_or_insert_with(make).1
    }

    /// Puts things where the wish has them; no tree is built.
    fn place(&mut self, placements: &Arc<Vec<Similarity>>) {
        if Arc::ptr_eq(placements, &self.placements)
            || placements.len() != self.placements.len()
            || **placements == *self.placements
        {
            return;
        }
        if self.shading.as_ref().is_some_and(|(at, _)| **at != **placements) {
            self.stop_shading();
        }
        let objects = self.scene.objects.len();
        let scene = Arc::make_mut(&mut self.scene);
        let both = placements.iter().zip(self.placements.iter());
        for (i, (now, _)) in both.enumerate().filter(|(_, (now, before))| now != before) {
            if i < objects {
                scene.place(i, now);
            } else {
                scene.place_mirror(i - objects, now);
            }
        }
        self.placements = Arc::clone(placements);
    }

    /// Starts computing the light anew where things were moved since; the old light stays until then.
    fn light(&mut self, shared: &Arc<Shared>) {
        if *self.lit == *self.placements || self.shading.is_some() {
            return;
        }
        let cx = Context::default();
        let flag = cx.cancel_flag();
        let (snapshot, lit) = (Arc::clone(&self.scene), Arc::clone(&self.placements));
        let (shared, generation) = (Arc::clone(shared), self.prepared.generation);
        let own = Arc::clone(&lit);
        let run = move || {
            let mut scene = (*snapshot).clone();
            drop(snapshot);
            if scene.shade(&cx).is_ok() {
                shared.post(|inbox| inbox.shaded = Some((generation, Box::new(scene), own)));
            }
        };
        if std::thread::Builder::new().name("shader".into()).spawn(run).is_ok() {
            self.shading = Some((lit, flag));
        }
    }

    fn stop_shading(&mut self) {
        if let Some((_, flag)) = self.shading.take() {
            flag.store(true, Ordering::Relaxed);
        }
    }
}

fn view_eye(scene: &PreparedScene, view: &View) -> Result<Eye> {
    scene.eye_of(&view.eye, view.size).ok_or_else(|| {
        Error::input("the view", "", "cannot be drawn from there", "press Home to start again")
    })
}

fn chosen(side: &Side) -> Result<&'static dyn Method> {
    method(side.method).ok_or(Error::Cancelled)
}

/// The renderer of a side. The two sides never share one: each keeps its last picture.
fn renderer_for(
    renderers: &mut Vec<(&'static str, BackendChoice, Renderer)>,
    at: usize,
    side: &Side,
) -> Result<usize> {
    let fits = |r: &(&str, BackendChoice, Renderer)| (r.0, r.1) == (side.method, side.backend);
    if !renderers.get(at).is_some_and(fits) {
        let renderer = Renderer::on(backend(side)?);
        renderers.truncate(at);
        renderers.push((side.method, side.backend, renderer));
    }
    Ok(at)
}

fn backend(side: &Side) -> Result<Box<dyn Backend>> {
    let has_shaders = chosen(side)?.info().has_shaders;
    Ok(match side.backend {
        BackendChoice::Cpu => Box::new(Cpu::default()),
        BackendChoice::Auto => fastest(has_shaders),
        BackendChoice::Gpu if !has_shaders => {
            let problem = format!("{} has no shaders", side.method);
            return Err(Error::input("backend gpu", "", problem, "choose auto or cpu"));
        }
        BackendChoice::Gpu => Box::new(gpu::Gpu::new(gpu::Options::default())?),
    })
}

/// As the display wants it.
pub(super) fn displayed(picture: &Picture) -> ColorImage {
    let color = |rgb: &[f32; 3]| {
        let [r, g, b] = linear_to_srgb8_rgb(*rgb);
        Color32::from_rgb(r, g, b)
    };
    let pixels = picture.rgb.par_iter().with_min_len(4096).map(color).collect();
    ColorImage::new([picture.width as usize, picture.height as usize], pixels)
}

/// |a - b| by channel, in display values.
fn difference(a: &Picture, b: &Picture) -> ColorImage {
    let of = |(a, b): (&[f32; 3], &[f32; 3])| {
        let [r, g, b] = [0, 1, 2].map(|k| linear_to_srgb8(a[k]).abs_diff(linear_to_srgb8(b[k])));
        Color32::from_rgb(r, g, b)
    };
    let pixels = a.rgb.par_iter().with_min_len(4096).zip(&b.rgb).map(of).collect();
    ColorImage::new([a.width as usize, a.height as usize], pixels)
}

/// FLIP from black (equal) over red and yellow to white.
fn heat_map(found: &Comparison, [width, height]: [u32; 2]) -> ColorImage {
    let pixels = found.flip_map.iter().map(|&error| heat(error)).collect();
    ColorImage::new([width as usize, height as usize], pixels)
}

/// A colour for 0 to 1.
pub(in super::super) fn heat(value: f32) -> Color32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 255")]
    let [r, g, b] = [0.0, 1.0, 2.0]
        .map(|from: f32| ((3.0 * value.clamp(0.0, 1.0) - from).clamp(0.0, 1.0) * 255.0) as u8);
    Color32::from_rgb(r, g, b)
}
