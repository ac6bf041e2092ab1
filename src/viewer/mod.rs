//! The window: the scene live, two methods side by side, and the inside of the method. It holds no algorithm.
//!
//! ```text
//! hands ─► Viewer ─ wish (the latest wins) ─► renderer's thread ─ shot ─► Viewer ─► window
//! files ─► loader's thread ─ PreparedScene, first small, then whole ─►┘
//! ```

mod app;
mod blit;
mod canvas;
mod command;
mod dialog;
mod gizmo;
mod legend;
mod measure;
mod navigation;
mod overlay;
mod panels;
mod placing;
mod settings;
#[cfg(test)]
mod tests;
mod window;
mod worker;

use std::path::PathBuf;
use std::time::Instant;

pub use measure::Outcome;
pub use window::run;
pub use worker::{BackendChoice, Prepared, Side};

use crate::camera::eye::ImageSize;
use crate::context::MemoryLimit;
use crate::scene::arrange::Request;
use crate::scene::prepared::PrepareOptions;

/// What the window opens with.
#[derive(Clone, Debug)]
pub struct Opening {
    /// The scene.
    pub request: Request,
    /// How it is prepared.
    pub prepare: PrepareOptions,
    /// The method shown first; `None`: as last time.
    pub side: Option<Side>,
    /// Size of the window, points; `None`: as last time.
    pub size: Option<ImageSize>,
    /// Draw so many frames of an orbit, then close.
    pub frames: Option<u32>,
    /// Write a picture of the window once it shows the whole scene, then close.
    pub screenshot: Option<PathBuf>,
    /// When the program started.
    pub started: Instant,
    /// How much memory loading may take.
    pub memory: Option<MemoryLimit>,
    /// Told what failed, besides the window: files that cannot be opened, say.
    pub on_failure: Option<fn(&str)>,
}

impl Opening {
    /// Nobody is at the window: nothing is remembered.
    fn is_measurement(&self) -> bool {
        self.frames.is_some() || self.screenshot.is_some()
    }
}
