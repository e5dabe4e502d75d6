//! The output: a point of a body with the rotation of that body, seen from the ground or from another body.
//!
//! Seen from a body with origin p and rotation R it has the place `R^T (x - p)` and the rotation `R^T Q`, where x is its
//! point and Q the rotation of its own body. Errors are differences of these, in the axes of the body it is seen from,
//! and a force f and a moment m in those axes do their work through `R f` and `R m` on its own body and through the
//! opposite of both, at the same place, on the other one.

use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::closure::sensitivity::Cost;
use crate::math::memory::Fresh;
use crate::math::real::Real;
use crate::math::space::{Component, Pose};
use crate::math::vector::{Vec3, add, cross, sub};
use crate::mechanism::Mechanism;
use crate::program::symbol::Symbol;

impl Mechanism {
    /// Where its point is.
    pub(crate) fn output_place<S: Real>(&self, poses: &[Pose<S>], parameters: &[S]) -> Vec3<S> {
        let place = self.place(self.output, poses, parameters).position;
        self.seen_from.map_or(place, |from| poses[from].turn_back(sub(place, poses[from].position)))
    }

    /// The coordinates of its body, with the rotation as it is seen; none where it is on the ground.
    fn output_coordinates(&self, coordinates: &[f64]) -> Option<Vec<f64>> {
        let width = self.n_body_coordinates();
        let of = |b: usize| &coordinates[b * width..(b + 1) * width];
        let own = of(self.points[self.output].body?);
        Some(self.seen_from.map_or_else(|| own.to_vec(), |from| self.space.seen_from(of(from), own)))
    }

    /// Coordinates of the output: position of its point, rotation of its body.
    #[must_use]
    pub fn output(&self, coordinates: &[f64], inputs: &Inputs<f64>) -> Vec<f64> {
        let place = self.output_place(&self.poses(coordinates), &inputs.parameters);
        let still = || vec![0.0; self.size() - self.n_translations()];
        let turned = self.output_coordinates(coordinates).map_or_else(still, |own| self.space.attitude(&own));
        self.pose_components(place, &turned)
    }

    /// What its body has turned from nominal coordinates to others.
    pub(crate) fn output_turn(&self, nominal: &[f64], coordinates: &[f64]) -> Vec<f64> {
        let (from, to) = (self.output_coordinates(nominal), self.output_coordinates(coordinates));
        let still = || vec![0.0; self.size() - self.n_translations()];
        from.zip(to).map_or_else(still, |(from, to)| self.space.turn_of_body(&from, &to))
    }

    /// Outputs of many perfect mechanisms, coordinates given one after the other.
    #[must_use]
    pub fn outputs(&self, coordinates: &[f64]) -> Vec<f64> {
        const AT_ONCE: usize = 1 << 10;
        let inputs = Inputs::nominal(self, &vec![0.0; self.n_drives]);
        let (point, width) = (&self.points[self.output], self.n_body_coordinates());
        let (Some(body), None) = (point.body, self.seen_from) else {
            let rows = coordinates.chunks_exact(self.n_coordinates());
            return rows.flat_map(|c| self.output(c, &inputs)).collect();
        };
        let mut outputs = Fresh::new(coordinates.len() / self.n_coordinates() * self.size());
        let runs = outputs.part().runs(AT_ONCE * self.size()).into_par_iter();
        runs.zip(coordinates.par_chunks(AT_ONCE * self.n_coordinates())).for_each(|(outputs, rows)| {
            let outputs = outputs.untouched().chunks_exact_mut(self.size());
            for (output, row) in outputs.zip(rows.chunks_exact(self.n_coordinates())) {
                let own = &row[body * width..(body + 1) * width];
                let pose = self.space.pose(own);
                let (place, attitude) = output.split_at_mut(self.n_translations());
                place.copy_from_slice(&add(pose.position, pose.turn(point.at))[..place.len()]);
                attitude.copy_from_slice(&self.space.attitude(own));
            }
        });
        outputs.into_vec()
    }

    /// Adds a wrench on the output, in the axes in which it is seen.
    pub(crate) fn add_output_wrench<S: Real>(
        &self,
        force: Vec3<S>,
        moment: Vec3<S>,
        poses: &[Pose<S>],
        parameters: &[S],
        cost: &mut Cost<S>,
    ) {
        let Some(from) = self.seen_from else {
            return self.add_wrench(self.output, force, moment, poses, parameters, cost);
        };
        let (force, moment) = (poses[from].turn(force), poses[from].turn(moment));
        self.add_wrench(self.output, force, moment, poses, parameters, cost);
        let place = self.place(self.output, poses, parameters).position;
        let moment = add(moment, cross(sub(place, poses[from].position), force));
        for (k, component) in self.space.components().iter().enumerate() {
            let slot = &mut cost.twists[from * self.size() + k];
            *slot = *slot
                - match component {
                    Component::Along(i) => force[*i],
                    Component::About(i) => moment[*i],
                };
        }
    }

    /// Puts the numbers that tell how far the output's body has turned, at the beginning.
    #[inline(always)]
    pub(crate) fn put_turn_numbers(&self, coordinates: &[f64], mut put: impl FnMut(f64)) {
        let width = self.n_body_coordinates();
        match (self.points[self.output].body, self.seen_from) {
            (Some(b), None) => self.space.put_turn_numbers(&coordinates[b * width..(b + 1) * width], put),
            (Some(_), Some(_)) => {
                self.output_coordinates(coordinates).iter().for_each(|own| self.space.put_turn_numbers(own, &mut put));
            }
            // The ground does not turn.
            (None, _) => (0..self.space.n_turn_numbers()).for_each(|_| put(0.0)),
        }
    }

    /// Those numbers after small twists of all bodies.
    pub(crate) fn move_turn_numbers<'r>(&self, turn: &[Symbol<'r>], twists: &[Symbol<'r>]) -> Vec<Symbol<'r>> {
        let of = |b: usize| &twists[b * self.size()..(b + 1) * self.size()];
        let Some(body) = self.points[self.output].body else { return turn.to_vec() };
        let Some(from) = self.seen_from else { return self.space.move_turn_numbers(turn, of(body)) };
        let twist: Vec<Symbol<'r>> = of(body).iter().zip(of(from)).map(|(&a, &b)| a - b).collect();
        self.space.move_turn_numbers(turn, &twist)
    }

    /// The rotation of the output's body since the beginning.
    pub(crate) fn turned<'r>(&self, turn: &[Symbol<'r>], numbers: &[Symbol<'r>]) -> Vec<Symbol<'r>> {
        let width = self.space.n_pose_numbers();
        let of = |b: usize| &numbers[b * width..(b + 1) * width];
        match (self.points[self.output].body, self.seen_from) {
            (Some(body), None) => self.space.turned(turn, of(body)),
            (Some(body), Some(from)) => self.space.turned(turn, &self.space.seen_from(of(from), of(body))),
            (None, _) => vec![Symbol::Constant(0.0); self.size() - self.n_translations()],
        }
    }
}
