//! What a pixel of the last picture shows.

use eframe::egui::{Color32, ColorImage};
use glam::{DVec3, Vec2, Vec3};

use super::View;
use super::{Side, draw::heat};
use crate::analysis::multiplicity::{MirrorCameras, class_color};
use crate::analysis::{CameraTrace, trace_camera, triangle_costs};
use crate::camera::three_ray::multiplicity::Class;
use crate::camera::{Eye, RayScale};
use crate::context::Context;
use crate::error::Result;
use crate::frame::Renderer;
use crate::image::NONE;
use crate::image::color::linear_to_srgb8;
use crate::methods::{Value, ray_scale};
use crate::paths::{Path, PathFinder, PathOptions, PathScene};
use crate::scene::prepared::PreparedScene;
use crate::visibility::{NONE_ID, RayWeights, Visibility};

/// A question about a pixel of the last picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Probe {
    /// As shares of the picture, from the top left.
    pub(crate) at: Vec2,
    /// It was clicked: what is there gets selected.
    pub(crate) pick: bool,
    /// The camera that draws it is wanted too.
    pub(crate) trace: bool,
    /// All paths of the point that is seen there are wanted too.
    pub(crate) paths: bool,
}

/// Something in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Thing {
    Object(usize),
    Mirror(usize),
}

impl Thing {
    /// Its index among objects, then mirrors.
    pub(crate) fn placement(self, objects: usize) -> usize {
        match self {
            Self::Object(i) => i,
            Self::Mirror(i) => objects + i,
        }
    }
}

/// What a mirror shows at a pixel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reflected {
    /// Triangle within the mirror, and weights of its corners at the pixel's centre.
    pub(crate) triangle: usize,
    pub(crate) weights: [f32; 3],
    /// Of what is reflected; `None` where it is the environment, or not known.
    pub(crate) lambda: Option<f32>,
    pub(crate) object: Option<usize>,
    pub(crate) surfel: Option<u32>,
    pub(crate) images: Option<u32>,
    pub(crate) steps: Option<u32>,
    /// World space.
    pub(crate) position: Option<DVec3>,
    pub(crate) coverage: Option<f32>,
}

/// A way of light from the eye over a mirror to a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeenPath {
    /// Index of the mirror, and of the triangle in it.
    pub(crate) mirror: usize,
    pub(crate) triangle: u32,
    /// Where it meets the mirror, world space.
    pub(crate) mirror_point: DVec3,
    /// From the eye to the point, world units.
    pub(crate) length: f64,
    /// See [`crate::paths::Path::parity`].
    pub(crate) parity: i8,
    pub(crate) near_caustic: bool,
    /// Something is in the way.
    pub(crate) hidden: bool,
}

/// The answer.
#[derive(Clone, Debug)]
pub(crate) struct Probed {
    pub(crate) probe: Probe,
    /// What is seen directly; `None` for the sky.
    pub(crate) thing: Option<Thing>,
    pub(crate) reflected: Option<Reflected>,
    pub(crate) trace: Option<CameraTrace>,
    /// What is seen there, directly or reflected, world space; `None` for the sky.
    pub(crate) point: Option<DVec3>,
    /// Of that point, if they were asked for.
    pub(crate) paths: Vec<SeenPath>,
}

/// Answers it for the picture that `renderer` drew last.
pub(super) fn probe(
    scene: &PreparedScene,
    eye: &Eye,
    view: &View,
    renderer: &Renderer,
    asked: &Probe,
) -> Result<Probed> {
    let visibility = renderer.visibility();
    let mut found = Probed {
        probe: *asked,
        thing: None,
        reflected: None,
        trace: None,
        point: None,
        paths: Vec::new(),
    };
    let size = visibility.size;
    if size != eye.size || !(0.0..1.0).contains(&asked.at.x) || !(0.0..1.0).contains(&asked.at.y) {
        return Ok(found);
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the size")]
    let pixel = [(asked.at.x * size.width as f32) as u32, (asked.at.y * size.height as f32) as u32];
    let at = pixel[1] as usize * size.width as usize + pixel[0] as usize;
    let mirrors = visibility.mirrors();
    found.thing = visibility.locate(visibility.samples[at][0]).map(|(surface, _)| {
        if surface < mirrors { Thing::Mirror(surface) } else { Thing::Object(surface - mirrors) }
    });
    let px = Vec2::new(pixel[0] as f32, pixel[1] as f32) + 0.5;
    let id = visibility.mirror_ids[at];
    if id == NONE_ID {
        found.point = seen_point(scene, eye, visibility, at, px);
        return Ok(found);
    }
    let (_, triangle) = scene.mirror_of(id);
    let corners = scene.mirror_triangle(id).corners;
    let weights = RayWeights::new(eye, corners).at(px.as_dvec2()).unwrap_or_default();
    let mut seen = Reflected { triangle, weights, ..Reflected::default() };
    if let Some(planes) = renderer.planes().filter(|p| p.object.len() == size.pixels()) {
        seen.coverage = Some(planes.coverage[at]);
        if planes.object[at] != NONE {
            let known = |n: u32| (n != NONE).then_some(n);
            seen.object = known(planes.object[at]).map(|n| n as usize);
            seen.surfel = known(planes.surfel[at]);
            seen.images = known(planes.images[at]);
            seen.steps = known(planes.steps[at]);
            seen.lambda = Some(planes.lambda[at]);
            seen.position = Some(Vec3::from(planes.position[at]).as_dvec3());
        }
    }
    found.point = seen.position;
    found.reflected = Some(seen);
    if asked.trace && view.sides[0].method == "c3rc" {
        found.trace = trace_camera(scene, eye, visibility, &view.sides[0].params, pixel)?;
    }
    Ok(found)
}

/// The point of an object that is seen directly at a pixel's centre, world space.
fn seen_point(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    at: usize,
    px: Vec2,
) -> Option<DVec3> {
    let (surface, triangle) = visibility.locate(visibility.samples[at][0])?;
    let object = &scene.objects[surface.checked_sub(visibility.mirrors())?];
    let corners = object.mesh.triangles()[triangle].map(|i| object.positions[i as usize]);
    let [a, b, c] = RayWeights::new(eye, corners).at(px.as_dvec2())?;
    let point = corners[0] * a + corners[1] * b + corners[2] * c;
    Some(point.as_dvec3() + scene.origin)
}

/// All ways of light from the eye of a view to a point (world space).
pub(super) fn paths(scene: &PathScene, view: &View, point: DVec3) -> Result<Vec<SeenPath>> {
    let ray_scale = scale_of(&view.sides[0]);
    let options = PathOptions { ray_scale, ..PathOptions::default() };
    let finder = PathFinder::new(scene, view.eye.position, options)?;
    let seen = |path: &Path| SeenPath {
        mirror: path.mirror as usize,
        triangle: path.triangle,
        mirror_point: path.mirror_point,
        length: path.length,
        parity: path.parity(),
        near_caustic: path.near_caustic(),
        hidden: path.is_occluded(),
    };
    Ok(finder.find(&[point], &Context::default())?.of(0).iter().map(seen).collect())
}

/// The rays of a side's cameras; of other methods those of the standard.
fn scale_of(side: &Side) -> RayScale {
    match side.params.get("ray-scale") {
        Some(Value::Choice(word)) => ray_scale(word),
        _ => RayScale::default(),
    }
}

/// The mirrors coloured by how the rays of each triangle's camera run.
pub(super) fn classes(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    side: &Side,
) -> ColorImage {
    let classes = MirrorCameras::new(scene, eye.position, scale_of(side)).classes();
    let color = |&id: &u32| match id {
        NONE_ID => Color32::TRANSPARENT,
        id => {
            let [r, g, b] = class_color(classes[id as usize]).map(linear_to_srgb8);
            Color32::from_rgb(r, g, b)
        }
    };
    let size = [visibility.size.width as usize, visibility.size.height as usize];
    ColorImage::new(size, visibility.mirror_ids.iter().map(color).collect())
}

/// What each colour of [`classes`] means.
pub(crate) fn class_colors() -> [(Color32, &'static str); 3] {
    let color = |class| {
        let [r, g, b] = class_color(Some(class)).map(linear_to_srgb8);
        Color32::from_rgb(r, g, b)
    };
    [
        (color(Class::Divergent), "rays run only apart"),
        (color(Class::ConvergentThenDivergent), "together, then apart"),
        (color(Class::Mixed), "cross: several images"),
    ]
}

/// Straight lines on the caustic surface of all mirrors, scene space.
pub(super) fn caustic(scene: &PreparedScene, eye: &Eye, side: &Side) -> Vec<[Vec3; 2]> {
    let surface = MirrorCameras::new(scene, eye.position, scale_of(side)).caustic();
    surface.strips.into_iter().flat_map(|strip| strip.rulings).collect()
}

/// The mirrors coloured by the projections that each of their triangles takes in a frame, a pixel that it covers:
/// black for none, white for as many as the most costly hundredth, which comes with it. `None` for methods without cameras.
pub(super) fn costs(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    side: &Side,
) -> Result<Option<(ColorImage, f32)>> {
    if side.method != "c3rc" {
        return Ok(None);
    }
    let projections = triangle_costs(scene, eye, visibility, &side.params)?;
    let mut pixels = vec![0_u32; projections.len()];
    for &id in visibility.mirror_ids.iter().filter(|&&id| id != NONE_ID) {
        pixels[id as usize] += 1;
    }
    let share = |id: usize| projections[id] as f32 / pixels[id].max(1) as f32;
    let mut all: Vec<f32> = (0..pixels.len()).filter(|&i| pixels[i] > 0).map(share).collect();
    all.sort_unstable_by(f32::total_cmp);
    let most = all.get(all.len() * 99 / 100).copied().unwrap_or(1.0).max(1e-6);
    let color = |&id: &u32| match id {
        NONE_ID => Color32::TRANSPARENT,
        id => heat((share(id as usize) / most).sqrt()),
    };
    let size = [visibility.size.width as usize, visibility.size.height as usize];
    let map = ColorImage::new(size, visibility.mirror_ids.iter().map(color).collect());
    Ok(Some((map, most)))
}
