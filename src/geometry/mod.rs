//! Shapes and numbers: nothing in here knows of mirrors or cameras.

pub mod aabb;
pub mod lanes;
pub mod mesh;
pub mod surfel;
pub mod transform;

pub use aabb::Aabb;
pub use mesh::{Mesh, MeshDefect};
pub use surfel::Surfels;
pub use transform::Similarity;
