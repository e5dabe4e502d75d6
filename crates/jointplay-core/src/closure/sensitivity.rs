//! First-order maps from the inputs to the output, by the transposed closure Jacobian.
//!
//! For a cost c on the poses, `J^T l = dc/dx` gives the multipliers l, and the gradient of c along the
//! inputs u of the closed mechanism is `-(dr/du)^T l`. With c the work of a load, l are the
//! reactions; with c a component of the output's pose, the gradient is that component's row of the
//! sensitivity. One solve serves all inputs.

use nalgebra::DMatrix;

use crate::closure::equations::Inputs;
use crate::closure::newton::{Linearised, State};
use crate::math::real::Real;
use crate::math::space::{Component, Pose};
use crate::math::vector::{Vec3, add, cross, dot};
use crate::mechanism::case::Case;
use crate::mechanism::point::constant;
use crate::mechanism::{Mechanism, Row};

/// What the load leaves undecided is observable when it moves the output, to first order, by more than this part
/// of what all play together could.
pub(crate) const UNOBSERVABLE: f64 = 1e-9;

/// First-order maps of the output.
#[derive(Clone, Debug)]
pub struct Output {
    /// Output components by parameters.
    pub parameters: DMatrix<f64>,
    /// Output components by drives.
    pub drives: DMatrix<f64>,
}

impl Output {
    /// The error to first order with all parameters given; `shift` is the part of drive values other than the nominal ones.
    pub(crate) fn error(&self, shift: &[f64], parameters: &[f64]) -> Vec<f64> {
        let moved = |i: usize| parameters.iter().enumerate().map(|(p, u)| self.parameters[(i, p)] * u).sum::<f64>();
        shift.iter().enumerate().map(|(i, shift)| shift + moved(i)).collect()
    }
}

/// A cost's gradient along the inputs, and the multipliers of the closure rows.
#[derive(Clone, Debug)]
pub struct Gradient {
    /// Along drives and parameters.
    pub inputs: Inputs<f64>,
    /// One per row; the joint pushes its second body by their negative.
    pub multipliers: Vec<f64>,
}

impl Mechanism {
    /// Components of a pose: the translations that exist, then the rotations.
    pub(crate) fn pose_components<S: Real>(&self, position: Vec3<S>, rotation: &[S]) -> Vec<S> {
        let mut rotations = rotation.iter();
        let component = |component: &Component| match component {
            Component::Along(i) => Some(position[*i]),
            Component::About(_) => rotations.next().copied(),
        };
        self.space.components().iter().filter_map(component).collect()
    }

    /// What takes one output to another, per component.
    #[must_use]
    pub fn output_difference(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        let n = self.n_translations();
        let mut difference: Vec<f64> = from[..n].iter().zip(&to[..n]).map(|(a, b)| b - a).collect();
        difference.extend(self.space.turn_between(&from[n..], &to[n..]));
        difference
    }

    /// Adds a wrench on the body of a point: the gradient of its work along the twists and along the
    /// parameters that move the point.
    pub(crate) fn add_wrench<S: Real>(
        &self,
        point: usize,
        force: Vec3<S>,
        moment: Vec3<S>,
        poses: &[Pose<S>],
        parameters: &[S],
        cost: &mut Cost<S>,
    ) {
        if let Some(body) = self.points[point].body {
            let lever = self.place(point, poses, parameters).lever;
            let moment = add(moment, cross(lever, force));
            for (k, component) in self.space.components().iter().enumerate() {
                let slot = &mut cost.twists[body * self.size() + k];
                *slot = *slot
                    + match component {
                        Component::Along(i) => force[*i],
                        Component::About(i) => moment[*i],
                    };
            }
        }
        // A point on the ground moves with its dimensions only.
        for (parameter, [velocity, _]) in self.ground_rates(point, poses, parameters) {
            let slot = &mut cost.parameters[parameter];
            *slot = *slot + dot(force, velocity);
        }
    }

    /// A cost without any term.
    pub(crate) fn no_cost<S: Real>(&self) -> Cost<S> {
        let zero = S::from_f64(0.0);
        Cost { twists: vec![zero; self.n_unknowns()], parameters: vec![zero; self.n_parameters()] }
    }

    /// The work of the loads and springs: the gradient of it by their forces at the pose.
    pub(crate) fn load_cost<S: Real>(&self, poses: &[Pose<S>], parameters: &[S]) -> Cost<S> {
        self.cost_of_loads(self.loads.iter().map(|load| [load.force, load.moment].map(constant)), poses, parameters)
    }

    /// The same where the loads have other forces and moments, in their axes.
    pub(crate) fn cost_of_loads<S: Real>(
        &self,
        wrenches: impl Iterator<Item = [Vec3<S>; 2]>,
        poses: &[Pose<S>],
        parameters: &[S],
    ) -> Cost<S> {
        let mut cost = self.no_cost();
        for (load, wrench) in self.loads.iter().zip(wrenches) {
            let [force, moment] = load.axes.map_or(wrench, |b| wrench.map(|v| poses[b].turn(v)));
            self.add_wrench(load.point, force, moment, poses, parameters, &mut cost);
        }
        self.add_springs(poses, parameters, &mut cost);
        cost
    }

    /// The cost whose gradient is one component of the output.
    pub(crate) fn component_cost<S: Real>(&self, component: usize, poses: &[Pose<S>], parameters: &[S]) -> Cost<S> {
        let mut cost = self.no_cost();
        let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
        match self.space.components()[component] {
            Component::Along(i) => force[i] = 1.0,
            Component::About(i) => moment[i] = 1.0,
        }
        self.add_output_wrench(constant(force), constant(moment), poses, parameters, &mut cost);
        cost
    }

    /// The cost that is the opening between the flanks of a coupled row.
    pub(crate) fn opening_cost(&self, row: &Row, poses: &[Pose<f64>], parameters: &[f64]) -> Cost<f64> {
        let rate = self.coupled_row(row, poses, parameters, &[]).opening_rate;
        let joint = &self.joints[row.joint];
        let mut cost = self.no_cost();
        let ends = [(joint.second, rate.linear, rate.second), (joint.first, rate.linear.map(|v| -v), rate.first)];
        for (point, force, moment) in ends {
            self.add_wrench(point, force, moment, poses, parameters, &mut cost);
            // The axes of the joint turn with the point.
            for (parameter, [_, rotation]) in self.ground_rates(point, poses, parameters) {
                cost.parameters[parameter] += dot(moment, rotation);
            }
        }
        cost
    }

    /// Gradient of a cost along the inputs of the closed mechanism.
    pub(crate) fn gradient(&self, linearised: &Linearised<'_>, cost: Cost<f64>) -> Gradient {
        let Cost { mut twists, parameters } = cost;
        let mut multipliers = vec![0.0; self.n_rows()];
        linearised.factors.solve_transposed(&mut twists, &mut multipliers);
        let mut inputs = Inputs { drives: vec![0.0; self.n_drives], parameters };
        self.pull_back(&linearised.poses, &linearised.parameters, &multipliers, &mut inputs);
        Gradient { inputs, multipliers }
    }

    /// Sensitivity of every output component to every parameter and drive.
    #[must_use]
    pub fn output_sensitivity(&self, linearised: &Linearised<'_>, state: &State) -> Output {
        let mut parameters = DMatrix::zeros(self.size(), self.n_parameters());
        let mut drives = DMatrix::zeros(self.size(), self.n_drives);
        for i in 0..self.size() {
            let gradient =
                self.gradient(linearised, self.component_cost(i, &linearised.poses, &state.inputs.parameters));
            parameters.row_mut(i).iter_mut().zip(&gradient.inputs.parameters).for_each(|(a, b)| *a = *b);
            drives.row_mut(i).iter_mut().zip(&gradient.inputs.drives).for_each(|(a, b)| *a = *b);
        }
        Output { parameters, drives }
    }

    /// First-order shift of the output by drive values that differ from the nominal ones.
    pub(crate) fn drive_shift(&self, map: &Output, case: &Case<'_>, nominal: &State) -> Vec<f64> {
        (0..self.size())
            .map(|i| {
                let drives = case.drives.iter().zip(&nominal.inputs.drives).enumerate();
                drives.map(|(d, (q, q0))| map.drives[(i, d)] * (q - q0)).sum()
            })
            .collect()
    }
}

/// The gradient of a cost along the twists of all bodies and, directly, along the parameters.
pub(crate) struct Cost<S> {
    pub twists: Vec<S>,
    pub parameters: Vec<S>,
}
