//! One frame from end to end: the only place where the stages meet.

use std::time::Instant;

use glam::Vec3;

use crate::backend::cpu::{Cpu, finish};
use crate::backend::{Backend, ExecuteReport};
use crate::camera::Eye;
use crate::context::Context;
use crate::error::Result;
use crate::image::{Picture, Planes};
use crate::methods::{FrameInput, Made, Method, Params, Value};
use crate::plan::{Plan, Reflection};
use crate::scene::prepared::{PreparedScene, milliseconds};
use crate::visibility::{self, NONE_ID, Visibility};

/// What a frame did and took. Times in milliseconds; a stage that was not timed apart is `None`, and so is a
/// count of what the method has none of.
#[derive(Clone, Debug, Default)]
pub struct FrameReport {
    /// Method id.
    pub method: &'static str,
    /// Backend id.
    pub backend: &'static str,
    /// See [`Backend::device`].
    pub device: Option<String>,
    /// Cameras (patch and object).
    pub cameras: Option<usize>,
    /// Batches.
    pub batches: Option<u64>,
    /// Camera–surfel pairs projected.
    pub projections: Option<u64>,
    /// Pairs with an image.
    pub valid: Option<u64>,
    /// Steps of all searches together.
    pub steps: Option<u64>,
    /// Pixels whose centre shows a mirror.
    pub mirror_pixels: usize,
    /// Those that objects cover at least half of.
    pub covered_pixels: usize,
    /// Mirror ids, depth and direct visibility.
    pub ids_ms: Option<f64>,
    /// Visible patches and their cameras.
    pub cameras_ms: Option<f64>,
    /// Culling.
    pub cull_ms: Option<f64>,
    /// Projection.
    pub project_ms: Option<f64>,
    /// Splatting.
    pub splat_ms: Option<f64>,
    /// The whole reflected layer, wall time: patches, cameras, clear, cull, project, splat, resolve.
    pub layer_ms: Option<f64>,
    /// Tracing the reflected rays, wall time.
    pub rays_ms: Option<f64>,
    /// Direct view, environment and composite.
    pub composite_ms: Option<f64>,
    /// All of it, wall time.
    pub frame_ms: Option<f64>,
    /// What the method cannot show in this scene, a sentence each.
    pub notes: Vec<String>,
}

impl FrameReport {
    /// Share of the projected pairs that have an image; `None` if there were none.
    pub fn valid_share(&self) -> Option<f64> {
        let (projections, valid) = (self.projections?, self.valid?);
        (projections > 0).then(|| valid as f64 / projections as f64)
    }

    /// Everything of the frame but what is seen directly, wall time: the layer, or the rays. Not a number if neither was
    /// timed.
    pub fn reflection_ms(&self) -> f64 {
        self.layer_ms.or(self.rays_ms).unwrap_or(f64::NAN)
    }

    /// Steps of a search, in the mean; `None` if nothing was searched for.
    pub fn mean_steps(&self) -> Option<f64> {
        let (searched, steps) = (self.projections?, self.steps?);
        (searched > 0).then(|| steps as f64 / searched as f64)
    }

    /// The one whose reflections took least.
    ///
    /// # Panics
    /// If there are none.
    pub fn fastest(reports: Vec<Self>) -> Self {
        let by_time = |a: &Self, b: &Self| a.reflection_ms().total_cmp(&b.reflection_ms());
        reports.into_iter().min_by(by_time).expect("at least one report")
    }

    /// The last report with every time replaced by the median over all.
    ///
    /// # Panics
    /// If there are none.
    pub fn median(reports: &[Self]) -> Self {
        let of = |pick: fn(&Self) -> Option<f64>| {
            let mut values: Vec<f64> = reports.iter().filter_map(pick).collect();
            values.sort_by(f64::total_cmp);
            let n = values.len();
            (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
        };
        Self {
            ids_ms: of(|r| r.ids_ms),
            cameras_ms: of(|r| r.cameras_ms),
            cull_ms: of(|r| r.cull_ms),
            project_ms: of(|r| r.project_ms),
            splat_ms: of(|r| r.splat_ms),
            layer_ms: of(|r| r.layer_ms),
            rays_ms: of(|r| r.rays_ms),
            composite_ms: of(|r| r.composite_ms),
            frame_ms: of(|r| r.frame_ms),
            ..reports.last().expect("at least one report").clone()
        }
    }
}

/// A method, the version of a scene, and the parameters that matter.
type MadeFor = (&'static str, u64, Vec<Value>);

/// Renders frames; keeps its memory between them.
pub struct Renderer {
    backend: Box<dyn Backend>,
    visibility: Visibility,
    scratch: visibility::Scratch,
    reflection: Reflection,
    picture: Picture,
    white: f32,
    /// The last method's, with what it depends on.
    made: Option<(MadeFor, Made)>,
}

impl Default for Renderer {
    fn default() -> Self {
        Self::new()
    }
}

impl Renderer {
    /// A renderer on the CPU.
    pub fn new() -> Self {
        Self::on(Box::new(Cpu::default()))
    }

    /// A renderer on a backend.
    pub fn on(backend: Box<dyn Backend>) -> Self {
        Self {
            backend,
            visibility: Visibility::default(),
            scratch: visibility::Scratch::default(),
            reflection: Reflection::default(),
            picture: Picture::black(0, 0),
            white: 1.0,
            made: None,
        }
    }

    /// The backend, for another renderer.
    pub fn into_backend(self) -> Box<dyn Backend> {
        self.backend
    }

    /// Keeps values brighter than a display's white, for pictures in floating point.
    pub fn keep_bright(&mut self) {
        self.white = f32::INFINITY;
    }

    /// Renders one frame. With `planes` it also keeps what every mirror pixel shows.
    ///
    /// # Errors
    /// The method cannot draw this scene, or the work was cancelled.
    pub fn render(
        &mut self,
        scene: &PreparedScene,
        eye: &Eye,
        method: &dyn Method,
        params: &Params,
        planes: bool,
        cx: &Context,
    ) -> Result<FrameReport> {
        let made = self.prepared(scene, method, params, cx)?;
        let start = Instant::now();
        let ids_ms = self.see(scene, eye);
        cx.check()?;
        let (mut report, _) = self.reflect(scene, eye, method, &made, params, planes, cx)?;
        cx.check()?;
        let composite = Instant::now();
        self.compose(scene, eye);
        report.ids_ms = Some(ids_ms);
        report.composite_ms = Some(milliseconds(composite));
        report.frame_ms = Some(milliseconds(start));
        Ok(report)
    }

    /// What the method makes once a scene, made anew only when it has to be.
    ///
    /// # Errors
    /// The method cannot draw this scene, or the work was cancelled.
    pub fn prepared(
        &mut self,
        scene: &PreparedScene,
        method: &dyn Method,
        params: &Params,
        cx: &Context,
    ) -> Result<Made> {
        let values = method.prepares_with().iter().filter_map(|id| params.get(id)).collect();
        let key = (method.info().id, method.version(scene), values);
        if let Some((of, made)) = &self.made
            && *of == key
        {
            return Ok(Made::clone(made));
        }
        self.made = None;
        method.qualify(scene, params)?;
        let made = method.prepare(scene, params, cx)?;
        self.made = Some((key, Made::clone(&made)));
        Ok(made)
    }

    /// The first stage: what the eye sees directly. Returns its milliseconds.
    pub fn see(&mut self, scene: &PreparedScene, eye: &Eye) -> f64 {
        let start = Instant::now();
        let mirrors = finish::mirror_surfaces(scene);
        let objects = finish::object_surfaces(scene);
        self.visibility.update(eye, &mirrors, &objects, &mut self.scratch);
        milliseconds(start)
    }

    /// The second stage: the reflection, for the eye that was last seen from.
    ///
    /// # Errors
    /// The backend failed, or the work was cancelled.
    #[expect(clippy::too_many_arguments, reason = "what to draw, how, and how long")]
    pub fn reflect(
        &mut self,
        scene: &PreparedScene,
        eye: &Eye,
        method: &dyn Method,
        made: &Made,
        params: &Params,
        planes: bool,
        cx: &Context,
    ) -> Result<(FrameReport, ExecuteReport)> {
        let start = Instant::now();
        let gathers = self.backend.gathers();
        let mut plan = Plan { cx: cx.silent(), gathers, ..Plan::default() };
        let input = FrameInput { scene, eye, visibility: &self.visibility };
        method.plan(input, made, params, &mut plan)?;
        let planned_ms = milliseconds(start);
        let done =
            self.backend.execute(&plan, scene, &self.visibility, planes, &mut self.reflection)?;
        let report = FrameReport {
            method: method.info().id,
            backend: self.backend.id(),
            device: self.backend.device(),
            cameras: done.cameras,
            batches: done.batches,
            projections: done.projections,
            valid: done.valid,
            steps: done.steps,
            mirror_pixels: self.visibility.mirror_ids.iter().filter(|&&id| id != NONE_ID).count(),
            covered_pixels: self.reflection.coverage.iter().filter(|&&c| c >= 0.5).count(),
            cameras_ms: done.cameras_ms.or(done.cameras.map(|_| plan.times.cameras_ms)),
            cull_ms: done.cull_ms,
            project_ms: done.project_ms,
            splat_ms: done.splat_ms,
            layer_ms: done.passes_ms.map(|ms| ms + planned_ms),
            rays_ms: done.rays_ms,
            notes: plan.notes.into_iter().chain(done.notes.iter().cloned()).collect(),
            ..FrameReport::default()
        };
        Ok((report, done))
    }

    /// The last stage: environment, tint, direct view.
    fn compose(&mut self, scene: &PreparedScene, eye: &Eye) {
        let (reflection, picture) = (&mut self.reflection, &mut self.picture);
        self.backend.compose(scene, eye, &self.visibility, reflection, self.white, picture);
    }

    /// The picture of the last frame, linear RGB.
    pub fn picture(&self) -> &Picture {
        &self.picture
    }

    /// What the eye saw directly in the last frame.
    pub fn visibility(&self) -> &Visibility {
        &self.visibility
    }

    /// What every mirror pixel of the last frame shows, if it was asked for.
    pub fn planes(&self) -> Option<&Planes> {
        self.reflection.planes.as_deref()
    }

    /// The share of each pixel that reflects objects.
    pub fn coverage(&self) -> &[f32] {
        &self.reflection.coverage
    }

    /// The reflection's radiance by pixel, before environment and tint; zero where nothing landed.
    pub fn reflection(&self) -> &[Vec3] {
        &self.reflection.radiance
    }
}
