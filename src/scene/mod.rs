//! What is to be rendered: read, made or given, then sampled, shaded and sorted into trees.

pub mod description;
pub mod environment;
pub mod shade;
