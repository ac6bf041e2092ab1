//! Trees over space: what lies where, found fast.

pub mod triangle_bvh;

pub use triangle_bvh::{Hit, Ray, TriangleBvh};
