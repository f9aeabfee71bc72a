//! Multithreading: thread pools, parallel loops over one flock, dispatch of many flocks, cancellation.

mod chunks;
mod dispatch;
mod pools;
mod progress;

pub(crate) use chunks::{
    MIN_ITEMS, for_each_chunk, for_each_chunk_with, for_each_pair, map_reduce, num_chunks, sort,
};
pub(crate) use dispatch::{Pool, dispatch};
pub use pools::forked;
pub(crate) use pools::{num_threads, pool};
pub use progress::Progress;
