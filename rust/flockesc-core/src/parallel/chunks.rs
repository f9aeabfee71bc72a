//! Parallel loops over the groups of one flock, in chunks.

use rayon::prelude::*;

use super::pools::is_pooled;

/// Smallest number of items (groups of agents) for a parallel loop.
pub(crate) const MIN_ITEMS: usize = 64;
/// Smallest number of integers that are sorted in parallel.
const MIN_SORTED: usize = 1 << 14;
/// Number of items in a chunk.
const CHUNK: usize = 16;

/// Calls `work(first, chunk)` for all chunks of `items`, as [`for_each_pair`] does.
pub(crate) fn for_each_chunk<A: Send>(items: &mut [A], work: impl Fn(usize, &mut [A]) + Sync) {
    let mut nothing = vec![(); items.len()];
    for_each_pair(items, &mut nothing, |first, items, _| work(first, items));
}

/// Calls `work(first, chunk of a, chunk of b)` for all chunks, where `first` is the index of the chunks'
/// first item. Runs in parallel if there are at least [`MIN_ITEMS`] items and the calling thread belongs to a
/// pool.
pub(crate) fn for_each_pair<A: Send, B: Send>(
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

/// Returns the number of chunks of `items` items.
pub(crate) fn num_chunks(items: usize) -> usize {
    items.div_ceil(CHUNK)
}

/// Calls `work(first, chunk of a, scratch of the chunk)` for all chunks, as [`for_each_pair`] does.
/// `scratch` has one item for each of [`num_chunks`] chunks.
pub(crate) fn for_each_chunk_with<A: Send, B: Send>(
    a: &mut [A],
    scratch: &mut [B],
    work: impl Fn(usize, &mut [A], &mut B) + Sync,
) {
    if a.len() >= MIN_ITEMS && is_pooled() {
        a.par_chunks_mut(CHUNK)
            .zip(scratch)
            .enumerate()
            .for_each(|(index, (a, scratch))| work(index * CHUNK, a, scratch));
    } else {
        for (index, (a, scratch)) in a.chunks_mut(CHUNK).zip(scratch).enumerate() {
            work(index * CHUNK, a, scratch);
        }
    }
}

/// Maps the chunks of `items` and folds the results, in parallel if there are many. `fold` must be
/// associative and commutative. Returns `None` if there are no items.
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

/// Sorts `items`, in parallel if there are many.
pub(crate) fn sort(items: &mut [u64]) {
    if items.len() >= MIN_SORTED && is_pooled() {
        items.par_sort_unstable();
    } else {
        items.sort_unstable();
    }
}
