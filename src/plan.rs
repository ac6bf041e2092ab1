//! A frame as data: passes over named resources, in order. Methods write plans, backends execute them.

pub(crate) mod kernel;
pub(crate) mod pool;
pub mod search;

use std::sync::Arc;

use glam::Vec3;

use crate::camera::Eye;
use crate::camera::reflector::cube::CubeMap;
use crate::camera::three_ray::{ThreeRay, ViewVolume};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::Aabb;
use crate::visibility::Patch;

/// One camera: a patch of a mirror and an object, in the object's space.
#[derive(Clone, Debug)]
pub struct CameraInstance {
    /// Index into [`SplatPass::patches`].
    pub patch: u32,
    /// Index of the object; those of mirrors that hide objects follow.
    pub object: u32,
    /// The projection's constants.
    pub camera: ThreeRay<f32>,
    /// The grown camera's view volume.
    pub volume: Volume,
    /// λ that can meet the object.
    pub lambda: [f32; 2],
    /// λ between which a point may have several images; reversed if nowhere.
    pub several: [f32; 2],
    /// Direction of the ray in scene space by coordinate, linear in (b2, b3).
    pub direction: [[f32; 3]; 3],
    /// From the object's directions to the scene's, by row.
    pub rotation: [[f32; 3]; 3],
    /// Homogeneous screen coordinates (x·w, y·w, w) relative to the patch's rectangle, in pixels, linear in (b2, b3).
    pub screen: [[f32; 3]; 3],
    /// How the point at λ moves in scene space with the place on the screen that sees it, a pixel to the right and a
    /// pixel down: `per_px[0]` + λ `per_px[1]`. The unit is the distance within which every point of the object's
    /// surface has a surfel; not numbers if the triangle has no area on the screen.
    pub per_px: [[[f32; 3]; 2]; 2],
    /// Where the rays go, if what faces away from all of them is hidden.
    pub gaze: Option<Gaze>,
    /// The object's first representative: surfels from there on have radii of their own.
    pub representatives: u32,
    /// A node that would be seen as less than 1/`detail` of a pixel is taken as one representative; 0: no node is.
    pub detail: f32,
    /// What `per_px` is measured in, scene units.
    pub radius: f32,
    /// Radius of the disk that the object's surfels stand for.
    pub extent: f32,
    /// What a pixel sees at λ: the symmetric matrix [a b; b c] that gives the squared distance across the rays of
    /// two points by their distance in pixels; each a quadratic in λ, by power.
    pub footprint: [[f32; 3]; 3],
    /// How far outside the triangle images are drawn, by weight.
    pub guard: [f32; 3],
    /// Positive where the ray leaves the mirror on the side that is seen, linear in (b2, b3).
    pub front: [f32; 3],
    /// v(w) - eye in scene space by coordinate, linear in (b2, b3): for push-back depth.
    pub from_eye: [[f32; 3]; 3],
}

/// What a camera sees between its outermost rays.
#[derive(Clone, Copy, Debug)]
pub enum Volume {
    /// Of a triangle.
    Three(ViewVolume<f32>),
    /// Of a rectangle on the screen.
    Four(ViewVolume<f32, 4>),
}

/// The directions of a camera's rays: a cone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaze {
    /// Unit, in the object's space.
    pub axis: [f32; 3],
    /// Cosine of the half angle.
    pub cosine: f32,
    /// Sine of that.
    pub sine: f32,
}

/// A range of surfels that a camera is to project.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Batch {
    /// First surfel, over the whole scene.
    pub first: u32,
    /// Number of surfels to project.
    pub count: u32,
    /// Each stands for so many consecutive ones, of which it is the first.
    pub stride: u32,
    /// λ that can meet them.
    pub lambda: [f32; 2],
    /// 1 if the theorem allows one image a point, else 3.
    pub roots: u32,
}

/// Where batches come from: the culling, as the backend sees it. It asks for as much as it can use at a time.
pub trait BatchSource: Send + Sync {
    /// Appends the batches of one camera, in surfel order.
    fn cull(&self, camera: &CameraInstance, out: &mut Vec<Batch>);
}

/// Which pixels a projected surfel covers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SplatShape {
    /// Those that the surfel's disk is seen on, each by the part of it that the disk covers.
    Ellipse,
    /// The one that it falls on.
    Square1,
    /// The 2 × 2 around it.
    #[default]
    Square2,
}

/// An ellipse's half axes end at about so many pixels: beyond it a caustic is near, or the surfels are too few.
pub const LARGEST_ELLIPSE: f32 = 8.0;

impl SplatShape {
    /// How far, along x and y, an image may lie from the centre of a pixel that it covers, in pixels.
    pub fn reach(self) -> f32 {
        match self {
            Self::Ellipse => LARGEST_ELLIPSE,
            Self::Square1 => 0.5,
            Self::Square2 => 1.0,
        }
    }
}

/// Surfels are so evenly spread that a disk of this many of their radii about any point of a surface holds one.
pub const EVENNESS: f32 = 1.5;
/// The camera of a cell of the picture may be about so many pixels beside its exact rays; see [`Pixels::deviations`].
pub const CELL_SLACK_PX: f32 = 0.5;

/// What decides which surfel is nearest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DepthKey {
    /// λ|d(w)|: the distance from the mirror.
    #[default]
    Lambda,
    /// The paper's: the distance from the eye to the mirror plus that.
    PushBack,
}

/// What is known of the pixels of patches that are cells of the picture, by patch.
#[derive(Clone, Debug, Default)]
pub struct Pixels {
    /// A word a row of the patch's rectangle, bit 0 its left end: which pixels are the patch's own.
    pub rows: Vec<u32>,
    /// By pixel of the rectangle: the direction of the exact ray less that of the camera's, scene space. Zero for
    /// pixels that are not the patch's own.
    pub deviations: Vec<[f32; 3]>,
}

/// Projects surfels and keeps the nearest at every pixel.
pub struct SplatPass<'a> {
    /// Visible parts of the mirrors.
    pub patches: Vec<Patch>,
    /// For patches that are cells of the picture: see [`Pixels`].
    pub pixels: Pixels,
    /// By patch, then by object.
    pub cameras: Vec<CameraInstance>,
    /// Patch i owns cameras `patch_cameras[i]..patch_cameras[i + 1]`.
    pub patch_cameras: Vec<u32>,
    /// The culling.
    pub batches: Box<dyn BatchSource + 'a>,
    /// Footprint, in pixels.
    pub shape: SplatShape,
    /// Depth.
    pub depth: DepthKey,
    /// Keep only the first root that has an image, as the paper's vertex program.
    pub first_root_only: bool,
    /// Surfels from this one on show nothing: they hide what lies behind them from the mirrors.
    pub first_hider: u32,
}

/// Computes the reflection pixel by pixel.
pub struct GatherPass<'a> {
    /// What to compute.
    pub kernel: Box<dyn GatherKernel + 'a>,
}

/// A computation per mirror pixel, called on runs of pixels.
pub trait GatherKernel: Send + Sync {
    /// Prepares what all pixels share (ray lists, say) and computes every pixel of the reflection.
    ///
    /// # Errors
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    fn gather(&self, out: &mut Reflection, cx: &Context) -> Result<GatherTimes>;
}

/// What a gather pass took.
#[derive(Clone, Copy, Debug, Default)]
pub struct GatherTimes {
    /// Tracing the reflected rays, milliseconds.
    pub rays_ms: f64,
    /// Number of rays.
    pub rays: usize,
    /// What it did with surfels, where it draws those.
    pub surfels: Option<GatherCounts>,
}

/// What a gather pass that draws surfels did.
#[derive(Clone, Copy, Debug, Default)]
pub struct GatherCounts {
    /// Beams and clouds walked for them.
    pub cameras: usize,
    /// Beams.
    pub patches: usize,
    /// Ranges of surfels that were looked at.
    pub batches: u64,
    /// Beam–surfel pairs.
    pub projections: u64,
    /// Pairs of which something may be seen.
    pub valid: u64,
    /// Rays and beams, nanoseconds of all threads together.
    pub cameras_ns: u64,
    /// Culling and projection, likewise.
    pub walk_ns: u64,
    /// Blending, likewise.
    pub splat_ns: u64,
}

impl GatherCounts {
    /// Both together.
    #[must_use]
    pub fn plus(self, o: Self) -> Self {
        Self {
            cameras: self.cameras + o.cameras,
            patches: self.patches + o.patches,
            batches: self.batches + o.batches,
            projections: self.projections + o.projections,
            valid: self.valid + o.valid,
            cameras_ns: self.cameras_ns + o.cameras_ns,
            walk_ns: self.walk_ns + o.walk_ns,
            splat_ns: self.splat_ns + o.splat_ns,
        }
    }
}

/// What is around a mirror, seen from its centre.
#[derive(Clone, Debug)]
pub struct EnvironmentCube {
    /// Scene space.
    pub center: Vec3,
    /// Linear RGB radiance of the objects times their coverage, and that.
    pub radiance: CubeMap<4>,
    /// By texel: the object's triangle over all objects, and where on it.
    pub seen: Vec<Option<(u32, [f32; 3])>>,
}

/// Looks reflections up by the direction of the reflected ray.
pub struct LookupPass<'a> {
    /// The eye.
    pub eye: &'a Eye,
    /// By mirror.
    pub cubes: Arc<Vec<EnvironmentCube>>,
    /// Where the reflected ray leaves this box (scene space) is what it sees; `None`: infinitely far away.
    pub walls: Option<Aabb>,
}

impl LookupPass<'_> {
    /// The direction in which a ray from `origin` (scene space) is looked up in a mirror's cube.
    pub fn direction(&self, mirror: usize, origin: Vec3, direction: Vec3) -> Vec3 {
        let Some(walls) = self.walls else { return direction };
        let far = Vec3::select(direction.cmpgt(Vec3::ZERO), walls.max, walls.min);
        let t = ((far - origin) / direction).map(|t| if t.is_finite() { t } else { f32::INFINITY });
        let t = t.min_element();
        // Outside of the box there is no wall.
        if t > 0.0 && t.is_finite() {
            origin + direction * t - self.cubes[mirror].center
        } else {
            direction
        }
    }
}

/// The reflection of all mirrors: one element a pixel of the picture, by row.
#[derive(Clone, Debug, Default)]
pub struct Reflection {
    /// Linear RGB; what is not covered is left to the environment.
    pub radiance: Vec<glam::Vec3>,
    /// Share of the pixel covered by objects.
    pub coverage: Vec<f32>,
    /// The environment behind the objects is in `radiance` already.
    pub environment_included: bool,
    /// What was seen, where asked for.
    pub planes: Option<Box<crate::image::Planes>>,
}

/// Things that passes read and write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resource {
    /// Mirror triangle ids of the pixels: there before the first pass.
    Ids,
    /// Nearest surfel of each pixel.
    Keys,
    /// The reflection.
    Reflection,
}

/// One step of a frame.
pub enum Pass<'a> {
    /// Ids → Keys.
    Splat(Box<SplatPass<'a>>),
    /// Keys → Reflection.
    Resolve,
    /// Ids → Reflection.
    Gather(GatherPass<'a>),
    /// Ids → Reflection.
    Lookup(LookupPass<'a>),
    /// Ids → Reflection.
    Search(Box<search::SearchPass<'a>>),
}

impl Pass<'_> {
    /// What must be there before.
    pub fn reads(&self) -> &'static [Resource] {
        match self {
            Self::Splat(_) | Self::Gather(_) | Self::Lookup(_) | Self::Search(_) => {
                &[Resource::Ids]
            }
            Self::Resolve => &[Resource::Keys],
        }
    }

    /// What is there afterwards.
    pub fn writes(&self) -> &'static [Resource] {
        match self {
            Self::Splat(_) => &[Resource::Keys],
            Self::Resolve | Self::Gather(_) | Self::Lookup(_) | Self::Search(_) => {
                &[Resource::Reflection]
            }
        }
    }
}

/// A frame's passes in order.
#[derive(Default)]
pub struct Plan<'a> {
    /// In order.
    pub passes: Vec<Pass<'a>>,
    /// Time spent on planning, by stage.
    pub times: PlanTimes,
    /// What the method cannot show in this scene, a sentence each.
    pub notes: Vec<String>,
    /// Whoever executes it stops once this is cancelled.
    pub cx: Context,
    /// Whether gather passes can be executed: a method may draw otherwise where they cannot.
    pub gathers: bool,
}

/// What planning took, milliseconds.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlanTimes {
    /// Listing the visible patches and making their cameras.
    pub cameras_ms: f64,
}

impl Plan<'_> {
    /// The first resource that some pass reads before it was written.
    pub fn missing_resource(&self) -> Option<Resource> {
        let mut there = vec![Resource::Ids];
        for pass in &self.passes {
            if let Some(r) = pass.reads().iter().find(|r| !there.contains(r)) {
                return Some(*r);
            }
            there.extend(pass.writes());
        }
        None
    }
}
