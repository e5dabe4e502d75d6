//! The nearest points of boxes and balls, and how they move.

use crate::clearance::offset::inner;
use crate::math::vector::norm;

/// How the nearest point of the box from -1 to 1 moves.
pub(crate) fn onto_box_along(unit: &[f64], direction: &mut [f64]) {
    for (d, u) in direction.iter_mut().zip(unit) {
        if u.abs() > 1.0 {
            *d = 0.0;
        }
    }
}

/// How the nearest point of the unit ball moves.
pub(crate) fn onto_ball_along(unit: &[f64], direction: &mut [f64]) {
    let size = norm(unit);
    if size > 1.0 {
        let outwards = inner(unit, direction) / (size * size);
        direction.iter_mut().zip(unit).for_each(|(d, u)| *d = (*d - outwards * u) / size);
    }
}

/// The nearest point of the unit ball.
pub(crate) fn onto_ball(unit: &mut [f64]) {
    let size = norm(unit);
    if size > 1.0 {
        for u in unit {
            *u /= size;
        }
    }
}
