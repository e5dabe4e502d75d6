//! Statistics of streams of numbers, mergeable.

pub(crate) mod moments;
pub(crate) mod sketch;
