//! Shapes and numbers: nothing in here knows of mirrors or cameras.

pub mod aabb;
pub mod bicubic;
pub mod edges;
pub mod lanes;
pub mod look;
pub mod mesh;
pub mod surfel;
pub mod transform;

pub use aabb::Aabb;
pub use bicubic::{BicubicPatch, PatchPoint};
pub use edges::SharedEdge;
pub use mesh::{Mesh, MeshDefect};
pub use surfel::Surfels;
pub use transform::Similarity;
