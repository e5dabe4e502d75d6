//! What has been derived once of an object that does not change, kept with it.

use std::any::Any;
use std::fmt;
use std::sync::{Arc, Mutex};

use crate::program::patient::lock;

/// Most entries of one object. Those that have recorded programs share them with [`super::kept`] as long as that keeps
/// them.
const MOST: usize = 24;

type Entry = Arc<dyn Any + Send + Sync>;

/// Results by their keys, those found last at the end. A copy of the object begins without, since it may be changed
/// before it is used.
#[derive(Default)]
pub struct Memo(Mutex<Vec<Entry>>);

impl Memo {
    /// The result of a key, found now unless it is known. Several threads may find it at the same time; what they find
    /// must be the same.
    pub(crate) fn get<K, T>(&self, key: K, find: impl FnOnce() -> T) -> T
    where
        K: PartialEq + Send + Sync + 'static,
        T: Clone + Send + Sync + 'static,
    {
        let is = |entry: &&Entry| entry.downcast_ref::<(K, T)>().is_some_and(|(known, _)| *known == key);
        let known = self.with(|entries| entries.iter().find(is).cloned()).flatten();
        if let Some((_, found)) = known.as_ref().and_then(|entry| entry.downcast_ref::<(K, T)>()) {
            return found.clone();
        }
        let found = find();
        self.with(|entries| {
            if entries.len() >= MOST {
                entries.remove(0);
            }
            entries.push(Arc::new((key, found.clone())));
        });
        found
    }

    fn with<R>(&self, change: impl FnOnce(&mut Vec<Entry>) -> R) -> Option<R> {
        lock(&self.0).map(|mut entries| change(&mut entries))
    }
}

impl Clone for Memo {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl fmt::Debug for Memo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Memo")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_kinds_of_results_are_kept_apart() {
        let memo = Memo::default();
        assert_eq!(memo.get("a", || 1), 1);
        assert_eq!(memo.get("a", || 2), 1);
        assert_eq!(memo.get("b", || 3), 3);
        assert_eq!(memo.get("a", || 4_u8), 4);
        assert_eq!(memo.clone().get("a", || 5), 5);
        assert_eq!(memo.get("a", || 6), 1);
    }

    #[test]
    fn it_is_bounded_and_what_finds_may_ask_it() {
        let memo = Memo::default();
        for k in 0..3 * MOST {
            assert_eq!(memo.get(k, || memo.get((k, k), || k)), k);
        }
        assert_eq!(memo.with(|entries| entries.len()), Some(MOST));
    }
}
