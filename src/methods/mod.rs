//! The ways to render a reflection.

pub mod ray_traced;
