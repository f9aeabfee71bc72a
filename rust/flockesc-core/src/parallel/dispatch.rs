//! Pieces of work shared out over threads.

use std::hint;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::ThreadPool;
use rayon::prelude::*;

/// How often to look whether all are done before sleeping: some 50 us.
const SPINS: usize = 1000;

/// The threads that [`spread`] uses.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Pool {
    /// None but the caller's.
    None,
    /// The caller's, and those of a pool beside it: for pieces that stay on one thread. The caller begins at once, while
    /// the others are still waking up, which takes as long as some flocks need for a step.
    Beside(&'static ThreadPool),
    /// Those of a pool alone: pieces can be cut further there.
    Within(&'static ThreadPool),
}

/// Runs every piece of work; results are in order.
pub(crate) fn spread<T: Send, R: Send>(
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

/// Shares `work` between this thread and all but one of a pool; whoever is free takes some of what is left, ever less.
fn share<T: Send, R: Send>(
    pool: &ThreadPool,
    work: impl ExactSizeIterator<Item = T> + Send,
    run: impl Fn(T) -> R + Send + Sync,
) -> Vec<R> {
    let helpers = pool.current_num_threads().min(work.len()).saturating_sub(1);
    let queue = Mutex::new(work.enumerate());
    let take_some = || {
        let mut queue = locked(&queue);
        let share = (queue.len() / (2 * (helpers + 1))).max(1);
        queue.by_ref().take(share).collect::<Vec<_>>()
    };
    let all_done = Mutex::new(Vec::new());
    let take_part = || {
        let mut done = Vec::new();
        loop {
            let some = take_some();
            if some.is_empty() {
                break;
            }
            done.extend(some.into_iter().map(|(index, piece)| (index, run(piece))));
        }
        locked(&all_done).extend(done);
    };
    let gone = AtomicUsize::new(0);
    pool.in_place_scope(|scope| {
        for _ in 0..helpers {
            scope.spawn(|_| {
                take_part();
                gone.fetch_add(1, Ordering::Release);
            });
        }
        take_part();
        // To fall asleep until the last piece is done and to wake up again takes longer than most pieces do.
        for _ in 0..SPINS {
            if gone.load(Ordering::Acquire) == helpers {
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

/// What a mutex holds; nothing panics while one is held here.
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
                    let done = spread(pool, counts.iter().enumerate(), |(index, count)| {
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
            spread(pool, 0..100, |piece| {
                assert_ne!(piece, 99, "as meant");
                done.fetch_add(1, Ordering::Relaxed);
            })
        }));
        assert!(panicked.is_err());
        assert_eq!(done.load(Ordering::Relaxed), 99);
    }
}
