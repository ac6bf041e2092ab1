//! The ray-traced reference: one reflected ray a sample.

pub mod trace;
