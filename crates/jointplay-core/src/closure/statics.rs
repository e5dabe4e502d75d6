//! The reactions at the joints: the multipliers of the closure equations, which are statics transposed.

use crate::math::real::Real;
use crate::math::space::{Component, Pose};
use crate::mechanism::Mechanism;

impl Mechanism {
    /// The reactions that the multipliers of the closure rows stand for.
    pub(crate) fn reactions<S: Real>(&self, poses: &[Pose<S>], multipliers: &[S]) -> Vec<S> {
        let size = self.size();
        let mut reactions = vec![S::from_f64(0.0); self.n_joints() * size];
        for (number, (row, &l)) in self.rows.iter().zip(multipliers).enumerate() {
            let direction = self.row_axis(number, poses);
            for (k, component) in self.space.components().iter().enumerate() {
                if let (Component::Along(_), Component::Along(i)) | (Component::About(_), Component::About(i)) =
                    (row.component, component)
                {
                    let slot = &mut reactions[row.joint * size + k];
                    *slot = *slot - l * direction[*i];
                }
            }
        }
        reactions
    }
}
