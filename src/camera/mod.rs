//! The viewer's pinhole (the *eye*) and the continuous 3-ray cameras of the mirrors.

pub mod eye;
pub mod mirror_ray;

pub use eye::Eye;
pub use mirror_ray::{MirrorTriangle, RayScale};
