//! Dispatch of pieces of work to threads.

use std::hint;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::ThreadPool;
use rayon::prelude::*;

/// Number of checks for the end of the work before the caller sleeps: about 50 us.
const SPINS: usize = 1000;

/// The threads that [`dispatch`] uses.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Pool {
    /// Only the calling thread.
    None,
    /// The calling thread and those of a pool, for pieces that stay on one thread. The calling thread starts at once: pool
    /// threads need as long to wake up as some flocks need for a step.
    Beside(&'static ThreadPool),
    /// Only the threads of a pool, for pieces that are divided further.
    Within(&'static ThreadPool),
}

/// Runs every piece of work; results are in order.
pub(crate) fn dispatch<T: Send, R: Send>(
    pool: Pool,
    work: impl ExactSizeIterator<Item = T> + Send,
    run: impl Fn(T) -> R + Send + Sync,
) -> Vec<R> {
    match pool {
        Pool::None => work.map(run).collect(),
        Pool::Beside(pool) => share(pool, work, run),
        Pool::Within(pool) => {
            let work: Vec<T> = work.collect();
            pool.install(|| work.into_par_iter().map(run).collect())
        }
    }
}

/// Runs `work` on the calling thread and n - 1 pool threads. Idle threads take chunks of decreasing size (guided
/// self-scheduling).
fn share<T: Send, R: Send>(
    pool: &ThreadPool,
    work: impl ExactSizeIterator<Item = T> + Send,
    run: impl Fn(T) -> R + Send + Sync,
) -> Vec<R> {
    let helpers = pool.current_num_threads().min(work.len()).saturating_sub(1);
    let queue = Mutex::new(work.enumerate());
    let take_chunk = || {
        let mut queue = locked(&queue);
        let share = (queue.len() / (2 * (helpers + 1))).max(1);
        queue.by_ref().take(share).collect::<Vec<_>>()
    };
    let all_done = Mutex::new(Vec::new());
    let run_chunks = || {
        let mut done = Vec::new();
        loop {
            let chunk = take_chunk();
            if chunk.is_empty() {
                break;
            }
            done.extend(chunk.into_iter().map(|(index, piece)| (index, run(piece))));
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
        // Falling asleep and waking up takes longer than most pieces.
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

/// Locks a mutex. It is never poisoned, because nothing panics while it is held.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parallel::pool as pool_of;

    #[test]
    fn every_piece_is_done_once_and_in_its_place() {
        for threads in [1, 2, 5] {
            let pool = pool_of(Some(threads)).expect("few threads");
            for pieces in [0, 1, 2, 7, 1000] {
                let counts: Vec<_> = (0..pieces).map(|_| AtomicUsize::new(0)).collect();
                let expected: Vec<_> = (0..pieces).collect();
                for pool in [Pool::None, Pool::Beside(pool), Pool::Within(pool)] {
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
    fn a_panic_is_passed_on_after_the_other_pieces() {
        let pool = Pool::Beside(pool_of(Some(2)).expect("few threads"));
        let done = AtomicUsize::new(0);
        let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            dispatch(pool, 0..100, |piece| {
                assert_ne!(piece, 99, "as meant");
                done.fetch_add(1, Ordering::Relaxed);
            })
        }));
        assert!(panicked.is_err());
        assert_eq!(done.load(Ordering::Relaxed), 99);
    }
}
