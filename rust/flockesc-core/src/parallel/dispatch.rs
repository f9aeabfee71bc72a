//! Dispatch of independent tasks to threads, with guided self-scheduling.

use std::hint;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::ThreadPool;
use rayon::prelude::*;

/// Number of times that the caller polls for the end of the work before it sleeps, about 50 us.
const SPINS: usize = 1000;

/// The threads that [`dispatch`] uses.
#[derive(Debug, Clone)]
pub(crate) enum Pool {
    /// Only the calling thread.
    None,
    /// The calling thread and the threads of a pool, for tasks that run on one thread. The calling thread
    /// starts at once, because waking up a pool thread takes as long as a step of some flocks.
    WithCaller(Arc<ThreadPool>),
    /// Only the threads of a pool, for tasks with parallel loops.
    ThreadsOnly(Arc<ThreadPool>),
}

/// Runs all tasks and returns their results in order.
pub(crate) fn dispatch<T: Send, R: Send>(
    pool: Pool,
    work: impl ExactSizeIterator<Item = T> + Send,
    run: impl Fn(T) -> R + Send + Sync,
) -> Vec<R> {
    match pool {
        Pool::None => work.map(run).collect(),
        Pool::WithCaller(pool) => run_with_caller(&pool, work, run),
        Pool::ThreadsOnly(pool) => {
            let work: Vec<T> = work.collect();
            pool.install(|| work.into_par_iter().map(run).collect())
        }
    }
}

/// Runs `work` on the calling thread and n - 1 threads of a pool of n. Idle threads take chunks of decreasing
/// size (guided self-scheduling).
fn run_with_caller<T: Send, R: Send>(
    pool: &ThreadPool,
    work: impl ExactSizeIterator<Item = T> + Send,
    run: impl Fn(T) -> R + Send + Sync,
) -> Vec<R> {
    let helpers = pool.current_num_threads().min(work.len()).saturating_sub(1);
    let queue = Mutex::new(work.enumerate());
    let take_chunk = || {
        let mut queue = locked(&queue);
        let size = (queue.len() / (2 * (helpers + 1))).max(1);
        queue.by_ref().take(size).collect::<Vec<_>>()
    };
    let all_done = Mutex::new(Vec::new());
    let run_chunks = || {
        let mut done = Vec::new();
        loop {
            let chunk = take_chunk();
            if chunk.is_empty() {
                break;
            }
            done.extend(chunk.into_iter().map(|(index, task)| (index, run(task))));
        }
        locked(&all_done).extend(done);
    };
    let finished = AtomicUsize::new(0);
    pool.in_place_scope(|scope| {
        for _ in 0..helpers {
            scope.spawn(|_| {
                run_chunks();
                finished.fetch_add(1, Ordering::Release);
            });
        }
        run_chunks();
        // Poll first, because sleeping and waking up takes longer than most tasks.
        for _ in 0..SPINS {
            if finished.load(Ordering::Acquire) == helpers {
                break;
            }
            hint::spin_loop();
        }
    });
    let mut done = all_done
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    done.sort_unstable_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Locks a mutex. It cannot be poisoned, because no code panics while it is held.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parallel::pool as pool_of;

    #[test]
    fn every_task_runs_once_and_results_are_in_order() {
        for threads in [1, 2, 5] {
            let pool = pool_of(Some(threads)).expect("few threads");
            for num_tasks in [0, 1, 2, 7, 1000] {
                let counts: Vec<_> = (0..num_tasks).map(|_| AtomicUsize::new(0)).collect();
                let expected: Vec<_> = (0..num_tasks).collect();
                let pools = [
                    Pool::None,
                    Pool::WithCaller(pool.clone()),
                    Pool::ThreadsOnly(pool.clone()),
                ];
                for pool in pools {
                    let done = dispatch(pool, counts.iter().enumerate(), |(index, count)| {
                        count.fetch_add(1, Ordering::Relaxed);
                        index
                    });
                    assert_eq!(done, expected);
                }
                assert!(
                    counts
                        .iter()
                        .all(|count| count.load(Ordering::Relaxed) == 3)
                );
            }
        }
    }

    #[test]
    fn a_panic_is_propagated_after_the_other_tasks() {
        let pool = Pool::WithCaller(pool_of(Some(2)).expect("few threads"));
        let done = AtomicUsize::new(0);
        let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            dispatch(pool, 0..100, |task| {
                assert_ne!(task, 99, "intended panic");
                done.fetch_add(1, Ordering::Relaxed);
            })
        }));
        assert!(panicked.is_err());
        assert_eq!(done.load(Ordering::Relaxed), 99);
    }
}
