//! One operation of a program.

use crate::program::graph::Kind;

/// One operation on registers of a block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Op {
    pub kind: Kind,
    pub a: u32,
    pub b: u32,
    pub c: u32,
    pub target: u32,
}
