//! The hybrid method of Mei, Popescu & Sacks 2007: every visible mirror triangle is a continuous 3-ray camera,
//! culled against the surfels' trees (backward), which then projects and splats what is left (forward).
//!
//! Cameras are the mirror's triangles, as in the paper; or cells of the picture (`cells.rs`); or blocks of pixels (`beams`), whose
//! rays are each taken as they are, so that nothing has to be solved: on the CPU that is the fastest and the most accurate.

mod beams;
mod cameras;
mod cells;
mod footprint;
mod guard;

use std::time::Instant;

use super::{
    FrameInput, MIRROR_OCCLUSION, Made, Method, MethodInfo, ParamInfo, ParamKind, Params, Preset,
    RAY_SCALE, Value, ray_scale,
};
use crate::camera::three_ray::BoxTest;
use crate::cull::Culler;
use crate::error::{Error, Result};
use crate::plan::{DepthKey, GatherPass, Pass, Pixels, Plan, SplatPass, SplatShape};
use crate::scene::prepared::{PreparedScene, milliseconds};
use crate::visibility::{MirrorTriangleIndex, PatchScratch, patches};

/// See the module.
pub struct C3rc;

static INFO: MethodInfo = MethodInfo {
    id: "c3rc",
    about: "point splatting with continuous 3-ray cameras",
    citation: "Mei, Popescu & Sacks 2007, A Hybrid Backward-Forward Method for Interactive Reflections",
    has_shaders: true,
    params: &[
        ParamInfo {
            id: "cameras",
            about: "what one camera sees for: 16 x 16 pixels by their exact rays (with ellipses, on the CPU; else cells), pixels whose rays are nearly linear, or a triangle of the mirror",
            unit: "",
            kind: ParamKind::Choice(&["triangles", "cells", "blocks"]),
            default: Value::Choice("blocks"),
            is_quality_knob: true,
        },
        ParamInfo {
            id: "test",
            about: "how tree nodes are tested against a camera's view volume (paper: not conservative)",
            unit: "",
            kind: ParamKind::Choice(&["none", "interval", "sweep", "slab", "paper"]),
            default: Value::Choice("slab"),
            is_quality_knob: false,
        },
        ParamInfo {
            id: "splat",
            about: "pixels that a surfel covers: those that its disk is seen on, in part, the one it falls on, or 2 x 2",
            unit: "",
            kind: ParamKind::Choice(&["ellipse", "square1", "square2"]),
            default: Value::Choice("ellipse"),
            is_quality_knob: true,
        },
        ParamInfo {
            id: "detail",
            about: "splats a pixel and layer: what would be more is drawn as representatives; 0: every surfel",
            unit: "",
            kind: ParamKind::Integer(0, 64),
            default: Value::Integer(2),
            is_quality_knob: true,
        },
        ParamInfo {
            id: "depth",
            about: "what decides which surfel is nearest (push-back: the paper's key)",
            unit: "",
            kind: ParamKind::Choice(&["lambda", "push-back"]),
            default: Value::Choice("lambda"),
            is_quality_knob: false,
        },
        RAY_SCALE,
        MIRROR_OCCLUSION,
        ParamInfo {
            id: "roots",
            about: "images of a point that a camera draws: all, or only the first as in the paper",
            unit: "",
            kind: ParamKind::Choice(&["all", "first"]),
            default: Value::Choice("all"),
            is_quality_knob: false,
        },
    ],
    presets: &[Preset {
        id: "paper",
        about: "as Mei et al.: unit rays, their box test, leaves of 122, 1-pixel squares, first root, push-back depth",
        params: &[
            ("cameras", "triangles"),
            ("test", "paper"),
            ("splat", "square1"),
            ("detail", "0"),
            ("depth", "push-back"),
            ("ray-scale", "unit"),
            ("roots", "first"),
            ("mirror-occlusion", "off"),
        ],
        leaf_points: Some(122),
    }],
    qualities: &[
        Preset {
            id: "draft",
            about: "one ellipse a pixel",
            params: &[("cameras", "blocks"), ("splat", "ellipse"), ("detail", "1")],
            leaf_points: None,
        },
        Preset {
            id: "best",
            about: "four ellipses a pixel",
            params: &[("cameras", "blocks"), ("splat", "ellipse"), ("detail", "4")],
            leaf_points: None,
        },
    ],
};

/// What culls for a frame with these parameters.
///
/// # Panics
/// If they are another method's.
pub(crate) fn culler<'a>(scene: &'a PreparedScene, params: &Params) -> Culler<'a> {
    let test = match params.choice("test") {
        "none" => BoxTest::None,
        "interval" => BoxTest::Interval,
        "sweep" => BoxTest::Sweep,
        "paper" => BoxTest::Paper,
        _ => BoxTest::Slab,
    };
    Culler::new(scene, test)
}

/// Whether blocks draw what is asked for: they do not know the other shapes, tests and keys, which are about cameras.
fn in_blocks(params: &Params) -> bool {
    let only = [
        ("cameras", "blocks"),
        ("splat", "ellipse"),
        ("test", "slab"),
        ("depth", "lambda"),
        ("roots", "all"),
    ];
    only.into_iter().all(|(id, value)| params.choice(id) == value)
}

impl Method for C3rc {
    fn info(&self) -> &'static MethodInfo {
        &INFO
    }

    fn plan<'a>(
        &self,
        frame: FrameInput<'a>,
        _made: &Made,
        params: &Params,
        out: &mut Plan<'a>,
    ) -> Result<()> {
        let start = Instant::now();
        let scene = frame.scene;
        let shape = match params.choice("splat") {
            "square1" => SplatShape::Square1,
            "square2" => SplatShape::Square2,
            _ => SplatShape::Ellipse,
        };
        let detail = params.integer("detail");
        let settings = cameras::CameraSettings {
            ray_scale: ray_scale(params.choice("ray-scale")),
            shape,
            detail: f64::from(detail),
            mirror_occlusion: params.choice("mirror-occlusion") == "on",
        };
        if params.choice("cameras") != "triangles" {
            for (id, value) in [("test", "paper"), ("ray-scale", "unit")] {
                if params.choice(id) == value {
                    let what = format!("--{id} {value}");
                    let remedy = format!("use --cameras triangles, or another --{id}");
                    return Err(Error::input(what, "", "goes with triangles only", remedy));
                }
            }
        }
        if out.gathers && in_blocks(params) {
            let kernel = beams::Kernel { frame, settings };
            out.passes.push(Pass::Gather(GatherPass { kernel: Box::new(kernel) }));
            return Ok(());
        }
        let corners = |t: MirrorTriangleIndex| scene.mirror_triangle(t.0).corners;
        let (patches, pixels, cameras) = if params.choice("cameras") != "triangles" {
            cells::cells(frame, settings)
        } else {
            let mut list = Vec::new();
            patches(frame.eye, frame.visibility, corners, &mut PatchScratch::default(), &mut list);
            let cameras = cameras::cameras(frame, &list, settings);
            (list, Pixels::default(), cameras)
        };
        let (cameras, patch_cameras) = cameras;
        out.times.cameras_ms = milliseconds(start);
        out.passes.push(Pass::Splat(Box::new(SplatPass {
            patches,
            pixels,
            cameras,
            patch_cameras,
            batches: Box::new(culler(scene, params)),
            shape,
            depth: match params.choice("depth") {
                "push-back" => DepthKey::PushBack,
                _ => DepthKey::Lambda,
            },
            first_hider: scene.first_mirror_surfel(),
            first_root_only: params.choice("roots") == "first",
        })));
        out.passes.push(Pass::Resolve);
        Ok(())
    }
}
