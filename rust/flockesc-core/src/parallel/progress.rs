//! The hook by which a long call is watched and stopped.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::base::error::{Error, Result};

/// How far a long call has come, and the wish to stop it; shared between its worker and its watcher.
#[derive(Debug, Default)]
pub struct Progress {
    done: AtomicUsize,
    cancelled: AtomicBool,
}

impl Progress {
    /// Number of finished pieces of work.
    #[must_use]
    pub fn done(&self) -> usize {
        self.done.load(Ordering::Relaxed)
    }

    /// Asks the worker to stop; it returns [`Error::Interrupted`] within one step of the model.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    pub(crate) fn advance(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn check(&self) -> Result<()> {
        if self.cancelled.load(Ordering::Relaxed) {
            Err(Error::Interrupted)
        } else {
            Ok(())
        }
    }
}
