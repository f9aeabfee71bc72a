//! The crate's thread pools, which are safe to use after `fork`.

use std::sync::atomic::{AtomicUsize, Ordering};

use once_cell::race::OnceBox;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::base::error::{Error, Result};

/// Largest number of threads of a call.
const MAX_THREADS: usize = 1024;

/// A lock-free linked list of all pools. A lock would stay locked in a child process if another thread held
/// it during the fork. A child inherits its parent's pools without their threads. It neither uses them nor
/// drops them, because dropping a pool waits for its threads.
static POOLS: OnceBox<Node> = OnceBox::new();

/// Number of calls of [`forked`] in this process and its ancestors.
static FORKS: AtomicUsize = AtomicUsize::new(0);

/// A node of the list: a pool, and the process id and fork count of the process that started it.
struct Node {
    pool: ThreadPool,
    process: (u32, usize),
    next: OnceBox<Node>,
}

/// Marks this process as a forked child. The process id alone does not identify a process, because ids are
/// reused, and the first processes of two containers have the same id.
pub fn forked() {
    FORKS.fetch_add(1, Ordering::Relaxed);
}

/// Returns this process's pool of `num_threads` threads, and starts it at the first call. `None` is one
/// thread per core.
///
/// # Errors
/// [`Error::Argument`] if `num_threads` is 0 or above [`MAX_THREADS`], or if threads cannot be started.
pub(crate) fn pool(num_threads: Option<usize>) -> Result<&'static ThreadPool> {
    let threads = self::num_threads(num_threads);
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
        let node = link.get_or_try_init(|| start(threads, process))?;
        if node.process == process && node.pool.current_num_threads() == threads {
            return Ok(&node.pool);
        }
        link = &node.next;
    }
}

/// Starts a pool. If two threads start one at the same time, one of the pools is dropped.
fn start(threads: usize, process: (u32, usize)) -> Result<Box<Node>> {
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| {
            let expected = "a number of threads that the system can start";
            Error::argument("num_threads", expected, error)
        })?;
    Ok(Box::new(Node {
        pool,
        process,
        next: OnceBox::new(),
    }))
}

/// Returns a number of threads; `None` is one per core.
pub(crate) fn num_threads(num_threads: Option<usize>) -> usize {
    num_threads.unwrap_or_else(available_threads)
}

/// Returns the default number of threads, one per core.
fn available_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Returns whether the calling thread belongs to a pool of several threads. On other threads, rayon would use
/// its global pool.
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
    fn all_threads_of_a_process_get_the_same_pool() {
        let started = thread::scope(|scope| {
            let handles: Vec<_> = (0..8).map(|_| scope.spawn(|| address(3))).collect();
            handles
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
