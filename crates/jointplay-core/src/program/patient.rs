//! A lock that is gone without rather than waited for: in a process that was forked just when another thread of its
//! parent held it, it is held for ever.

use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

/// Times that other threads may go first.
const PATIENCE: usize = 1000;

/// What is locked, `None` where others have it for long. What is in it must be whole at any time.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> Option<MutexGuard<'_, T>> {
    for _ in 0..PATIENCE {
        match mutex.try_lock() {
            Ok(held) => return Some(held),
            Err(TryLockError::Poisoned(held)) => return Some(PoisonError::into_inner(held)),
            Err(TryLockError::WouldBlock) => std::thread::yield_now(),
        }
    }
    None
}
