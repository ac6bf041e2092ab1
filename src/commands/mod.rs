//! The command line: one thin file a verb. It parses, calls the library and writes.

pub(crate) mod analyze;
pub(crate) mod bench;
pub(crate) mod compare;
pub(crate) mod info;
mod machine;
pub(crate) mod memory;
pub(crate) mod paths;
mod plots;
pub(crate) mod render;
#[cfg(feature = "viewer")]
pub(crate) mod view;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context as _;
use catoptric::accel::KdTreeLimits;
use catoptric::camera::Eye;
use catoptric::camera::eye::ImageSize;
use catoptric::geometry::lanes::{SIMD_VARIABLE, requested_level};
use catoptric::image::io::check_place;
use catoptric::image::io::write_bytes;
use catoptric::methods::{METHODS, Method, MethodInfo, Params, method};
use catoptric::scene::arrange::{self, Request};
use catoptric::scene::description::Scene;
use catoptric::scene::load::{self, ReadOptions, UpAxis};
use catoptric::scene::prepared::{self, DEFAULT_SURFELS, PrepareOptions, PreparedScene};
use catoptric::{Context, Error, Result};
use clap::{Arg, ArgMatches, Args, Command};
use glam::DVec3;
use serde_json::{Value, json};

/// Largest picture side: what the rasteriser's coordinates hold.
const MAX_SIDE: u32 = 16_384;

/// Threads beyond any machine's cores only cost memory.
const MAX_THREADS: u64 = 1024;

/// A line on standard output. Whoever reads it may stop (`catoptric info room | head -1`).
macro_rules! say {
    ($($what:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), $($what)*);
    }};
}
pub(crate) use say;

/// What to render and how to look at it.
#[derive(Args, Debug)]
pub(crate) struct SceneArgs {
    #[command(flatten)]
    pub(crate) place: PlaceArgs,
    /// Surfels over all objects
    #[arg(long, value_name = "N", default_value_t = DEFAULT_SURFELS, allow_negative_numbers = true)]
    pub(crate) surfels: usize,
    /// Surfels a tree leaf holds at most (default 8; 122 with --preset paper)
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    leaf: Option<u32>,
    /// Tree nodes of at most this share of their object's size are leaves
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, allow_negative_numbers = true)]
    leaf_size: f32,
}

/// What stands where, and who looks at it.
#[derive(Args, Clone, Debug)]
pub(crate) struct PlaceArgs {
    /// A built-in scene (default, room, knot), a scene file (.toml), or models or point clouds (.obj, .ply, .stl, .gltf, .glb,
    /// .las, .laz, .xyz, …) to be set beside the teapot; a file that has mirrors of its own is a scene as it is
    #[arg(value_name = "SCENE|MODEL")]
    pub(crate) inputs: Vec<String>,
    /// Mirror: a mesh file, used as placed, or a built-in shape; repeatable
    #[arg(long, value_name = "FILE|NAME")]
    pub(crate) mirror: Vec<String>,
    /// What stands for a mirror where a method needs a closed, star-shaped one (estalella, roger-holzschuch): a mesh file in
    /// the mirror's own space, or a built-in shape, made as large as the mirror; repeatable, in the mirrors' order ("none" leaves one out)
    #[arg(long, value_name = "FILE|NAME")]
    proxy: Vec<String>,
    /// Object: a mesh file, used as placed, or a built-in shape; repeatable
    #[arg(long, value_name = "FILE|NAME")]
    pub(crate) object: Vec<String>,
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// Environment: a panorama (equirectangular HDR, EXR, PNG or JPEG), its middle along -z, instead of the scene's
    #[arg(long, value_name = "FILE")]
    pub(crate) environment: Option<PathBuf>,
    /// Seed of the sampling
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true)]
    pub(crate) seed: u64,
    /// Eye position, world space
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    eye: Option<DVec3>,
    /// What the eye looks at, world space
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    target: Option<DVec3>,
    /// Vertical field of view in degrees
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true)]
    fov: Option<f64>,
    /// Picture size in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size, allow_hyphen_values = true)]
    pub(crate) size: ImageSize,
    /// Threads (default: all cores)
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u64).range(1..=MAX_THREADS))]
    threads: Option<u64>,
}

/// How files are read.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(crate) struct ReadArgs {
    /// Which axis is up in models: y, or z as in CAD and surveys (default: y; z for .las and .laz)
    #[arg(long, value_name = "AXIS")]
    up: Option<Axis>,
    /// Let scenes and models name files outside of their own folder
    #[arg(long)]
    allow_outside: bool,
}

impl ReadArgs {
    /// The rest of a request is as nothing was said.
    pub(crate) fn request(self, points: usize, seed: u64) -> Request {
        let (outside, up) = (self.allow_outside, self.up.map(Into::into));
        Request { read: ReadOptions { outside, up, points, seed }, ..Request::default() }
    }
}

/// See [`UpAxis`].
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Axis {
    Y,
    Z,
}

impl From<Axis> for UpAxis {
    fn from(axis: Axis) -> Self {
        match axis {
            Axis::Y => Self::Y,
            Axis::Z => Self::Z,
        }
    }
}

/// Says on standard error what should be known about the files that were read.
pub(crate) fn tell(notes: &[String]) {
    use std::io::Write as _;
    for note in notes {
        let _ = writeln!(std::io::stderr(), "note: {note}");
    }
}

fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|t| t.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z] if numbers.iter().all(|n| n.is_finite()) && text.split(',').count() == 3 => {
            Ok(DVec3::new(x, y, z))
        }
        _ => Err("give three numbers with commas between, such as 0,0.5,-2".into()),
    }
}

fn size(text: &str) -> Result<ImageSize, String> {
    let sides =
        text.split_once(['x', 'X']).and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match sides {
        Some((width, height))
            if (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height) =>
        {
            Ok(ImageSize { width, height })
        }
        Some(_) => Err(format!("each side must be from 1 to {MAX_SIDE} pixels")),
        None => Err("give width x height in pixels, such as 1280x720".into()),
    }
}

/// A scene that is ready, the eye, and how long loading took.
pub(crate) struct Ready {
    pub(crate) scene: PreparedScene,
    pub(crate) eye: Eye,
    pub(crate) load_ms: f64,
    /// What it was made from.
    pub(crate) described: Scene,
}

impl PlaceArgs {
    /// The built-in scene.
    fn default_scene() -> Self {
        Self {
            inputs: Vec::new(),
            mirror: Vec::new(),
            proxy: Vec::new(),
            object: Vec::new(),
            read: ReadArgs::default(),
            environment: None,
            seed: 1,
            eye: None,
            target: None,
            fov: None,
            size: ImageSize { width: 1280, height: 720 },
            threads: None,
        }
    }

    /// What can be refused before anything is read, and the threads. `surfels`: as many as will be made.
    pub(crate) fn begin(&self, surfels: usize, cx: &Context) -> anyhow::Result<()> {
        let model = |name: &String| load::is_model(Path::new(name));
        let given = [&self.inputs, &self.mirror, &self.object];
        if self.read.up.is_some() && !given.into_iter().flatten().any(model) {
            let remedy = "leave it out; in a scene file, rotate_deg turns a thing";
            let error = Error::input("--up", "", "turns models, and no model is given", remedy);
            return Err(error.into());
        }
        prepared::check_room(surfels, cx)?;
        memory::check(self.size, cx)?;
        begin(self.threads)
    }

    /// The scene that is asked for. `points`: of a cloud, at most.
    pub(crate) fn request(&self, points: usize) -> Request {
        Request {
            inputs: self.inputs.clone(),
            mirrors: self.mirror.clone(),
            objects: self.object.clone(),
            proxies: self.proxy.clone(),
            environment: self.environment.clone(),
            eye: self.eye,
            target: self.target,
            fov_y_deg: self.fov,
            ..self.read.request(points, self.seed)
        }
    }

    /// The eye of a prepared scene.
    pub(crate) fn eye(&self, scene: &PreparedScene) -> Result<Eye> {
        self.eye_at(scene, self.size)
    }

    /// The eye of a prepared scene, for a picture of another size.
    pub(crate) fn eye_at(&self, scene: &PreparedScene, size: ImageSize) -> Result<Eye> {
        seen(scene.eye_for(size), "--eye, --target, --fov")
    }
}

impl SceneArgs {
    /// The scene without a command line: the built-in one.
    pub(crate) fn default_scene() -> Self {
        Self {
            place: PlaceArgs::default_scene(),
            surfels: DEFAULT_SURFELS,
            leaf: None,
            leaf_size: 0.0,
        }
    }

    /// See [`PlaceArgs::begin`].
    pub(crate) fn begin(&self, cx: &Context) -> anyhow::Result<()> {
        self.place.begin(self.surfels, cx)
    }

    /// How it is to be prepared. `leaf` is a preset's leaf size.
    pub(crate) fn prepare_options(&self, leaf: Option<u32>) -> PrepareOptions {
        let standard = KdTreeLimits::default();
        PrepareOptions {
            surfels: self.surfels,
            tree: KdTreeLimits {
                leaf_points: self.leaf.or(leaf).unwrap_or(standard.leaf_points),
                leaf_size: self.leaf_size,
            },
            seed: self.place.seed,
        }
    }

    /// Loads and prepares. `leaf` is a preset's leaf size.
    pub(crate) fn ready(&self, leaf: Option<u32>, cx: &Context) -> anyhow::Result<Ready> {
        self.begin(cx)?;
        let start = Instant::now();
        let described = arrange::scene(&self.place.request(self.surfels), cx)?;
        let load_ms = start.elapsed().as_secs_f64() * 1e3;
        tell(&described.notes);
        let scene = PreparedScene::new(&described, &self.prepare_options(leaf), cx)?;
        let eye = self.place.eye(&scene)?;
        Ok(Ready { scene, eye, load_ms, described })
    }
}

/// Refuses an unknown instruction set, and sets the number of threads for everything that follows.
pub(crate) fn begin(threads: Option<u64>) -> anyhow::Result<()> {
    if let Err(name) = requested_level() {
        let problem = format!("{name:?} is not an instruction set");
        let remedy = "unset it, or choose sse2, sse4.2, avx2 or avx512";
        return Err(Error::input(SIMD_VARIABLE, "", problem, remedy).into());
    }
    if let Some(n) = threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(usize::try_from(n)?)
            .build_global()
            .context("--threads: the threads could not be started")?;
    }
    Ok(())
}

impl Ready {
    /// The eye, moved around its target.
    pub(crate) fn orbited(&self, radians: f64) -> Result<Eye> {
        let eye = self.scene.eye.orbited(radians);
        seen(self.scene.eye_of(&eye, self.eye.size), "--orbit")
    }
}

fn seen(eye: Option<Eye>, options: &str) -> Result<Eye> {
    eye.ok_or_else(|| {
        Error::input(
            options,
            "",
            "they do not make a view",
            "let the eye differ from the target, not look along its up vector, and take 0 < fov < 180",
        )
    })
}

/// Refuses a folder that cannot be written before any work is done.
pub(crate) fn check_folder(folder: &Path) -> Result<()> {
    if folder.is_dir() {
        return check_place(&folder.join("methods.md"));
    }
    if folder.exists() {
        let remedy = "give the name of a folder";
        return Err(Error::file(folder, "", "is a file, and a folder is written", remedy));
    }
    check_place(folder)
}

/// Adds the flags of all methods' parameters to a command.
pub(crate) fn with_method_flags(mut command: Command) -> Command {
    let mut seen: Vec<&str> = Vec::new();
    for m in METHODS {
        for p in m.info().params {
            if seen.contains(&p.id) {
                continue;
            }
            seen.push(p.id);
            let users: Vec<&str> = METHODS
                .iter()
                .filter(|m| m.info().params.iter().any(|q| q.id == p.id))
                .map(|m| m.info().id)
                .collect();
            let unit = if p.unit.is_empty() { String::new() } else { format!(", {}", p.unit) };
            // Methods may differ in what is standard.
            let same = |m: &&&dyn Method| m.info().params.iter().find(|q| q.id == p.id);
            let mut takes: Vec<String> = Vec::new();
            for (m, q) in METHODS.iter().filter_map(|m| Some((m, same(&m)?))) {
                if q.takes() != p.takes() {
                    takes.push(format!("default {} for {}", q.default, m.info().id));
                }
            }
            takes.insert(0, p.takes());
            let help = format!("{}{unit} [{}; {}]", p.about, takes.join(", "), users.join(", "));
            command = command.arg(
                Arg::new(p.id)
                    .long(p.id)
                    .value_name(p.value_name())
                    .help(help)
                    .help_heading("Method parameters"),
            );
        }
    }
    command
}

/// The method of that name with the parameters that the flags give it.
pub(crate) fn chosen_method(
    how: &render::HowArgs,
    matches: &ArgMatches,
) -> Result<(&'static dyn Method, Params, Option<u32>)> {
    let id = how.method.as_str();
    let ids: Vec<&str> = METHODS.iter().map(|m| m.info().id).collect();
    let chosen = method(id).ok_or_else(|| {
        Error::input(
            "--method",
            "",
            format!("there is no method \"{id}\""),
            format!("use one of {}", ids.join(", ")),
        )
    })?;
    let info = chosen.info();
    let mut params = Params::defaults(info.params);
    let mut leaf = None;
    if let Some(name) = &how.preset {
        let preset = info.presets.iter().find(|p| p.id == *name).ok_or_else(|| {
            let names: Vec<&str> = info.presets.iter().map(|p| p.id).collect();
            let remedy = if names.is_empty() {
                "leave it out".into()
            } else {
                format!("use {}", names.join(", "))
            };
            Error::input("--preset", "", format!("{id} has no preset \"{name}\""), remedy)
        })?;
        leaf = preset.leaf_points;
        for (param, value) in preset.params {
            params.set(info.param(param), value)?;
        }
    }
    for quality in info.qualities.iter().filter(|q| q.id == how.quality) {
        for (param, value) in quality.params {
            params.set(info.param(param), value)?;
        }
    }
    apply_flags(info, matches, &mut params)?;
    Ok((chosen, params, leaf))
}

fn apply_flags(info: &MethodInfo, matches: &ArgMatches, params: &mut Params) -> Result<()> {
    for m in METHODS {
        for p in m.info().params {
            let Ok(Some(text)) = matches.try_get_one::<String>(p.id) else { continue };
            match info.params.iter().find(|own| own.id == p.id) {
                Some(own) => params.set(own, text)?,
                None => {
                    return Err(Error::input(
                        format!("--{}", p.id),
                        "",
                        format!("{} has no such parameter", info.id),
                        format!("leave it out or use --method {}", m.info().id),
                    ));
                }
            }
        }
    }
    Ok(())
}

/// Refuses outputs that would overwrite one another.
pub(crate) fn check_apart(outputs: &[(&str, Option<&Path>)]) -> Result<()> {
    for (i, (option, path)) in outputs.iter().enumerate() {
        let known = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let own = path.map(known);
        let same = |(_, other): &&(&str, Option<&Path>)| own.is_some() && other.map(known) == own;
        if let Some((other, _)) = outputs[..i].iter().find(same) {
            let problem = format!("names the same file as {other}");
            return Err(Error::input(*option, "", problem, "give another name"));
        }
    }
    Ok(())
}

/// Writes the figures where `--json` says.
pub(crate) fn write_json(path: Option<&PathBuf>, value: &Value) -> anyhow::Result<()> {
    if let Some(path) = path {
        let mut text = serde_json::to_string_pretty(value)?;
        text.push('\n');
        write_bytes(path, text.as_bytes())?;
    }
    Ok(())
}

/// A number rounded to what a timer can tell, or null.
pub(crate) fn ms(value: Option<f64>) -> Value {
    value.map_or(Value::Null, |v| json!((v * 1e3).round() / 1e3))
}

/// Refuses an output that cannot be written before any work is done.
pub(crate) fn check_json(path: Option<&PathBuf>) -> Result<()> {
    path.map_or(Ok(()), |p| catoptric::image::io::check_place(p))
}
