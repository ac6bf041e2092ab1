//! What executes a frame.

pub mod cpu;
