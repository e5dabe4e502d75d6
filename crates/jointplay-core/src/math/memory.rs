//! Memory that all cores fill.

use std::mem::{MaybeUninit, take};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Values to which nothing has been written yet.
///
/// Memory from the system comes page by page, and takes as long as many a result, so that every core has to write the part
/// that it works on, shortly before it does.
pub(crate) struct Fresh<T> {
    values: Vec<T>,
    n: usize,
    written: AtomicUsize,
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
        Self { values: Vec::with_capacity(n), n, written: AtomicUsize::new(0) }
    }

    /// All of them, to be split up.
    pub fn part(&mut self) -> FreshPart<'_, T> {
        *self.written.get_mut() = 0;
        let values = &mut self.values.spare_capacity_mut()[..self.n];
        FreshPart { values, written: &self.written }
    }

    /// The values when no part of them is left.
    ///
    /// # Panics
    /// When a part was forgotten.
    #[allow(unsafe_code)]
    pub fn into_vec(mut self) -> Vec<T> {
        assert_eq!(*self.written.get_mut(), self.n, "a part of the memory was forgotten");
        // SAFETY: parts do not overlap, none is left, and each counts its values once, when all of them are written.
        unsafe { self.values.set_len(self.n) };
        self.values
    }
}

/// A part of them. What nobody asks for is written when it is dropped.
pub(crate) struct FreshPart<'t, T: Untouched> {
    values: &'t mut [MaybeUninit<T>],
    written: &'t AtomicUsize,
}

impl<'t, T: Untouched> FreshPart<'t, T> {
    pub const fn len(&self) -> usize {
        self.values.len()
    }

    pub fn split_at(mut self, n: usize) -> (Self, Self) {
        let (first, second) = take(&mut self.values).split_at_mut(n);
        let part = |values| Self { values, written: self.written };
        (part(first), part(second))
    }

    /// Parts of up to `n` values.
    pub fn runs(mut self, n: usize) -> Vec<Self> {
        let runs = take(&mut self.values).chunks_mut(n);
        runs.map(|values| Self { values, written: self.written }).collect()
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
        self.written.fetch_add(values.len(), Ordering::Relaxed);
        // SAFETY: every one of them has just been written.
        unsafe { &mut *(std::ptr::from_mut(values) as *mut [T]) }
    }
}

impl<T: Untouched> Drop for FreshPart<'_, T> {
    fn drop(&mut self) {
        self.written(|_| T::UNTOUCHED);
    }
}

#[cfg(test)]
mod tests {
    use super::Fresh;

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
    #[should_panic(expected = "forgotten")]
    fn what_is_forgotten_is_not_given_away() {
        let mut fresh = Fresh::<u64>::new(3);
        std::mem::forget(fresh.part());
        fresh.into_vec();
    }
}
