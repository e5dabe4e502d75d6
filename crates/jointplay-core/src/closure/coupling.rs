//! Couplings among the closure equations: their rows at a pose, and which teeth mesh on the way to another one.

use crate::closure::equations::Command;
use crate::math::real::Real;
use crate::math::space::Pose;
use crate::math::vector::{add, cross, dot, sub};
use crate::mechanism::coupling::{Coupled, Coupling, Measure, Pair, Rate, Reference};
use crate::mechanism::{Mechanism, Row};

impl Mechanism {
    /// The rows that couple.
    fn coupled_rows(&self) -> impl Iterator<Item = (usize, &Coupling)> {
        let coupled = self.rows.iter().enumerate().filter(|(_, row)| row.is_coupled);
        coupled.filter_map(|(k, row)| Some((k, self.joints[row.joint].coupling.as_ref()?)))
    }

    /// The joints whose couplings slide, with what measures it, in the order of their commands after those of the drives.
    pub(crate) fn sliding(&self) -> impl Iterator<Item = (usize, &Coupling, Measure)> {
        let joints = self.joints.iter().enumerate();
        joints.filter_map(|(number, joint)| {
            let coupling = joint.coupling.as_ref()?;
            Some((number, coupling, coupling.slides()?))
        })
    }

    /// Number of commands: those of the driven rows, then the references of what slides.
    pub(crate) fn n_commands(&self) -> usize {
        self.commanded.len() + self.sliding().count()
    }

    /// How far every coupling that slides has done so, with sine and cosine of its phase.
    pub(crate) fn references(&self, coordinates: &[f64]) -> Vec<Command<f64>> {
        if self.sliding().next().is_none() {
            return Vec::new();
        }
        let (poses, parameters) = (self.poses(coordinates), vec![0.0; self.n_parameters()]);
        let reference = |(joint, coupling, slid): (usize, &Coupling, Measure)| {
            let value = self.pair(joint, &poses, &parameters).measure(slid);
            let (sine, cosine) = (value / coupling.radian).sin_cos();
            Command { value, sine, cosine }
        };
        self.sliding().map(reference).collect()
    }

    /// The two bodies of a joint as a coupling sees them.
    fn pair<S: Real>(&self, joint: usize, poses: &[Pose<S>], parameters: &[S]) -> Pair<S> {
        let axes = |second| {
            let carried = self.carried(joint, second, poses, parameters);
            self.joints[joint].plane().map(|axis| carried[axis])
        };
        let place = |point| self.place(point, poses, parameters).position;
        Pair {
            apart: sub(place(self.joints[joint].second), place(self.joints[joint].first)),
            axes: [axes(false), axes(true)],
        }
    }

    /// The coupled row of a joint. The commands of couplings that slide tell a displacement near the pose with sine
    /// and cosine of its phase; they may be left out where the residual is not asked for.
    pub(crate) fn coupled_row<S: Real>(
        &self,
        row: &Row,
        poses: &[Pose<S>],
        parameters: &[S],
        commands: &[Command<S>],
    ) -> Coupled<S> {
        let one = S::from_f64(1.0);
        let Some(coupling) = &self.joints[row.joint].coupling else {
            let none = Rate::zero();
            return Coupled { residual: S::from_f64(0.0), rate: none, opening_rate: none, slope: one, gap: one };
        };
        let reference = self.sliding().position(|(joint, ..)| joint == row.joint).map(|k| self.commanded.len() + k);
        let reference = reference.and_then(|k| commands.get(k)).map(|c| Reference {
            value: c.value,
            sine: c.sine,
            cosine: c.cosine,
        });
        let pair = self.pair(row.joint, poses, parameters);
        coupling
            .row(&pair, reference.as_ref(), row.play, row.displaced(parameters), |taken| row.shifted(taken, parameters))
    }

    /// The rows with play between flanks, those that a basis leaves out as well.
    pub(crate) fn flanks(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().chain(&self.left_out).filter(|row| row.play.is_some())
    }

    /// Whether the flanks of a coupling in whose play an offset is given would have to pass through each other.
    pub(crate) fn jams(&self, coordinates: &[f64], parameters: &[f64]) -> bool {
        let mut taken = self.flanks().filter(|row| row.displaced(parameters) != 0.0).peekable();
        if taken.peek().is_none() {
            return false;
        }
        let poses = self.poses(coordinates);
        taken.any(|row| self.coupled_row(row, &poses, parameters, &[]).gap < 0.0)
    }

    /// What the terms of all coupled rows measure, one after the other; angles up to full turns.
    fn through(&self, coordinates: &[f64], parameters: &[f64]) -> Vec<f64> {
        if self.coupled_rows().next().is_none() {
            return Vec::new();
        }
        let poses = self.poses(coordinates);
        let of_row = |(row, coupling): (usize, &Coupling)| {
            let pair = self.pair(self.rows[row].joint, &poses, parameters);
            coupling.terms.iter().map(|term| pair.measure(term.0)).collect::<Vec<_>>()
        };
        self.coupled_rows().flat_map(of_row).collect()
    }

    /// What twists of all bodies change in what the terms of all coupled rows measure, to first order.
    fn through_along(&self, coordinates: &[f64], parameters: &[f64], twists: &[f64]) -> Vec<f64> {
        let poses = self.poses(coordinates);
        let twist_at = |point: usize| {
            let Some(b) = self.points[point].body else { return [[0.0; 3]; 2] };
            let [velocity, rotation] = self.space.screw(&twists[b * self.size()..(b + 1) * self.size()]);
            [add(velocity, cross(rotation, self.place(point, &poses, parameters).lever)), rotation]
        };
        let of_row = |(row, coupling): (usize, &Coupling)| {
            let joint = self.rows[row].joint;
            let pair = self.pair(joint, &poses, parameters);
            let [[v1, w1], [v2, w2]] = [self.joints[joint].first, self.joints[joint].second].map(twist_at);
            let change = |rate: Rate<f64>| dot(rate.linear, sub(v2, v1)) + dot(rate.first, w1) + dot(rate.second, w2);
            coupling.terms.iter().map(|term| change(pair.rate(term.0))).collect::<Vec<_>>()
        };
        self.coupled_rows().flat_map(of_row).collect()
    }
}

/// Counts what couplings move through on a way, to see whether the same teeth mesh at its end.
pub(crate) struct Mesh<'m> {
    mechanism: &'m Mechanism,
    measures: Vec<f64>,
    moved: Vec<f64>,
    /// Residuals at the beginning.
    from: Vec<f64>,
}

impl<'m> Mesh<'m> {
    pub fn new(mechanism: &'m Mechanism, coordinates: &[f64], parameters: &[f64]) -> Self {
        let measures = mechanism.through(coordinates, parameters);
        Self { mechanism, moved: vec![0.0; measures.len()], measures, from: Vec::new() }
    }

    /// After a move in which no angle changes by as much as half a turn.
    pub fn moves(&mut self, coordinates: &[f64], parameters: &[f64]) {
        self.moves_about(coordinates, parameters, &vec![0.0; self.measures.len()]);
    }

    /// After the first move, by twists of all bodies from coordinates at which the rows have this residual; no angle changes
    /// by as much as half a turn more or less than they say.
    pub fn moves_by(&mut self, [from, to]: [&[f64]; 2], parameters: &[f64], twists: &[f64], residual: Vec<f64>) {
        let ways = self.mechanism.through_along(from, parameters, twists);
        self.moves_about(to, parameters, &ways);
        self.from = residual;
    }

    fn moves_about(&mut self, coordinates: &[f64], parameters: &[f64], expected: &[f64]) {
        let measures = self.mechanism.through(coordinates, parameters);
        let ways = measures.iter().zip(&self.measures).map(|(to, from)| to - from);
        let terms = self.mechanism.coupled_rows().flat_map(|(_, coupling)| &coupling.terms);
        for (((moved, way), expected), (measure, _)) in self.moved.iter_mut().zip(ways).zip(expected).zip(terms) {
            let turn = std::f64::consts::TAU;
            *moved += if measure.turns() { way - turn * ((way - expected) / turn).round() } else { way };
        }
        self.measures = measures;
    }

    /// Whether no tooth has been skipped until the rows have this residual; the first time is the beginning.
    pub fn is_kept(&mut self, residual: &[f64]) -> bool {
        if self.measures.is_empty() {
            return true;
        }
        if self.from.is_empty() {
            self.from = residual.to_vec();
        }
        let mut moved = self.moved.iter();
        self.mechanism.coupled_rows().all(|(row, coupling)| {
            let way: f64 = coupling.terms.iter().zip(&mut moved).map(|(term, moved)| term.1 * moved).sum();
            (way - (residual[row] - self.from[row])).abs() < 0.5 * std::f64::consts::PI * coupling.radian
        })
    }
}

#[cfg(test)]
mod tests;
