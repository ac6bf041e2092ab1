//! Cancellation and progress, handed down to everything that can take longer than a moment.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

/// Receives progress. The command line draws bars, the viewer its own, tests nothing.
pub trait Progress: Send + Sync {
    /// `stage` is a short name ("sampling"); `done` runs from 0 to 1.
    fn report(&self, stage: &str, done: f64);
}

/// What long work is given: whether to go on, and where to say how far it is.
#[derive(Clone, Default)]
pub struct Context {
    cancel: Arc<AtomicBool>,
    progress: Option<Arc<dyn Progress>>,
}

impl Context {
    /// A context that reports to `progress`.
    pub fn new(progress: Arc<dyn Progress>) -> Self {
        Self { cancel: Arc::default(), progress: Some(progress) }
    }

    /// A context without progress that this flag cancels.
    pub fn cancelled_by(flag: Arc<AtomicBool>) -> Self {
        Self { cancel: flag, progress: None }
    }

    /// The flag that cancels everything that was given this context.
    pub fn cancel_flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.cancel)
    }

    /// Whether to go on.
    ///
    /// # Errors
    /// [`Error::Cancelled`] once the work was cancelled.
    pub fn check(&self) -> Result<()> {
        if self.cancel.load(Ordering::Relaxed) { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// Reports that `stage` is at `done` (0 to 1).
    ///
    /// # Errors
    /// [`Error::Cancelled`] once the work was cancelled.
    pub fn step(&self, stage: &str, done: f64) -> Result<()> {
        self.check()?;
        if let Some(progress) = &self.progress {
            progress.report(stage, done);
        }
        Ok(())
    }
}
