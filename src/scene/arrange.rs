//! The scene that a command line asks for: a scene, models beside the teapot, or files as placed.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DQuat, DVec3, Vec3};

use super::description::{EyeDescription, Mirror, Object, Paint, PatternKind, Scene, Source};
use super::environment::image::Mounting;
use super::file::{self, DEFAULT_FOV_Y_DEG, DEFAULT_SKY, PARALLEL, default_light, plain_paint};
use super::fit::{fit, world_bounds};
use super::library::{Library, stem, unique};
use super::{builtin, load};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::{Mesh, Similarity};

/// What the command line says about the scene; all of it may be empty.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// One scene (a built-in name or a `.toml` file), or any number of models (`.obj`, `.ply`).
    pub inputs: Vec<String>,
    /// Instead of the scene's mirrors: files, as placed, and built-in shapes, where the teapot stands.
    pub mirrors: Vec<String>,
    /// What stands for the mirrors, in their order: files, in the mirror's own space, and built-in shapes, as large as
    /// the mirror. Replaces the scene's.
    pub proxies: Vec<String>,
    /// Instead of the scene's objects: files, as placed, and built-in shapes, beside the teapot.
    pub objects: Vec<String>,
    /// Instead of the scene's: a panorama's file, mounted as it is.
    pub environment: Option<PathBuf>,
    /// Instead of the scene's.
    pub eye: Option<DVec3>,
    /// Instead of the scene's.
    pub target: Option<DVec3>,
    /// Instead of the scene's; vertical, degrees.
    pub fov_y_deg: Option<f64>,
}

/// A mirror stands at the origin with this bounding-box diagonal.
/// As `--proxy`: this mirror has none.
const NO_PROXY: &str = "none";
const MIRROR_DIAGONAL: f64 = 2.0;
/// Objects have this bounding-box diagonal, and the first stands here.
const OBJECT_DIAGONAL: f64 = 1.2;
const BESIDE: DVec3 = DVec3::new(0.74, 0.0, 0.50);
/// The eye of scenes without their own.
const EYE: DVec3 = DVec3::new(-0.6, 0.9, 2.9);
const TARGET: DVec3 = DVec3::new(0.2, 0.35, 0.0);
/// Colours of models without their own, in turn (untuned).
const MODEL_COLORS: [Vec3; 4] = [
    Vec3::new(0.75, 0.25, 0.10),
    Vec3::new(0.08, 0.40, 0.42),
    Vec3::new(0.80, 0.55, 0.10),
    Vec3::new(0.35, 0.12, 0.40),
];

/// Makes the scene.
///
/// # Errors
/// [`Error::Input`] names the input, file or option that is wrong; [`Error::Cancelled`].
pub fn scene(request: &Request, cx: &Context) -> Result<Scene> {
    let mut library = Library::new(cx);
    let mut scene = base(request, &mut library, cx)?;
    if !request.mirrors.is_empty() {
        scene.mirrors.clear();
    }
    if !request.objects.is_empty() {
        scene.objects.clear();
    }
    for input in &request.mirrors {
        let spot = (MIRROR_DIAGONAL, DVec3::ZERO);
        let Placed { mesh, source, transform, name } =
            placed("--mirror", input, spot, &mut library)?;
        let name = new_name(&scene, &name);
        scene.mirrors.push(Mirror { name, mesh, source, transform, tint: Vec3::ONE, proxy: None });
    }
    for input in &request.objects {
        let spot = (OBJECT_DIAGONAL, BESIDE);
        let Placed { mesh, source, transform, name } =
            placed("--object", input, spot, &mut library)?;
        let (name, paint) = (new_name(&scene, &name), plain_paint(&mesh));
        scene.objects.push(Object { name, mesh, source, transform, paint, density: 1.0 });
    }
    let count = scene.mirrors.len();
    for (i, input) in request.proxies.iter().enumerate() {
        let Some(mirror) = scene.mirrors.get_mut(i) else {
            let problem = format!("there are more of them than mirrors ({count})");
            return Err(Error::input("--proxy", "", problem, "give one a mirror at most"));
        };
        if input == NO_PROXY {
            continue;
        }
        mirror.proxy = Some(library.proxy(input, &mirror.mesh, |problem, remedy| {
            Error::input("--proxy", "", problem, format!("{remedy}; files end in .obj or .ply"))
        })?);
    }
    if let Some(panorama) = &request.environment {
        scene.environment = load::environment(panorama, Mounting::default(), cx)?;
    }
    override_eye(&mut scene.eye, request)?;
    Ok(scene)
}

/// The scene before `--mirror`, `--object` and the eye's options.
fn base(request: &Request, library: &mut Library, cx: &Context) -> Result<Scene> {
    let models = request.inputs.iter().filter(|i| load::is_mesh(Path::new(i))).count();
    match &request.inputs[..] {
        [] if request.mirrors.is_empty() && request.objects.is_empty() => named("default", cx),
        [] => {
            let mut scene = bare("placed");
            if request.mirrors.is_empty() {
                scene.mirrors.push(teapot(library)?);
            }
            Ok(scene)
        }
        inputs if models == inputs.len() => {
            if !request.objects.is_empty() {
                let remedy = "give all models as inputs, or all with --object";
                return Err(Error::input("--object", "", "would replace the given models", remedy));
            }
            beside_teapot(inputs, library)
        }
        [input] => named(input, cx),
        [first, ..] => {
            let remedy = "give a single scene, or only models (.obj, .ply)";
            Err(Error::input(first, "", "is given together with other inputs", remedy))
        }
    }
}

/// A built-in scene or a scene file.
fn named(input: &str, cx: &Context) -> Result<Scene> {
    let path = Path::new(input);
    if let Some(text) = builtin::scene_text(input) {
        return file::parse(text, input, Path::new(""), cx);
    }
    if load::extension(path).as_deref() == Some("toml") {
        return file::read(path, cx);
    }
    let problem = "is neither a built-in scene nor a scene file (.toml) nor a model (.obj, .ply)";
    let scenes = builtin::SCENES.join(", ");
    let remedy = if builtin::SHAPES.contains(&input) {
        format!("use the shape with --mirror or --object; the built-in scenes are {scenes}")
    } else {
        format!("the built-in scenes are {scenes}")
    };
    Err(Error::input(input, "", problem, remedy))
}

/// No mirrors or objects, only sky and light.
fn bare(name: &str) -> Scene {
    let fov_y = DEFAULT_FOV_Y_DEG.to_radians();
    Scene {
        name: name.to_owned(),
        eye: EyeDescription { position: EYE, target: TARGET, up: DVec3::Y, fov_y },
        mirrors: Vec::new(),
        objects: Vec::new(),
        environment: DEFAULT_SKY,
        light: default_light(),
    }
}

/// The mirror where none is asked for.
fn teapot(library: &mut Library) -> Result<Mirror> {
    let spot = (MIRROR_DIAGONAL, DVec3::ZERO);
    let Placed { mesh, source, transform, name } = placed("--mirror", "teapot", spot, library)?;
    Ok(Mirror { name, mesh, source, transform, tint: Vec3::ONE, proxy: None })
}

/// What becomes a mirror or an object.
struct Placed {
    mesh: Arc<Mesh>,
    source: Option<Source>,
    transform: Similarity,
    /// Plain: others may have it, too.
    name: String,
}

/// A file as placed, or a built-in shape with a diagonal and base.
fn placed(
    option: &str,
    input: &str,
    (diagonal, base): (f64, DVec3),
    library: &mut Library,
) -> Result<Placed> {
    let path = Path::new(input);
    if !builtin::SHAPES.contains(&input) && (load::is_mesh(path) || path.exists()) {
        let (mesh, source) = library.file(path)?;
        let (transform, name) = (Similarity::IDENTITY, stem(path));
        return Ok(Placed { mesh, source: Some(source), transform, name });
    }
    let (mesh, source) = library.shape(input, None, |problem, remedy| {
        Error::input(option, "", problem, format!("{remedy}; files end in .obj or .ply"))
    })?;
    let transform = fit(&mesh, DQuat::IDENTITY, diagonal, base);
    Ok(Placed { mesh, source: Some(source), transform, name: input.to_owned() })
}

/// A name that nothing in the scene has.
fn new_name(scene: &Scene, plain: &str) -> String {
    let mirrors = scene.mirrors.iter().map(|m| m.name.clone());
    let taken: Vec<String> = mirrors.chain(scene.objects.iter().map(|o| o.name.clone())).collect();
    unique(plain, &taken)
}

/// The teapot on a checkered ground, with models around it.
fn beside_teapot(models: &[String], library: &mut Library) -> Result<Scene> {
    let mut scene = bare(&stem(Path::new(&models[0])));
    let mirror = teapot(library)?;
    let mut discs = vec![Disc::around(&mirror.mesh, &mirror.transform)];
    scene.mirrors.push(mirror);

    for (i, model) in models.iter().enumerate() {
        let path = Path::new(model);
        let (mesh, source) = library.file(path)?;
        let source = Some(source);
        let mut transform = fit(&mesh, DQuat::IDENTITY, OBJECT_DIAGONAL, BESIDE);
        let mut disc = Disc::around(&mesh, &transform);
        if i > 0 {
            disc.center = free_spot(disc.radius, &discs);
            transform.translation += disc.center - BESIDE;
        }
        discs.push(disc);
        let paint = match plain_paint(&mesh) {
            Paint::Vertex => Paint::Vertex,
            _ => Paint::Constant(MODEL_COLORS[i % MODEL_COLORS.len()]),
        };
        let name = new_name(&scene, &stem(path));
        scene.objects.push(Object { name, mesh, source, transform, paint, density: 1.0 });
    }
    let things = scene.objects.iter().map(|o| (&o.mesh, &o.transform));
    let boxes: Vec<_> = things.map(|(mesh, transform)| world_bounds(mesh, transform)).collect();
    scene.eye = stepped_back(scene.eye, &boxes);

    let far = discs.iter().map(|d| d.center.length() + d.radius).fold(0.0, f64::max);
    let ground = ground(GROUND_SHARE * far, library)?;
    scene.objects.push(Object { name: new_name(&scene, "ground"), ..ground });
    Ok(scene)
}

/// The ground reaches so much farther than what stands on it.
const GROUND_SHARE: f64 = 2.0;
/// Length of two of its tiles, world units.
const GROUND_PERIOD: f64 = 0.5;

#[expect(clippy::cast_possible_truncation, reason = "a length in a pattern")]
fn narrow(x: f64) -> f32 {
    x as f32
}

/// The checkered ground, grown if it would end less than `radius` from the origin.
fn ground(radius: f64, library: &mut Library) -> Result<Object> {
    let (mesh, source) = library.shape("ground", None, |p, r| Error::input("ground", "", p, r))?;
    let half = f64::from(mesh.bounds().extent().x.min(mesh.bounds().extent().z)) * 0.5;
    let transform = Similarity { scale: (radius / half).max(1.0), ..Similarity::IDENTITY };
    let colors = [Vec3::splat(0.72), Vec3::new(0.16, 0.17, 0.20)];
    let period = narrow(GROUND_PERIOD / transform.scale);
    let paint = Paint::Pattern { kind: PatternKind::Checker, colors, period };
    let source = Some(source);
    Ok(Object { name: String::new(), mesh, source, transform, paint, density: 1.0 })
}

/// What a thing stands on: y is 0.
#[derive(Clone, Copy)]
struct Disc {
    center: DVec3,
    radius: f64,
}

impl Disc {
    fn around(mesh: &Mesh, transform: &Similarity) -> Self {
        let (min, max) = world_bounds(mesh, transform);
        let flat = DVec3::new(1.0, 0.0, 1.0);
        Self { center: 0.5 * (min + max) * flat, radius: 0.5 * ((max - min) * flat).length() }
    }
}

/// The first place around the teapot where a disc touches no other: on rings from the inside out, on each
/// from the sides that the eye sees to the back, and not between eye and teapot.
fn free_spot(radius: f64, discs: &[Disc]) -> DVec3 {
    let to_eye = EYE.z.atan2(EYE.x);
    // Rings 0.15 apart, 16 places on each; the quarter towards the eye stays free. Discs of bounded size
    // leave room on some ring.
    (4..)
        .flat_map(|ring| (2..=14).map(move |step| (f64::from(ring) * 0.15, step)))
        .map(|(ring, step)| {
            // 2, 14, 3, 13, …: left and right in turn.
            let turn = if step % 2 == 0 { 1 + step / 2 } else { 15 - step / 2 };
            let angle = to_eye + TAU * f64::from(turn) / 16.0;
            DVec3::new(ring * angle.cos(), 0.0, ring * angle.sin())
        })
        .find(|&p| discs.iter().all(|d| (d.center - p).length() >= d.radius + radius))
        .unwrap_or(BESIDE)
}

/// Moves the eye back along its view until the boxes are in a picture of 4:3 or wider.
fn stepped_back(eye: EyeDescription, boxes: &[(DVec3, DVec3)]) -> EyeDescription {
    let forward = (eye.target - eye.position).normalize_or(DVec3::NEG_Z);
    let right = forward.cross(eye.up).normalize_or(DVec3::X);
    let up = right.cross(forward);
    let tan_y = (0.5 * eye.fov_y).tan();
    let tan_x = tan_y * 4.0 / 3.0;
    let distance = |&(min, max): &(DVec3, DVec3)| {
        let corner = |i: u32| {
            let side = |bit: u32, min: f64, max: f64| if i >> bit & 1 == 0 { min } else { max };
            let p = DVec3::new(side(0, min.x, max.x), side(1, min.y, max.y), side(2, min.z, max.z));
            let p = p - eye.target;
            (p.dot(right).abs() / tan_x).max(p.dot(up).abs() / tan_y) - p.dot(forward)
        };
        (0..8).map(corner).fold(0.0, f64::max)
    };
    let now = (eye.target - eye.position).length();
    let needed = boxes.iter().map(distance).fold(now, f64::max);
    EyeDescription { position: eye.target - forward * needed, ..eye }
}

/// Applies `--eye`, `--target` and `--fov`.
fn override_eye(eye: &mut EyeDescription, request: &Request) -> Result<()> {
    for (option, given, place) in
        [("--eye", request.eye, &mut eye.position), ("--target", request.target, &mut eye.target)]
    {
        if let Some(point) = given {
            if !point.abs().cmple(DVec3::splat(1e15)).all() {
                let remedy = "give three numbers such as 0,1,3";
                return Err(Error::input(option, "", "is not finite, or beyond 1e15", remedy));
            }
            *place = point;
        }
    }
    if let Some(degrees) = request.fov_y_deg {
        if !(degrees > 0.0 && degrees < 180.0) {
            let problem = format!("{degrees} degrees are not between 0 and 180");
            return Err(Error::input("--fov", "", problem, "give a value such as 45"));
        }
        eye.fov_y = degrees.to_radians();
    }
    let option = if request.eye.is_some() { "--eye" } else { "--target" };
    let Some(view) = (eye.target - eye.position).try_normalize() else {
        let problem = format!("the eye and its target coincide at {}", eye.target);
        return Err(Error::input(option, "", problem, "move one of them"));
    };
    // Straight up or down: any other up will do.
    if view.cross(eye.up.normalize_or(DVec3::Y)).length() < PARALLEL {
        eye.up = if eye.up.z.abs() > 0.5 * eye.up.length() { DVec3::Y } else { DVec3::NEG_Z };
    }
    Ok(())
}

#[cfg(test)]
mod tests;
