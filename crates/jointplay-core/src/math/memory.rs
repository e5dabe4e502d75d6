//! Memory that all cores fill.

use rayon::prelude::*;

/// Values of which all cores write a part for the first time: memory from the system comes page by page, and takes as
/// long as many a result.
pub(crate) fn filled<T: Copy + Send + Sync>(n: usize, value: T) -> Vec<T> {
    const AT_ONCE: usize = 1 << 14;
    rayon::iter::repeat_n(value, n).with_min_len(AT_ONCE).collect()
}
