//! The scene that a command line asks for: a scene, models beside the teapot, or files as placed.

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3, Vec3};

use super::description::{EyeDescription, Mirror, Object, Paint, Scene};
use super::environment::image::Mounting;
use super::file::{self, DEFAULT_FOV_Y_DEG, DEFAULT_SKY, PARALLEL, default_light, plain_paint};
use super::fit::fit;
use super::library::{Found, Library, stem, unique};
use super::load::ReadOptions;
use super::{builtin, load};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::Similarity;

mod models;
mod out_of_view;

/// What the command line says about the scene; all of it may be empty.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// One scene (a built-in name or a `.toml` file), or any number of models (see [`load::EXTENSIONS`]).
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
    /// How files are read.
    pub read: ReadOptions,
}

/// As `--proxy`: this mirror has none.
const NO_PROXY: &str = "none";
/// A mirror stands at the origin with this bounding-box diagonal.
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
    let mut library = Library::new(request.read, cx);
    let mut scene = base(request, &mut library, cx)?;
    if !request.mirrors.is_empty() {
        scene.mirrors.clear();
    }
    if !request.objects.is_empty() {
        scene.objects.clear();
    }
    for input in &request.mirrors {
        let spot = (MIRROR_DIAGONAL, DVec3::ZERO);
        let Placed { found, transform, name } =
            placed("--mirror", input, spot, request, &mut library)?;
        let name = new_name(&scene, &name);
        scene.mirrors.push(mirror(name, found.mirror()?, transform, Vec3::ONE));
    }
    for input in &request.objects {
        let spot = (OBJECT_DIAGONAL, BESIDE);
        let Placed { found, transform, name } =
            placed("--object", input, spot, request, &mut library)?;
        let (name, paint) = (new_name(&scene, &name), plain_paint(&found));
        scene.objects.push(object(name, found, transform, paint));
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
            Error::input("--proxy", "", problem, format!("{remedy}; files end in {}", known()))
        })?);
    }
    if let Some(panorama) = &request.environment {
        scene.environment = load::environment(panorama, Mounting::default(), cx)?;
    }
    override_eye(&mut scene.eye, request)?;
    scene.notes.append(&mut library.notes);
    // Files lie where they lie; who says where the eye is knows.
    if !request.mirrors.is_empty() && request.eye.is_none() && request.target.is_none() {
        scene.notes.extend(out_of_view::note(&scene));
    }
    Ok(scene)
}

/// What models' files end in, for errors.
fn known() -> String {
    let names: Vec<String> = load::EXTENSIONS.iter().map(|e| format!(".{e}")).collect();
    names.join(", ")
}

fn mirror(name: String, found: Found, transform: Similarity, tint: Vec3) -> Mirror {
    let Found { mesh, source, .. } = found;
    Mirror { name, mesh, source: Some(source), transform, tint, proxy: None }
}

fn object(name: String, found: Found, transform: Similarity, paint: Paint) -> Object {
    let Found { mesh, points, source, .. } = found;
    Object { name, mesh, points, source: Some(source), transform, paint, density: 1.0 }
}

/// The scene before `--mirror`, `--object` and the eye's options.
fn base(request: &Request, library: &mut Library, cx: &Context) -> Result<Scene> {
    let models = request.inputs.iter().filter(|i| load::is_model(Path::new(i))).count();
    match &request.inputs[..] {
        [] if request.mirrors.is_empty() && request.objects.is_empty() => {
            named("default", request, cx)
        }
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
            models::scene(request, library)
        }
        [input] => named(input, request, cx),
        [first, ..] => {
            let remedy = format!("give a single scene, or only models ({})", known());
            Err(Error::input(first, "", "is given together with other inputs", remedy))
        }
    }
}

/// A built-in scene or a scene file.
fn named(input: &str, request: &Request, cx: &Context) -> Result<Scene> {
    let path = Path::new(input);
    if let Some(text) = builtin::scene_text(input) {
        return file::parse(text, input, Path::new(""), &request.read, cx);
    }
    if load::extension(path).as_deref() == Some("toml") {
        return file::read(path, &request.read, cx);
    }
    let problem =
        format!("is neither a built-in scene nor a scene file (.toml) nor a model ({})", known());
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
        notes: Vec::new(),
    }
}

/// The mirror where none is asked for.
fn teapot(library: &mut Library) -> Result<Mirror> {
    let found = library.shape("teapot", None, |p, r| Error::input("teapot", "", p, r))?;
    let things = [(&*found.mesh, Similarity::IDENTITY)];
    let transform = fit(&things, DQuat::IDENTITY, MIRROR_DIAGONAL, DVec3::ZERO);
    Ok(mirror("teapot".into(), found, transform, Vec3::ONE))
}

/// What becomes a mirror or an object.
struct Placed {
    found: Found,
    transform: Similarity,
    /// Plain: others may have it, too.
    name: String,
}

/// A file as placed, or a built-in shape with a diagonal and base.
fn placed(
    option: &str,
    input: &str,
    (diagonal, base): (f64, DVec3),
    request: &Request,
    library: &mut Library,
) -> Result<Placed> {
    let path = Path::new(input);
    if !builtin::SHAPES.contains(&input) && (load::is_model(path) || path.exists()) {
        let found = library.file(path)?;
        let turn = Similarity { rotation: request.read.turn(path), ..Similarity::IDENTITY };
        let (transform, name) = (found.own().then(&turn), stem(path));
        return Ok(Placed { found, transform, name });
    }
    let found = library.shape(input, None, |problem, remedy| {
        Error::input(option, "", problem, format!("{remedy}; files end in {}", known()))
    })?;
    let things = [(&*found.mesh, Similarity::IDENTITY)];
    let transform = fit(&things, DQuat::IDENTITY, diagonal, base);
    Ok(Placed { found, transform, name: input.to_owned() })
}

/// A name that nothing in the scene has.
fn new_name(scene: &Scene, plain: &str) -> String {
    let mirrors = scene.mirrors.iter().map(|m| m.name.clone());
    let taken: Vec<String> = mirrors.chain(scene.objects.iter().map(|o| o.name.clone())).collect();
    unique(plain, &taken)
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
