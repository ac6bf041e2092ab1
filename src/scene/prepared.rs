//! A scene made ready to be rendered: surfels in leaf order, trees, triangles. Everything a frame depends on
//! besides the eye and its parameters.

mod look_up;
mod place;
mod trees;

pub use trees::SurfelBytes;

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::description::{
    Environment, EyeDescription, Light, Mirror, Object, Paint, Proxy, Scene, Source,
};
use super::sun_map::SunMap;
use super::{sample, shade};
use crate::accel::{KdTree, KdTreeLimits, TriangleBvh};
use crate::camera::Eye;
use crate::camera::eye::ImageSize;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::look::Look;
use crate::geometry::surfel::PADDING;
use crate::geometry::{Aabb, Mesh, SharedEdge, Similarity, Surfels};

/// How a scene is prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrepareOptions {
    /// Surfels over all objects.
    pub surfels: usize,
    /// When tree nodes become leaves.
    pub tree: KdTreeLimits,
    /// Seed of the sampling.
    pub seed: u64,
}

impl Default for PrepareOptions {
    fn default() -> Self {
        Self { surfels: DEFAULT_SURFELS, tree: KdTreeLimits::default(), seed: 1 }
    }
}

impl PrepareOptions {
    /// # Errors
    /// One is out of its range.
    pub(super) fn check(&self) -> Result<()> {
        if self.surfels == 0 || self.surfels > MAX_SURFELS {
            return Err(Error::input(
                "--surfels",
                "",
                format!("{} is not between 1 and {MAX_SURFELS}", self.surfels),
                "choose a number in that range",
            ));
        }
        if self.tree.leaf_points == 0 {
            return Err(Error::input("--leaf", "", "0 is not a leaf size", "choose 1 or more"));
        }
        if !(0.0..=1.0).contains(&self.tree.leaf_size) {
            let problem = format!("{} is not between 0 and 1", self.tree.leaf_size);
            return Err(Error::input("--leaf-size", "", problem, "choose a share such as 0.01"));
        }
        Ok(())
    }
}

/// Leaves few holes in the built-in scenes.
pub const DEFAULT_SURFELS: usize = 3_000_000;
/// Surfel indices are 32 bits, and a surfel may bring as many as fourteen representatives.
pub const MAX_SURFELS: usize = (u32::MAX / 16) as usize;

/// What preparing took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrepareTimes {
    /// Sampling the surfaces, milliseconds.
    pub sample_ms: f64,
    /// Building the kd-trees, milliseconds.
    pub tree_ms: f64,
    /// Shading with shadow rays, the triangles' BVH included, milliseconds.
    pub shade_ms: f64,
}

/// A mirror in scene space.
#[derive(Clone, Debug)]
pub struct PreparedMirror {
    /// As in the scene.
    pub name: String,
    /// The mesh as given.
    pub mesh: Arc<Mesh>,
    /// Vertices in scene space.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals in scene space.
    pub normals: Vec<Vec3>,
    /// Linear RGB factor of the reflection.
    pub tint: Vec3,
    /// Index of its first triangle over all mirrors.
    pub first_triangle: u32,
    /// As in the scene.
    pub source: Option<Source>,
    /// As in the scene.
    pub proxy: Option<Proxy>,
}

/// A diffuse object.
#[derive(Clone, Debug)]
pub struct PreparedObject {
    /// As in the scene.
    pub name: String,
    /// The mesh as given.
    pub mesh: Arc<Mesh>,
    /// Whether it was given as points: its mesh only stands for them.
    pub is_cloud: bool,
    /// Detail smaller than this casts no shadow on it, scene units: 0, but for a cloud of points.
    pub detail: f32,
    /// The same in its own space.
    own_detail: f32,
    /// Its colour.
    pub paint: Paint,
    /// Object space to scene space.
    pub to_scene: Similarity,
    /// Vertices in scene space.
    pub positions: Vec<Vec3>,
    /// Index of its first triangle over all objects.
    pub first_triangle: u32,
    /// Of the mesh.
    edges: Vec<SharedEdge>,
}

/// The surfels of one object or mirror: they and their tree live in its own space and never move.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// Its own space to scene space.
    pub to_scene: Similarity,
    /// Over its surfels; ranges are relative to `surfels.start`.
    pub tree: KdTree,
    /// Its part of the scene's surfels.
    pub surfels: Range<u32>,
    /// What stands for the nodes of its tree, behind its surfels.
    pub representatives: Range<u32>,
    /// The surface encloses something with outward normals: from outside, what faces away is hidden.
    pub closed: bool,
    /// Largest radius that one of its surfels stands for, own space.
    pub extent: f32,
    /// Contains its surfels, scene space.
    pub bounds: Aabb,
}

impl Cloud {
    /// Appends `own` to `all`, in leaf order and followed by its representatives.
    fn new(mut own: Surfels, closed: bool, limits: KdTreeLimits, all: &mut Surfels) -> Self {
        let mut tree = KdTree::build(&mut own, limits);
        if own.extent.iter().all(|&extent| extent == 0.0) {
            own.extent.fill(tree.spacing_extent());
        }
        let first = index(all.len());
        let count = index(own.len());
        let extent = own.extent.iter().copied().fold(0.0, f32::max);
        tree.append_representatives(&mut own);
        append(all, own);
        Self {
            to_scene: Similarity::IDENTITY,
            tree,
            surfels: first..first + count,
            representatives: first + count..index(all.len()),
            closed,
            extent,
            bounds: Aabb::EMPTY,
        }
    }
}

impl PreparedObject {
    /// Reflectance at a point of a triangle, linear RGB.
    pub fn albedo(&self, triangle: usize, weights: [f32; 3]) -> Vec3 {
        self.paint.color(&self.mesh, triangle, weights, 0.0)
    }

    /// Interpolated unit normal at a point of a triangle, scene space.
    pub fn normal(&self, triangle: usize, weights: [f32; 3]) -> Vec3 {
        let corner = self.mesh.triangles()[triangle];
        let at = |k: usize| self.mesh.normals()[corner[k] as usize] * weights[k];
        let local = at(0) + at(1) + at(2);
        self.to_scene.direction(local.as_dvec3()).as_vec3().normalize_or(Vec3::Y)
    }
}

/// See the module. Scene space is world space less `origin`. A copy has surfels and trees of its own.
#[derive(Clone)]
pub struct PreparedScene {
    /// As in the scene.
    pub name: String,
    /// World position of scene space's zero: near the mirrors, so that f32 is exact enough anywhere.
    pub origin: DVec3,
    /// The scene's own eye.
    pub eye: EyeDescription,
    /// Mirrors.
    pub mirrors: Vec<PreparedMirror>,
    /// Objects.
    pub objects: Vec<PreparedObject>,
    /// The surfels of each object, then of each mirror: what is behind a mirror is hidden.
    pub clouds: Vec<Cloud>,
    /// All surfels, cloud by cloud, each in leaf order and followed by its representatives. Those of mirrors have no
    /// radiance.
    pub surfels: Surfels,
    /// Of the same.
    pub looks: Vec<Look>,
    /// The objects' triangles in scene space, object by object.
    pub triangles: TriangleBvh,
    /// The mirrors' triangles in scene space, mirror by mirror.
    pub mirror_triangles: TriangleBvh,
    /// Shadows of the objects' triangles, as far as they are certain.
    pub sun_map: SunMap,
    /// What rays meet that meet nothing else.
    pub environment: Environment,
    /// Sun and ambient.
    pub light: Light,
    /// What preparing took.
    pub times: PrepareTimes,
    /// Another number for other meshes, over all scenes of the program: places and light may change under it.
    pub version: u64,
    /// Another number for other surfels or other light on them, over all scenes of the program.
    pub surfel_version: u64,
    /// Another number for other places of objects or mirrors, likewise.
    pub placement_version: u64,
    /// How many trees over surfels were built since this scene was prepared: moving objects and mirrors builds none.
    pub tree_builds: usize,
}

/// Peak bytes a surfel (measured between 1 and 10 million: 126).
const SURFEL_BYTES: u64 = 130;
/// Peak bytes a triangle of an object, in addition to its mesh (measured between 1 and 3 million: 390 with it).
const TRIANGLE_BYTES: u64 = 350;

/// Whether there is room for a scene with so many surfels.
///
/// # Errors
/// There is not: see [`Context::room_for`].
pub fn check_room(surfels: usize, cx: &Context) -> Result<()> {
    let bytes = SURFEL_BYTES.saturating_mul(surfels as u64);
    cx.room_for("--surfels", &format!("{surfels} surfels"), bytes)
}

/// A number that no other scene of the program has had.
fn another_version() -> u64 {
    static VERSIONS: AtomicU64 = AtomicU64::new(1);
    VERSIONS.fetch_add(1, Ordering::Relaxed)
}

impl PreparedScene {
    /// Samples, sorts and shades a scene.
    ///
    /// # Errors
    /// An option is out of its range, or cancelled.
    pub fn new(scene: &Scene, options: &PrepareOptions, cx: &Context) -> Result<Self> {
        options.check()?;
        check_room(options.surfels, cx)?;
        let triangles: usize = scene.objects.iter().map(|o| o.mesh.triangles().len()).sum();
        let bytes = TRIANGLE_BYTES.saturating_mul(triangles as u64);
        cx.room_for(&scene.name, &format!("its {triangles} triangles"), bytes)?;
        let start = Instant::now();
        let mut sampled = sample_objects(scene, options, cx)?;
        sampled.extend(sample_mirrors(scene, options.surfels, options.seed, cx)?);
        let mut prepared = Self::of_sampled(scene, sampled, options.tree, cx)?;
        // What is found out about the meshes, too.
        prepared.times.sample_ms = milliseconds(start) - prepared.times.tree_ms;
        let start = Instant::now();
        prepared.shade(cx)?;
        prepared.times.shade_ms = milliseconds(start);
        Ok(prepared)
    }

    /// Sorts surfels into trees and puts everything in its place, unshaded. `sampled` holds each object's surfels, then
    /// each mirror's, none of them empty.
    ///
    /// # Errors
    /// Cancelled.
    pub(super) fn of_sampled(
        scene: &Scene,
        sampled: Vec<Surfels>,
        limits: KdTreeLimits,
        cx: &Context,
    ) -> Result<Self> {
        let mut surfels = Surfels::default();
        let mut objects = Vec::with_capacity(sampled.len());
        let origin = mirror_center(scene);
        let mut first_triangle = 0;
        for object in &scene.objects {
            objects.push(PreparedObject {
                name: object.name.clone(),
                mesh: Arc::clone(&object.mesh),
                is_cloud: object.points.is_some(),
                detail: 0.0,
                own_detail: object.points.as_ref().map_or(0.0, |points| {
                    // As large as the squares, of which there may be fewer.
                    let squares = (object.mesh.triangles().len() / 2).max(1);
                    let fewer = (points.len() as f32 / squares as f32).max(1.0);
                    shade::CLOUD_ROUGHNESS * sample::given::mean_extent(points) * fewer.sqrt()
                }),
                paint: object.paint.clone(),
                to_scene: Similarity::IDENTITY,
                positions: Vec::new(),
                first_triangle,
                edges: object.mesh.shared_edges(),
            });
            first_triangle += index(object.mesh.triangles().len());
        }
        let closed_object = |o: &Object| match &o.points {
            Some(points) => sample::given::enclose(points),
            None => o.mesh.is_closed_outward(),
        };
        let mirrors = scene.mirrors.iter().map(|m| m.mesh.is_closed_outward());
        let closed: Vec<bool> = scene.objects.iter().map(closed_object).chain(mirrors).collect();
        let start = Instant::now();
        let count = sampled.len();
        let mut clouds: Vec<Cloud> = Vec::with_capacity(count);
        for (closed, own) in closed.into_iter().zip(sampled) {
            cx.step("building trees", clouds.len() as f64 / count as f64)?;
            clouds.push(Cloud::new(own, closed, limits, &mut surfels));
        }
        pad(&mut surfels);
        let times = PrepareTimes { tree_ms: milliseconds(start), ..PrepareTimes::default() };

        let mut prepared = Self {
            name: scene.name.clone(),
            origin,
            eye: scene.eye,
            mirrors: unplaced_mirrors(scene),
            tree_builds: clouds.len(),
            objects,
            clouds,
            surfels,
            looks: Vec::new(),
            triangles: TriangleBvh::build(&[]),
            mirror_triangles: TriangleBvh::build(&[]),
            sun_map: SunMap::default(),
            environment: scene.environment.clone(),
            light: scene.light,
            times,
            version: another_version(),
            surfel_version: 0,
            placement_version: 0,
        };
        for (i, mirror) in scene.mirrors.iter().enumerate() {
            prepared.set_mirror(i, &mirror.transform);
        }
        prepared.build_mirror_triangles();
        for (i, object) in scene.objects.iter().enumerate() {
            prepared.place(i, &object.transform);
        }
        prepared.average();
        Ok(prepared)
    }

    /// The scene's own eye for a picture of this size; `None` if its description makes no view (see
    /// [`Eye::new`]).
    pub fn eye_for(&self, size: ImageSize) -> Option<Eye> {
        self.eye_of(&self.eye, size)
    }

    /// Another eye; `None` if its description makes no view (see [`Eye::new`]).
    pub fn eye_of(&self, eye: &EyeDescription, size: ImageSize) -> Option<Eye> {
        let EyeDescription { position, target, up, fov_y } = *eye;
        Eye::new(position - self.origin, target - self.origin, up, fov_y, size)
    }

    /// Gives the representatives the colours of what they stand for.
    fn average(&mut self) {
        self.surfel_version = another_version();
        // Shadows are cast from where objects are now.
        self.placement_version = another_version();
        for cloud in &self.clouds[..self.objects.len()] {
            cloud.tree.average(&mut self.surfels.radiance, cloud.surfels.start as usize);
            cloud.tree.average(&mut self.surfels.albedo, cloud.surfels.start as usize);
        }
        let both = self.surfels.normals.par_iter().zip(&self.surfels.radiance);
        both.map(|(n, c)| Look::new(*n, *c)).collect_into_vec(&mut self.looks);
    }

    /// Number of surfels over all objects, without representatives.
    pub fn surfel_count(&self) -> usize {
        self.clouds[..self.objects.len()].iter().map(|o| o.surfels.len()).sum()
    }
}

/// Milliseconds since `start`.
pub(crate) fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

fn index(n: usize) -> u32 {
    u32::try_from(n).expect("fewer than 2^32 surfels")
}

/// The surfels of each object: as its points are given, thinned if there are more than its part, or else sampled.
fn sample_objects(scene: &Scene, options: &PrepareOptions, cx: &Context) -> Result<Vec<Surfels>> {
    let mut list = Vec::with_capacity(scene.objects.len());
    for (object, count) in scene.objects.iter().zip(allot(scene, options.surfels)) {
        list.push(match &object.points {
            Some(points) => {
                let mut own = sample::given::thinned(points, count);
                sample::given::colored(&mut own, &object.paint);
                own
            }
            None => sample::sample(&object.mesh, &object.paint, count, options.seed, cx)?,
        });
    }
    Ok(list)
}

/// Of all surfels, so many are clouds' at most, where there are meshes, too.
const CLOUDS: f64 = 0.75;

/// Each object's part of the surfels. Clouds keep their points as far as there is room; meshes share the rest by area and
/// density.
fn allot(scene: &Scene, total: usize) -> Vec<usize> {
    let points: Vec<usize> =
        scene.objects.iter().map(|o| o.points.as_ref().map_or(0, |points| points.len())).collect();
    let all: usize = points.iter().sum();
    let alone = points.iter().all(|&count| count > 0);
    let room = if alone { 1.0 } else { CLOUDS } * total as f64;
    let part = (room / all.max(1) as f64).min(1.0);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a part of a count"
    )]
    let of_cloud = |count: usize| ((count as f64 * part) as usize).max(1);
    let taken: usize =
        points.iter().filter(|&&count| count > 0).map(|&count| of_cloud(count)).sum();
    let mesh = |i: &usize| points[*i] == 0;
    let meshes: Vec<usize> = (0..points.len()).filter(mesh).collect();
    let area = |&i: &usize| {
        let object = &scene.objects[i];
        object.mesh.area() * object.transform.scale.powi(2)
    };
    let areas: Vec<f64> = meshes.iter().map(area).collect();
    let densities: Vec<f64> = meshes.iter().map(|&i| scene.objects[i].density).collect();
    let mut shares = points.iter().map(|&count| of_cloud(count)).collect::<Vec<usize>>();
    let of_meshes = sample::allot(&areas, &densities, total.saturating_sub(taken));
    meshes.iter().zip(of_meshes).for_each(|(&i, share)| shares[i] = share);
    shares
}

/// Surfels of all mirrors together, at most.
const MIRROR_SURFELS: usize = 1 << 16;

/// The mirrors' surfels: not more than `most` or so.
pub(super) fn sample_mirrors(
    scene: &Scene,
    most: usize,
    seed: u64,
    cx: &Context,
) -> Result<Vec<Surfels>> {
    let areas: Vec<f64> =
        scene.mirrors.iter().map(|m| m.mesh.area() * m.transform.scale.powi(2)).collect();
    let counts = sample::allot(&areas, &[], most.min(MIRROR_SURFELS));
    let paint = Paint::Constant(Vec3::ZERO);
    let of =
        |(mirror, count): (&Mirror, usize)| sample::sample(&mirror.mesh, &paint, count, seed, cx);
    scene.mirrors.iter().zip(counts).map(of).collect()
}

/// Mirrors without positions and normals.
fn unplaced_mirrors(scene: &Scene) -> Vec<PreparedMirror> {
    let mut first_triangle = 0;
    let unplaced = |m: &Mirror| {
        let mirror = PreparedMirror {
            name: m.name.clone(),
            mesh: Arc::clone(&m.mesh),
            positions: Vec::new(),
            normals: Vec::new(),
            tint: m.tint,
            first_triangle,
            source: m.source.clone(),
            proxy: m.proxy.clone(),
        };
        first_triangle += index(m.mesh.triangles().len());
        mirror
    };
    scene.mirrors.iter().map(unplaced).collect()
}

/// The middle of the mirrors' box, rounded to what f32 holds exactly near it.
fn mirror_center(scene: &Scene) -> DVec3 {
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for mirror in &scene.mirrors {
        for p in mirror.mesh.positions() {
            let p = mirror.transform.point(p.as_dvec3());
            (min, max) = (min.min(p), max.max(p));
        }
    }
    let center = (min + max) * 0.5;
    if center.is_finite() { center.round() } else { DVec3::ZERO }
}

fn append(all: &mut Surfels, own: Surfels) {
    let n = own.len();
    all.x.extend(&own.x[..n]);
    all.y.extend(&own.y[..n]);
    all.z.extend(&own.z[..n]);
    all.normals.extend(own.normals);
    all.albedo.extend(own.albedo);
    all.radiance.extend(own.radiance);
    all.extent.extend(own.extent);
}

fn pad(surfels: &mut Surfels) {
    for list in [&mut surfels.x, &mut surfels.y, &mut surfels.z, &mut surfels.extent] {
        let last = list.last().copied().unwrap_or(0.0);
        list.extend([last; PADDING]);
    }
}
