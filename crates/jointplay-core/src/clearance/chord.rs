//! Lines through a set in its own coordinates, and the density of its laws there.

use crate::clearance::law::Law;
use crate::clearance::offset::MAX_SIZE;
use crate::clearance::{Set, Shape};

/// A part of a line: from where to where along its direction.
pub type Chord = [f64; 2];

/// What `|a + t b| <= bound` leaves of a line.
#[inline(always)]
fn between(chord: &mut Chord, a: f64, b: f64, bound: f64) {
    if b != 0.0 {
        let (s, e) = ((-bound - a) / b, (bound - a) / b);
        chord[0] = chord[0].max(s.min(e));
        chord[1] = chord[1].min(s.max(e));
    }
}

/// What the unit ball leaves of a line.
#[inline(always)]
fn through_ball(chord: &mut Chord, at: &[f64], along: &[f64]) {
    let (mut square, mut half, mut own) = (0.0, 0.0, 0.0);
    for (a, b) in at.iter().zip(along) {
        square += b * b;
        half += a * b;
        own += a * a;
    }
    let rest = 1.0 - own;
    if square > 0.0 {
        let root = (half * half + square * rest.max(0.0)).sqrt();
        chord[0] = chord[0].max((-half - root) / square);
        chord[1] = chord[1].min((-half + root) / square);
    }
}

impl Set {
    /// What the set leaves of the line `at + t along` in its own coordinates, `at` being one of its points.
    // Inlined into chains, which are compiled for a given width of vector registers.
    #[inline(always)]
    #[must_use]
    pub fn chord(&self, at: &[f64], along: &[f64]) -> Chord {
        let mut chord = [f64::NEG_INFINITY, f64::INFINITY];
        match self.shape() {
            Shape::Round { .. } => through_ball(&mut chord, at, along),
            Shape::Diamond { .. } | Shape::Interval { .. } => {
                at.iter().zip(along).for_each(|(a, b)| between(&mut chord, *a, *b, 1.0));
            }
            Shape::Pin(pin) => {
                let first = usize::from(pin.axial.is_some());
                (0..first).for_each(|k| between(&mut chord, at[k], along[k], 1.0));
                for k in [first, first + 2] {
                    through_ball(&mut chord, &at[k..k + 2], &along[k..k + 2]);
                }
            }
            Shape::Tapered(tapered) => {
                between(&mut chord, at[0], along[0], 1.0);
                for k in 1..=2 * tapered.n {
                    let taper = tapered.tapers[(k - 1) / 2];
                    // |p| + taper |rho| <= 1, for both signs of their product.
                    for g in [taper, -taper] {
                        between(&mut chord, at[k] + g * at[0], along[k] + g * along[0], 1.0);
                    }
                }
            }
        }
        chord
    }

    /// Whether own coordinates belong to the set.
    #[must_use]
    pub fn contains_unit(&self, unit: &[f64]) -> bool {
        let round = |u: &[f64]| u.iter().map(|u| u * u).sum::<f64>() <= 1.0;
        match self.shape() {
            Shape::Round { .. } => round(unit),
            Shape::Diamond { .. } | Shape::Interval { .. } => unit.iter().all(|u| u.abs() <= 1.0),
            Shape::Pin(pin) => {
                let (along, ends) = unit.split_at(usize::from(pin.axial.is_some()));
                along.iter().all(|u| u.abs() <= 1.0) && ends.chunks_exact(2).all(round)
            }
            Shape::Tapered(tapered) => {
                unit[0].abs() <= 1.0
                    && (1..=2 * tapered.n).all(|k| unit[k].abs() + tapered.tapers[(k - 1) / 2] * unit[0].abs() <= 1.0)
            }
        }
    }

    /// The law's density within the set is `exp(-sum precision u^2 / 2)` in own coordinates, times a constant.
    #[must_use]
    pub fn precisions(&self, law: Law) -> [f64; MAX_SIZE] {
        let one = match law {
            Law::Uniform | Law::Boundary => return [0.0; MAX_SIZE],
            Law::Normal | Law::Gauss => crate::clearance::draw::SIGMAS * crate::clearance::draw::SIGMAS,
        };
        match self.shape() {
            Shape::Round { .. } | Shape::Interval { .. } | Shape::Pin(_) => [one; MAX_SIZE],
            // Normal along the diagonals, which are the half sum and the half difference.
            Shape::Diamond { .. } => [0.5 * one; MAX_SIZE],
            Shape::Tapered(_) => std::array::from_fn(|k| if k == 0 { one } else { 0.5 * one }),
        }
    }
}
