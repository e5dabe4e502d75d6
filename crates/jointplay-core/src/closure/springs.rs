//! Springs, whose forces follow from the pose.
//!
//! A spring between the points P1 and P2, `d = P2 - P1`, with the stiffness k, the free length `l_0` and the preload
//! `F_0` pulls P1 towards P2 with
//!
//! ```text
//! F d / |d|,   F = F_0 + k (|d| - l_0),   that is   (k + (F_0 - k l_0) / |d|) d
//! ```
//!
//! and P2 with the opposite force. Without a constant part it needs no direction, so that P1 and P2 may coincide.
//! A torsion spring about the axis a of a joint acts on the second body with `-(M_0 + k (angle - angle_0)) a`, on the
//! first with the opposite moment.

use crate::closure::equations::constant;
use crate::closure::sensitivity::Cost;
use crate::math::real::Real;
use crate::math::space::{Component, Pose};
use crate::math::vector::{dot, scale, sub};
use crate::mechanism::{Mechanism, SpringSpec, TorsionSpec};

impl Mechanism {
    /// Adds the forces of all springs.
    pub(crate) fn add_springs<S: Real>(&self, poses: &[Pose<S>], parameters: &[S], cost: &mut Cost<S>) {
        for spring in &self.springs {
            self.add_spring(spring, poses, parameters, cost);
        }
        for spring in &self.torsions {
            self.add_torsion(spring, poses, parameters, cost);
        }
    }

    fn add_spring<S: Real>(&self, spring: &SpringSpec, poses: &[Pose<S>], parameters: &[S], cost: &mut Cost<S>) {
        let place = |point| self.place(point, poses, parameters).position;
        let apart = sub(place(spring.second), place(spring.first));
        let fixed = spring.preload - spring.stiffness * spring.free_length;
        let mut rate = S::from_f64(spring.stiffness);
        if fixed != 0.0 {
            rate = rate + S::from_f64(fixed) * dot(apart, apart).reciprocal_root(self.length);
        }
        let (force, none) = (scale(apart, rate), constant([0.0; 3]));
        self.add_wrench(spring.first, force, none, poses, parameters, cost);
        self.add_wrench(spring.second, force.map(|f| -f), none, poses, parameters, cost);
    }

    fn add_torsion<S: Real>(&self, spring: &TorsionSpec, poses: &[Pose<S>], parameters: &[S], cost: &mut Cost<S>) {
        let joint = &self.joints[spring.joint];
        let Some(Component::About(axis)) = joint.coordinate else { return };
        let (sine, cosine) = self.roll(spring.joint, axis, poses);
        let (s, c) = spring.free_angle.sin_cos();
        let (s, c) = (S::from_f64(s), S::from_f64(c));
        let angle = S::whole_angle(sine * c - cosine * s, cosine * c + sine * s);
        let moment = S::from_f64(spring.preload) + S::from_f64(spring.stiffness) * angle;
        let moment = scale(self.rotation_gradient(spring.joint, axis, poses), moment);
        let none = constant([0.0; 3]);
        self.add_wrench(joint.first, none, moment, poses, parameters, cost);
        self.add_wrench(joint.second, none, moment.map(|m| -m), poses, parameters, cost);
    }
}
