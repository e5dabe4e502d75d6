//! The reactions at the joints: the multipliers of the closure equations, which are statics transposed.

use crate::math::real::Real;
use crate::math::space::{Component, Pose};
use crate::mechanism::Mechanism;

impl Mechanism {
    /// What every drive does to the second bodies of its joints, by the multipliers of all rows: a moment or a force along
    /// its coordinate.
    pub(crate) fn drive_forces<S: Real>(&self, multipliers: &[S]) -> Vec<S> {
        let mut forces = vec![S::from_f64(0.0); self.n_drives];
        for (row, &l) in self.rows.iter().zip(multipliers) {
            if let Some(by) = row.drive {
                forces[by.drive] = forces[by.drive] - S::from_f64(by.coefficient) * l;
            }
        }
        forces
    }

    /// The reactions that the multipliers of the closure rows stand for.
    pub(crate) fn reactions<S: Real>(&self, poses: &[Pose<S>], parameters: &[S], multipliers: &[S]) -> Vec<S> {
        let size = self.size();
        let mut reactions = vec![S::from_f64(0.0); self.n_joints() * size];
        for (row, &l) in self.rows.iter().zip(multipliers) {
            // No load turns what is settled: its multiplier is the rounding of zero.
            if self.joints[row.joint].is_spin(row.component) {
                continue;
            }
            let [force, moment] = self.row_wrench(row, poses, parameters);
            for (k, component) in self.space.components().iter().enumerate() {
                let part = match component {
                    Component::Along(i) => force.map(|force| force[*i]),
                    Component::About(i) => moment.map(|moment| moment[*i]),
                };
                if let Some(part) = part {
                    let slot = &mut reactions[row.joint * size + k];
                    *slot = *slot - l * part;
                }
            }
        }
        reactions
    }
}
