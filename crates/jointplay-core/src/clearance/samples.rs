//! Sets that unit tests go through.

use crate::clearance::Set;

/// One of every kind.
pub(crate) const KINDS: [Set; 8] = [
    Set::Disc { radius: 0.7 },
    Set::Diamond { gap: 0.3, half_length: 2.5 },
    Set::Interval { low: -0.2, high: 0.5 },
    Set::Ball { radius: 0.4 },
    Set::Journal { radius: 0.7, half_length: 2.0, axial: 0.3 },
    Set::Sleeve { radius: 0.2, half_length: 3.0 },
    Set::Guide { gap: 0.3, half_length: 2.5, half_width: 0.8, half_height: 0.5 },
    Set::Plate { gap: 0.3, half_normal: 2.5, half_side: 0.5 },
];

/// Sets that are points or flat, or two of whose bounds meet.
pub(crate) const DEGENERATE: [Set; 6] = [
    Set::Interval { low: 0.0, high: 0.0 },
    Set::Journal { radius: 0.7, half_length: 0.5, axial: 0.0 },
    Set::Journal { radius: 0.0, half_length: 2.0, axial: 0.3 },
    Set::Guide { gap: 0.3, half_length: 0.5, half_width: 0.4, half_height: 0.4 },
    Set::Guide { gap: 0.2, half_length: 1.5, half_width: 0.0, half_height: 0.5 },
    Set::Plate { gap: 0.0, half_normal: 2.5, half_side: 0.5 },
];
