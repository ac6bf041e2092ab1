//! Scene files: TOML to [`Scene`], and back ([`to_toml`]). The grammar is in `grammar.rs`; unknown keys are errors.
//!
//! ```toml
//! name = "default"
//! [eye]                              # all needed but up and fov_y_deg
//! position = [0, 1, 3]
//! target = [0, 0.4, 0]
//! up = [0, 1, 0]
//! fov_y_deg = 45.0
//! [light]                            # optional, as is each key
//! to_sun = [0.4, 0.8, 0.45]          # any length
//! sun = [0.9, 0.85, 0.75]
//! ambient = "#9ca8bc"
//! [environment]                      # optional; or kind = "constant" and color, or kind = "image" (see below)
//! kind = "sky"
//! zenith = [0.1, 0.3, 0.7]
//! horizon = [0.7, 0.8, 0.95]
//! ground = [0.2, 0.18, 0.16]
//! [[mirror]]                         # at least one
//! name = "pot"                       # by default the shape or the file's name
//! shape = "teapot"                   # or file = "pot.ply", relative to the scene file; and part = "lid", if not all of it
//! triangles = 4000                   # of shapes only
//! tint = [1, 1, 1]
//! fit = { diagonal = 2, base = [0, 0, 0] }
//! [[object]]
//! file = "bunny.ply"
//! density = 1.0                      # surfels per area, relative to other objects
//! pattern = { kind = "checker", colors = ["#ffffff", "#222222"], period = 0.25 }
//! rotate_deg = { axis = [0, 1, 0], angle = 30 }
//! scale = 0.5                        # x becomes rotation · (scale · x) + translate
//! translate = [1, 0, 0]
//! ```
//!
//! Colours are `[r, g, b]` in linear light or "#rrggbb" in sRGB. An object has a `color` or a `pattern`
//! ("checker", "stripes" or "rings"; the period is in local units), or else its vertex colours, or else it is
//! light grey. An environment of the kind "image" is a panorama (`file`, relative to the scene file; equirectangular HDR, EXR,
//! PNG or JPEG), turned by `rotate_deg` about y and made 2 to the power of `exposure` times as bright; see
//! [`Mounting`]. Instead of `scale` and `translate`, `fit` gives the diagonal of the bounding box after the
//! rotation and where the middle of its bottom lies.

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3, Vec3};
use toml::Spanned;

use super::builtin;
use super::description::{
    Environment, EyeDescription, Light, Mirror, Object, Paint, PatternKind, Proxy, Scene,
};
use super::environment::image::Mounting;
use super::fit::fit;
use super::library::{Found, Library, stem, unique};
use super::load::{self, Nearby, ReadOptions};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::{Mesh, Similarity};

mod grammar;
mod write;

pub use write::{to_toml, write};

use grammar::{
    Color, EnvironmentName, EnvironmentTable, EyeTable, FitTable, LightTable, MirrorTable, Name,
    ObjectTable, PatternName, Point, Positive, RotationTable, SceneTable, Triangles,
};

/// Of objects that say nothing else.
pub(super) const LIGHT_GREY: Vec3 = Vec3::splat(0.7);
/// Vertical, degrees, where nothing else is said.
pub(super) const DEFAULT_FOV_Y_DEG: f64 = 45.0;
/// The sky where nothing else is said (untuned).
pub(super) const DEFAULT_SKY: Environment = Environment::Sky {
    zenith: Vec3::new(0.10, 0.28, 0.68),
    horizon: Vec3::new(0.70, 0.82, 0.95),
    ground: Vec3::new(0.22, 0.20, 0.18),
};

/// The light where nothing else is said (untuned): a warm sun over the viewer's shoulder, a blue sky.
pub(super) fn default_light() -> Light {
    Light {
        to_sun: Vec3::new(0.4, 0.8, 0.45).normalize_or(Vec3::Y),
        sun: Vec3::new(0.90, 0.85, 0.75),
        ambient: Vec3::new(0.33, 0.36, 0.42),
    }
}

/// Reads a scene file.
///
/// # Errors
/// As [`parse`], and if the file cannot be read.
pub fn read(path: &Path, options: &ReadOptions, cx: &Context) -> Result<Scene> {
    let bytes = load::bytes(path)?;
    let Ok(text) = str::from_utf8(&bytes) else {
        return Err(Error::file(path, "", "is not a text file in UTF-8", "give a scene file"));
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    parse(text, &path.display().to_string(), folder, options, cx)
}

/// Makes the scene that a text describes. `name` stands for the text in errors; files that it names are
/// relative to `folder`.
///
/// # Errors
/// [`Error::Input`] with the line if the text is not a scene, or from a mesh file; [`Error::Cancelled`].
pub fn parse(
    text: &str,
    name: &str,
    folder: &Path,
    options: &ReadOptions,
    cx: &Context,
) -> Result<Scene> {
    let source = Text { text, name, folder };
    let table: SceneTable = toml::from_str(text).map_err(|e| {
        let message = e.message().trim().replace('\n', " ");
        source.error(e.span().map_or(0, |s| s.start), message, "correct this line")
    })?;
    if table.mirror.is_empty() {
        let remedy = "add one, such as: [[mirror]] shape = \"teapot\"";
        return Err(Error::input(name, "", "has no mirror", remedy));
    }

    let mut library = Library::new(*options, cx);
    let mut names = names(&source, &table)?.into_iter();
    let mut next_name = || names.next().unwrap_or_default();
    let mut mirrors = Vec::new();
    for spanned in &table.mirror {
        let at = spanned.span().start;
        let table = spanned.get_ref();
        let found = source.thing(at, Thing::from(table), &mut library)?.mirror()?;
        mirrors.push(Mirror {
            name: next_name(),
            transform: source.transform(at, &Thing::from(table), &found)?,
            proxy: source.proxy(at, table.proxy.as_deref(), &found.mesh, &mut library)?,
            mesh: found.mesh,
            source: Some(found.source),
            tint: table.tint.map_or(Vec3::ONE, |c| c.0),
        });
    }
    let mut objects = Vec::new();
    for spanned in &table.object {
        let at = spanned.span().start;
        let table = spanned.get_ref();
        let found = source.thing(at, Thing::from(table), &mut library)?;
        objects.push(Object {
            name: next_name(),
            transform: source.transform(at, &Thing::from(table), &found)?,
            paint: source.paint(at, table, &found)?,
            density: table.density.map_or(1.0, |d| d.0),
            mesh: found.mesh,
            points: found.points,
            source: Some(found.source),
        });
    }
    Ok(Scene {
        name: table.name.map_or_else(|| stem(Path::new(name)), |n| n.0),
        eye: source.eye(&table.eye)?,
        mirrors,
        objects,
        environment: source.environment(table.environment.as_ref(), &library)?,
        light: light(table.light.unwrap_or_default()),
        notes: library.notes,
    })
}

/// The paint of what brings none.
pub(super) fn plain_paint(found: &Found) -> Paint {
    found.paint.clone().unwrap_or(Paint::Constant(LIGHT_GREY))
}

/// A name for each mirror, then for each object, all different.
fn names(source: &Text, table: &SceneTable) -> Result<Vec<String>> {
    let mirrors = table.mirror.iter().map(|m| (m.span().start, Thing::from(m.get_ref())));
    let objects = table.object.iter().map(|o| (o.span().start, Thing::from(o.get_ref())));
    let things: Vec<(usize, Thing)> = mirrors.chain(objects).collect();
    // The given names come first: the others give way.
    let mut taken: Vec<String> = Vec::new();
    for (at, thing) in &things {
        if let Some(Name(name)) = thing.name {
            if taken.contains(name) {
                let problem = format!("the name \"{name}\" is used twice");
                return Err(source.error(*at, problem, "give each mirror and object its own name"));
            }
            taken.push(name.clone());
        }
    }
    let mut names = Vec::new();
    for (_, thing) in &things {
        names.push(match (thing.name, thing.shape, thing.file) {
            (Some(Name(name)), ..) => name.clone(),
            (None, shape, file) => {
                let plain = shape.or(thing.part).cloned();
                let plain = plain.or_else(|| Some(stem(Path::new(file?))));
                let name = unique(&plain.unwrap_or_default(), &taken);
                taken.push(name.clone());
                name
            }
        });
    }
    Ok(names)
}

fn light(table: LightTable) -> Light {
    let default = default_light();
    Light {
        to_sun: table.to_sun.map_or(default.to_sun, |d| d.0.as_vec3()),
        sun: table.sun.map_or(default.sun, |c| c.0),
        ambient: table.ambient.map_or(default.ambient, |c| c.0),
    }
}

/// What mirrors and objects have in common.
struct Thing<'a> {
    name: Option<&'a Name>,
    shape: Option<&'a String>,
    file: Option<&'a String>,
    part: Option<&'a String>,
    triangles: Option<Triangles>,
    rotate_deg: Option<&'a RotationTable>,
    scale: Option<Positive>,
    translate: Option<Point>,
    fit: Option<&'a FitTable>,
}

macro_rules! thing_from {
    ($table:ty) => {
        impl<'a> From<&'a $table> for Thing<'a> {
            fn from(table: &'a $table) -> Self {
                Self {
                    name: table.name.as_ref(),
                    shape: table.shape.as_ref(),
                    file: table.file.as_ref(),
                    part: table.part.as_ref(),
                    triangles: table.triangles,
                    rotate_deg: table.rotate_deg.as_ref(),
                    scale: table.scale,
                    translate: table.translate,
                    fit: table.fit.as_ref(),
                }
            }
        }
    };
}
thing_from!(MirrorTable);
thing_from!(ObjectTable);

/// The text and where it comes from.
#[derive(Clone, Copy)]
struct Text<'a> {
    text: &'a str,
    name: &'a str,
    folder: &'a Path,
}

impl Text<'_> {
    /// An error at a byte of the text.
    fn error(&self, at: usize, problem: impl Into<String>, remedy: impl Into<String>) -> Error {
        Error::input(self.name, format!("line {}", self.line(at)), problem, remedy)
    }

    /// The line of a byte of the text.
    fn line(&self, at: usize) -> usize {
        let before = &self.text.as_bytes()[..at.min(self.text.len())];
        1 + before.iter().filter(|&&b| b == b'\n').count()
    }

    fn eye(&self, table: &Spanned<EyeTable>) -> Result<EyeDescription> {
        let at = table.span().start;
        let EyeTable { position, target, up, fov_y_deg } = table.get_ref();
        let eye = EyeDescription {
            position: position.0,
            target: target.0,
            up: up.map_or(DVec3::Y, |d| d.0),
            fov_y: fov_y_deg.map_or(DEFAULT_FOV_Y_DEG, |f| f.0).to_radians(),
        };
        let Some(view) = (eye.target - eye.position).try_normalize() else {
            return Err(self.error(at, "the eye's position and target coincide", "move one"));
        };
        if view.cross(eye.up).length() < PARALLEL {
            return Err(self.error(at, "the eye's up is parallel to its view", "give another up"));
        }
        Ok(eye)
    }

    fn environment(
        &self,
        table: Option<&Spanned<EnvironmentTable>>,
        library: &Library,
    ) -> Result<Environment> {
        let (Some(spanned), Environment::Sky { zenith, horizon, ground }) = (table, DEFAULT_SKY)
        else {
            return Ok(DEFAULT_SKY);
        };
        let error = |problem: &str| self.error(spanned.span().start, problem, "correct this table");
        let table = spanned.get_ref();
        let or = |given: Option<Color>, default| given.map_or(default, |c| c.0);
        let colors = [table.color, table.zenith, table.horizon, table.ground];
        let of_image = table.file.is_some() || table.rotate_deg.or(table.exposure).is_some();
        match (&table.kind, &table.file) {
            (EnvironmentName::Image, Some(Name(file))) if colors.iter().all(Option::is_none) => {
                let mounting = Mounting {
                    rotate_deg: table.rotate_deg.map_or(0.0, |v| v.0),
                    exposure: table.exposure.map_or(0.0, |v| v.0),
                };
                if let Some(problem) = mounting.defect() {
                    return Err(error(&problem));
                }
                let path = self.file(spanned.span().start, file, library)?;
                return load::environment(&path, mounting, library.cx);
            }
            (EnvironmentName::Image, _) => {
                return Err(error("an image has file, rotate_deg and exposure, and no colours"));
            }
            _ if of_image => {
                return Err(error("only kind = \"image\" has file, rotate_deg and exposure"));
            }
            _ => {}
        }
        match (&table.kind, table.color, [table.zenith, table.horizon, table.ground]) {
            (EnvironmentName::Sky, Some(_), _) => {
                Err(error("a sky has zenith, horizon and ground instead of color"))
            }
            (EnvironmentName::Sky, None, [z, h, g]) => Ok(Environment::Sky {
                zenith: or(z, zenith),
                horizon: or(h, horizon),
                ground: or(g, ground),
            }),
            (EnvironmentName::Constant, Some(color), [None, None, None]) => {
                Ok(Environment::Constant(color.0))
            }
            (EnvironmentName::Constant | EnvironmentName::Image, ..) => {
                Err(error("a constant environment has color and nothing else"))
            }
        }
    }

    fn thing(&self, at: usize, thing: Thing, library: &mut Library) -> Result<Found> {
        match (thing.shape, thing.file) {
            (Some(_), None) if thing.part.is_some() => {
                Err(self.error(at, "a built-in shape has no parts", "remove the part"))
            }
            (Some(shape), None) => {
                library.shape(shape, thing.triangles.map(|t| t.0), |problem, remedy| {
                    self.error(at, problem, remedy)
                })
            }
            (None, Some(_)) if thing.triangles.is_some() => {
                Err(self.error(at, "triangles cannot be chosen for a file", "remove that key"))
            }
            (None, Some(file)) => {
                let path = self.file(at, file, library)?;
                match thing.part {
                    Some(part) => library.part(&path, part, |p, r| self.error(at, p, r)),
                    None => library.file(&path),
                }
            }
            (Some(_), Some(_)) => Err(self.error(at, "has both shape and file", "remove one")),
            (None, None) => Err(self.error(at, "has neither shape nor file", "add one of them")),
        }
    }

    /// A file that the text names.
    fn file(&self, at: usize, file: &str, library: &Library) -> Result<PathBuf> {
        let nearby = Nearby { folder: self.folder, outside: library.options.outside };
        nearby.find(file).map_err(|why| {
            let path = self.folder.join(file).display().to_string();
            why.error(self.name, &format!("line {}", self.line(at)), &path)
        })
    }

    /// What stands for a mirror with this mesh.
    fn proxy(
        &self,
        at: usize,
        input: Option<&str>,
        mirror: &Mesh,
        library: &mut Library,
    ) -> Result<Option<Proxy>> {
        let Some(input) = input else { return Ok(None) };
        let is_file = !builtin::SHAPES.contains(&input) && load::is_model(Path::new(input));
        let path = if is_file { Some(self.file(at, input, library)?) } else { None };
        let input = path.as_ref().and_then(|path| path.to_str()).unwrap_or(input);
        library.proxy(input, mirror, |problem, remedy| self.error(at, problem, remedy)).map(Some)
    }

    fn transform(&self, at: usize, thing: &Thing, found: &Found) -> Result<Similarity> {
        let rotation = thing
            .rotate_deg
            .map_or(DQuat::IDENTITY, |r| DQuat::from_axis_angle(r.axis.0, r.angle.0.to_radians()));
        match thing.fit {
            Some(_) if thing.scale.is_some() || thing.translate.is_some() => {
                let problem = "fit already says what scale and translate say";
                Err(self.error(at, problem, "remove fit, or the other two"))
            }
            Some(f) => {
                let things = [(&*found.mesh, found.own())];
                Ok(found.own().then(&fit(&things, rotation, f.diagonal.0, f.base.0)))
            }
            None => Ok(found.own().then(&Similarity {
                rotation,
                translation: thing.translate.map_or(DVec3::ZERO, |t| t.0),
                scale: thing.scale.map_or(1.0, |s| s.0),
            })),
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "the period is f32 by design")]
    fn paint(&self, at: usize, table: &ObjectTable, found: &Found) -> Result<Paint> {
        match (&table.color, &table.pattern) {
            (Some(_), Some(_)) => Err(self.error(at, "has both color and pattern", "remove one")),
            (Some(color), None) => Ok(Paint::Constant(color.0)),
            (None, Some(pattern)) => Ok(Paint::Pattern {
                kind: match pattern.kind {
                    PatternName::Checker => PatternKind::Checker,
                    PatternName::Stripes => PatternKind::Stripes,
                    PatternName::Rings => PatternKind::Rings,
                },
                colors: pattern.colors.0.map(|c| c.0),
                period: pattern.period.0 as f32,
            }),
            (None, None) => Ok(plain_paint(found)),
        }
    }
}

/// Sine of the angle below which two directions count as parallel: as `Eye::new` has it.
pub(super) const PARALLEL: f64 = 1e-6;

#[cfg(test)]
mod tests;
