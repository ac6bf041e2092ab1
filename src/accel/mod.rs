//! Spatial structures: our kd-tree over surfels; triangles use the `obvhs` crate.

pub mod kd_tree;

pub use kd_tree::{KdTree, KdTreeLimits};
