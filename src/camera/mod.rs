//! The viewer's pinhole (the *eye*), the rays that mirrors send on, and the continuous 3-ray cameras.

pub mod eye;
pub mod mirror_ray;
pub mod reflector;
pub mod three_ray;

pub use eye::Eye;
pub use mirror_ray::{MirrorTriangle, RayScale};
