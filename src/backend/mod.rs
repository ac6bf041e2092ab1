//! Backends execute plans. They know passes, not methods.

pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

use crate::camera::Eye;
#[cfg(any(feature = "gpu", test))]
use crate::error::Error;
use crate::error::Result;
use crate::image::Picture;
use crate::plan::{Plan, Reflection};
use crate::scene::prepared::PreparedScene;
use crate::visibility::Visibility;

/// The backend that is the fastest here for a method: a graphics card's, if there is one and the method `has_shaders` (a
/// software adapter is none), else the CPU's. Where a card fails, the CPU goes on.
pub fn fastest(has_shaders: bool) -> Box<dyn Backend> {
    #[cfg(feature = "gpu")]
    if has_shaders
        && gpu::may_be_there()
        && gpu::adapters().first().is_some_and(|adapter| !adapter.software)
        && let Ok(gpu) = gpu::Gpu::new(gpu::Options::default())
    {
        return Box::new(WithSpare { first: Some(Box::new(gpu)), spare: cpu::Cpu::default() });
    }
    let _ = has_shaders;
    Box::new(cpu::Cpu::default())
}

/// A backend that the CPU takes over from when it fails.
#[cfg(any(feature = "gpu", test))]
struct WithSpare {
    first: Option<Box<dyn Backend>>,
    spare: cpu::Cpu,
}

#[cfg(any(feature = "gpu", test))]
impl WithSpare {
    fn current(&self) -> &dyn Backend {
        self.first.as_deref().unwrap_or(&self.spare)
    }
}

#[cfg(any(feature = "gpu", test))]
impl Backend for WithSpare {
    fn id(&self) -> &'static str {
        self.current().id()
    }

    fn device(&self) -> Option<String> {
        self.current().device()
    }

    fn gathers(&self) -> bool {
        self.current().gathers()
    }

    fn execute(
        &mut self,
        plan: &Plan<'_>,
        scene: &PreparedScene,
        visibility: &Visibility,
        planes: bool,
        out: &mut Reflection,
    ) -> Result<ExecuteReport> {
        if let Some(first) = &mut self.first {
            let done = first.execute(plan, scene, visibility, planes, out);
            if matches!(done, Ok(_) | Err(Error::Cancelled)) {
                return done;
            }
            self.first = None;
        }
        self.spare.execute(plan, scene, visibility, planes, out)
    }

    fn compose(
        &mut self,
        scene: &PreparedScene,
        eye: &Eye,
        visibility: &Visibility,
        reflection: &mut Reflection,
        white: f32,
        picture: &mut Picture,
    ) {
        match &mut self.first {
            Some(first) => first.compose(scene, eye, visibility, reflection, white, picture),
            None => self.spare.compose(scene, eye, visibility, reflection, white, picture),
        }
    }
}

/// What executing a plan did and took. A stage that was not timed apart is `None`.
#[derive(Clone, Debug, Default)]
pub struct ExecuteReport {
    /// Cameras of the splat passes.
    pub cameras: Option<usize>,
    /// Visible patches of the splat passes.
    pub patches: usize,
    /// Batches of surfels.
    pub batches: Option<u64>,
    /// Camera–surfel pairs projected, or points searched for on a reflector.
    pub projections: Option<u64>,
    /// Those that have an image, where they are counted.
    pub valid: Option<u64>,
    /// Making cameras, where that was not done while planning: milliseconds of all threads together by their number.
    pub cameras_ms: Option<f64>,
    /// Culling, likewise; with projection where they go hand in hand.
    pub cull_ms: Option<f64>,
    /// Projection, likewise.
    pub project_ms: Option<f64>,
    /// Splatting, likewise.
    pub splat_ms: Option<f64>,
    /// Wall time of clear, splat and resolve passes, milliseconds.
    pub passes_ms: Option<f64>,
    /// Wall time of tracing reflected rays, milliseconds.
    pub rays_ms: Option<f64>,
    /// What could not be shown, a sentence each.
    pub notes: Vec<String>,
    /// Of all searches together.
    pub steps: Option<u64>,
}

/// Something that executes plans. It keeps its memory between frames.
pub trait Backend: Send {
    /// Short name, as after `--backend`.
    fn id(&self) -> &'static str;

    /// The device that it runs on, and how, where that is not the CPU.
    fn device(&self) -> Option<String> {
        None
    }

    /// Whether it executes gather passes.
    fn gathers(&self) -> bool {
        true
    }

    /// Executes `plan`; `out` becomes the reflection of every mirror pixel. With `planes` it also says what was
    /// seen, which is not timed.
    ///
    /// # Errors
    /// The device failed, or the plan was cancelled.
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

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::camera::eye::ImageSize;
    use crate::context::Context;
    use crate::frame::Renderer;
    use crate::methods::{Params, method};
    use crate::scene::description::{Environment, EyeDescription};
    use crate::scene::{GivenSurfels, PreparedScene, builtin};

    /// Fails at its second frame.
    struct Failing(cpu::Cpu, usize);

    impl Backend for Failing {
        fn id(&self) -> &'static str {
            "failing"
        }

        fn execute(
            &mut self,
            plan: &Plan<'_>,
            scene: &PreparedScene,
            visibility: &Visibility,
            planes: bool,
            out: &mut Reflection,
        ) -> Result<ExecuteReport> {
            self.1 += 1;
            if self.1 > 1 {
                return Err(Error::input("a card", "", "is broken", "use another"));
            }
            self.0.execute(plan, scene, visibility, planes, out)
        }
    }

    #[test]
    fn where_a_backend_fails_the_cpu_goes_on() {
        let points = [Vec3::new(0.0, 0.2, 1.6); 4];
        let given =
            GivenSurfels { positions: &points, normals: &[Vec3::Z; 4], radiance: &[Vec3::X; 4] };
        let eye = EyeDescription {
            position: DVec3::new(0.0, 0.0, 5.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            fov_y: 0.7,
        };
        let mirror = builtin::shape("sphere", Some(200)).expect("it is built in");
        let sky = Environment::Constant(Vec3::ONE);
        let scene = PreparedScene::from_surfels(mirror, given, eye, sky).expect("it is a scene");
        let eye = scene.eye_for(ImageSize { width: 64, height: 36 }).expect("a view");
        let first: Box<dyn Backend> = Box::new(Failing(cpu::Cpu::default(), 0));
        let both = WithSpare { first: Some(first), spare: cpu::Cpu::default() };
        let mut renderer = Renderer::on(Box::new(both));
        let c3rc = method("c3rc").expect("it is there");
        let params = Params::defaults(c3rc.info().params);
        let mut pictures = Vec::new();
        for backend in ["failing", "cpu", "cpu"] {
            let report = renderer.render(&scene, &eye, c3rc, &params, false, &Context::default());
            assert_eq!(report.expect("the CPU draws it").backend, backend);
            pictures.push(renderer.picture().rgb.clone());
        }
        assert!(pictures[1..].iter().all(|p| *p == pictures[0]));
    }
}
