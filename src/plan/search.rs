//! Reflections drawn by searching for every vertex or surfel on the reflector.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;

use super::SplatShape;
use crate::camera::Eye;
use crate::camera::reflector::{ReflectorMap, estalella};
use crate::visibility::Visibility;

/// Which way a surface is curved, seen from the mirror side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bend {
    /// Not at all.
    Flat,
    /// In flat faces that meet at edges: images jump from one to the next.
    Faceted,
    /// Outward everywhere: every point has one image.
    Convex,
    /// Inward everywhere.
    Concave,
    /// Both, or as a saddle.
    Mixed,
}

/// A star-shaped part of a mirror.
#[derive(Clone, Debug)]
pub struct ReflectorPart {
    /// For messages: the mirror's name, and the part's.
    pub name: String,
    /// Index of the mirror.
    pub mirror: usize,
    /// Its triangles over all mirrors: only pixels that show one of them are its own.
    pub triangles: Range<u32>,
    /// Where the map is seen from, the mirror's local space.
    pub center: Vec3,
    /// In the mirror's local space, about `center`.
    pub map: ReflectorMap,
    /// What of a point's images can be found.
    pub bend: Bend,
}

impl ReflectorPart {
    /// Whether the centre of a pixel shows the part.
    pub fn owns(&self, visibility: &Visibility, pixel: usize) -> bool {
        self.triangles.contains(&visibility.mirror_ids[pixel])
    }
}

/// How reflection points are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Search {
    /// Estalella et al. 2005. Vertices that the reflector hides are searched for, too.
    Estalella(estalella::Ends),
    /// Roger & Holzschuch 2006.
    Roger {
        /// Steps at most.
        iterations: u32,
        /// It ends when a step moves the image by less than this many pixels; 0: never before `iterations`.
        px: f32,
    },
}

/// What is searched for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Primitive {
    /// The vertices of the objects' meshes; what is between them is drawn as triangles.
    Triangles {
        /// Edges whose images are longer than this many pixels are halved, a few times at most; infinity: none are.
        longest_px: f32,
    },
    /// All surfels of the objects.
    Points(SplatShape),
}

/// A grid about an object's vertices (Estalella et al. section 5): its corners are searched for, and the vertices' images
/// interpolated between theirs.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    /// Corners of the cells that hold a vertex, object space.
    pub corners: Vec<Vec3>,
    /// Of each vertex: the corners of its cell (x fastest), and its place in it.
    pub vertices: Vec<([u32; 8], [f32; 3])>,
}

/// Searches for vertices or surfels on reflectors and draws them.
pub struct SearchPass<'a> {
    /// The eye.
    pub eye: &'a Eye,
    /// What is reflected in.
    pub parts: Arc<Vec<ReflectorPart>>,
    /// How.
    pub search: Search,
    /// What.
    pub primitive: Primitive,
    /// By object; empty: every vertex is searched for.
    pub grids: Arc<Vec<Grid>>,
}
