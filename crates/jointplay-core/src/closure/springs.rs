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

use crate::closure::sensitivity::Cost;
use crate::math::real::Real;
use crate::math::space::{Component, Pose, Space};
use crate::math::vector::{Vec3, cross, dot, norm, scale, sub};
use crate::mechanism::point::constant;
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

    /// Whether forces change with the pose by springs.
    pub(crate) fn has_springs(&self) -> bool {
        !self.springs.is_empty() || !self.torsions.is_empty()
    }

    /// The largest force of the springs' stiffnesses over a characteristic length.
    pub(crate) fn spring_scale(&self) -> f64 {
        let forces = self.springs.iter().map(|spring| spring.stiffness * self.length);
        let moments = self.torsions.iter().map(|spring| spring.stiffness / self.length);
        forces.chain(moments).fold(0.0, f64::max)
    }

    /// The stiffnesses of the springs at a pose, each with the gradient of what it resists: elongation and deflection,
    /// and, of a spring under tension, the motion of its ends across.
    pub(crate) fn spring_stiffness(&self, poses: &[Pose<f64>], parameters: &[f64]) -> Vec<(f64, Cost<f64>)> {
        let none = [0.0; 3];
        let mut found = Vec::new();
        for spring in &self.springs {
            let place = |point| self.place(point, poses, parameters).position;
            let apart = sub(place(spring.second), place(spring.first));
            let length = norm(&apart);
            let across = if length > 0.0 {
                spring.stiffness + (spring.preload - spring.stiffness * spring.free_length) / length
            } else {
                0.0
            };
            for (axis, along) in frame(apart, self.space).into_iter().enumerate() {
                let mut work = self.no_cost();
                self.add_wrench(spring.second, along, none, poses, parameters, &mut work);
                self.add_wrench(spring.first, along.map(|x| -x), none, poses, parameters, &mut work);
                found.push((if axis == 0 { spring.stiffness } else { across }, work));
            }
        }
        for spring in &self.torsions {
            let joint = &self.joints[spring.joint];
            let Some(Component::About(axis)) = joint.coordinate else { continue };
            let moment = self.rotation_gradient(spring.joint, axis, poses, parameters);
            let mut work = self.no_cost();
            self.add_wrench(joint.second, none, moment, poses, parameters, &mut work);
            self.add_wrench(joint.first, none, moment.map(|m| -m), poses, parameters, &mut work);
            found.push((spring.stiffness, work));
        }
        found.retain(|(stiffness, _)| *stiffness > 0.0);
        found
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
        let carried = self.carried_by_both(spring.joint, poses, parameters);
        let (sine, cosine) = carried.roll(axis);
        let (s, c) = spring.free_angle.sin_cos();
        let (s, c) = (S::from_f64(s), S::from_f64(c));
        let angle = S::whole_angle(sine * c - cosine * s, cosine * c + sine * s);
        let moment = S::from_f64(spring.preload) + S::from_f64(spring.stiffness) * angle;
        let moment = scale(carried.rotation_gradient(axis), moment);
        let none = constant([0.0; 3]);
        self.add_wrench(joint.first, none, moment, poses, parameters, cost);
        self.add_wrench(joint.second, none, moment.map(|m| -m), poses, parameters, cost);
    }
}

/// A direction, or any one, and those across it.
fn frame(direction: Vec3<f64>, space: Space) -> Vec<Vec3<f64>> {
    let length = norm(&direction);
    let along = if length > 0.0 { scale(direction, 1.0 / length) } else { [1.0, 0.0, 0.0] };
    if space == Space::Planar {
        return vec![along, [-along[1], along[0], 0.0]];
    }
    let mut other = [0.0; 3];
    let least = (0..3).min_by(|a, b| along[*a].abs().total_cmp(&along[*b].abs())).unwrap_or_default();
    other[least] = 1.0;
    let across = cross(along, other);
    let across = scale(across, 1.0 / norm(&across));
    vec![along, across, cross(along, across)]
}
