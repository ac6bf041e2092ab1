//! Shapes and scenes that need no file.

mod builder;
mod knot;
mod revolution;
mod round;
mod sheets;
mod smooth;
mod teapot;

pub(crate) use smooth::SmoothSurface;

use crate::geometry::Mesh;

/// A shape that can be made with any number of triangles.
struct Shape {
    name: &'static str,
    /// Triangles if nothing is said.
    default: usize,
    /// Fewer are not made.
    least: usize,
    make: fn(usize) -> Mesh,
}

/// No shape is made with more triangles: a slip of the pen shall not fill the memory.
const MOST_TRIANGLES: usize = 1 << 24;

const TABLE: [Shape; 13] = [
    Shape { name: "teapot", default: 4_000, least: 1_992, make: teapot::teapot },
    Shape { name: "sphere", default: 4_000, least: 80, make: round::sphere },
    Shape { name: "ellipsoid", default: 4_000, least: 80, make: round::ellipsoid },
    Shape { name: "torus", default: 4_000, least: 200, make: round::torus },
    Shape { name: "goblet", default: 8_000, least: 1_000, make: round::goblet },
    Shape { name: "bowl", default: 4_000, least: 80, make: round::bowl },
    Shape { name: "wave", default: 4_000, least: 400, make: sheets::wave },
    Shape { name: "plane", default: 2, least: 2, make: sheets::plane },
    Shape { name: "ground", default: 2, least: 2, make: sheets::ground },
    Shape { name: "cube", default: 12, least: 12, make: sheets::cube },
    Shape { name: "cylinder", default: 2_000, least: 100, make: round::cylinder },
    Shape { name: "cone", default: 2_000, least: 200, make: round::cone },
    Shape { name: "knot", default: 20_000, least: 1_000, make: knot::knot },
];

const NAMES: [&str; TABLE.len()] = {
    let mut names = [""; TABLE.len()];
    let mut k = 0;
    while k < names.len() {
        names[k] = TABLE[k].name;
        k += 1;
    }
    names
};

/// Names of the built-in shapes.
pub const SHAPES: &[&str] = &NAMES;

/// A built-in shape in its own space, y up, about one unit large; `None` for an unknown name.
///
/// The mesh has the wanted number of triangles as nearly as its grid permits: within 10 % from 2,000 on. Below
/// what a shape needs to be recognised (and above 2²⁴) the wish is clamped. Normals are those of the smooth
/// surface, outward or to the mirror side; triangles are counter-clockwise seen from there.
pub fn shape(name: &str, triangles: Option<usize>) -> Option<Mesh> {
    let (shape, wanted) = find(name, triangles)?;
    Some((shape.make)(wanted))
}

/// The surface in closed form that [`shape`] of the same arguments approximates; `None` for shapes without one.
pub(crate) fn smooth(name: &str, triangles: Option<usize>) -> Option<SmoothSurface> {
    let (shape, wanted) = find(name, triangles)?;
    SmoothSurface::of(shape.name, wanted)
}

/// The shape of a name and the triangles that are wanted of it.
fn find(name: &str, triangles: Option<usize>) -> Option<(&'static Shape, usize)> {
    let shape = TABLE.iter().find(|shape| shape.name == name)?;
    let wanted = triangles.unwrap_or(shape.default).clamp(shape.least, MOST_TRIANGLES);
    Some((shape, wanted))
}

/// The parts that a built-in shape with about so many triangles is made of: their names, and the triangles of each, in the
/// shape's order. Most shapes are of one piece.
pub fn parts(name: &str, triangles: Option<usize>) -> Vec<(&'static str, std::ops::Range<usize>)> {
    let Some(shape) = TABLE.iter().find(|shape| shape.name == name) else { return Vec::new() };
    let wanted = triangles.unwrap_or(shape.default).clamp(shape.least, MOST_TRIANGLES);
    if name != "teapot" {
        return vec![(shape.name, 0..usize::MAX)];
    }
    let mut first = 0;
    let range = |(name, end): (&'static str, usize)| {
        let range = first..end;
        first = end;
        (name, range)
    };
    teapot::parts(wanted).into_iter().map(range).collect()
}

/// As [`parts`], with the teapot's knob apart from its lid: parts that differ in how they are curved.
pub fn regions(
    name: &str,
    triangles: Option<usize>,
) -> Vec<(&'static str, std::ops::Range<usize>)> {
    let mut list = parts(name, triangles);
    if let Some(lid) = list.iter().position(|(part, _)| name == "teapot" && *part == "lid") {
        let range = list[lid].1.clone();
        let wanted = find(name, triangles).map_or(0, |(_, wanted)| wanted);
        let end = range.start + teapot::knob(wanted);
        list[lid].1.start = end;
        list.insert(lid, ("knob", range.start..end));
    }
    list
}

/// The closed surface that an open built-in shape with about so many triangles is a part of, in the same space; `None` if
/// there is none.
pub fn closed(name: &str, triangles: Option<usize>) -> Option<Mesh> {
    let bowl = TABLE.iter().find(|shape| shape.name == "bowl" && name == "bowl")?;
    let wanted = triangles.unwrap_or(bowl.default).clamp(bowl.least, MOST_TRIANGLES);
    Some(round::hollow(wanted))
}

/// The built-in scenes: names and texts.
const SCENE_TEXTS: [(&str, &str); 3] = [
    ("default", include_str!("../../../assets/scenes/default.toml")),
    ("room", include_str!("../../../assets/scenes/room.toml")),
    ("knot", include_str!("../../../assets/scenes/knot.toml")),
];

/// Names of the built-in scenes.
pub const SCENES: &[&str] = &[SCENE_TEXTS[0].0, SCENE_TEXTS[1].0, SCENE_TEXTS[2].0];

/// A built-in scene as TOML; `None` for an unknown name.
pub fn scene_text(name: &str) -> Option<&'static str> {
    SCENE_TEXTS.iter().find(|scene| scene.0 == name).map(|scene| scene.1)
}

#[cfg(test)]
#[cfg(feature = "cli")]
mod scene_tests;
#[cfg(test)]
mod tests;
