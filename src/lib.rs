//! Accurate reflections on curved mirrors, without ray-tracing hardware.
//!
//! Surfaces around a mirror are sampled into points once. For each frame, every visible triangle of the
//! mirror, or group of pixels with nearly linear rays, becomes a *continuous 3-ray camera*, which maps a point straight to the pixels where it is seen
//! reflected: no search along rays (Mei, Popescu & Sacks 2007). A ray-traced reference comes along.
//!
//! # The flow
//!
//! ```text
//! once    scene file ─► Scene ─► PreparedScene   surfels in the order of their kd-trees' leaves, mirrors' too; triangles, light
//! frame   Eye ─► visibility ─► Visibility        per pixel: five samples of the direct view, and its mirror triangle
//!         method ─► Plan                         passes as data
//!           c3rc      Gather: blocks of pixels walk the trees, each pixel by its exact ray   (where the backend gathers)
//!                     or cells, or patches ─► cameras ─► Splat, Resolve    (culled while it is executed: BatchSource)
//!           raytrace  Gather
//!         backend ─► Reflection                  per mirror pixel: radiance, coverage; on demand what was seen (Planes)
//!         compose ─► Picture                     environment where nothing landed, tint, antialiased direct view
//! then    Picture ─► PNG, EXR, HDR, window     Planes ─► EXR, comparison
//! points  Scene ─► PathScene ─► PathFinder ─► PathSet        every image of a point, without a picture
//! ```
//!
//! A frame depends on the prepared scene, the eye and the method's parameters, and on nothing else: it has
//! the same bits for any number of threads and any instruction set. [`frame::Renderer`] is the only place
//! where the stages meet.
//!
//! # Example
//!
//! Surfels that you have already, without any default feature:
//!
//! ```
//! use catoptric::glam::{DVec3, Vec3};
//! use catoptric::scene::{GivenSurfels, PreparedScene, builtin, description::{Environment, EyeDescription}};
//! use catoptric::{Context, camera::eye::ImageSize, frame::Renderer, methods::METHODS, methods::Params};
//!
//! let at = |i: u16| Vec3::new(f32::from(i % 200) * 0.02 - 2.0, -0.6, f32::from(i / 200) * 0.02 - 2.0);
//! let floor: Vec<Vec3> = (0..40_000).map(at).collect();
//! let (normals, orange) = ([Vec3::Y; 40_000], [Vec3::new(0.9, 0.4, 0.1); 40_000]);
//! let surfels = GivenSurfels { positions: &floor, normals: &normals, radiance: &orange };
//! let eye = EyeDescription { position: DVec3::new(0.0, 1.0, 3.0), target: DVec3::ZERO, up: DVec3::Y, fov_y: 0.7 };
//! let mirror = builtin::shape("sphere", None).expect("it is built in");
//! let scene = PreparedScene::from_surfels(mirror, surfels, eye, Environment::Constant(Vec3::ONE))?;
//! let eye = scene.eye_for(ImageSize { width: 320, height: 180 }).expect("from_surfels checked it");
//! let (method, mut renderer) = (METHODS[0], Renderer::new());
//! let params = Params::defaults(method.info().params);
//! let report = renderer.render(&scene, &eye, method, &params, false, &Context::default())?;
//! assert!(report.covered_pixels > 1000 && renderer.picture().rgb.len() == 320 * 180);
//! # Ok::<(), catoptric::Error>(())
//! ```
//!
//! # Rooms
//!
//! | room | holds | may use |
//! |---|---|---|
//! | [`geometry`] | boxes, meshes, transforms, surfels, numbers in lanes | – |
//! | [`image`] | planes, pictures, files, comparison | – |
//! | [`camera`] | the eye, mirror rays, continuous 3-ray cameras | geometry |
//! | [`accel`] | kd-trees over surfels, triangle BVHs | geometry |
//! | [`scene`] | files, built-in shapes, sampling, shading, [`scene::PreparedScene`] | geometry, camera, accel, image |
//! | [`paths`] | every image of a point in the cameras of all mirrors, in f64 | geometry, camera, accel, scene |
//! | [`visibility`] | what the eye sees directly, patches of mirrors | geometry, camera, scene |
//! | [`plan`] | a frame as data: passes, cameras, batches | geometry, camera, scene, visibility, image |
//! | [`cull`] | (trees, camera) → batches | geometry, camera, accel, scene, plan |
//! | [`methods`] | the registry: a method is one file | all above |
//! | [`backend`] | executes plans, on the CPU or through wgpu (shaders in `shaders/`) | all above but cull and methods |
//! | [`frame`] | one frame from end to end | all above |
//! | [`analysis`] | what a frame does, looked at afterwards: one camera's walk, costs by triangle; multiple images and caustics | all above |
//! | `viewer` (feature `viewer`) | the window: hands in, wishes out; no algorithm | all above |
//!
//! Everything may use [`error`] and [`context`]. `tests/architecture.rs` holds the table.
//!
//! # Conventions
//!
//! - Right-handed, y up, column vectors; angles in radians. An eye that looks along -z with y up has +x to
//!   its right. Triangles are counter-clockwise seen from their front, where their normals point.
//! - **Local** or **object space**: a mesh's own; surfels and kd-trees live there, so rigid motion and uniform
//!   scale rebuild nothing. **World space**: the scene's author's, f64. **Scene space**: world space less
//!   [`scene::PreparedScene::origin`], f32, with the mirrors about its zero, so that rounding does not depend
//!   on where in the world a scene lies. Lengths have the author's unit.
//! - Colours are linear RGB with the primaries of sRGB; only PNG files and "#rrggbb" are encoded.
//! - Pixel (0, 0) is at the top left, its centre at (0.5, 0.5); lists of pixels go row by row.
//! - λ is the parameter along a camera's ray `v(w) + λ d(w)`: 0 on the mirror. The ray is not of unit length,
//!   so the distance from the mirror is λ·|d(w)|.
//! - Weights `w` (barycentrics) belong to a triangle's corners in their order and sum to 1.
//!
//! # Glossary
//!
//! - **Eye**: the viewer's pinhole. **Camera**: a continuous 3-ray camera (C3RC): a triangle of a mirror with
//!   the reflected view ray at each corner; rays in between are interpolated.
//! - **Surfel**: a point sample of a surface, with normal, colour and extent. **Representative**: a surfel that stands
//!   for all of a tree node, their mean. **Cloud**: the surfels of an object
//!   or a mirror, with their tree; those of mirrors hide what is behind them. **Samples**, per pixel, are those of the
//!   direct view and of the ray tracer (`spp`).
//! - **Patch**: a visible mirror triangle, or a part of a large one; or a **cell**: pixels of a 32 × 32 tile whose exact
//!   rays are nearly linear over the picture, across triangles. **Block**: 16 × 16 pixels; **beam**: those of a block's rays that go
//!   on from each other; **group**: 4 × 4 of its pixels. **Batch**: a contiguous range of surfels
//!   that a camera has to project. **Image**: a place where a camera sees a surfel; there may be three.
//! - **Path**: a way of light from the eye over a mirror point to a point. **Ghost**: where a range sensor at the eye would see the point
//!   by it: straight on behind the mirror point, as far as the path is long.
//! - **Layer**: the reflection before environment and direct view, and what it costs: patches, cameras,
//!   clearing, culling, projection, splatting, resolve.
//!
//! # Where it departs from the obvious
//!
//! - A camera belongs to a *patch*, not to a mirror triangle: a large triangle has several, so that the
//!   work of one task is bounded. Pixels are accepted by [`visibility::MirrorTriangleIndex`], cameras are
//!   found by patch: the two indices are never mixed.
//! - Blocks have a path of their own, from tree to pixel. In a block nothing has to be solved: along a beam's axis
//!   every pixel's ray is a known place in the plane of a surfel, so that a lane a pixel measures how far it passes by. That is exact, a
//!   fold needs no second root, and with near nodes first the walk ends where the block is full. With cells, which keep culling, projection and
//!   splatting apart as the paper does, pictures took two to three times as long.
//! - Culling is not a pass. A splat pass carries a [`plan::BatchSource`], and the backend asks it for the
//!   batches of a camera when it has room for them. So neither room knows the other, batches stay in the
//!   cache, and each stage can still be timed.
//! - The direct view reads most shadows from a map along the sun that keeps bounds over its texels, not samples of them;
//!   only what they leave open is traced. So it shows what shadow rays show.
//! - The direct view is antialiased over five samples a pixel, the reflection has one value a pixel: the
//!   composition mixes the two by the samples that show a mirror.
//! - A camera draws a little outside its triangle (guard band), but only on pixels that are its triangle's:
//!   otherwise surfels that a neighbour projects would be missing along the edges. The band is as wide as the
//!   object's surfels lie apart on the screen, and no wider than a splat.
//! - A cell's camera is up to half a pixel beside its pixels' exact rays. Each pixel keeps by how much, and images are
//!   moved by that: the picture is that of the exact rays.
//! - Ellipses of one patch are sorted by depth and fill their pixels in order, each by the part that it covers: layers
//!   need no bands, and what a surface leaves open shows what is behind it.
//! - Of squares, the nearest surfel wins only among those that the ray through the pixel's centre can see; farther ones fill
//!   what is left. Where a pixel sees a whole room, the nearest of all would be wrong.
//! - Depth is the distance from the mirror along the ray, behind a pre-pass that says which mirror triangle
//!   a pixel shows. The paper's distance from the eye can let a hidden mirror's reflection win.
//! - The numeric kernels are written once, over lanes, without fused or approximate operations; their only twins are
//!   the files in `shaders/`. On the GPU every pixel has a list of the ellipses that cover it and takes the nearest
//!   itself: nothing is sorted.
//!
//! # Sources
//!
//! - C. Mei, V. Popescu, E. Sacks: A Hybrid Backward-Forward Method for Interactive Reflections. Proc. GRAPP
//!   2007, pp. 284–292, doi:10.5220/0002076802840292.
//! - V. Popescu, J. Dauble, C. Mei, E. Sacks: An Efficient Error-Bounded General Camera Model. Proc. 3DPVT
//!   2006.
//! - P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild: FLIP: A Difference
//!   Evaluator for Alternating Images. Proc. ACM CGIT 3(2), 2020.
//!
//! Smaller debts are named where they are used.

pub mod accel;
pub mod analysis;
pub mod backend;
pub mod camera;
pub mod context;
pub mod cull;
pub mod error;
pub mod frame;
pub mod geometry;
pub mod image;
pub mod methods;
pub mod paths;
pub mod plan;
pub mod scene;
#[cfg(feature = "viewer")]
pub mod viewer;
pub mod visibility;

pub use context::{Context, Progress};
pub use error::{Error, Result};
/// The vectors of the interface.
pub use glam;
