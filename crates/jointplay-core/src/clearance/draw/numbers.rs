//! Any kind of numbers, chosen at run time.

use crate::clearance::draw::given::Given;
use crate::clearance::draw::points::Points;
use crate::clearance::draw::stream::Stream;

/// Numbers of a chunk of samples.
#[allow(clippy::large_enum_variant)] // one per chunk
pub enum Numbers {
    /// Pseudo-random.
    Plain(Stream),
    /// Scrambled Sobol points.
    Sobol(Points),
    /// Of given scores.
    Given(Given),
}
