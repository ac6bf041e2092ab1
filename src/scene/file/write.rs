//! From [`Scene`] to the text of a scene file.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::path::Path;

use glam::{DQuat, DVec3, Vec3};
use serde::Serialize;
use toml::ser::ValueSerializer;

use super::grammar::SceneTable;
use super::{DEFAULT_FOV_Y_DEG, DEFAULT_SKY, LIGHT_GREY, Text, default_light, names};
use crate::error::{Error, Result};
use crate::geometry::{Mesh, Similarity};
use crate::image::io::write_bytes;
use crate::scene::description::{
    Environment, Mirror, Object, Paint, PatternKind, Proxy, Scene, Source,
};
use crate::scene::environment::image::Mounting;
use crate::scene::load::linear_from_srgb;

/// Writes a scene file, whole or not at all.
///
/// # Errors
/// As [`to_toml`], and if the file cannot be written.
pub fn write(scene: &Scene, path: &Path) -> Result<()> {
    write_bytes(path, to_toml(scene)?.as_bytes())
}

/// The text that [`parse`](super::parse) makes the same scene of: transforms to a few roundings of f64, the direction to
/// the sun to one of f32. What is as it is by default is left out; files are named by their absolute paths. Vertex
/// colours of a mesh that has none are white, and are written as that.
///
/// # Errors
/// [`Error::Input`] if a mesh has no source, or a file's path is not Unicode, or if the scene is none that a file could
/// describe (a name is empty or used twice, there is no mirror, a number is not in its range).
pub fn to_toml(scene: &Scene) -> Result<String> {
    let mut out = Lines(String::new());
    out.entry("name", &scene.name);
    out.eye(scene);
    if scene.light != default_light() {
        out.table("[light]");
        out.entry("to_sun", &scene.light.to_sun.to_array().map(short));
        out.entry("sun", &Color::new(scene.light.sun));
        out.entry("ambient", &Color::new(scene.light.ambient));
    }
    out.environment(&scene.environment)?;
    for mirror in &scene.mirrors {
        let Mirror { name, mesh: _, source, transform, tint, proxy } = mirror;
        out.table("[[mirror]]");
        out.entry("name", name);
        out.source(name, source.as_ref())?;
        if *tint != Vec3::ONE {
            out.entry("tint", &Color::new(*tint));
        }
        out.proxy(name, proxy.as_ref())?;
        out.transform(transform, source.as_ref());
    }
    for object in &scene.objects {
        let Object { name, mesh, points: _, source, transform, paint, density } = object;
        out.table("[[object]]");
        out.entry("name", name);
        out.source(name, source.as_ref())?;
        if *density != 1.0 {
            out.entry("density", density);
        }
        out.paint(paint, mesh, source.as_ref());
        out.transform(transform, source.as_ref());
    }
    check(&out.0)?;
    Ok(out.0)
}

/// Whether the grammar knows the text, without reading its meshes.
fn check(text: &str) -> Result<()> {
    const NAME: &str = "the scene";
    let refused = |problem: &str| Error::input(NAME, "", problem, "correct it");
    let table: SceneTable = toml::from_str(text).map_err(|e| refused(e.message().trim()))?;
    if table.mirror.is_empty() {
        return Err(refused("has no mirror"));
    }
    let text = Text { text, name: NAME, folder: Path::new("") };
    text.eye(&table.eye)?;
    names(&text, &table).map(|_| ())
}

/// The text as far as it was written.
struct Lines(String);

impl Lines {
    fn table(&mut self, header: &str) {
        writeln!(self.0, "\n{header}").expect("strings grow");
    }

    fn entry(&mut self, key: &str, value: &impl Serialize) {
        write!(self.0, "{key} = ").expect("strings grow");
        value.serialize(ValueSerializer::new(&mut self.0)).expect("it has a form in TOML");
        self.0.push('\n');
    }

    fn eye(&mut self, scene: &Scene) {
        let eye = scene.eye;
        self.table("[eye]");
        self.entry("position", &plain(eye.position));
        self.entry("target", &plain(eye.target));
        if eye.up != DVec3::Y {
            self.entry("up", &plain(eye.up));
        }
        let fov = degrees(eye.fov_y);
        if fov != DEFAULT_FOV_Y_DEG {
            self.entry("fov_y_deg", &fov);
        }
    }

    fn environment(&mut self, environment: &Environment) -> Result<()> {
        if *environment == DEFAULT_SKY {
            return Ok(());
        }
        self.table("[environment]");
        match environment {
            &Environment::Constant(color) => {
                self.entry("kind", &"constant");
                self.entry("color", &Color::new(color));
            }
            Environment::Image(image) => {
                const NAME: &str = "the environment";
                let refused = |problem: &str, remedy: &str| Error::input(NAME, "", problem, remedy);
                let remedy = "save its picture to a file, and make the scene with that";
                let path = image.source.as_ref();
                let path = path.ok_or_else(|| refused("its picture comes from no file", remedy))?;
                let path = path.to_str().ok_or_else(|| {
                    refused("the path of its file is not Unicode", "rename the file")
                })?;
                self.entry("kind", &"image");
                self.entry("file", &path);
                let Mounting { rotate_deg, exposure } = image.mounting();
                for (key, value) in [("rotate_deg", rotate_deg), ("exposure", exposure)] {
                    if value != 0.0 {
                        self.entry(key, &value);
                    }
                }
            }
            &Environment::Sky { zenith, horizon, ground } => {
                self.entry("kind", &"sky");
                self.entry("zenith", &Color::new(zenith));
                self.entry("horizon", &Color::new(horizon));
                self.entry("ground", &Color::new(ground));
            }
        }
        Ok(())
    }

    fn source(&mut self, name: &str, source: Option<&Source>) -> Result<()> {
        let refused = |problem: &str, remedy: &str| Err(Error::input(name, "", problem, remedy));
        match source {
            None => {
                let remedy = "save its mesh to a file, and make the scene with that";
                return refused("its mesh comes from no file and is no built-in shape", remedy);
            }
            Some(Source::File { path, part, own: _ }) => {
                let Some(path) = path.to_str() else {
                    return refused("the path of its file is not Unicode", "rename the file");
                };
                self.entry("file", &path);
                if let Some(part) = part {
                    self.entry("part", part);
                }
            }
            Some(Source::Shape { name, triangles }) => {
                self.entry("shape", name);
                if let Some(triangles) = *triangles {
                    self.entry("triangles", &i64::try_from(triangles).unwrap_or(i64::MAX));
                }
            }
        }
        Ok(())
    }

    fn proxy(&mut self, mirror: &str, proxy: Option<&Proxy>) -> Result<()> {
        match proxy.map(|p| &p.source) {
            None => Ok(()),
            Some(Some(Source::Shape { name, .. })) => {
                self.entry("proxy", name);
                Ok(())
            }
            Some(Some(Source::File { path, .. })) if path.to_str().is_some() => {
                self.entry("proxy", &path.to_str());
                Ok(())
            }
            Some(_) => {
                let problem = "its proxy comes from no file and is no built-in shape";
                Err(Error::input(mirror, "", problem, "leave the proxy out"))
            }
        }
    }

    fn paint(&mut self, paint: &Paint, mesh: &Mesh, source: Option<&Source>) {
        #[derive(Serialize)]
        struct Pattern {
            kind: &'static str,
            colors: [Color; 2],
            period: f64,
        }
        match *paint {
            // They come with the mesh.
            Paint::Materials(_) => {}
            Paint::Vertex if !mesh.colors().is_empty() => {}
            Paint::Vertex => self.entry("color", &Color::new(Vec3::ONE)),
            Paint::Constant(LIGHT_GREY) if matches!(source, Some(Source::Shape { .. })) => {}
            Paint::Constant(color) => self.entry("color", &Color::new(color)),
            Paint::Pattern { kind, colors, period } => {
                let kind = match kind {
                    PatternKind::Checker => "checker",
                    PatternKind::Stripes => "stripes",
                    PatternKind::Rings => "rings",
                };
                let colors = colors.map(Color::new);
                self.entry("pattern", &Pattern { kind, colors, period: short(period) });
            }
        }
    }

    fn transform(&mut self, transform: &Similarity, source: Option<&Source>) {
        #[derive(Serialize)]
        struct Rotation {
            axis: [f64; 3],
            angle: f64,
        }
        // Where its file puts it comes with the file.
        let own = source.map_or(Similarity::IDENTITY, Source::own);
        let rest =
            if own == Similarity::IDENTITY { *transform } else { own.inverse().then(transform) };
        let Similarity { rotation, translation, scale } = rest;
        if let Some((axis, angle)) = axis_angle(rotation) {
            self.entry("rotate_deg", &Rotation { axis: plain(axis), angle: degrees(angle) });
        }
        if scale != 1.0 {
            self.entry("scale", &scale);
        }
        if translation != DVec3::ZERO {
            self.entry("translate", &plain(translation));
        }
    }
}

/// A colour as a file has it.
#[derive(Serialize)]
#[serde(untagged)]
enum Color {
    Linear([f64; 3]),
    Srgb(String),
}

impl Color {
    /// In sRGB where that is exact.
    fn new(linear: Vec3) -> Self {
        let byte = |v: f32| (0..=255u8).find(|b| linear_from_srgb(f32::from(*b) / 255.0) == v);
        match linear.to_array().map(byte) {
            [Some(r), Some(g), Some(b)] => Self::Srgb(format!("#{r:02x}{g:02x}{b:02x}")),
            _ => Self::Linear(linear.to_array().map(short)),
        }
    }
}

/// The number with the fewest decimals that is rounded to this one.
#[expect(clippy::cast_possible_truncation, reason = "what reading does")]
fn short(x: f32) -> f64 {
    let short = x.to_string().parse().unwrap_or(f64::from(x));
    if short as f32 == x { short } else { x.into() }
}

/// Without negative zeros.
fn plain(v: DVec3) -> [f64; 3] {
    (v + DVec3::ZERO).to_array()
}

/// Decimals of a degree that people write.
const WRITTEN: f64 = 1e9;
/// Roundings, as a share of the value, that reading back does not show.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// An angle in degrees, with few decimals where these say the same.
fn degrees(radians: f64) -> f64 {
    let exact = radians.to_degrees();
    let written = (exact * WRITTEN).round() / WRITTEN;
    if (written - exact).abs() <= ROUNDING * exact.abs() { written } else { exact }
}

/// Unit axis, whose largest coordinate is positive, and angle in radians from -π to π; `None` if nothing is turned.
fn axis_angle(rotation: DQuat) -> Option<(DVec3, f64)> {
    let v = DVec3::new(rotation.x, rotation.y, rotation.z);
    let axis = v.try_normalize()?;
    // Exact for small angles, too, where an arc cosine is not.
    let angle = 2.0 * v.length().atan2(rotation.w);
    let angle = if angle > PI { angle - TAU } else { angle };
    let [x, y, z] = axis.to_array();
    let largest =
        [x, y, z].into_iter().fold(0.0, |m: f64, c| if c.abs() > m.abs() { c } else { m });
    Some(if largest < 0.0 { (-axis, -angle) } else { (axis, angle) })
}

#[cfg(test)]
#[path = "write_tests.rs"]
mod tests;
