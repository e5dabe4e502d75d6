//! Tasks of uneven length on all cores.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

/// Does every task in a room that an earlier one has left, or in a new one.
///
/// Each task may go to any core. `map_init` gives out runs of tasks, which share a room: where the long tasks are neighbours,
/// as at the edge of what can be assembled, one core is left with all of them.
pub(crate) fn in_rooms<I: IndexedParallelIterator, R: Send, T: Send>(
    tasks: I,
    new_room: impl Fn() -> R + Sync + Send,
    work: impl Fn(&mut R, I::Item) -> T + Sync + Send,
) -> impl IndexedParallelIterator<Item = T> {
    let rooms = Mutex::new(Vec::new());
    tasks.with_max_len(1).map(move |task| {
        let free = || rooms.lock().unwrap_or_else(PoisonError::into_inner);
        let left = free().pop();
        let mut room = left.unwrap_or_else(&new_room);
        let done = work(&mut room, task);
        free().push(room);
        done
    })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::{Duration, Instant};

    use super::*;

    #[test]
    fn rooms_are_used_again_and_results_are_in_order() {
        let made = AtomicUsize::new(0);
        let new_room = || made.fetch_add(1, Ordering::Relaxed);
        let done: Vec<usize> = in_rooms((0..1000).into_par_iter(), new_room, |_, task| 2 * task).collect();
        assert!(done.iter().enumerate().all(|(k, d)| *d == 2 * k));
        assert!(made.into_inner() <= rayon::current_num_threads());
    }

    /// The last two tasks wait for each other, which two cores can do only if each has one of them.
    #[test]
    fn neighbours_may_go_to_different_cores() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("two threads");
        let arrived = AtomicUsize::new(0);
        let meet = |(): &mut (), task: usize| {
            if task < 30 {
                return true;
            }
            arrived.fetch_add(1, Ordering::SeqCst);
            let since = Instant::now();
            while arrived.load(Ordering::SeqCst) < 2 && since.elapsed() < Duration::from_secs(20) {
                std::thread::yield_now();
            }
            arrived.load(Ordering::SeqCst) == 2
        };
        let met: Vec<bool> = pool.install(|| in_rooms((0..32).into_par_iter(), || (), meet).collect());
        assert!(met.iter().all(|met| *met));
    }
}
