//! What is to be rendered: read, made or given, then sampled, shaded and sorted into trees.

#[cfg(feature = "cli")]
pub mod arrange;
pub mod builtin;
pub mod description;
#[cfg(feature = "cli")]
pub mod file;
pub mod fit;
#[cfg(feature = "cli")]
mod library;
#[cfg(feature = "cli")]
pub mod load;
