//! Cancellation and progress, handed down to everything that can take longer than a moment.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

/// Receives progress. The command line draws bars, the viewer its own, tests nothing.
pub trait Progress: Send + Sync {
    /// `stage` is a short name ("sampling"); `done` runs from 0 to 1.
    fn report(&self, stage: &str, done: f64);
}

/// What long work is given: whether to go on, where to say how far it is, and how much memory it may take.
#[derive(Clone, Default)]
pub struct Context {
    cancel: Arc<AtomicBool>,
    progress: Option<Arc<dyn Progress>>,
    memory: Option<MemoryLimit>,
}

/// How much memory the program may take.
#[derive(Clone, Copy, Debug)]
pub struct MemoryLimit {
    /// All of the program, bytes.
    pub bytes: u64,
    /// Bytes that the program has taken so far.
    pub taken: fn() -> u64,
}

/// Bytes that are taken without asking how many others there are.
const SMALL: u64 = 1 << 20;

impl Context {
    /// A context that reports to `progress`.
    pub fn new(progress: Arc<dyn Progress>) -> Self {
        Self { progress: Some(progress), ..Self::default() }
    }

    /// A context without progress that this flag cancels.
    pub fn cancelled_by(flag: Arc<AtomicBool>) -> Self {
        Self { cancel: flag, ..Self::default() }
    }

    /// The same with another limit on its memory; `None`: none.
    #[must_use]
    pub fn with_memory(self, memory: Option<MemoryLimit>) -> Self {
        Self { memory, ..self }
    }

    /// The same without progress.
    #[must_use]
    pub fn silent(&self) -> Self {
        Self { progress: None, ..self.clone() }
    }

    /// The limit on its memory.
    pub fn memory(&self) -> Option<MemoryLimit> {
        self.memory
    }

    /// Whether there is room for so many bytes more, to be asked before they are taken. `name` is the file or option that
    /// asks for them, `what` they are for.
    ///
    /// # Errors
    /// [`Error::Input`] if the limit would be passed.
    pub fn room_for(&self, name: &str, what: &str, bytes: u64) -> Result<()> {
        let Some(MemoryLimit { bytes: limit, taken }) = self.memory else { return Ok(()) };
        // Little things are not worth the question.
        if bytes < SMALL && bytes < limit {
            return Ok(());
        }
        let taken = taken();
        if taken.saturating_add(bytes) <= limit {
            return Ok(());
        }
        let problem = format!(
            "{what} need about {} of memory, and of the {} allowed {} are taken",
            told(bytes),
            told(limit),
            told(taken)
        );
        Err(Error::input(
            name,
            "",
            problem,
            "choose something smaller, or allow more (--max-memory)",
        ))
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

/// An amount of memory, for people.
fn told(bytes: u64) -> String {
    let bytes = bytes as f64;
    if bytes < 1e9 { format!("{:.0} MB", bytes * 1e-6) } else { format!("{:.2} GB", bytes * 1e-9) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused_by_name() {
        let limit = MemoryLimit { bytes: 3_000_000_000, taken: || 1_000_000_000 };
        let cx = Context::default().with_memory(Some(limit));
        assert!(cx.room_for("a.ply", "9 points", 2_000_000_000).is_ok());
        let error = cx.room_for("a.ply", "9 points", 2_000_000_001).unwrap_err().to_string();
        let expected = "a.ply: 9 points need about 2.00 GB of memory, and of the 3.00 GB allowed 1.00 GB are taken; choose";
        assert!(error.starts_with(expected), "{error}");
        let small = MemoryLimit { bytes: 90_000_000, taken: || 64_000_000 };
        let cx = cx.with_memory(Some(small));
        let error = cx.room_for("a.ply", "9 points", 195_000_000).unwrap_err().to_string();
        assert!(error.contains("195 MB of memory, and of the 90 MB allowed 64 MB are"), "{error}");
        assert!(cx.room_for("a.ply", "9 points", u64::MAX).is_err());
        assert!(cx.with_memory(None).room_for("a.ply", "9 points", u64::MAX).is_ok());
    }
}
