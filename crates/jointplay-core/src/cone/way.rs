//! How a displacement gives way to a change of the force on it.
//!
//! `d delta = B dW` with `B = L L'`, column by column of L:
//!
//! | displacement | B |
//! |---|---|
//! | deformation of what is elastic | its compliance |
//! | support point of a round body, radius r | `r (1 - n n') / |W|`, n along W: it turns with the force |
//! | offset on a face that the force exposes | without bound along the face, in proportion to the squares of its sizes |
//! | offset in a corner | none |

use crate::clearance::Set;
use crate::clearance::law::Law;
use crate::clearance::offset::{MAX_SIZE, inner};
use crate::cone::bodies::{Atom, Form, Own};
use crate::cone::{Kind, springs};
use crate::math::vector::norm;

/// Columns of L: of what gives way without bound, and of what does by force.
#[derive(Clone, Debug, Default)]
pub(crate) struct Way {
    pub open: Vec<Form>,
    pub firm: Vec<Form>,
}

impl Kind {
    /// The set of a clearance under a force on its offset. How what is elastic gives way is [`Self::compliance`] whatever the
    /// force is.
    pub(crate) fn sides(&self, force: &[f64], offset: &[f64]) -> Option<Sides> {
        self.set().map(|set| Sides::new(set, &force[..set.size()], offset))
    }

    /// How every offset of the set gives way where nothing pushes it.
    pub(crate) fn play(&self) -> Vec<Form> {
        self.set().map(|set| Own::of(set).columns().to_vec()).unwrap_or_default()
    }

    /// By what the components of [`Self::play`] are to be multiplied so that it is a law's covariance.
    pub(crate) fn spread(&self, law: Law) -> Form {
        let Some(set) = self.set() else { return [1.0; MAX_SIZE] };
        let (variances, play) = (set.moments(law).1, self.play());
        std::array::from_fn(|k| {
            let square: f64 = play.iter().map(|column| column[k].powi(2)).sum();
            if square > 0.0 { (variances[k] / square).sqrt() } else { 1.0 }
        })
    }

    /// How what is elastic gives way.
    pub(crate) fn compliance(&self) -> Vec<Form> {
        let Self::Spring(compliance) = self else { return Vec::new() };
        let columns = springs::factor(compliance, self.size()).unwrap_or_default();
        columns.iter().map(|column| std::array::from_fn(|k| column.get(k).copied().unwrap_or(0.0))).collect()
    }
}

/// A set with the force and the offset in its own coordinates.
pub(crate) struct Sides {
    own: Own,
    force: Form,
    at: Form,
}

impl Sides {
    fn new(set: &Set, force: &[f64], offset: &[f64]) -> Self {
        let own = Own::of(set);
        let (mut along, mut at) = ([0.0; MAX_SIZE], [0.0; MAX_SIZE]);
        along.iter_mut().zip(own.columns()).for_each(|(a, column)| *a = inner(column, force));
        at.iter_mut().zip(own.coordinates(set, offset)).for_each(|(a, p)| *a = p);
        Self { own, force: along, at }
    }

    /// What parts of the own coordinates displace together.
    fn column(&self, parts: &(impl Iterator<Item = (usize, f64)> + Clone)) -> Form {
        std::array::from_fn(|k| parts.clone().map(|(c, part)| part * self.own.columns()[c][k]).sum())
    }

    /// The most that the force does along one of the own coordinates.
    pub(crate) fn push(&self) -> f64 {
        self.force.iter().fold(0.0, |most: f64, along| most.max(along.abs()))
    }

    /// How the offset gives way. It is free to move where the force does less along that than the part of `largest` that the
    /// distance from the set's nearest side is of the set, or than the part `least`.
    pub(crate) fn way(&self, largest: f64, least: f64) -> Way {
        let negligible = |slack: f64| largest * slack.max(least);
        let mut way = Way::default();
        for (first, atom) in self.own.atoms() {
            let range = first..first + atom.size();
            let (force, at) = (&self.force[range.clone()], &self.at[range]);
            match atom {
                Atom::Interval { .. } => {
                    if force[0].abs() <= negligible(atom.slack(at)) {
                        way.open.push(self.column(&[(first, 1.0)].into_iter()));
                    }
                }
                Atom::Round { size } => {
                    let pushed = norm(force);
                    let open = pushed <= negligible(atom.slack(at));
                    for i in 0..size {
                        let across = |k: usize| {
                            let one = if k == i { 1.0 } else { 0.0 };
                            if open { one } else { (one - force[i] * force[k] / pushed.powi(2)) / pushed.sqrt() }
                        };
                        let parts = (0..size).map(|k| (first + k, across(k)));
                        if open { &mut way.open } else { &mut way.firm }.push(self.column(&parts));
                    }
                }
                Atom::Tapered { arms, tapers } => {
                    let axis = at[0].abs();
                    // Towards the end of the axis that the offset is on, or that the force pushes to.
                    let sign = if at[0] == 0.0 { 1.0_f64.copysign(force[0]) } else { at[0].signum() };
                    let (mut gain, mut parts) = (sign * force[0], vec![(first, sign)]);
                    let mut nearest = 1.0 - axis;
                    for k in 0..arms {
                        let (arm, pushed) = (at[1 + k], force[1 + k]);
                        if pushed.abs() <= negligible(1.0 - arm.abs() - tapers[k] * axis) {
                            way.open.push(self.column(&[(first + 1 + k, 1.0)].into_iter()));
                        } else if tapers[k] > 0.0 {
                            // It follows its side, which comes nearer the farther along the axis.
                            gain -= tapers[k] * pushed.abs();
                            parts.push((first + 1 + k, -tapers[k] * pushed.signum()));
                            nearest = nearest.min(axis);
                        }
                    }
                    if gain.abs() <= negligible(nearest) {
                        way.open.push(self.column(&parts.iter().copied()));
                    }
                }
            }
        }
        way
    }
}
