//! Environment mapping (Blinn & Newell 1976): a cube map of the objects from each mirror's centre, looked up by the direction
//! of the reflected ray alone.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::{FrameInput, Made, Method, MethodInfo, ParamInfo, ParamKind, Params, Preset, Value};
use crate::accel::{Hit, Ray};
use crate::camera::reflector::cube::{CubeMap, directions};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::Aabb;
use crate::plan::{EnvironmentCube, LookupPass, Pass, Plan};
use crate::scene::prepared::PreparedScene;
use crate::scene::shade::Sun;

/// See the module.
pub struct EnvironmentMap;

static INFO: MethodInfo = MethodInfo {
    id: "environment",
    about: "environment mapping: a cube map from the mirror's centre, looked up by direction",
    citation: "Blinn & Newell 1976, Texture and Reflection in Computer Generated Images",
    has_shaders: true,
    params: &[
        ParamInfo {
            id: "cube-side",
            about: "texels a side of the cube map",
            unit: "",
            kind: ParamKind::Integer(8, 2048),
            default: Value::Integer(512),
            is_quality_knob: true,
        },
        ParamInfo {
            id: "update",
            about: "when the cube map is rendered: once for where things are (static), or again for every frame",
            unit: "",
            kind: ParamKind::Choice(&["static", "frame"]),
            default: Value::Choice("static"),
            is_quality_knob: false,
        },
        ParamInfo {
            id: "box-correction",
            about: "whether the objects are taken to be on the walls of their common box, not infinitely far away",
            unit: "",
            kind: ParamKind::Choice(&["off", "on"]),
            default: Value::Choice("off"),
            is_quality_knob: true,
        },
    ],
    presets: &[],
    qualities: &[
        Preset {
            id: "draft",
            about: "128 texels a side",
            params: &[("cube-side", "128")],
            leaf_points: None,
        },
        Preset {
            id: "best",
            about: "1024 texels a side, corrected for the objects' box",
            params: &[("cube-side", "1024"), ("box-correction", "on")],
            leaf_points: None,
        },
    ],
};

impl Method for EnvironmentMap {
    fn info(&self) -> &'static MethodInfo {
        &INFO
    }

    fn prepares_with(&self) -> &'static [&'static str] {
        &["cube-side"]
    }

    fn version(&self, scene: &PreparedScene) -> u64 {
        scene.placement_version
    }

    fn prepare(&self, scene: &PreparedScene, params: &Params, cx: &Context) -> Result<Made> {
        cx.check()?;
        Ok(Arc::new(cubes(scene, params.integer("cube-side"))))
    }

    fn plan<'a>(
        &self,
        frame: FrameInput<'a>,
        made: &Made,
        params: &Params,
        out: &mut Plan<'a>,
    ) -> Result<()> {
        let cubes = match params.choice("update") {
            "frame" => cubes(frame.scene, params.integer("cube-side")),
            _ => made.downcast_ref::<Cubes>().expect("prepare made it").clone(),
        };
        let corrected = params.choice("box-correction") == "on";
        let walls = corrected.then(|| frame.scene.triangles.bounds());
        out.passes.push(Pass::Lookup(LookupPass {
            eye: frame.eye,
            cubes,
            walls: walls.filter(|b: &Aabb| !b.is_empty()),
        }));
        Ok(())
    }
}

/// By mirror.
type Cubes = Arc<Vec<EnvironmentCube>>;

fn cubes(scene: &PreparedScene, side: u32) -> Cubes {
    Arc::new((0..scene.mirrors.len()).map(|mirror| cube(scene, mirror, side)).collect())
}

/// The objects around a mirror's centre.
fn cube(scene: &PreparedScene, mirror: usize, side: u32) -> EnvironmentCube {
    let bounds = Aabb::of(scene.mirrors[mirror].positions.iter().copied());
    let center: Vec3 = (bounds.min + bounds.max) * 0.5;
    let rays: Vec<Ray> = directions(side).into_iter().map(|d| Ray::new(center, d)).collect();
    let mut hits: Vec<Option<Hit>> = vec![None; rays.len()];
    scene.triangles.trace_closest(&rays, &mut hits);
    let sun = Sun::new(&scene.triangles, &scene.light);
    let texel = |hit: &Option<Hit>| {
        hit.map_or([0.0; 4], |hit| {
            let color = scene.radiance_of(&sun, hit.triangle, hit.barycentrics);
            [color.x, color.y, color.z, 1.0]
        })
    };
    let texels = hits.par_iter().map(texel).collect();
    let seen = hits.iter().map(|hit| hit.map(|hit| (hit.triangle, hit.barycentrics))).collect();
    EnvironmentCube { center, radiance: CubeMap::new(side, texels), seen }
}
