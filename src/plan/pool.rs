//! Memory that tasks borrow and give back, so that a frame in steady state allocates nothing.

use std::ops::{Deref, DerefMut};
use std::sync::Mutex;

/// A stock of reusable values.
#[derive(Default)]
pub(crate) struct Pool<T>(Mutex<Vec<T>>);

impl<T: Default> Pool<T> {
    /// Takes one from the stock, or makes one.
    pub(crate) fn take(&self) -> Pooled<'_, T> {
        let value = self.lock().pop().unwrap_or_default();
        Pooled { pool: self, value }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<T>> {
        // A value is never half changed while the lock is held.
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

/// Goes back to its pool when dropped.
pub(crate) struct Pooled<'a, T: Default> {
    pool: &'a Pool<T>,
    value: T,
}

impl<T: Default> Deref for Pooled<'_, T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T: Default> DerefMut for Pooled<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<T: Default> Drop for Pooled<'_, T> {
    fn drop(&mut self) {
        self.pool.lock().push(std::mem::take(&mut self.value));
    }
}
