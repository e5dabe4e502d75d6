//! The axes of a joint as both of its bodies carry them, and what its rotations are measured by.

use crate::math::real::Real;
use crate::math::space::{Pose, Space};
use crate::math::vector::{Vec3, add, cross, dot, scale, sub};
use crate::mechanism::Mechanism;
use crate::mechanism::joint::Joint;

/// The axes of a joint in ground axes.
pub(crate) struct Carried<'m, S> {
    joint: &'m Joint,
    /// As the first body carries them.
    pub first: [Vec3<S>; 3],
    /// As the second one does.
    pub second: [Vec3<S>; 3],
}

impl Mechanism {
    /// The axes of a joint as the first body (or the second) carries them, in ground axes.
    pub(crate) fn carried<S: Real>(
        &self,
        joint: usize,
        second: bool,
        poses: &[Pose<S>],
        parameters: &[S],
    ) -> [Vec3<S>; 3] {
        let joint = &self.joints[joint];
        let (point, axes) = if second { (joint.second, &joint.axes_second) } else { (joint.first, &joint.axes_first) };
        let point = &self.points[point];
        axes.map(|axis| {
            let axis = point.axis(axis, parameters);
            point.body.map_or(axis, |b| poses[b].turn(axis))
        })
    }

    /// The axes of a joint as both bodies carry them.
    pub(crate) fn carried_by_both<S: Real>(&self, joint: usize, poses: &[Pose<S>], parameters: &[S]) -> Carried<'_, S> {
        let [first, second] = [false, true].map(|second| self.carried(joint, second, poses, parameters));
        Carried { joint: &self.joints[joint], first, second }
    }
}

impl<S: Real> Carried<'_, S> {
    /// Sine and cosine (times one positive number) of the roll about an axis.
    pub fn roll(&self, axis: usize) -> (S, S) {
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let (a, b) = (&self.first, &self.second);
        let (sine, cosine) = (dot(a[k], b[j]), dot(a[j], b[j]));
        if !self.joint.settled {
            return (sine, cosine);
        }
        (sine - dot(a[j], b[k]), cosine + dot(a[k], b[k]))
    }

    /// The vector whose scalar product with `w2 - w1` is the rate of a rotation component.
    pub fn rotation_gradient(&self, axis: usize) -> Vec3<S> {
        let (zero, one) = (S::from_f64(0.0), S::from_f64(1.0));
        if self.joint.space == Space::Planar {
            return [zero, zero, one];
        }
        let (a, b) = (&self.first, &self.second);
        match axis {
            0 if self.joint.settled => scale(add(a[0], b[0]), one / (one + dot(a[0], b[0]))),
            0 => {
                let (sine, cosine) = self.roll(axis);
                let across = sub(scale(a[2], cosine), scale(a[1], sine));
                scale(cross(b[1], across), one / (cosine * cosine + sine * sine))
            }
            1 => cross(a[2], b[0]),
            _ => cross(b[0], a[1]),
        }
    }

    /// A tilt, as the sine of an angle where that is below a sixth of a turn, and the angle itself beyond: unlike its
    /// sine it does not vanish at half a turn, so that a rough start cannot settle on the mirrored
    /// solution.
    pub fn tilt(&self, axis: usize) -> S {
        let other = if axis == 1 { 2 } else { 1 };
        let sine = dot(self.first[other], self.second[0]);
        let sine = if axis == 1 { -sine } else { sine };
        S::tilt(sine, dot(self.first[0], self.second[0]))
    }
}
