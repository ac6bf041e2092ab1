//! Pictures as planes of numbers: made by the frame, written, read back and compared.

#[cfg(feature = "cli")]
pub mod aov;
pub mod color;
pub mod compare;
pub mod flip;
#[cfg(feature = "cli")]
pub mod header;
#[cfg(feature = "cli")]
pub mod io;
pub mod picture;
pub mod planes;
#[cfg(feature = "cli")]
pub mod streamed;
pub mod temporal;

pub use picture::Picture;
pub use planes::{NONE, Planes, Reason};
