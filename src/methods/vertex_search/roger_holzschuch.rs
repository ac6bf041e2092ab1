//! Roger & Holzschuch 2006: reflected vertices, found by the secant method on the gradient of the optical path.

use std::sync::Arc;

use super::{
    MAP_SIDE, MAP_TRIANGLES, POINT, PRIMITIVE, TESSELLATE, made, primitive, qualify, reflectors,
    unused,
};
use crate::context::Context;
use crate::error::Result;
use crate::methods::{
    FrameInput, Made, Method, MethodInfo, ParamInfo, ParamKind, Params, Preset, Value,
};
use crate::plan::search::{Search, SearchPass};
use crate::plan::{Pass, Plan};
use crate::scene::prepared::PreparedScene;

/// See the module.
pub struct RogerHolzschuch;

/// A search ends when a step moves the image by less than this.
const EARLY_EXIT_PX: f32 = 0.01;

static INFO: MethodInfo = MethodInfo {
    id: "roger-holzschuch",
    about: "reflected vertices: searched for by the gradient of the optical path on a star-shaped reflector",
    citation: "Roger & Holzschuch 2006, Accurate Specular Reflections in Real-Time",
    has_shaders: true,
    params: &[
        ParamInfo {
            id: "iterations",
            about: "steps of the search, at most",
            unit: "",
            kind: ParamKind::Integer(1, 100),
            default: Value::Integer(20),
            is_quality_knob: true,
        },
        ParamInfo {
            id: "early-exit",
            about: "whether a search ends when its steps are far below a pixel, or after all iterations",
            unit: "",
            kind: ParamKind::Choice(&["on", "off"]),
            default: Value::Choice("on"),
            is_quality_knob: false,
        },
        PRIMITIVE,
        POINT,
        TESSELLATE,
        MAP_SIDE,
        MAP_TRIANGLES,
    ],
    presets: &[],
    qualities: &[
        Preset { id: "draft", about: "8 steps", params: &[("iterations", "8")], leaf_points: None },
        Preset {
            id: "best",
            about: "40 steps, images of edges at most 8 pixels long",
            params: &[("iterations", "40"), ("tessellate", "8")],
            leaf_points: None,
        },
    ],
};

impl Method for RogerHolzschuch {
    fn info(&self) -> &'static MethodInfo {
        &INFO
    }

    fn qualify(&self, scene: &PreparedScene, params: &Params) -> Result<Vec<String>> {
        qualify(scene, params)
    }

    fn prepares_with(&self) -> &'static [&'static str] {
        &[MAP_SIDE.id, MAP_TRIANGLES.id]
    }

    fn prepare(&self, scene: &PreparedScene, params: &Params, cx: &Context) -> Result<Made> {
        reflectors(scene, params, Vec::new(), cx)
    }

    fn plan<'a>(
        &self,
        frame: FrameInput<'a>,
        maps: &Made,
        params: &Params,
        out: &mut Plan<'a>,
    ) -> Result<()> {
        let px = if params.choice("early-exit") == "on" { EARLY_EXIT_PX } else { 0.0 };
        out.notes.extend_from_slice(&made(maps).notes);
        out.notes.extend(unused(params));
        out.passes.push(Pass::Search(Box::new(SearchPass {
            eye: frame.eye,
            parts: Arc::clone(&made(maps).parts),
            search: Search::Roger { iterations: params.integer("iterations"), px },
            primitive: primitive(params),
            grids: Arc::clone(&made(maps).grids),
        })));
        Ok(())
    }
}
