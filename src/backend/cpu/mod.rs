//! Frames on the CPU.

pub mod direct;
