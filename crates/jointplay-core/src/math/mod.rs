//! Numbers, vectors, rotations, poses, sparse elimination, lanes of registers, statistics: nothing of mechanisms.

pub(crate) mod affine;
pub(crate) mod boole;
pub(crate) mod curve;
pub(crate) mod decomposition;
pub(crate) mod dual;
pub(crate) mod interval;
pub mod lanes;
pub(crate) mod memory;
pub(crate) mod mesh;
pub(crate) mod real;
pub(crate) mod rotation;
pub(crate) mod sobol;
pub(crate) mod space;
pub(crate) mod sparse;
pub(crate) mod stats;
pub(crate) mod tasks;
pub mod vector;
