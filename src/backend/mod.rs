//! Backends execute plans. They know passes, not methods.

pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

use crate::camera::Eye;
use crate::error::Result;
use crate::image::Picture;
use crate::plan::{Plan, Reflection};
use crate::scene::prepared::PreparedScene;
use crate::visibility::Visibility;

/// The backend that is the fastest here for a method: a graphics card's, if there is one and the method `has_shaders` (a
/// software adapter is none), else the CPU's.
pub fn fastest(has_shaders: bool) -> Box<dyn Backend> {
    #[cfg(feature = "gpu")]
    if has_shaders
        && gpu::may_be_there()
        && gpu::adapters().first().is_some_and(|adapter| !adapter.software)
        && let Ok(gpu) = gpu::Gpu::new(gpu::Options::default())
    {
        return Box::new(gpu);
    }
    let _ = has_shaders;
    Box::new(cpu::Cpu::default())
}

/// What executing a plan did and took. A stage that was not timed apart is `None`.
#[derive(Clone, Copy, Debug, Default)]
pub struct ExecuteReport {
    /// Cameras of the splat passes.
    pub cameras: usize,
    /// Visible patches of the splat passes.
    pub patches: usize,
    /// Batches of surfels.
    pub batches: u64,
    /// Camera–surfel pairs projected.
    pub projections: u64,
    /// Pairs that have an image in the camera, where they are counted.
    pub valid: Option<u64>,
    /// Culling, milliseconds of all threads together by their number.
    pub cull_ms: Option<f64>,
    /// Projection, likewise.
    pub project_ms: Option<f64>,
    /// Splatting, likewise.
    pub splat_ms: Option<f64>,
    /// Wall time of clear, splat and resolve passes, milliseconds.
    pub passes_ms: Option<f64>,
    /// Wall time of tracing reflected rays, milliseconds.
    pub rays_ms: Option<f64>,
}

/// Something that executes plans. It keeps its memory between frames.
pub trait Backend: Send {
    /// Short name, as after `--backend`.
    fn id(&self) -> &'static str;

    /// The device that it runs on, and how, where that is not the CPU.
    fn device(&self) -> Option<String> {
        None
    }

    /// Executes `plan`; `out` becomes the reflection of every mirror pixel. With `planes` it also says what was
    /// seen, which is not timed.
    ///
    /// # Errors
    /// The device failed.
    ///
    /// # Panics
    /// If a pass reads what no pass before it wrote.
    fn execute(
        &mut self,
        plan: &Plan<'_>,
        scene: &PreparedScene,
        visibility: &Visibility,
        planes: bool,
        out: &mut Reflection,
    ) -> Result<ExecuteReport>;

    /// Completes the reflection that was executed last (environment, tint; its planes' radiance, where there are planes)
    /// and draws what the eye sees. `white`: see [`cpu::direct::DirectView::white`].
    fn compose(
        &mut self,
        scene: &PreparedScene,
        eye: &Eye,
        visibility: &Visibility,
        reflection: &mut Reflection,
        white: f32,
        picture: &mut Picture,
    ) {
        cpu::finish::finish(scene, eye, visibility, reflection, white, picture);
    }
}
