//! The viewer's pinhole (the *eye*) and the continuous 3-ray cameras of the mirrors.

pub mod eye;
pub mod three_ray;

pub use eye::Eye;
