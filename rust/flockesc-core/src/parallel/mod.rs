//! Multithreading: thread pools, parallel loops over one flock, dispatch of many flocks, cancellation.

mod chunks;
mod dispatch;
mod pools;

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::base::error::{Error, Result};

pub(crate) use chunks::{
    MIN_ITEMS, for_each_chunk, for_each_chunk_with, for_each_pair, map_reduce, num_chunks, sort,
};
pub(crate) use dispatch::{Pool, dispatch};
pub use pools::forked;
pub(crate) use pools::{num_threads, pool};

/// A counter of finished runs and a cancellation flag, shared by a worker and its caller.
#[derive(Debug, Default)]
pub struct Progress {
    done: AtomicUsize,
    cancelled: AtomicBool,
}

impl Progress {
    /// Returns the number of finished runs.
    pub fn done(&self) -> usize {
        self.done.load(Ordering::Relaxed)
    }

    /// Cancels the call. The worker returns [`Error::Interrupted`] after at most one more step of the model.
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
