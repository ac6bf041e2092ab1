//! The registry of reflection methods: a method is one file (or folder) and one line in [`METHODS`].

pub mod c3rc;
pub mod environment_map;
pub mod params;
pub mod ray_traced;
pub mod vertex_search;

use std::any::Any;
use std::sync::Arc;

pub use params::{ParamInfo, ParamKind, Params, Value};

use crate::camera::{Eye, RayScale};
use crate::context::Context;
use crate::error::Result;
use crate::plan::Plan;
use crate::scene::prepared::PreparedScene;
use crate::visibility::Visibility;

/// What is known of a method without running it.
#[derive(Debug)]
pub struct MethodInfo {
    /// Short name, as after `--method`.
    pub id: &'static str,
    /// One line for people.
    pub about: &'static str,
    /// Where it comes from.
    pub citation: &'static str,
    /// Whether the GPU can draw it: its passes have shaders.
    pub has_shaders: bool,
    /// Its parameters.
    pub params: &'static [ParamInfo],
    /// Named sets of values.
    pub presets: &'static [Preset],
    /// Less time or less error than the defaults, by how much of each: named `draft` and `best`.
    pub qualities: &'static [Preset],
}

/// The parameter of all methods that use the camera's rays.
const RAY_SCALE: ParamInfo = ParamInfo {
    id: "ray-scale",
    about: "length of a camera's three rays (unit: as in the paper)",
    unit: "",
    kind: ParamKind::Choice(&["eye-distance", "unit"]),
    default: Value::Choice("eye-distance"),
    is_quality_knob: false,
};

const MIRROR_OCCLUSION: ParamInfo = ParamInfo {
    id: "mirror-occlusion",
    about: "whether mirrors hide what lies behind them from reflected rays, which then see the environment",
    unit: "",
    kind: ParamKind::Choice(&["on", "off"]),
    default: Value::Choice("on"),
    is_quality_knob: false,
};

/// What a word of [`RAY_SCALE`] means.
pub(crate) fn ray_scale(word: &str) -> RayScale {
    if word == "unit" { RayScale::Unit } else { RayScale::EyeDistance }
}

/// A named set of parameter values.
#[derive(Debug)]
pub struct Preset {
    /// Short name, as after `--preset`.
    pub id: &'static str,
    /// One line for people.
    pub about: &'static str,
    /// Parameters and their values as text.
    pub params: &'static [(&'static str, &'static str)],
    /// Surfels a tree leaf holds at most, if the preset says.
    pub leaf_points: Option<u32>,
}

impl MethodInfo {
    /// The parameter of that id.
    ///
    /// # Panics
    /// If there is none.
    pub fn param(&self, id: &str) -> &ParamInfo {
        self.params.iter().find(|p| p.id == id).expect("the method has this parameter")
    }
}

/// Everything a frame depends on besides the method's parameters.
#[derive(Clone, Copy)]
pub struct FrameInput<'a> {
    /// The scene.
    pub scene: &'a PreparedScene,
    /// The eye.
    pub eye: &'a Eye,
    /// What the eye sees first.
    pub visibility: &'a Visibility,
}

/// What a method makes once per scene.
pub type Made = Arc<dyn Any + Send + Sync>;

/// A way to render reflections.
pub trait Method: Send + Sync {
    /// Name, citation, parameters.
    fn info(&self) -> &'static MethodInfo;

    /// The parameters that [`Method::prepare`] looks at.
    fn prepares_with(&self) -> &'static [&'static str] {
        &[]
    }

    /// A number that changes when what [`Method::prepare`] made does not hold any more: its meshes are others, by default.
    fn version(&self, scene: &PreparedScene) -> u64 {
        scene.version
    }

    /// Whether the method can draw this scene, and what it found out about that, a sentence each.
    ///
    /// # Errors
    /// Says why not.
    fn qualify(&self, _scene: &PreparedScene, _params: &Params) -> Result<Vec<String>> {
        Ok(Vec::new())
    }

    /// Makes what only depends on the scene.
    ///
    /// # Errors
    /// Cancelled.
    fn prepare(&self, _scene: &PreparedScene, _params: &Params, _cx: &Context) -> Result<Made> {
        Ok(Arc::new(()))
    }

    /// Writes a frame's passes into `out`, which is empty.
    ///
    /// # Errors
    /// Cancelled.
    fn plan<'a>(
        &self,
        frame: FrameInput<'a>,
        made: &Made,
        params: &Params,
        out: &mut Plan<'a>,
    ) -> Result<()>;
}

/// All methods; the first is the default.
pub static METHODS: [&dyn Method; 5] = [
    &c3rc::C3rc,
    &ray_traced::RayTraced,
    &vertex_search::Estalella,
    &vertex_search::RogerHolzschuch,
    &environment_map::EnvironmentMap,
];

/// The method of that id.
pub fn method(id: &str) -> Option<&'static dyn Method> {
    METHODS.into_iter().find(|m| m.info().id == id)
}
