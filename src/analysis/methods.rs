//! All methods on one scene, held against many rays a pixel.

use glam::{DVec3, Vec2};

use crate::analysis::measure::Ratio;
use crate::backend::Backend;
use crate::camera::Eye;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::frame::{FrameReport, Renderer};
use crate::image::compare::{Comparison, Percentiles, Set, Side, compare};
use crate::image::temporal::{Restlessness, Sequence};
use crate::image::{NONE, Picture, Planes};
use crate::methods::{METHODS, Method, Params, method};
use crate::paths::{PathFinder, PathOptions, PathScene};
use crate::scene::PreparedScene;
use crate::scene::description::Scene;

/// Makes a backend for the candidate of that index.
pub type MakeBackend<'a> = dyn Fn(usize, &dyn Method) -> Result<Box<dyn Backend>> + 'a;

/// What is measured, and how often.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Rays a pixel of the reference.
    pub spp: u32,
    /// Turns that are timed, each the fastest of a few frames; the medians count.
    pub repeat: u32,
    /// Frames of the orbit on which flicker is measured; fewer than three: it is not.
    pub frames: u32,
    /// The orbit, radians.
    pub orbit: f64,
}

/// The truth.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Many rays a pixel.
    pub picture: Picture,
    /// What the pixels' centres show.
    pub planes: Planes,
}

/// What a method's frame took and how far it is from the truth.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Times are medians.
    pub report: FrameReport,
    /// The reflections' time by that of one ray a pixel, whose frames alternated with these.
    pub to_one_ray: Ratio,
    /// Against the reference, where that reflects objects.
    pub errors: Comparison,
}

/// A method's parameters other than the defaults, with what they give.
#[derive(Clone, Debug)]
pub struct Setting {
    /// The knob.
    pub knob: &'static str,
    /// Its value.
    pub value: String,
    /// What it gives.
    pub measured: Measured,
}

/// A method that can draw the scene.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// With its default parameters.
    pub measured: Measured,
    /// Its picture.
    pub picture: Picture,
    /// What it shows.
    pub planes: Planes,
    /// How far what is shown is from where it belongs, pixels; `None`: nothing is.
    pub displacement_px: Option<Percentiles>,
    /// Over the orbit.
    pub restlessness: Restlessness,
    /// Its quality knobs turned.
    pub settings: Vec<Setting>,
}

/// A method with its parameters.
#[derive(Clone)]
pub struct Candidate {
    /// What it is called: the method's name, and its parameters where they are not the defaults.
    pub label: String,
    /// The method.
    pub method: &'static dyn Method,
    /// Its parameters.
    pub params: Params,
    /// Whether its quality knobs are turned.
    pub knobs: bool,
}

impl Candidate {
    /// All methods with their defaults, in the order of the registry.
    pub fn all(knobs: bool) -> Vec<Self> {
        let candidate = |method: &'static dyn Method| Self {
            label: method.info().id.to_owned(),
            method,
            params: Params::defaults(method.info().params),
            knobs,
        };
        METHODS.into_iter().map(candidate).collect()
    }
}

/// A candidate with what it draws, or why it cannot draw the scene.
pub struct Entry {
    /// The candidate.
    pub candidate: Candidate,
    /// What it draws.
    pub result: std::result::Result<Box<Drawn>, Error>,
}

/// What the reference is, and what every candidate makes of the scene.
///
/// `described` is what the scene was made from.
///
/// # Errors
/// The eye sees no mirror that reflects an object, or cancelled.
pub fn compare_methods(
    described: &Scene,
    scene: &PreparedScene,
    eye: &Eye,
    candidates: Vec<Candidate>,
    effort: Effort,
    backend: &MakeBackend<'_>,
    cx: &Context,
) -> Result<(Reference, Vec<Entry>)> {
    cx.step("reference", 0.0)?;
    let reference = reference(scene, eye, effort.spp, cx)?;
    let places = Places::new(described);
    let mut rays = Renderer::new();
    let mut entries = Vec::new();
    let count = candidates.len() as f64;
    for (i, candidate) in candidates.into_iter().enumerate() {
        cx.step(&candidate.label, i as f64 / count)?;
        let trial = Trial { scene, eye, effort, reference: &reference, places: &places, cx };
        let made = backend(i, candidate.method);
        let result = match made.and_then(|backend| trial.draw(&candidate, backend, &mut rays)) {
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            result => result.map(Box::new),
        };
        entries.push(Entry { candidate, result });
    }
    Ok((reference, entries))
}

/// The picture of `spp` rays a pixel.
///
/// # Errors
/// The eye sees no mirror that reflects an object, or cancelled.
pub fn reference(scene: &PreparedScene, eye: &Eye, spp: u32, cx: &Context) -> Result<Reference> {
    let rays = method("raytrace").expect("it is in the registry");
    let mut params = Params::defaults(rays.info().params);
    params.set(rays.info().param("spp"), &spp.to_string())?;
    let mut renderer = Renderer::new();
    renderer.keep_bright();
    renderer.render(scene, eye, rays, &params, true, cx)?;
    let planes = renderer.planes().expect("they were asked for").clone();
    if planes.object.iter().all(|&object| object == NONE) {
        let remedy = "choose another --eye, --target or --size";
        return Err(Error::input(
            "the view",
            "",
            "shows no mirror that reflects an object",
            remedy,
        ));
    }
    Ok(Reference { picture: renderer.picture().clone(), planes })
}

/// One method at a time.
struct Trial<'a> {
    scene: &'a PreparedScene,
    eye: &'a Eye,
    effort: Effort,
    reference: &'a Reference,
    places: &'a Places,
    cx: &'a Context,
}

/// Frames of a turn of a method and of one ray a pixel, alternating.
const FRAMES: usize = 3;

impl Trial<'_> {
    fn draw(
        &self,
        candidate: &Candidate,
        backend: Box<dyn Backend>,
        rays: &mut Renderer,
    ) -> Result<Drawn> {
        let Candidate { method, ref params, knobs, .. } = *candidate;
        let mut own = Renderer::on(backend);
        own.keep_bright();
        let measured = self.measure([&mut own, rays], method, params)?;
        let picture = own.picture().clone();
        let planes = own.planes().expect("they were asked for").clone();
        let settings = if knobs { self.turn([&mut own, rays], candidate)? } else { Vec::new() };
        let restlessness = self.orbit(&mut own, method, params)?;
        let displacement_px = self.places.displacement(self.scene, self.eye, &planes, self.cx)?;
        Ok(Drawn { measured, picture, planes, displacement_px, restlessness, settings })
    }

    /// By the first renderer, in turn with one ray a pixel by the second. The last frame comes with its planes, and is not
    /// timed.
    fn measure(
        &self,
        [own, rays]: [&mut Renderer; 2],
        method: &dyn Method,
        params: &Params,
    ) -> Result<Measured> {
        let Self { scene, eye, cx, .. } = *self;
        let one = crate::methods::method("raytrace").expect("it is in the registry");
        let one_params = Params::defaults(one.info().params);
        let (mut reports, mut beside) = (Vec::new(), Vec::new());
        for turn in 0..=self.effort.repeat {
            let mut frames = [Vec::new(), Vec::new()];
            for _ in 0..FRAMES {
                frames[0].push(own.render(scene, eye, method, params, false, cx)?);
                frames[1].push(rays.render(scene, eye, one, &one_params, false, cx)?);
            }
            // The first one fills caches and compiles shaders.
            if turn > 0 {
                let [own, beside_own] = frames.map(FrameReport::fastest);
                reports.push(own);
                beside.push(beside_own.reflection_ms());
            }
        }
        let mut report = FrameReport::median(&reports);
        let times: Vec<f64> = reports.iter().map(FrameReport::reflection_ms).collect();
        let to_one_ray = Ratio::of(&times, &beside).expect("there is a turn");
        let last = own.render(scene, eye, method, params, true, cx)?;
        report.valid = last.valid;
        let shown = Side { picture: own.picture(), planes: own.planes() };
        let truth = Side { picture: &self.reference.picture, planes: Some(&self.reference.planes) };
        Ok(Measured { report, to_one_ray, errors: compare(shown, truth, &Set::Objects)? })
    }

    /// Each quality knob, one at a time.
    fn turn(&self, [own, rays]: [&mut Renderer; 2], candidate: &Candidate) -> Result<Vec<Setting>> {
        let method = candidate.method;
        let mut settings = Vec::new();
        for knob in method.info().params.iter().filter(|p| p.is_quality_knob) {
            let values = KNOB_VALUES.iter().filter(|(id, _)| *id == knob.id);
            for &value in values.flat_map(|(_, values)| *values) {
                let mut params = candidate.params.clone();
                params.set(knob, value)?;
                let measured = self.measure([&mut *own, &mut *rays], method, &params)?;
                settings.push(Setting { knob: knob.id, value: value.to_owned(), measured });
            }
        }
        Ok(settings)
    }

    fn orbit(
        &self,
        renderer: &mut Renderer,
        method: &dyn Method,
        params: &Params,
    ) -> Result<Restlessness> {
        let mut sequence = Sequence::default();
        let frames = if self.effort.frames < 3 { 0 } else { self.effort.frames };
        for frame in 0..frames {
            let turn = self.effort.orbit * f64::from(frame) / f64::from(frames);
            let described = self.scene.eye.orbited(turn);
            let Some(eye) = self.scene.eye_of(&described, self.eye.size) else { continue };
            renderer.render(self.scene, &eye, method, params, false, self.cx)?;
            let on = renderer.coverage().iter().map(|&c| c >= 0.5).collect();
            sequence.add(&renderer.picture().rgb, on);
        }
        Ok(sequence.figures())
    }
}

/// Where points are truly seen.
struct Places(PathScene);

/// Pixels whose displacement is measured, at most: more say nothing new.
const MOST_MEASURED: usize = 40_000;

impl Places {
    /// Without sources, so that paths are those of the interpolated normals, as the reference's rays.
    fn new(described: &Scene) -> Self {
        let mut scene = described.clone();
        scene.mirrors.iter_mut().for_each(|mirror| mirror.source = None);
        Self(PathScene::new(&scene))
    }

    /// How far from the pixel that shows it each shown point is seen, by its image nearest to there.
    fn displacement(
        &self,
        scene: &PreparedScene,
        eye: &Eye,
        planes: &Planes,
        cx: &Context,
    ) -> Result<Option<Percentiles>> {
        let shown: Vec<usize> =
            (0..planes.object.len()).filter(|&i| planes.object[i] != NONE).collect();
        let every = shown.len().div_ceil(MOST_MEASURED).max(1);
        let shown: Vec<usize> = shown.into_iter().step_by(every).collect();
        let point = |&i: &usize| DVec3::from_array(planes.position[i].map(f64::from));
        let points: Vec<DVec3> = shown.iter().map(point).collect();
        let options = PathOptions { occlusion: false, refine: true, ..PathOptions::default() };
        let finder = PathFinder::new(&self.0, eye.position.as_dvec3() + scene.origin, options)?;
        let paths = finder.find(&points, cx)?;
        let width = planes.width as usize;
        let nearest = |(k, &i): (usize, &usize)| {
            let middle = Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
            let splat = Vec2::from_array(planes.splat[i]);
            let here = if splat == Vec2::ZERO { middle } else { splat };
            let seen = paths
                .of(k)
                .iter()
                .filter_map(|path| eye.project_px((path.mirror_point - scene.origin).as_vec3()));
            seen.map(|px| px.distance(here)).min_by(f32::total_cmp)
        };
        Ok(Percentiles::of(shown.iter().enumerate().filter_map(nearest).collect()))
    }
}

/// Values of the knobs, from fast to exact.
const KNOB_VALUES: [(&str, &[&str]); 6] = [
    ("detail", &["1", "2", "4", "8"]),
    ("spp", &["1", "4", "16"]),
    ("grid", &["0.041", "0.055", "0.096", "0.143"]),
    ("iterations", &["3", "5", "7", "9", "20"]),
    ("tessellate", &["64", "16", "4"]),
    ("cube-side", &["64", "128", "256", "512", "1024"]),
];
