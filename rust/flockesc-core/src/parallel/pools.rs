//! The crate's own thread pools, safe after `fork`.

use std::sync::atomic::{AtomicUsize, Ordering};

use once_cell::race::OnceBox;
use rayon::{ThreadPool, ThreadPoolBuilder};

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

/// Whether this is a thread of a pool of several, so that rayon does not fall back on its global pool.
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
