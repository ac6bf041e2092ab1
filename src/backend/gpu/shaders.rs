//! The shaders' texts: constants of the Rust code, then the files.

use std::fmt::Write as _;

use super::records::{LAYOUT, NO_OWNER};
use super::surfaces::{PAINTS, SURFACE_ROWS};
use crate::backend::cpu::search::raster::BACK_SLACK;
use crate::backend::cpu::splat::{EDGE_TOLERANCE, projection};
use crate::camera::reflector::{self, estalella, roger};
use crate::camera::three_ray::project::NOISE_ROUNDINGS;
use crate::camera::three_ray::solve::MAX_STEPS;
use crate::geometry::lanes::Scalar;
use crate::plan::{CELL_SLACK_PX, LARGEST_ELLIPSE, SplatShape, kernel};
use crate::scene::{environment, shade};
use crate::visibility::SAMPLE_EIGHTHS;

/// Workgroups along the first dimension of a grid: the most that every device has, and a power of two.
pub(super) const GROUPS: u32 = 1 << 15;

macro_rules! file {
    ($path:literal) => {
        include_str!(concat!("../../../shaders/", $path))
    };
}

const PLAN: &str = file!("plan.wgsl");
const SOLVE: &str = file!("camera/three_ray/solve.wgsl");
const PROJECT: &str = file!("camera/three_ray/project.wgsl");
const PROJECTION: &str = file!("splat/projection.wgsl");
const LISTS: &str = file!("splat/lists.wgsl");
const KEYS: &str = file!("splat/keys.wgsl");
const KEYS_64: &str = file!("splat/keys64.wgsl");
const RADIANCE: &str = file!("splat/radiance.wgsl");
const VERTEX: &str = file!("passes/vertex.wgsl");
const VERTEX_LISTS: &str = file!("passes/vertex_lists.wgsl");
const VERTEX_KEYS: &str = file!("passes/vertex_keys.wgsl");
const COMPUTE: &str = file!("passes/compute.wgsl");
const COMPUTE_LISTS: &str = file!("passes/compute_lists.wgsl");
const COMPUTE_KEYS: &str = file!("passes/compute_keys.wgsl");
const RESOLVE_LISTS: &str = file!("passes/resolve_lists.wgsl");
const RESOLVE_KEYS: &str = file!("passes/resolve_keys.wgsl");
const CLOSE: &str = file!("passes/close.wgsl");
const REFLECTED: &str = file!("passes/reflected.wgsl");
const SEARCH: &str = file!("passes/search.wgsl");
const CUBE: &str = file!("camera/reflector/cube.wgsl");
const ESTALELLA: &str = file!("camera/reflector/estalella.wgsl");
const ROGER: &str = file!("camera/reflector/roger.wgsl");
const LOOK: &str = file!("look.wgsl");
const PANORAMA: &str = file!("scene/environment.wgsl");
const SHADOW: &str = file!("shadow.wgsl");
const DIRECT: &str = file!("passes/direct.wgsl");
const ENVIRONMENT: &str = file!("passes/environment.wgsl");
const COMPOSITE: &str = file!("passes/composite.wgsl");

/// One constant, one place: those of the Rust code.
fn constants(shape: SplatShape) -> String {
    let mut text = String::new();
    let mut word = |name: &str, value: u32| {
        writeln!(text, "const {name}: u32 = {value}u;").expect("strings grow");
    };
    for (name, value) in LAYOUT {
        word(name, value);
    }
    let (side, corners) = match shape {
        SplatShape::Square1 => (1, 1),
        SplatShape::Square2 => (2, 6),
        SplatShape::Ellipse => (0, 6),
    };
    word("SIDE", side);
    word("CORNERS", corners);
    word("GROUPS", GROUPS);
    word("NO_OWNER", NO_OWNER);
    word("MAX_STEPS", u32::try_from(MAX_STEPS).expect("few"));
    #[expect(clippy::cast_possible_truncation, reason = "a power of two")]
    let [epsilon, noise] = [<f32 as Scalar>::ROOT_EPSILON, NOISE_ROUNDINGS * f32::ROUNDING]
        .map(|number| number as f32);
    let numbers = [
        ("ROOT_EPSILON", epsilon),
        ("NOISE", noise),
        ("REACH", shape.reach()),
        ("EDGE_TOLERANCE", EDGE_TOLERANCE),
        ("LARGEST_ELLIPSE", LARGEST_ELLIPSE),
        ("CELL_SLACK_PX", CELL_SLACK_PX),
        ("SPREAD", kernel::SPREAD),
        ("PIXEL", kernel::PIXEL),
        ("PER_DISK", kernel::PER_DISK),
        ("LEAST_FACING", kernel::LEAST_FACING),
        ("MOST_CORRECTION_PX", projection::MOST_CORRECTION_PX),
        ("SAME_SURFACE_RADII", kernel::SAME_SURFACE_RADII),
        ("SAME_SURFACE_SHARE", kernel::SAME_SURFACE_SHARE),
        ("SLOPE", kernel::SLOPE),
        ("GAIN", kernel::GAIN),
        ("CLOSING", kernel::CLOSING),
        ("CLOSING_TWO", kernel::CLOSING_TWO),
        ("SURROUNDED", kernel::SURROUNDED),
        ("AROUND_WITHIN", kernel::ALL_AROUND[0]),
        ("AROUND_BEYOND", kernel::ALL_AROUND[1]),
        ("LARGE_FROM", kernel::LARGE[0]),
        ("LARGE_TO", kernel::LARGE[1]),
        ("GAP_FROM", kernel::GAP[0]),
        ("GAP_TO", kernel::GAP[1]),
        ("WHOLE", kernel::WHOLE),
    ];
    for (name, value) in numbers {
        writeln!(text, "const {name}: f32 = {value:?}f;").expect("strings grow");
    }
    let ellipse = shape == SplatShape::Ellipse;
    writeln!(text, "const ELLIPSE: bool = {ellipse};").expect("strings grow");
    text
}

/// Projection by one of the paths; `wide`: keys of 64 bits.
pub(super) fn splat(shape: SplatShape, vertex: bool, wide: bool) -> String {
    let ellipse = shape == SplatShape::Ellipse;
    let store = match (ellipse, wide) {
        (true, _) => LISTS,
        (false, true) => KEYS_64,
        (false, false) => KEYS,
    };
    let [passes, cover] = match (vertex, ellipse) {
        (true, true) => [VERTEX, VERTEX_LISTS],
        (true, false) => [VERTEX, VERTEX_KEYS],
        (false, true) => [COMPUTE, COMPUTE_LISTS],
        (false, false) => [COMPUTE, COMPUTE_KEYS],
    };
    [&constants(shape), PLAN, SOLVE, PROJECT, PROJECTION, store, passes, cover].concat()
}

/// From lists or keys to colours.
pub(super) fn resolve(shape: SplatShape, wide: bool) -> String {
    let constants = constants(shape);
    match (shape, wide) {
        (SplatShape::Ellipse, _) => [&constants, PLAN, LISTS, RADIANCE, RESOLVE_LISTS].concat(),
        (_, true) => [&constants, PLAN, KEYS_64, RADIANCE, RESOLVE_KEYS].concat(),
        (_, false) => [&constants, PLAN, KEYS, RADIANCE, RESOLVE_KEYS].concat(),
    }
}

/// Closing gaps.
pub(super) fn close() -> String {
    [&constants(SplatShape::Ellipse), PLAN, CLOSE].concat()
}

/// Searches on reflectors, and cube maps read.
pub(super) fn search() -> String {
    let mut text = String::new();
    let words = [
        ("GROUPS", GROUPS),
        ("SIGHT_SAMPLES", reflector::SIGHT_SAMPLES),
        ("SIGHT_HALVINGS", reflector::SIGHT_HALVINGS),
    ];
    for (name, value) in words {
        writeln!(text, "const {name}: u32 = {value}u;").expect("strings grow");
    }
    let numbers = [
        ("MOST_STEP", estalella::MOST_STEP),
        ("STEP_SHARE_LEAST", estalella::STEP_SHARE[0]),
        ("STEP_SHARE_MOST", estalella::STEP_SHARE[1]),
        ("STEP_RANGE_LEAST", estalella::STEP_RANGE[0]),
        ("STEP_RANGE_MOST", estalella::STEP_RANGE[1]),
        ("TURN", estalella::TURN),
        ("TRUST_MOST", roger::TRUST[0]),
        ("TRUST_FIRST", roger::TRUST[1]),
        ("LEAST_DETERMINANT", roger::LEAST_DETERMINANT),
        ("LEAST_AREA", roger::LEAST_AREA),
        ("NEW_SIDE_LEAST", roger::NEW_SIDE[0]),
        ("NEW_SIDE_MOST", roger::NEW_SIDE[1]),
        ("GRADIENT_ENDS", roger::GRADIENT_ENDS),
        ("LENGTH_NOISE", roger::LENGTH_NOISE),
        ("LEAST_SIDE", roger::LEAST_SIDE),
        ("HEIGHT", roger::HEIGHT),
    ];
    for (name, value) in numbers {
        writeln!(text, "const {name}: f32 = {value:?}f;").expect("strings grow");
    }
    [&text, SEARCH, CUBE, ESTALELLA, ROGER].concat()
}

/// Triangles between images on a mirror.
pub(super) fn reflected() -> String {
    format!("const BACK_SLACK: f32 = {BACK_SLACK:?}f;\n{REFLECTED}")
}

/// The direct view, the environment and the composition, with their entry points.
pub(super) fn looks() -> [(String, &'static str); 3] {
    let mut text = String::new();
    let mut number = |name: &str, value: f32| {
        writeln!(text, "const {name}: f32 = {value:?}f;").expect("strings grow");
    };
    number("HORIZON_BLUR", environment::HORIZON_BLUR);
    number("SUN_EDGE_OUTER", environment::SUN_EDGE[0]);
    number("SUN_EDGE_INNER", environment::SUN_EDGE[1]);
    number("SUN_DISC", environment::SUN_DISC);
    number("TERMINATOR", shade::TERMINATOR);
    number("NEIGHBORHOOD", shade::NEIGHBORHOOD);
    number("TRIANGLE_EDGE", TRIANGLE_EDGE);
    let packed = |axis: usize| {
        let at = SAMPLE_EIGHTHS.iter().enumerate();
        at.fold(0, |bits, (i, eighths)| bits | u32::from(eighths[axis]) << (4 * i))
    };
    let words = [
        ("GROUPS", GROUPS),
        ("PASSES", u32::try_from(shade::PASSES).expect("few")),
        ("SAMPLES_X", packed(0)),
        ("SAMPLES_Y", packed(1)),
        ("SURFACE_ROWS", SURFACE_ROWS),
    ];
    for (name, value) in words.into_iter().chain(PAINTS) {
        writeln!(text, "const {name}: u32 = {value}u;").expect("strings grow");
    }
    [
        ([&text, LOOK, PANORAMA, SHADOW, DIRECT].concat(), "draw_direct"),
        ([&text, LOOK, PANORAMA, ENVIRONMENT].concat(), "complete"),
        ([&text, LOOK, PANORAMA, COMPOSITE].concat(), "compose"),
    ]
}

/// Triangles are grown by this for shadow rays, as weights: what f32 loses at their edges.
const TRIANGLE_EDGE: f32 = 4e-5;

/// The projection alone, behind which a test puts its entry point.
#[cfg(test)]
pub(super) fn projection_for_tests(shape: SplatShape) -> String {
    [&constants(shape), PLAN, SOLVE, PROJECT, PROJECTION].concat()
}
