//! Spatial structures: our kd-tree over surfels; triangles use the `obvhs` crate.

pub mod kd_tree;
pub mod triangle_bvh;

pub use kd_tree::{KdTree, KdTreeLimits};
pub use triangle_bvh::{Hit, Ray, TriangleBvh};
