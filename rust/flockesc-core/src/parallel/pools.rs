//! The crate's thread pools, which are safe to use after `fork`.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use once_cell::race::OnceBox;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::base::check::{rounding, within};
use crate::base::error::{Error, Result};

/// Largest number of threads of a call.
const MAX_THREADS: usize = 1024;

/// Largest number of pools that a process keeps.
const MAX_POOLS: usize = 4;

/// A lock-free linked list of processes: this one and its ancestors that had pools. A child inherits its
/// parent's pools without their threads, and its parent's locks, which other threads may have held during
/// the fork. It neither uses nor drops them.
static PROCESSES: OnceBox<Process> = OnceBox::new();

/// Number of calls of [`forked`] in this process and its ancestors.
static FORKS: AtomicUsize = AtomicUsize::new(0);

/// A process that has started pools.
struct Process {
    /// Process id and fork count.
    id: (u32, usize),
    /// At most [`MAX_POOLS`] pools with different numbers of threads; the last one was used last.
    pools: Mutex<Vec<Arc<ThreadPool>>>,
    next: OnceBox<Process>,
}

/// Marks this process as a forked child. The process id alone does not identify a process, because ids are
/// reused, and the first processes of two containers have the same id.
pub fn forked() {
    FORKS.fetch_add(1, Ordering::Relaxed);
}

/// Returns this process's pool of `num_threads` threads. `None` is one thread per core. The pool stays for
/// later calls until [`MAX_POOLS`] others have been used after it.
///
/// # Errors
/// [`Error::Input`] if `num_threads` is 0 or above [`MAX_THREADS`], or if threads cannot be started;
/// [`Error::Rounding`], because threads inherit the rounding mode of the thread that starts them.
pub(crate) fn pool(num_threads: Option<usize>) -> Result<Arc<ThreadPool>> {
    rounding()?;
    let threads = self::num_threads(num_threads);
    within("num_threads", threads, 1, MAX_THREADS)?;
    this_process().pool(threads)
}

impl Process {
    fn new(id: (u32, usize)) -> Self {
        Self {
            id,
            pools: Mutex::default(),
            next: OnceBox::new(),
        }
    }

    fn pool(&self, threads: usize) -> Result<Arc<ThreadPool>> {
        let mut pools = self.pools.lock().unwrap_or_else(PoisonError::into_inner);
        let is_known = |pool: &Arc<ThreadPool>| pool.current_num_threads() == threads;
        let pool = match pools.iter().position(is_known) {
            Some(index) => pools.remove(index),
            None => start(threads)?,
        };
        pools.push(pool.clone());
        if pools.len() > MAX_POOLS {
            pools.remove(0);
        }
        Ok(pool)
    }
}

/// Returns the entry of this process in the list.
fn this_process() -> &'static Process {
    let id = (std::process::id(), FORKS.load(Ordering::Relaxed));
    let mut link = &PROCESSES;
    loop {
        let process = link.get_or_init(|| Box::new(Process::new(id)));
        if process.id == id {
            return process;
        }
        link = &process.next;
    }
}

fn start(threads: usize) -> Result<Arc<ThreadPool>> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map(Arc::new).map_err(|error| {
        let expected = "a number of threads that the system can start";
        Error::input("num_threads", expected, error)
    })
}

/// Returns a number of threads; `None` is one per core.
pub(crate) fn num_threads(num_threads: Option<usize>) -> usize {
    num_threads.unwrap_or_else(|| thread::available_parallelism().map_or(1, usize::from))
}

/// Returns whether the calling thread belongs to a pool of several threads. On other threads, rayon would use
/// its global pool.
pub(super) fn is_pooled() -> bool {
    rayon::current_thread_index().is_some() && rayon::current_num_threads() > 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_threads_share_the_pools_that_were_used_last() {
        let process = Process::new((0, 0));
        let started = |threads| {
            let pool = process.pool(threads).expect("few threads");
            assert_eq!(pool.current_num_threads(), threads);
            pool
        };
        let pools: Vec<_> = thread::scope(|scope| {
            let handles: Vec<_> = (0..8).map(|_| scope.spawn(|| started(3))).collect();
            let joined = handles.into_iter().map(|thread| thread.join());
            joined.map(|pool| pool.expect("a pool")).collect()
        });
        assert!(pools.iter().all(|pool| Arc::ptr_eq(pool, &started(3))));
        let first = Arc::downgrade(&pools[0]);
        drop(pools);
        for threads in 4..4 + MAX_POOLS {
            assert!(first.upgrade().is_some());
            assert!(Arc::ptr_eq(&started(threads), &started(threads)));
        }
        assert!(first.upgrade().is_none());
    }

    #[test]
    fn a_forked_child_has_its_own_pools() {
        let before = this_process();
        forked();
        assert!(!std::ptr::eq(before, this_process()));
    }
}
