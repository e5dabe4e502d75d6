//! Long work can be stopped from outside.
//!
//! Whoever calls the core may say, thread by thread, how to ask whether to stop. What takes long asks again and again;
//! where the answer is yes, [`check`] unwinds the thread's stack, so that nothing in between has to hand the stop on.
//! Results do not depend on being asked for.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

thread_local! {
    static ASK: Cell<Option<fn() -> bool>> = const { Cell::new(None) };
}

/// What a stopped thread unwinds with.
#[derive(Clone, Copy, Debug)]
pub struct Stopped;

/// Says how this thread asks whether to stop; `None` where nothing stops it.
pub fn listen(ask: Option<fn() -> bool>) {
    ASK.set(ask);
}

/// Whether to stop.
#[must_use]
pub fn is_asked() -> bool {
    ASK.get().is_some_and(|ask| ask())
}

/// Unwinds with [`Stopped`] if asked to stop.
pub fn check() {
    if is_asked() {
        // Unlike a panic this prints nothing.
        resume_unwind(Box::new(Stopped));
    }
}

/// What work gives; `None` where it was stopped.
pub fn until_stopped<T>(work: impl FnOnce() -> T) -> Option<T> {
    // Stopped work leaves nothing behind that anybody looks at.
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(found) => Some(found),
        Err(payload) if payload.is::<Stopped>() => None,
        Err(panic) => resume_unwind(panic),
    }
}

/// The results of the parts before the first one that was stopped.
pub(crate) fn before_the_stop<T>(parts: Vec<Option<impl IntoIterator<Item = T>>>) -> Vec<T> {
    parts.into_iter().map_while(|part| part).flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::{before_the_stop, check, is_asked, listen, until_stopped};

    #[test]
    fn work_is_stopped_where_it_looks_and_only_on_threads_that_listen() {
        assert!(!is_asked());
        assert_eq!(until_stopped(|| [check(), check()].len()), Some(2));
        listen(Some(|| true));
        assert!(until_stopped(check).is_none());
        assert_eq!(std::thread::spawn(|| until_stopped(|| [check()].len())).join().ok(), Some(Some(1)));
        listen(None);
    }

    #[test]
    #[should_panic(expected = "a defect")]
    fn a_panic_is_no_stop() {
        let _ = until_stopped(|| panic!("a defect"));
    }

    #[test]
    fn what_is_done_ends_at_the_first_part_that_is_not() {
        assert_eq!(before_the_stop(vec![Some(vec![1, 2]), Some(vec![3]), None, Some(vec![5])]), [1, 2, 3]);
    }
}
