//! What a frame does, looked at afterwards: pure functions of a scene, an eye and a method's parameters, which plan the
//! frame anew and hook into none of its loops; and what mirrors do to an eye whatever the method.

pub mod balance;
pub mod break_even;
pub mod measure;
pub mod methods;
mod mirror_parts;
pub mod multiplicity;
mod replay;
mod trace_camera;
mod triangle_costs;

pub use mirror_parts::{PartCost, part_costs};
pub use replay::{CloudTrace, MOST_TRACED, Outcome, TracedSurfel, VisitedBox};
pub use trace_camera::{CameraTrace, trace_camera};
pub use triangle_costs::triangle_costs;

use std::sync::Arc;

use crate::camera::Eye;
use crate::error::Result;
use crate::methods::c3rc::C3rc;
use crate::methods::{FrameInput, Method, Params};
use crate::plan::{Pass, Plan, SplatPass};
use crate::scene::PreparedScene;
use crate::visibility::Visibility;

/// The splat pass of a frame drawn by c3rc.
fn splat_pass<'a>(
    scene: &'a PreparedScene,
    eye: &'a Eye,
    visibility: &'a Visibility,
    params: &Params,
) -> Result<Box<SplatPass<'a>>> {
    let mut plan = Plan::default();
    C3rc.plan(FrameInput { scene, eye, visibility }, &(Arc::new(()) as _), params, &mut plan)?;
    let splats = plan.passes.into_iter().find_map(|pass| match pass {
        Pass::Splat(pass) => Some(pass),
        Pass::Resolve | Pass::Gather(_) | Pass::Lookup(_) | Pass::Search(_) => None,
    });
    Ok(splats.expect("the method splats"))
}

#[cfg(test)]
mod tests;
