//! What the two vertex-search methods share: reflectors are found in mirrors and mapped once, then vertices or surfels are
//! searched for on them.

mod bend;
mod center;
mod estalella;
mod grid;
mod maps;
mod parts;
mod roger_holzschuch;
#[cfg(test)]
mod tests;

use std::sync::Arc;

pub use estalella::Estalella;
pub use roger_holzschuch::RogerHolzschuch;

use super::{Made, ParamInfo, ParamKind, Params, Value};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::plan::SplatShape;
use crate::plan::search::{Bend, Grid, Primitive, ReflectorPart};
use crate::scene::prepared::PreparedScene;

/// What the searches make once a scene.
pub(super) struct Reflectors {
    parts: Arc<Vec<ReflectorPart>>,
    /// By object, if there are any.
    grids: Arc<Vec<Grid>>,
    /// What cannot be searched on.
    notes: Vec<String>,
}

const MAP_SIDE: ParamInfo = ParamInfo {
    id: "map-side",
    about: "texels a side of a reflector's cube maps",
    unit: "",
    kind: ParamKind::Integer(8, 1024),
    default: Value::Integer(256),
    is_quality_knob: true,
};

const MAP_TRIANGLES: ParamInfo = ParamInfo {
    id: "map-triangles",
    about: "triangles of the built-in shape that its maps are made from, which may be finer than the drawn one; 0: as drawn",
    unit: "",
    kind: ParamKind::Integer(0, 1 << 20),
    default: Value::Integer(0),
    is_quality_knob: false,
};

const PRIMITIVE: ParamInfo = ParamInfo {
    id: "primitive",
    about: "what is searched for: vertices of the meshes, between which triangles are drawn, or the surfels that c3rc projects",
    unit: "",
    kind: ParamKind::Choice(&["triangles", "points"]),
    default: Value::Choice("triangles"),
    is_quality_knob: false,
};

const POINT: ParamInfo = ParamInfo {
    id: "point",
    about: "pixels that a searched surfel covers: the one that it falls on, or 2 x 2",
    unit: "",
    kind: ParamKind::Choice(&["square1", "square2"]),
    default: Value::Choice("square2"),
    is_quality_knob: false,
};

const TESSELLATE: ParamInfo = ParamInfo {
    id: "tessellate",
    about: "edges whose images are longer than this are halved, eight times at most; 0: none are, as in the paper",
    unit: "px",
    kind: ParamKind::Number(0.0, 1000.0),
    default: Value::Number(0.0),
    is_quality_knob: true,
};

/// Says so where surfels leave parameters of triangles without use.
fn unused(params: &Params) -> Option<String> {
    let triangles = ["grid", "tessellate"];
    let given =
        triangles.iter().any(|id| matches!(params.get(id), Some(Value::Number(n)) if n > 0.0));
    (params.choice("primitive") == "points" && given)
        .then(|| "--grid and --tessellate are for triangles: every surfel is searched for".into())
}

fn primitive(params: &Params) -> Primitive {
    if params.choice("primitive") == "points" {
        let one = params.choice("point") == "square1";
        return Primitive::Points(if one { SplatShape::Square1 } else { SplatShape::Square2 });
    }
    let px = params.number("tessellate");
    Primitive::Triangles { longest_px: if px > 0.0 { px } else { f32::INFINITY } }
}

/// Whether some part of every mirror can be searched on, and what is known of each.
fn qualify(scene: &PreparedScene, params: &Params) -> Result<Vec<String>> {
    if params.choice("primitive") == "triangles" && params.choice("point") != "square2" {
        let remedy = "add --primitive points";
        return Err(Error::input(
            "--point",
            "",
            "says how surfels are drawn, not triangles",
            remedy,
        ));
    }
    let mut facts = Vec::new();
    for mirror in 0..scene.mirrors.len() {
        let (shapes, others) = parts::shapes(scene, mirror, params.integer("map-triangles"))?;
        for shape in shapes {
            let bend = match shape.bend {
                Bend::Flat => "flat",
                Bend::Faceted => "of flat faces: images are torn where they meet",
                Bend::Convex => "convex",
                Bend::Concave => "concave: far points have several images, of which one is drawn",
                Bend::Mixed => {
                    "curved both ways: points may have several images, of which one is drawn"
                }
            };
            let name = match scene.mirrors[mirror].proxy {
                Some(_) => format!("the proxy of {}", shape.name),
                None => shape.name,
            };
            facts.push(format!("{name} is star-shaped and {bend}"));
        }
        facts.extend(others.iter().map(|name| not_shown(name)));
    }
    Ok(facts)
}

fn not_shown(part: &str) -> String {
    format!("{part} is not star-shaped: it shows the environment only")
}

/// Maps the reflectors of all mirrors.
fn reflectors(
    scene: &PreparedScene,
    params: &Params,
    grids: Vec<Grid>,
    cx: &Context,
) -> Result<Made> {
    let (mut list, mut notes) = (Vec::new(), Vec::new());
    for mirror in 0..scene.mirrors.len() {
        let (shapes, others) = parts::shapes(scene, mirror, params.integer("map-triangles"))?;
        for shape in shapes {
            cx.step("mapping reflectors", mirror as f64 / scene.mirrors.len() as f64)?;
            let part = maps::reflector(scene, mirror, &shape, params.integer("map-side"));
            notes.extend(misfit(scene, mirror, &part));
            let name = &part.name;
            match part.bend {
                Bend::Mixed => notes.push(format!(
                    "{name} is curved both ways: of several images of a point one is drawn"
                )),
                Bend::Faceted => {
                    notes.push(format!("{name} has flat faces: images are torn where they meet"));
                }
                _ => {}
            }
            list.push(part);
        }
        notes.extend(others.iter().map(|name| not_shown(name)));
    }
    Ok(Arc::new(Reflectors { parts: Arc::new(list), grids: Arc::new(grids), notes }))
}

/// A stand-in that is farther than this from the mirror, as a share of its distance from the centre, is worth a note: facets
/// are nearer.
const MISFIT: f32 = 0.02;

/// What is to be said of a proxy that is not where the mirror is.
fn misfit(scene: &PreparedScene, mirror: usize, part: &ReflectorPart) -> Option<String> {
    let own = &scene.mirrors[mirror];
    own.proxy.as_ref()?;
    let apart = own.mesh.positions().iter().map(|&p| {
        let offset = p - part.center;
        let radius = part.map.radius(offset);
        (offset.length() - radius).abs() / radius.max(f32::MIN_POSITIVE)
    });
    let most = apart.fold(0.0, f32::max);
    (most > MISFIT).then(|| {
        format!(
            "the proxy of {} is up to {:.0} % of its radius away from it: images are displaced",
            own.name,
            100.0 * most
        )
    })
}

/// What [`reflectors`] made.
fn made(made: &Made) -> &Reflectors {
    made.downcast_ref().expect("prepare made it")
}

/// A mirror that no search works on.
fn refused(scene: &PreparedScene, mirror: usize, problem: &str) -> Error {
    let own = &scene.mirrors[mirror];
    let (name, remedy) = if own.proxy.is_some() {
        let remedy = "give another, star-shaped one, or use --method c3rc";
        (format!("the proxy of mirror {}", own.name), remedy)
    } else {
        let remedy = "give a closed, star-shaped stand-in with --proxy, or use --method c3rc";
        (format!("mirror {}", own.name), remedy)
    };
    Error::input(name, "", problem, remedy)
}
