//! What is to be rendered: read, made or given, then sampled, shaded and sorted into trees.

#[cfg(feature = "cli")]
pub mod arrange;
pub mod builtin;
pub mod description;
pub mod environment;
#[cfg(feature = "cli")]
pub mod file;
pub mod fit;
pub mod given;
#[cfg(feature = "cli")]
mod library;
#[cfg(feature = "cli")]
pub mod load;
pub mod materials;
pub mod prepared;
pub mod sample;
#[cfg(feature = "cli")]
pub mod scan;
pub mod shade;
pub mod sun_map;

pub use given::GivenSurfels;
pub use prepared::{PrepareOptions, PreparedScene};
