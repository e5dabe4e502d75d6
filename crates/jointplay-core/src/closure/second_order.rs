//! How the reactions change with the inputs, exactly.
//!
//! On the closed mechanism the poses x move with the inputs u by `dx = -J^-1 F_u du`. The multipliers l of a load obey
//! `J^T l = c` with c the gradient of its work, so that
//!
//! ```text
//! J^T dl = dc - dJ^T l
//! ```
//!
//! where dJ and dc are derivatives along du and dx: the equations themselves give them, in numbers that carry derivatives.
//! One factored Jacobian serves all directions.

use crate::closure::equations::Inputs;
use crate::closure::newton::{Linearised, Solver, State};
use crate::closure::sensitivity::Gradient;
use crate::math::dual::{DIRECTIONS, Dual};
use crate::math::real::Real;
use crate::math::space::Pose;

/// A direction of the inputs: parameters, each with its part.
pub(crate) type Along = Vec<(usize, f64)>;

impl Solver<'_> {
    /// The derivatives of a load's gradient along the parameters, at a closed state, along each of some directions.
    pub(crate) fn gradient_along(
        &self,
        linearised: &Linearised<'_>,
        state: &State,
        gradient: &Gradient,
        directions: &[Along],
    ) -> Vec<Vec<f64>> {
        let motions = self.motions_along(linearised, directions);
        let at_once = directions.chunks(DIRECTIONS).zip(motions.chunks(DIRECTIONS));
        at_once.flat_map(|(directions, motions)| self.some_along(linearised, state, gradient, directions, motions)).collect()
    }

    /// The twists of all bodies along each of some directions.
    fn motions_along(&self, linearised: &Linearised<'_>, directions: &[Along]) -> Vec<Vec<f64>> {
        let m = self.mechanism;
        let mut right = vec![vec![0.0; m.n_rows()]; directions.len()];
        let mut of_row = Inputs { drives: vec![0.0; m.n_drives()], parameters: vec![0.0; m.n_parameters()] };
        for (k, row) in m.rows.iter().enumerate() {
            m.pull_row_back(row, &linearised.poses, &linearised.parameters, 1.0, &mut of_row);
            for (right, along) in right.iter_mut().zip(directions) {
                right[k] = along.iter().map(|(p, part)| part * of_row.parameters[*p]).sum();
            }
            of_row.parameters.fill(0.0);
        }
        let motion = |mut right: Vec<f64>| {
            let mut motion = vec![0.0; m.n_unknowns()];
            linearised.factors.solve(&mut right, &mut motion);
            motion
        };
        right.into_iter().map(motion).collect()
    }

    /// The derivatives along as many directions as numbers carry.
    fn some_along(
        &self,
        linearised: &Linearised<'_>,
        state: &State,
        gradient: &Gradient,
        directions: &[Along],
        motions: &[Vec<f64>],
    ) -> Vec<Vec<f64>> {
        let m = self.mechanism;
        let poses = self.moving_poses(state, motions);
        let mut parameters: Vec<Dual> = state.inputs.parameters.iter().map(|&p| Dual::from_f64(p)).collect();
        for (k, along) in directions.iter().enumerate() {
            along.iter().for_each(|&(p, part)| parameters[p].slopes[k] += part);
        }
        let drives: Vec<Dual> = state.inputs.drives.iter().map(|&q| Dual::from_f64(q)).collect();
        let zero = Dual::from_f64(0.0);
        let (mut residual, mut derivatives) = (vec![zero; m.n_rows()], vec![zero; 2 * m.size() * m.n_rows()]);
        m.evaluate(&poses, &m.commands(&drives, parameters.clone()), &mut residual, &mut derivatives);
        let cost = m.load_cost(&poses, &parameters);
        let mut right: Vec<[f64; DIRECTIONS]> = cost.twists.iter().map(|c| c.slopes).collect();
        for (&(row, column), &pick) in self.pattern.iter().zip(&self.picks) {
            let l = gradient.multipliers[row];
            right[column].iter_mut().zip(derivatives[pick].slopes).for_each(|(right, slope)| *right -= slope * l);
        }
        let mut multipliers: Vec<Dual> = gradient.multipliers.iter().map(|&l| Dual::from_f64(l)).collect();
        let mut change = vec![0.0; m.n_rows()];
        for k in 0..directions.len() {
            let mut right: Vec<f64> = right.iter().map(|right| right[k]).collect();
            linearised.factors.solve_transposed(&mut right, &mut change);
            multipliers.iter_mut().zip(&change).for_each(|(l, change)| l.slopes[k] = *change);
        }
        let mut of_load = Inputs { drives: vec![zero; m.n_drives()], parameters: cost.parameters };
        m.pull_back(&poses, &parameters, &multipliers, &mut of_load);
        (0..directions.len()).map(|k| of_load.parameters.iter().map(|g| g.slopes[k]).collect()).collect()
    }

    /// The poses of all bodies as they move along each of some twists.
    fn moving_poses(&self, state: &State, motions: &[Vec<f64>]) -> Vec<Pose<Dual>> {
        let (m, size) = (self.mechanism, self.mechanism.size());
        let pose = |(b, coordinates): (usize, &[f64])| {
            let mut numbers = Vec::with_capacity(m.space.n_pose_numbers());
            m.space.put_pose_numbers(coordinates, |x| numbers.push(Dual::from_f64(x)));
            let mut twist = vec![Dual::from_f64(0.0); size];
            for (k, motion) in motions.iter().enumerate() {
                twist.iter_mut().zip(&motion[b * size..]).for_each(|(twist, part)| twist.slopes[k] = *part);
            }
            m.space.pose_of_numbers(&m.space.move_numbers(&numbers, &twist))
        };
        state.coordinates.chunks_exact(m.space.n_coordinates()).enumerate().map(pose).collect()
    }
}
