//! Coordinates that follow another joint's along a curve: row `own coordinate - f(leader's coordinate) = parameter`.
//!
//! A follower is a row with two joints, and with their bodies, up to four. The leader's part is that of a command which
//! depends on the poses; with `x` its coordinate the row gains `-f'(x) dx`.

use std::f64::consts::TAU;

use crate::math::real::Real;
use crate::math::rotation::turn_back;
use crate::math::space::{Component, Pose};
use crate::math::vector::{dot, sub};
use crate::mechanism::coupling::Rate;
use crate::mechanism::follower::Follower;
use crate::mechanism::{Mechanism, Row};

/// What a follower is led by, at a pose.
pub(crate) struct Led<S> {
    /// Its joint.
    pub joint: usize,
    /// What it commands.
    pub value: S,
    /// What the row gains while points and axes of the leading joint move.
    pub rate: Rate<S>,
}

impl Mechanism {
    /// What leads a row; `None` for one that follows nothing.
    pub(crate) fn lead<S: Real>(&self, row: &Row, poses: &[Pose<S>], parameters: &[S]) -> Option<Led<S>> {
        let follower = self.joints[row.joint].follows.as_ref()?;
        let x = self.leading(follower, poses, parameters);
        let (value, slope) = x.along(&follower.curve);
        let gained = self.component_rate(follower.leader, follower.component, poses, parameters);
        let rate = Rate::zero().plus(-slope, gained);
        Some(Led { joint: follower.leader, value, rate })
    }

    /// The coordinate of the leading joint, angles within half a turn of the curve's middle.
    fn leading<S: Real>(&self, follower: &Follower, poses: &[Pose<S>], parameters: &[S]) -> S {
        let joint = &self.joints[follower.leader];
        match follower.component {
            Component::Along(i) => {
                let place = |point| self.place(point, poses, parameters).position;
                dot(self.axes(follower.leader, poses, parameters)[i], sub(place(joint.second), place(joint.first)))
            }
            Component::About(i) => {
                let rolled = self.carried_by_both(follower.leader, poses, parameters).roll(i);
                let middle = follower.middle.rem_euclid(TAU);
                let (sine, cosine) = turn_back(rolled, (S::from_f64(middle.sin()), S::from_f64(middle.cos())));
                S::from_f64(follower.middle) + S::whole_angle(sine, cosine)
            }
        }
    }

    /// Whether the equations can be recorded: of a curve all pieces are.
    pub(crate) fn is_recordable(&self) -> bool {
        self.joints.iter().filter_map(|joint| joint.follows.as_ref()).all(|follower| follower.curve.is_short())
    }
}

#[cfg(test)]
mod tests;
