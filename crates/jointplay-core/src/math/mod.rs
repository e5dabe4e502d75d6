//! Numbers, vectors, rotations, poses, sparse elimination, lanes of registers, statistics: nothing of mechanisms.

pub(crate) mod decomposition;
pub mod lanes;
pub mod mesh;
pub mod real;
pub mod rotation;
pub mod space;
pub mod sparse;
pub mod stats;
