//! Memory that all cores fill.

use std::mem::{MaybeUninit, take};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::interrupt;

/// Values to which nothing has been written yet.
///
/// Memory from the system comes page by page, and takes as long as many a result, so that every core has to write the part
/// that it works on, shortly before it does.
pub(crate) struct Fresh<T> {
    values: Vec<T>,
    n: usize,
    done: Done,
}

/// What has become of the values.
struct Done {
    /// How many are written, or left as they are.
    seen: AtomicUsize,
    /// The first one that is left as it is.
    left: AtomicUsize,
}

/// What such memory can be made of.
pub(crate) trait Untouched: Copy {
    /// What stands where nothing else is written. Known to the compiler, which clears memory as the system does.
    const UNTOUCHED: Self;
}

impl Untouched for f64 {
    const UNTOUCHED: Self = 0.0;
}

impl Untouched for u64 {
    const UNTOUCHED: Self = 0;
}

impl Untouched for bool {
    const UNTOUCHED: Self = true;
}

impl<T: Untouched> Fresh<T> {
    pub fn new(n: usize) -> Self {
        Self { values: Vec::with_capacity(n), n, done: Done { seen: AtomicUsize::new(0), left: AtomicUsize::new(n) } }
    }

    /// All of them, to be split up.
    pub fn part(&mut self) -> FreshPart<'_, T> {
        (*self.done.seen.get_mut(), *self.done.left.get_mut()) = (0, self.n);
        let values = &mut self.values.spare_capacity_mut()[..self.n];
        FreshPart { first: 0, values, done: &self.done }
    }

    /// How many of `n` rows, of the same length each, stopped work has not left.
    pub fn whole_rows(&mut self, n: usize) -> usize {
        self.done.left.get_mut().checked_div(self.n / n.max(1)).unwrap_or(n)
    }

    /// The values up to the first one that stopped work has left.
    ///
    /// # Panics
    /// When a part was forgotten.
    #[allow(unsafe_code)]
    pub fn into_vec(mut self) -> Vec<T> {
        assert_eq!(*self.done.seen.get_mut(), self.n, "a part of the memory was forgotten");
        // SAFETY: parts do not overlap, none is missing, and each counts its values once: when all of them are written, or
        // when it has said that they are left.
        unsafe { self.values.set_len(*self.done.left.get_mut()) };
        self.values
    }
}

/// A part of them. What nobody asks for is written when it is dropped, unless work has been stopped: most of the memory
/// may then be left, and would take longer than the work.
pub(crate) struct FreshPart<'t, T: Untouched> {
    first: usize,
    values: &'t mut [MaybeUninit<T>],
    done: &'t Done,
}

impl<'t, T: Untouched> FreshPart<'t, T> {
    pub const fn len(&self) -> usize {
        self.values.len()
    }

    pub fn split_at(mut self, n: usize) -> (Self, Self) {
        let (first, second) = take(&mut self.values).split_at_mut(n);
        let part = |first, values| Self { first, values, done: self.done };
        (part(self.first, first), part(self.first + n, second))
    }

    /// Parts of up to `n` values.
    pub fn runs(mut self, n: usize) -> Vec<Self> {
        let runs = (self.first..).step_by(n).zip(take(&mut self.values).chunks_mut(n));
        runs.map(|(first, values)| Self { first, values, done: self.done }).collect()
    }

    /// The values, all untouched.
    pub fn untouched(mut self) -> &'t mut [T] {
        self.written(|_| T::UNTOUCHED)
    }

    /// Values that are given.
    ///
    /// # Panics
    /// When there are fewer than in this part.
    pub fn copied(mut self, from: &[T]) {
        let from = &from[..self.values.len()];
        self.written(|k| from[k]);
    }

    #[allow(unsafe_code)]
    fn written(&mut self, value: impl Fn(usize) -> T) -> &'t mut [T] {
        let values = take(&mut self.values);
        for (k, place) in values.iter_mut().enumerate() {
            place.write(value(k));
        }
        self.done.seen.fetch_add(values.len(), Ordering::Relaxed);
        // SAFETY: every one of them has just been written.
        unsafe { &mut *(std::ptr::from_mut(values) as *mut [T]) }
    }
}

impl<T: Untouched> Drop for FreshPart<'_, T> {
    fn drop(&mut self) {
        if !self.values.is_empty() && interrupt::is_asked() {
            self.done.left.fetch_min(self.first, Ordering::Relaxed);
            self.done.seen.fetch_add(take(&mut self.values).len(), Ordering::Relaxed);
        } else {
            self.written(|_| T::UNTOUCHED);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Fresh;
    use crate::interrupt::listen;

    #[test]
    fn what_is_not_written_is_untouched() {
        let mut fresh = Fresh::new(10);
        let (first, rest) = fresh.part().split_at(4);
        let mut runs = rest.runs(4).into_iter();
        runs.next().unwrap().copied(&[1.0, 2.0, 3.0, 4.0]);
        first.untouched()[1] = 5.0;
        drop(runs);
        assert_eq!(fresh.into_vec(), [0.0, 5.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 0.0, 0.0]);
        assert!(Fresh::<u64>::new(0).into_vec().is_empty());
    }

    #[test]
    fn work_that_stops_leaves_its_part_untouched() {
        let mut fresh = Fresh::<bool>::new(3);
        let part = fresh.part();
        let stopped = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let _held = part;
            std::panic::resume_unwind(Box::new(()));
        }));
        assert!(stopped.is_err());
        assert_eq!(fresh.into_vec(), [true; 3]);
    }

    #[test]
    fn what_stopped_work_leaves_takes_no_time() {
        let mut fresh = Fresh::new(10);
        let mut runs = fresh.part().runs(2).into_iter();
        let [first, second, third] = std::array::from_fn(|_| runs.next().unwrap());
        third.untouched()[0] = 3.0;
        first.copied(&[1.0, 2.0]);
        listen(Some(|| true));
        drop((second, runs));
        listen(None);
        assert_eq!((fresh.whole_rows(5), fresh.whole_rows(10)), (1, 2));
        assert_eq!(fresh.into_vec(), [1.0, 2.0]);
    }

    #[test]
    #[should_panic(expected = "forgotten")]
    fn what_is_forgotten_is_not_given_away() {
        let mut fresh = Fresh::<u64>::new(3);
        std::mem::forget(fresh.part());
        fresh.into_vec();
    }
}
