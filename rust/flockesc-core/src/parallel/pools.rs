//! The crate's own thread pools, safe after `fork`.

use std::sync::atomic::{AtomicUsize, Ordering};

use once_cell::race::OnceBox;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::base::error::{Error, Result};

/// Most threads that a call may ask for.
const MAX_THREADS: usize = 1024;

/// All pools, in a list without locks: a lock held by another thread during a fork stays locked in the child. A child
/// inherits its parent's pools without their threads. It never uses them, and it never drops them, because a drop
/// waits for the threads.
static POOLS: OnceBox<Started> = OnceBox::new();

/// Number of calls of [`forked`] in this process and its ancestors.
static FORKS: AtomicUsize = AtomicUsize::new(0);

/// A pool and the process that started it.
struct Started {
    pool: ThreadPool,
    process: (u32, usize),
    next: OnceBox<Started>,
}

/// Marks this process as a forked child. The process id is not enough: ids are reused after a process ends, and the first
/// processes of two containers have the same id.
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

/// A new pool. If two threads start one at once, one of the pools is dropped and its threads end.
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

/// The default number of threads: one per core.
fn available_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Whether the calling thread belongs to a pool of several threads; elsewhere rayon would use its global pool.
pub(super) fn is_pooled() -> bool {
    rayon::current_thread_index().is_some() && rayon::current_num_threads() > 1
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
    fn every_thread_gets_the_pool_of_this_process() {
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
