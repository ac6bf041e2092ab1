//! Long work over all points, with progress.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::context::Context;
use crate::error::Result;

/// A part of a stage that is reported.
#[derive(Clone, Copy)]
pub(super) struct Stage<'a> {
    pub(super) cx: &'a Context,
    pub(super) name: &'static str,
    /// Where in the stage it begins and ends.
    pub(super) from: f64,
    pub(super) to: f64,
}

/// Points between two reports: some milliseconds.
const PART: usize = 1 << 13;

impl<'a> Stage<'a> {
    pub(super) fn new(cx: &'a Context, name: &'static str, from: f64, to: f64) -> Self {
        Self { cx, name, from, to }
    }

    /// Reports that so much of this part is done, 0 to 1.
    pub(super) fn step(&self, done: f64) -> Result<()> {
        self.cx.step(self.name, self.from + (self.to - self.from) * done)
    }

    /// Fills rows of `width` elements, all at once.
    pub(super) fn rows<T: Send>(
        &self,
        list: &mut [T],
        width: usize,
        fill: impl Fn(usize, &mut [T]) + Sync,
    ) -> Result<()> {
        self.step(0.0)?;
        let (total, finished) = (list.len(), AtomicUsize::new(0));
        list.par_chunks_mut(width * PART).enumerate().try_for_each(|(part, rows)| {
            for (row, elements) in rows.chunks_mut(width).enumerate() {
                fill(part * PART + row, elements);
            }
            let finished = finished.fetch_add(rows.len(), Ordering::Relaxed) + rows.len();
            self.step(finished as f64 / total as f64)
        })
    }

    /// What `make` makes of each of `count` indices.
    pub(super) fn map<T: Clone + Default + Send>(
        &self,
        count: usize,
        make: impl Fn(usize) -> T + Sync,
    ) -> Result<Vec<T>> {
        let mut list = vec![T::default(); count];
        self.rows(&mut list, 1, |i, slot| slot[0] = make(i))?;
        Ok(list)
    }
}
