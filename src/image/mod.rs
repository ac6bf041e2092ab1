//! Pictures as planes of numbers: made by the frame, written, read back and compared.

pub mod planes;

pub use planes::{NONE, Planes, Reason};
