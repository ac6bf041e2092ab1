//! The ray-traced reference: the reflected rays of every mirror pixel against the objects' triangles.

mod gather;
pub mod trace;

use super::{
    FrameInput, MIRROR_OCCLUSION, Made, Method, MethodInfo, ParamInfo, ParamKind, Params, Preset,
    RAY_SCALE, Value,
};
use crate::camera::mirror_ray::RaySource;
use crate::error::Result;
use crate::plan::{GatherPass, Pass, Plan};

/// See the module.
pub struct RayTraced;

static INFO: MethodInfo = MethodInfo {
    id: "raytrace",
    about: "ray-traced reference with interpolated normals",
    citation: "Whitted 1980, An Improved Illumination Model for Shaded Display; BVH of the obvhs crate",
    has_shaders: false,
    params: &[
        ParamInfo {
            id: "rays",
            about: "reflected at the interpolated normals (the truth), or as the 3-ray camera has them (the truth for its model)",
            unit: "",
            kind: ParamKind::Choice(&["surface", "camera"]),
            default: Value::Choice("surface"),
            is_quality_knob: false,
        },
        ParamInfo {
            id: "spp",
            about: "samples a pixel; 1 is the pixel's centre",
            unit: "",
            kind: ParamKind::Integer(1, 65_536),
            default: Value::Integer(1),
            is_quality_knob: true,
        },
        MIRROR_OCCLUSION,
        RAY_SCALE,
    ],
    presets: &[],
    qualities: &[
        Preset { id: "draft", about: "1 ray a pixel", params: &[("spp", "1")], leaf_points: None },
        Preset {
            id: "best",
            about: "16 rays a pixel",
            params: &[("spp", "16")],
            leaf_points: None,
        },
    ],
};

impl Method for RayTraced {
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
        let kernel = gather::Kernel {
            frame,
            source: match params.choice("rays") {
                "camera" => RaySource::Camera,
                _ => RaySource::Surface,
            },
            scale: super::ray_scale(params.choice("ray-scale")),
            spp: params.integer("spp"),
            mirror_occlusion: params.choice("mirror-occlusion") == "on",
        };
        out.passes.push(Pass::Gather(GatherPass { kernel: Box::new(kernel) }));
        Ok(())
    }
}
