//! A scene as its author means it: meshes, colours, transforms, eye and light. Nothing is prepared yet.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DQuat, DVec3, Vec3};

use super::environment::image::EnvironmentImage;
use super::materials::Materials;
use crate::geometry::lanes::Real;
use crate::geometry::{Mesh, Similarity, Surfels};

/// A scene to be prepared. World space: right-handed, y up unless the eye says otherwise, f64.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Short name for reports.
    pub name: String,
    /// Where it is seen from.
    pub eye: EyeDescription,
    /// Curved mirrors.
    pub mirrors: Vec<Mirror>,
    /// Diffuse things.
    pub objects: Vec<Object>,
    /// What rays meet that meet nothing else.
    pub environment: Environment,
    /// The sun and the ambient light.
    pub light: Light,
    /// What whoever asked for the scene should know about its files: what was passed over, or guessed.
    pub notes: Vec<String>,
}

/// The viewer's pinhole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeDescription {
    /// World space.
    pub position: DVec3,
    /// The point in the middle of the picture, world space.
    pub target: DVec3,
    /// Roughly upward; not parallel to the view.
    pub up: DVec3,
    /// Vertical field of view in radians, more than 0 and less than π.
    pub fov_y: f64,
}

impl EyeDescription {
    /// Moved around its target about `up`, counterclockwise seen from above. `radians`: how far.
    pub fn orbited(&self, radians: f64) -> Self {
        let axis = self.up.try_normalize().unwrap_or(DVec3::Y);
        let turn = DQuat::from_axis_angle(axis, radians);
        Self { position: self.target + turn * (self.position - self.target), ..*self }
    }
}

/// Where a mesh comes from: what a scene file has to say to get it again.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A file, by its absolute path.
    File {
        /// Where it is.
        path: PathBuf,
        /// Which of the things in it, by its name; `None` if it is all of them.
        part: Option<String>,
        /// Its own space to the file's: transforms of mirrors and objects contain it.
        own: Similarity,
    },
    /// A built-in shape, see [`builtin::shape`](super::builtin::shape).
    Shape {
        /// Its name.
        name: String,
        /// About how many triangles, if that was said.
        triangles: Option<usize>,
    },
}

impl Source {
    /// The thing's own space to that of where it comes from.
    pub fn own(&self) -> Similarity {
        match self {
            Self::File { own, .. } => *own,
            Self::Shape { .. } => Similarity::IDENTITY,
        }
    }
}

/// A perfectly specular mesh with smooth normals.
#[derive(Clone, Debug)]
pub struct Mirror {
    /// Name for reports and `--where`.
    pub name: String,
    /// Local space.
    pub mesh: Arc<Mesh>,
    /// Where the mesh comes from; `None` if it was given in code.
    pub source: Option<Source>,
    /// Local to world.
    pub transform: Similarity,
    /// Linear RGB factor of what is reflected.
    pub tint: Vec3,
    /// A closed, star-shaped mesh in the same local space that stands for the mirror where a method needs such a one.
    pub proxy: Option<Proxy>,
}

/// What stands for a mirror.
#[derive(Clone, Debug)]
pub struct Proxy {
    /// Its own space.
    pub mesh: Arc<Mesh>,
    /// Where the mesh comes from; `None` if it was given in code.
    pub source: Option<Source>,
    /// Its own space to the mirror's local space.
    pub transform: Similarity,
}

/// A diffuse mesh.
#[derive(Clone, Debug)]
pub struct Object {
    /// Name for reports and `--where object=NAME`.
    pub name: String,
    /// Local space.
    pub mesh: Arc<Mesh>,
    /// The surfels of a thing that was given as points, local space: the mesh only stands for them where triangles are
    /// needed (direct view, shadows, rays).
    pub points: Option<Arc<Surfels>>,
    /// Where the mesh comes from; `None` if it was given in code.
    pub source: Option<Source>,
    /// Local to world.
    pub transform: Similarity,
    /// Its colour.
    pub paint: Paint,
    /// Surfels per area relative to the other objects; 1 by default.
    pub density: f64,
}

/// Where the colour (linear RGB reflectance) of a surface point comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Paint {
    /// The mesh's vertex colours, interpolated.
    Vertex,
    /// The same everywhere.
    Constant(Vec3),
    /// Two colours by the position in local space.
    Pattern {
        /// Which pattern.
        kind: PatternKind,
        /// Its two colours.
        colors: [Vec3; 2],
        /// Length of a period in local units.
        period: f32,
    },
    /// Each triangle's own, with textures.
    Materials(Arc<Materials>),
}

/// Solid patterns: functions of the local position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PatternKind {
    /// Alternating cubes.
    Checker,
    /// Bands along local y.
    Stripes,
    /// Rings about the local y axis.
    Rings,
}

impl Paint {
    /// The colour at a point of a mesh.
    ///
    /// `triangle` and `weights` say where it is (for vertex colours and textures); patterns take the position from the
    /// mesh. `radius`, local units, of the surroundings over which textures are averaged; 0 for the point alone. Meshes
    /// without vertex colours are white.
    pub fn color(&self, mesh: &Mesh, triangle: usize, weights: [f32; 3], radius: f32) -> Vec3 {
        let of_vertices = |list: &[Vec3]| {
            let corner = mesh.triangles()[triangle].map(|i| list[i as usize]);
            corner[0] * weights[0] + corner[1] * weights[1] + corner[2] * weights[2]
        };
        let vertex =
            || if mesh.colors().is_empty() { Vec3::ONE } else { of_vertices(mesh.colors()) };
        match self {
            Self::Vertex => vertex(),
            Self::Constant(color) => *color,
            Self::Pattern { kind, colors, period } => {
                let position = of_vertices(mesh.positions());
                let odd = kind.is_odd((position / *period).to_array());
                colors[usize::from(odd)]
            }
            Self::Materials(materials) => {
                let density = || materials.texels_per_length(triangle, mesh.corners(triangle));
                let texels = if radius > 0.0 { radius * density() } else { 0.0 };
                vertex() * materials.color(triangle, weights, texels)
            }
        }
    }
}

impl PatternKind {
    /// Whether the second colour is at a position (in periods), in lanes.
    #[inline(always)]
    pub fn is_odd<R: Real<Scalar = f32>>(self, position: [R; 3]) -> R::Mask {
        // A hair off the origin, so that a face at a multiple of the period is not noise.
        const HAIR: f32 = 1.0e-4;
        let [x, y, z] = [position[0] + HAIR, position[1] + HAIR, position[2] + HAIR];
        let cell = match self {
            Self::Checker => x.floor() + y.floor() + z.floor(),
            Self::Stripes => y.floor(),
            Self::Rings => (x * x + z * z).sqrt().floor(),
        };
        let half = cell * 0.5;
        half.floor().lt(half)
    }
}

/// What a ray meets that meets nothing else: a function of its direction.
#[derive(Clone, Debug, PartialEq)]
pub enum Environment {
    /// The same everywhere, linear RGB.
    Constant(Vec3),
    /// A clear sky: zenith and horizon colours, a ground colour below the horizon and the sun's disc.
    Sky {
        /// Straight up, linear RGB.
        zenith: Vec3,
        /// At the horizon, linear RGB.
        horizon: Vec3,
        /// Below the horizon, linear RGB.
        ground: Vec3,
    },
    /// A panorama. It has its own sun, if any: the light's disc is not drawn over it.
    Image(Arc<EnvironmentImage>),
}

/// One distant sun and an ambient term.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Towards the sun, unit, world space.
    pub to_sun: Vec3,
    /// Linear RGB factor of max(n·l, 0).
    pub sun: Vec3,
    /// Linear RGB factor everywhere.
    pub ambient: Vec3,
}
