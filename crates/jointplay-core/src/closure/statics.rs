//! The reactions at the joints: the multipliers of the closure equations, which are statics transposed.

use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::math::real::Real;
use crate::math::space::{Component, Pose};
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;

/// What equilibrium is made of at a pose; all vectors in ground axes.
#[derive(Clone, Debug)]
pub struct EquilibriumTerms {
    /// The closure Jacobian J, row by row: multipliers l hold what the loads do with `J^T l = loads`.
    pub jacobian: Vec<f64>,
    /// What loads and springs do along the twists of all bodies.
    pub loads: Vec<f64>,
    /// Of every joint the places of its points, from the origins of their bodies.
    pub levers: Vec<f64>,
    /// Of every joint its three axes as the first body carries them, one after the other.
    pub axes: Vec<f64>,
}

impl Mechanism {
    /// What equilibrium is made of in every case, at its coordinates, for parameters and for forces and moments of the
    /// loads, one after the other.
    #[must_use]
    pub fn balances(
        &self,
        cases: &[Case<'_>],
        parameters: &[Vec<f64>],
        wrenches: &[Vec<f64>],
    ) -> Vec<EquilibriumTerms> {
        let each = cases.par_iter().zip(parameters).zip(wrenches);
        each.map(|((case, parameters), wrenches)| self.balance(case, parameters, wrenches)).collect()
    }

    fn balance(&self, case: &Case<'_>, parameters: &[f64], wrenches: &[f64]) -> EquilibriumTerms {
        let poses = self.poses(case.coordinates);
        let inputs = Inputs { drives: case.drives.to_vec(), parameters: parameters.to_vec() };
        let (_, jacobian) = self.dense_at(&poses, &inputs);
        let wrenches = wrenches.chunks_exact(6).map(|w| [[w[0], w[1], w[2]], [w[3], w[4], w[5]]]);
        let loads = self.cost_of_loads(wrenches, &poses, parameters).twists;
        let lever = |point: usize| self.place(point, &poses, parameters).lever;
        let levers = self.joints.iter().flat_map(|joint| [joint.first, joint.second].map(lever)).flatten().collect();
        let axes = (0..self.n_joints()).flat_map(|joint| self.carried(joint, false, &poses, parameters));
        EquilibriumTerms {
            jacobian: jacobian.transpose().as_slice().to_vec(),
            loads,
            levers,
            axes: axes.flatten().collect(),
        }
    }

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
