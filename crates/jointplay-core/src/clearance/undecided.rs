//! Which coordinates of a set are not pushed, and below which force.

/// A reaction below this part of the largest one decides nothing.
pub const UNDECIDED: f64 = 1e-9;

/// The coordinates of a set, each with its own force, that are not pushed: a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Unforced(u8);

impl Unforced {
    /// Whether every coordinate is pushed.
    #[inline]
    #[must_use]
    pub const fn is_none(self) -> bool {
        self.0 == 0
    }

    #[inline]
    pub(crate) const fn has(self, k: usize) -> bool {
        self.0 >> k & 1 == 1
    }

    #[inline]
    pub(crate) fn of<const N: usize>(unforced: [bool; N]) -> Self {
        Self(unforced.iter().rev().fold(0, |bits, &m| bits << 1 | u8::from(m)))
    }
}
