//! Catoptric: accurate reflections on curved mirrors without ray-tracing hardware.

pub mod accel;
pub mod backend;
pub mod camera;
pub mod context;
pub mod cull;
pub mod error;
pub mod frame;
pub mod geometry;
pub mod image;
pub mod methods;
pub mod plan;
pub mod scene;
pub mod visibility;

pub use context::{Context, Progress};
pub use error::{Error, Result};
