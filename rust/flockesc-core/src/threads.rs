//! The crate's own thread pools, safe after `fork`, and the hook by which a long call is watched and stopped.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use once_cell::race::OnceBox;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::agents::GROUP;
use crate::base::error::{Error, Result};

/// Most threads that a call may ask for.
const MAX_THREADS: usize = 1024;

/// All pools, in a list without locks: one that another thread held at the moment of a fork would stay locked in the
/// child for ever. A child inherits its parent's pools without their threads. It never uses them, and they are never
/// dropped, because dropping would wait for threads that do not exist.
static POOLS: OnceBox<Started> = OnceBox::new();

/// How often [`forked`] was called here or in a process that this one descends from.
static FORKS: AtomicUsize = AtomicUsize::new(0);

/// A pool and whose it is.
struct Started {
    pool: ThreadPool,
    process: (u32, usize),
    next: OnceBox<Started>,
}

/// Tells a child process that it is one. The process id alone would not: a parent that has ended leaves its id, and
/// the first process of a container has the same as the first of another.
pub fn forked() {
    FORKS.fetch_add(1, Ordering::Relaxed);
}

/// The pool of `num_threads` threads of this process (`None`: one thread per core).
///
/// # Errors
/// [`Error::Argument`] if `num_threads` is 0 or above [`MAX_THREADS`], or if threads cannot be started.
pub(crate) fn pool(num_threads: Option<usize>) -> Result<&'static ThreadPool> {
    let threads = num_threads.unwrap_or_else(available_threads);
    if !(1..=MAX_THREADS).contains(&threads) {
        return Err(Error::argument(
            "num_threads",
            format!("an integer from 1 to {MAX_THREADS}"),
            threads,
        ));
    }
    let process = (std::process::id(), FORKS.load(Ordering::Relaxed));
    let mut link = &POOLS;
    loop {
        let started = link.get_or_try_init(|| start(threads, process))?;
        if started.process == process && started.pool.current_num_threads() == threads {
            return Ok(&started.pool);
        }
        link = &started.next;
    }
}

/// A new pool; of two that are started at once one is dropped, which ends its threads.
fn start(threads: usize, process: (u32, usize)) -> Result<Box<Started>> {
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Error::argument("num_threads", "threads that can be started", error))?;
    Ok(Box::new(Started {
        pool,
        process,
        next: OnceBox::new(),
    }))
}

/// Number of threads that `None` stands for.
fn available_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Groups of agents from which on it pays to spread one flock over threads.
const SPREAD: usize = 64;
/// Groups that one thread takes at a time.
const CHUNK: usize = 16;

/// Calls `work(index of the first, some of a, as many of b)` until all groups are done: in parallel on a thread of a pool,
/// if there are many.
pub(crate) fn for_each_chunk<A: Send, B: Send>(
    a: &mut [A],
    b: &mut [B],
    work: impl Fn(usize, &mut [A], &mut [B]) + Sync,
) {
    if a.len() >= SPREAD && is_pooled() {
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
    if a.len() >= SPREAD && is_pooled() {
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
    if items.len() >= SPREAD && is_pooled() {
        items.par_chunks(CHUNK).map(map).reduce_with(fold)
    } else {
        Some(map(items))
    }
}

/// Whether a flock of so many agents is worth more than one thread.
pub(crate) fn is_large(num_agents: usize) -> bool {
    num_agents >= SPREAD * GROUP
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

/// Whether this is a thread of a pool of several, so that rayon does not fall back on its global pool.
fn is_pooled() -> bool {
    rayon::current_thread_index().is_some() && rayon::current_num_threads() > 1
}

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

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    fn address(threads: usize) -> usize {
        let pool = pool(Some(threads)).expect("few threads");
        assert_eq!(pool.current_num_threads(), threads);
        std::ptr::from_ref(pool).addr()
    }

    #[test]
    fn whoever_asks_gets_the_pool_of_this_process() {
        let started = thread::scope(|scope| {
            let asked: Vec<_> = (0..8).map(|_| scope.spawn(|| address(3))).collect();
            asked
                .into_iter()
                .map(|thread| thread.join().expect("a pool"))
                .collect::<Vec<_>>()
        });
        assert!(started.iter().all(|pool| *pool == started[0]));
        assert_eq!(address(3), started[0]);
        assert_ne!(address(2), started[0]);
        forked();
        assert_ne!(address(3), started[0]);
    }
}
