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

use nalgebra::DMatrix;

use crate::closure::equations::Inputs;
use crate::closure::newton::{Linearised, Solver, State};
use crate::closure::sensitivity::Gradient;
use crate::math::dual::{DIRECTIONS, Dual};
use crate::math::real::Real;
use crate::math::space::Pose;
use crate::mechanism::Mechanism;

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
        at_once
            .flat_map(|(directions, motions)| self.some_along(linearised, state, gradient, directions, motions))
            .collect()
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
        let poses = m.moving_poses(state, motions);
        let mut parameters: Vec<Dual> = state.inputs.parameters.iter().map(|&p| Dual::from_f64(p)).collect();
        for (k, along) in directions.iter().enumerate() {
            for &(p, part) in along {
                parameters[p].slopes[k] += part;
            }
        }
        let drives: Vec<Dual> = state.inputs.drives.iter().map(|&q| Dual::from_f64(q)).collect();
        let zero = Dual::from_f64(0.0);
        let (mut residual, mut derivatives) = (vec![zero; m.n_rows()], vec![zero; m.n_derivatives()]);
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
}

impl Mechanism {
    /// How the balance `J^T l - c` of all bodies changes where the multipliers l stay: along the twists of all bodies and
    /// along the parameters, one direction per column.
    pub(crate) fn balance_along(&self, state: &State, multipliers: &[f64]) -> [DMatrix<f64>; 2] {
        let n = self.n_unknowns();
        let mut along = DMatrix::zeros(n, n + self.n_parameters());
        let drives: Vec<Dual> = state.inputs.drives.iter().map(|&q| Dual::from_f64(q)).collect();
        let zero = Dual::from_f64(0.0);
        let (mut residual, mut derivatives) = (vec![zero; self.n_rows()], vec![zero; 2 * self.size() * self.n_rows()]);
        for first in (0..along.ncols()).step_by(DIRECTIONS) {
            let directions = first..along.ncols().min(first + DIRECTIONS);
            let mut motions = vec![vec![0.0; n]; directions.len()];
            let mut parameters: Vec<Dual> = state.inputs.parameters.iter().map(|&p| Dual::from_f64(p)).collect();
            for (k, direction) in directions.clone().enumerate() {
                match direction.checked_sub(n) {
                    None => motions[k][direction] = 1.0,
                    Some(p) => parameters[p].slopes[k] = 1.0,
                }
            }
            let poses = self.moving_poses(state, &motions);
            self.evaluate(&poses, &self.commands(&drives, parameters.clone()), &mut residual, &mut derivatives);
            let mut put = |unknown: usize, slopes: &[f64; DIRECTIONS], part: f64| {
                directions.clone().zip(slopes).for_each(|(d, slope)| along[(unknown, d)] += part * slope);
            };
            for (unknown, pull) in self.load_cost(&poses, &parameters).twists.iter().enumerate() {
                put(unknown, &pull.slopes, -1.0);
            }
            for (row, l) in multipliers.iter().enumerate() {
                for (side, body) in self.row_bodies(row).into_iter().enumerate() {
                    let Some(b) = body else { continue };
                    for c in 0..self.size() {
                        put(b * self.size() + c, &derivatives[(2 * row + side) * self.size() + c].slopes, *l);
                    }
                }
            }
        }
        [along.columns(0, n).into_owned(), along.columns(n, self.n_parameters()).into_owned()]
    }

    /// The poses of all bodies as they move along each of some twists.
    pub(crate) fn moving_poses(&self, state: &State, motions: &[Vec<f64>]) -> Vec<Pose<Dual>> {
        let size = self.size();
        let pose = |(b, coordinates): (usize, &[f64])| {
            let mut numbers = Vec::with_capacity(self.space.n_pose_numbers());
            self.space.put_pose_numbers(coordinates, |x| numbers.push(Dual::from_f64(x)));
            let mut twist = vec![Dual::from_f64(0.0); size];
            for (k, motion) in motions.iter().enumerate() {
                twist.iter_mut().zip(&motion[b * size..]).for_each(|(twist, part)| twist.slopes[k] = *part);
            }
            self.space.pose_of_numbers(&self.space.move_numbers(&numbers, &twist))
        };
        state.coordinates.chunks_exact(self.space.n_coordinates()).enumerate().map(pose).collect()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::mechanism::testing::{disc, pin, point};

    fn build(spec: Value) -> Mechanism {
        Mechanism::new(&serde_json::from_value(spec).expect("a specification")).expect("a mechanism")
    }

    /// Two wheels in bearings with play, the first one driven and with run-out; springs and a load on the other.
    fn wheels() -> Mechanism {
        let mut gear = pin(4, 5);
        gear["kind"] = json!("gear");
        gear["coupling"] = json!({"radii": [0.01, 0.02], "teeth": [20, 40], "pressure_angle": 0.349});
        let ways = json!([[[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]], [[0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]]);
        build(json!({
            "space": "planar", "n_bodies": 2, "length": 0.03, "singular_value": 1e-6,
            "guess": [[0.0, 0.0, 0.0], [0.03, 0.0, 0.0]],
            "points": [point(-1, 0.0, 0.0), point(0, 0.0, 0.0), point(-1, 0.03, 0.0), point(1, 0.0, 0.0),
                point(0, 0.0, 0.0), point(1, 0.0, 0.0), point(1, 0.01, 0.02), point(-1, 0.05, 0.06)],
            "joints": [pin(0, 1), pin(2, 3), gear],
            "drives": [{"joint": 0}], "output": {"point": 6},
            "displacements": [{"points": [4], "about": [0.0, 0.0, 0.0]}],
            "loads": [{"point": 6, "force": [3.0, -5.0, 0.0], "moment": [0.0, 0.0, 0.2], "axes": 1}],
            "springs": [{"first": 6, "second": 7, "stiffness": 300.0, "free_length": 0.02, "preload": 2.0}],
            "torsions": [{"joint": 1, "stiffness": 0.4, "free_angle": 0.3, "preload": 0.1}],
            "sources": [disc(0, 2e-4), disc(1, 2e-4),
                {"kind": "clearance", "joint": 2, "set": {"interval": {"low": -1e-4, "high": 2e-4}}, "centre": [1e-5],
                    "law": "uniform"},
                {"kind": "place", "displacement": 0, "components": ["x", "y"], "ways": ways,
                    "set": {"disc": {"radius": 1e-4}}, "centre": [0.0, 0.0], "law": "uniform"}],
        }))
    }

    /// An arm of two driven joints across one another whose pins tilt and slide; springs and a load on its end.
    fn arm() -> Mechanism {
        let joint = |first: usize, axis: [f64; 3]| {
            json!({"kind": "revolute", "first": first, "second": first + 1, "axis_first": axis, "axis_second": axis,
                "side_first": [1.0, 0.0, 0.0], "side_second": [1.0, 0.0, 0.0]})
        };
        let place = |body: i64, at: [f64; 3]| json!({"body": body, "at": at});
        let play = |joint: usize| {
            let set = json!({"journal": {"radius": 2e-4, "half_length": 0.01, "axial": 3e-4}});
            json!({"kind": "clearance", "joint": joint, "set": set, "centre": [0.0, 0.0, 0.0, 0.0, 0.0], "law": "uniform"})
        };
        build(json!({
            "space": "spatial", "n_bodies": 2, "length": 0.1, "singular_value": 1e-6,
            "guess": [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0]],
            "points": [place(-1, [0.01, 0.0, 0.02]), place(0, [0.01, 0.0, 0.02]), place(0, [0.0, 0.02, 0.1]),
                place(1, [0.0, 0.02, 0.0]), place(1, [0.08, 0.01, 0.03]), place(-1, [0.2, 0.1, 0.0])],
            "joints": [joint(0, [0.0, 0.0, 1.0]), joint(2, [0.0, 1.0, 0.0])],
            "drives": [{"joint": 0}, {"joint": 1}], "output": {"point": 4},
            "loads": [{"point": 4, "force": [3.0, -5.0, 4.0], "moment": [0.1, 0.3, 0.2]},
                {"point": 4, "force": [1.0, 2.0, 0.0], "moment": [0.0, 0.1, 0.0], "axes": 1}],
            "springs": [{"first": 4, "second": 5, "stiffness": 300.0, "free_length": 0.05, "preload": 2.0}],
            "torsions": [{"joint": 1, "stiffness": 2.0, "free_angle": 0.3, "preload": 0.1}],
            "sources": [play(0), play(1)],
        }))
    }

    /// Against closed mechanisms on both sides, where the play is taken in part.
    #[test]
    fn derivatives_of_the_reactions_are_differences() {
        for (m, drives) in [(wheels(), vec![0.1]), (arm(), vec![0.4, -0.3])] {
            let (solver, nominal) = m.first_state(&drives).expect("assembled");
            let at = |parameters: Vec<f64>| {
                let inputs = Inputs { drives: drives.clone(), parameters };
                let state = solver.follow(&nominal, &inputs).expect("assembled");
                let linearised = solver.linearise(&state).expect("regular");
                let gradient = m.gradient(&linearised, m.load_cost(&linearised.poses, &state.inputs.parameters));
                (
                    gradient.inputs.parameters.clone(),
                    solver.gradient_along(&linearised, &state, &gradient, &one_by_one(&m)),
                )
            };
            let noise = |k: usize| 1e-4 * ((k as f64 * 0.618_034).fract() - 0.5);
            let parameters: Vec<f64> = (0..m.n_parameters()).map(|k| m.centre[k] + noise(k + 1)).collect();
            let (forces, told) = at(parameters.clone());
            let scale = forces.iter().fold(0.0_f64, |scale, force| scale.max(force.abs()));
            assert!(told.len() > DIRECTIONS || m.n_parameters() <= DIRECTIONS);
            for (p, told) in told.iter().enumerate() {
                let h = 1e-6;
                let [high, low] = [h, -h].map(|h| {
                    let mut moved = parameters.clone();
                    moved[p] += h;
                    at(moved).0
                });
                for (i, slope) in told.iter().enumerate() {
                    let difference = (high[i] - low[i]) / (2.0 * h);
                    // Per metre and per radian; differences are off by their truncation and by rounding.
                    assert!((slope - difference).abs() < 1e-5 * scale / m.length, "{p} {i}: {slope} {difference}");
                }
            }
            let largest = told.iter().flatten().fold(0.0_f64, |largest, slope| largest.max(slope.abs()));
            assert!(largest > scale);
        }
    }

    fn one_by_one(m: &Mechanism) -> Vec<Along> {
        (0..m.n_parameters()).map(|p| vec![(p, 1.0)]).collect()
    }
}
