//! Catoptric: accurate reflections on curved mirrors without ray-tracing hardware.

pub mod accel;
pub mod camera;
pub mod context;
pub mod error;
pub mod geometry;
pub mod image;
pub mod methods;
pub mod scene;

pub use context::{Context, Progress};
pub use error::{Error, Result};
