//! Loops over the groups of one flock, in chunks on several threads.

use rayon::prelude::*;

use super::pools::is_pooled;

/// Smallest number of items, groups of agents, that are shared among threads.
pub(crate) const MIN_ITEMS: usize = 64;
/// Items that one thread takes at a time.
const CHUNK: usize = 16;

/// Calls `work(index of the first, some of a, as many of b)` until all are done: in parallel on a thread of a pool,
/// if there are many.
pub(crate) fn for_each_chunk<A: Send, B: Send>(
    a: &mut [A],
    b: &mut [B],
    work: impl Fn(usize, &mut [A], &mut [B]) + Sync,
) {
    if a.len() >= MIN_ITEMS && is_pooled() {
        a.par_chunks_mut(CHUNK)
            .zip(b.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(index, (a, b))| work(index * CHUNK, a, b));
    } else {
        work(0, a, b);
    }
}

/// Number of chunks into which so many items may be cut.
pub(crate) fn num_chunks(items: usize) -> usize {
    items.div_ceil(CHUNK)
}

/// As [`for_each_chunk`], with something of its own for every one of [`num_chunks`] chunks.
pub(crate) fn for_each_chunk_with<A: Send, B: Send>(
    a: &mut [A],
    own: &mut [B],
    work: impl Fn(usize, &mut [A], &mut B) + Sync,
) {
    if a.len() >= MIN_ITEMS && is_pooled() {
        a.par_chunks_mut(CHUNK)
            .zip(own)
            .enumerate()
            .for_each(|(index, (a, own))| work(index * CHUNK, a, own));
    } else {
        for (index, (a, own)) in a.chunks_mut(CHUNK).zip(own).enumerate() {
            work(index * CHUNK, a, own);
        }
    }
}

/// Folds what `map` makes of chunks of `items`, in an order that must not matter.
pub(crate) fn map_reduce<A: Sync, R: Send>(
    items: &[A],
    map: impl Fn(&[A]) -> R + Sync + Send,
    fold: impl Fn(R, R) -> R + Sync + Send,
) -> Option<R> {
    if items.len() >= MIN_ITEMS && is_pooled() {
        items.par_chunks(CHUNK).map(map).reduce_with(fold)
    } else {
        Some(map(items))
    }
}

/// Runs both: in parallel on a thread of a pool, if `is_large`.
pub(crate) fn join(is_large: bool, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
    if is_large && is_pooled() {
        rayon::join(a, b);
    } else {
        a();
        b();
    }
}
