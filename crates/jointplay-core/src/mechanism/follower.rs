//! A coordinate that follows another joint's along a curve.

use crate::math::curve::Curve;
use crate::math::space::Component;

/// What the row of a follower follows.
#[derive(Clone, Debug)]
pub(crate) struct Follower {
    /// The leading joint and its coordinate.
    pub leader: usize,
    pub component: Component,
    pub curve: Curve,
    /// Of an angle: it is taken within half a turn of this.
    pub middle: f64,
}
