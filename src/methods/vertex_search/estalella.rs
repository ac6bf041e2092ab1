//! Estalella et al. 2005: virtual vertices, found along the bisector.

use std::sync::Arc;

use super::grid::grid;
use super::{
    MAP_SIDE, MAP_TRIANGLES, POINT, PRIMITIVE, TESSELLATE, made, primitive, qualify, reflectors,
    unused,
};
use crate::camera::reflector::estalella::Ends;
use crate::context::Context;
use crate::error::Result;
use crate::methods::{
    FrameInput, Made, Method, MethodInfo, ParamInfo, ParamKind, Params, Preset, Value,
};
use crate::plan::search::{Search, SearchPass};
use crate::plan::{Pass, Plan};
use crate::scene::prepared::PreparedScene;

/// See the module.
pub struct Estalella;

static INFO: MethodInfo = MethodInfo {
    id: "estalella",
    about: "virtual meshes: vertices searched for along the bisector on reflector cube maps",
    citation: "Estalella, Martin, Drettakis, Tost, Devillers & Cazals 2005, Accurate Interactive Specular Reflections on Curved Objects",
    has_shaders: true,
    params: &[
        ParamInfo {
            id: "iterations",
            about: "steps of the search, at most",
            unit: "",
            kind: ParamKind::Integer(1, 100),
            default: Value::Integer(9),
            is_quality_knob: true,
        },
        ParamInfo {
            id: "epsilon",
            about: "error (1 - B.N)/2 at which a search ends",
            unit: "",
            kind: ParamKind::Number(0.0, 1.0),
            default: Value::Number(0.0),
            is_quality_knob: true,
        },
        ParamInfo {
            id: "grid",
            about: "cells of the interpolation grid, as a share of the vertices; 0: every vertex is searched for",
            unit: "",
            kind: ParamKind::Number(0.0, 1.0),
            default: Value::Number(0.0),
            is_quality_knob: true,
        },
        PRIMITIVE,
        POINT,
        TESSELLATE,
        MAP_SIDE,
        MAP_TRIANGLES,
    ],
    presets: &[],
    qualities: &[
        Preset {
            id: "draft",
            about: "5 steps, for a grid of a tenth",
            params: &[("iterations", "5"), ("grid", "0.1")],
            leaf_points: None,
        },
        Preset {
            id: "best",
            about: "20 steps, images of edges at most 8 pixels long",
            params: &[("iterations", "20"), ("tessellate", "8")],
            leaf_points: None,
        },
    ],
};

impl Method for Estalella {
    fn info(&self) -> &'static MethodInfo {
        &INFO
    }

    fn qualify(&self, scene: &PreparedScene, params: &Params) -> Result<Vec<String>> {
        qualify(scene, params)
    }

    fn prepares_with(&self) -> &'static [&'static str] {
        &[MAP_SIDE.id, MAP_TRIANGLES.id, "grid"]
    }

    fn prepare(&self, scene: &PreparedScene, params: &Params, cx: &Context) -> Result<Made> {
        let share = f64::from(params.number("grid"));
        let objects = scene.objects.iter().filter(|_| share > 0.0);
        let grids = objects.map(|o| grid(o.mesh.positions(), share)).collect();
        reflectors(scene, params, grids, cx)
    }

    fn plan<'a>(
        &self,
        frame: FrameInput<'a>,
        maps: &Made,
        params: &Params,
        out: &mut Plan<'a>,
    ) -> Result<()> {
        let ends =
            Ends { iterations: params.integer("iterations"), epsilon: params.number("epsilon") };
        out.notes.extend_from_slice(&made(maps).notes);
        out.notes.extend(unused(params));
        out.passes.push(Pass::Search(Box::new(SearchPass {
            eye: frame.eye,
            parts: Arc::clone(&made(maps).parts),
            search: Search::Estalella(ends),
            primitive: primitive(params),
            grids: Arc::clone(&made(maps).grids),
        })));
        Ok(())
    }
}
