//! The worst of specimens that have to be strained to be assembled, to first order and on the exact closure.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::questions::worst::ascent::Measure;
use crate::questions::worst::over_constrained::deviations::Deviations;
use crate::questions::worst::over_constrained::model::{Model, Strained, Tried};
use crate::questions::worst::over_constrained::search::Climb;
use crate::questions::worst::worker::Height;
use crate::redundancy::compatibility::Compatibility;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::sequence::is_apart;
use crate::redundancy::system::{Element, System};

/// What part the load of a direction is, where it is solved for by itself.
const SMALL: f64 = 1e-6;
/// The same for a figure that is reported.
const TINY: f64 = 1e-8;
/// A force below this part of the largest one is rounding, not the load of a direction.
const NOTHING: f64 = 1e-12;
/// Linearisations of an exact search.
const ROUNDS: usize = 8;
/// An exact search is over when it gains less than this part.
const GAIN: f64 = 1e-7;
/// Specimens closer than this part of the deviations are the same.
const SAME: f64 = 1e-9;
/// Climbs whose first-order figure falls short of the best one by more than this part are not the highest on the exact
/// closure, either.
const NEAR: f64 = 0.3;
/// Rounds in which deviations are sought that strain most.
const STRAINS: usize = 3;

/// A configuration of a mechanism with elastic parts.
pub(super) struct Elastic<'a> {
    pub mechanism: &'a Mechanism,
    pub system: System<'a>,
    pub deviations: Deviations<'a>,
    pub solver: &'a Solver<'a>,
    pub case: &'a Case<'a>,
    pub nominal: &'a State,
}

/// The largest first-order figure of a measure, and the exact one.
pub(super) struct Found {
    pub value: f64,
    /// What that certainly does not exceed.
    pub bound: f64,
    /// Share of every source.
    pub contribution: Vec<f64>,
    /// Share of every joint's deformation.
    pub elastic: Vec<f64>,
    pub height: Option<Height>,
}

impl Elastic<'_> {
    /// The model at the nominal pose.
    fn model<'m>(&'m self, c: &'m Compatibility, strain: f64) -> Model<'m> {
        let m = self.mechanism;
        let known = m.displacements(&m.centre);
        let moved = &c.output.parameters * DVector::from_column_slice(&known) - &c.shared * &c.misfit;
        let shift = m.drive_shift(&c.output, self.case, self.nominal);
        Model {
            system: &self.system,
            deviations: &self.deviations,
            compatibility: c,
            right: m.first_order_right(c, &known, self.case, self.nominal),
            base: shift.iter().zip(&moved).map(|(a, b)| a + b).collect(),
            strain,
        }
    }

    /// Corners of the deviations, those that strain most among them.
    fn corners(&self, model: &Model<'_>) -> Vec<Vec<f64>> {
        let columns = self.deviations.columns();
        let c = model.compatibility;
        let row = |k: usize| columns.iter().map(|&column| c.equations[(k, column)]).collect();
        let mut corners = self.deviations.corners(&(0..c.equations.nrows()).map(row).collect::<Vec<_>>());
        let mut last = corners.clone();
        for _ in 0..STRAINS {
            let asks: Vec<Tried> = last.iter().map(|specimen| model.unpulled(specimen.clone())).collect();
            // The energy is a convex function of the deviations; its slope are the self-stresses' works on them.
            let next = model.poses(&asks).into_iter().zip(asks).filter_map(|(strained, ask)| {
                let forces = strained?.balance.forces;
                let slope: Vec<f64> = columns.iter().map(|&column| -forces[column]).collect();
                Some(self.deviations.farthest(&slope, &ask.specimen))
            });
            last = next.collect();
            let known = corners.len();
            for specimen in last {
                if !corners.contains(&specimen) {
                    corners.push(specimen);
                }
            }
            last = corners[known..].to_vec();
        }
        corners
    }

    /// The strongest force that strains a specimen; `None` where none has to be strained.
    fn strain(&self, model: &Model<'_>, corners: &[Vec<f64>]) -> Option<f64> {
        let asks: Vec<Tried> = corners.iter().map(|specimen| model.unpulled(specimen.clone())).collect();
        let found: Vec<Option<Strained>> = model.poses(&asks);
        let energy = |strained: &Strained| strained.balance.answer.as_ref().map_or(0.0, |a| a.value);
        let energies = found.iter().zip(corners).filter_map(|(s, specimen)| Some((energy(s.as_ref()?), specimen)));
        let (_, specimen) = energies.max_by(|a, b| a.0.total_cmp(&b.0))?;
        self.is_strained(model, specimen).then(|| model.strongest(found.iter().flatten()))
    }

    /// Whether a specimen cannot be assembled without force.
    fn is_strained(&self, model: &Model<'_>, specimen: &[f64]) -> bool {
        let right = model.right_of(specimen);
        let factor = self.system.balance(model.compatibility, &right, &Ask::Factor).map_or(f64::INFINITY, |b| b.factor);
        is_apart(factor)
    }

    /// The extremes over all specimens, in the order of the measures; `None` where none has to be strained.
    pub fn extremes(&self, measures: &[Measure], climbs: usize) -> Option<Vec<Option<Found>>> {
        let c = Compatibility::at(self.system.basis, self.solver, self.nominal)?;
        let unpulled = self.model(&c, 0.0);
        let corners = self.corners(&unpulled);
        let strain = self.strain(&unpulled, &corners)?;
        let model = self.model(&c, strain);
        let mut found = model.begin(measures, &corners);
        let mut all: Vec<Climb> = found.iter().flatten().cloned().collect();
        model.climb(&mut all);
        let mut all = all.into_iter();
        for climbs in &mut found {
            // Where a climb began may be higher on the exact closure than where it ended.
            let n = climbs.len();
            climbs.extend(all.by_ref().take(n));
            climbs.sort_by(|a, b| b.value.total_cmp(&a.value));
        }
        let settled = if climbs > 0 { self.settled(&corners) } else { Vec::new() };
        let of = |best: Vec<Climb>| {
            let first = best.first()?;
            let nearly = first.value - NEAR * first.value.abs();
            let near = best.iter().filter(|climb| climb.value >= nearly).map(|climb| &climb.specimen);
            let exact = |error: &[f64]| first.measure.value(error, self.mechanism.n_translations());
            let mut far: Vec<&(Vec<f64>, Vec<f64>)> = settled.iter().collect();
            far.sort_by(|a, b| exact(&b.1).total_cmp(&exact(&a.1)));
            let mut different: Vec<&Vec<f64>> = Vec::new();
            for specimen in far.iter().take(climbs).map(|(specimen, _)| specimen).chain(near) {
                if different.iter().all(|other| !self.is_same(other, specimen)) {
                    different.push(specimen);
                }
            }
            // Those that can be assembled without force are sought all at once, by programs of their own.
            let strained = different.into_iter().filter(|specimen| self.is_strained(&model, specimen));
            let heights = strained.take(3 * climbs).filter_map(|specimen| self.summit(first.measure, specimen, strain));
            let mut height = heights.max_by(|a, b| a.value.total_cmp(&b.value));
            let (measure, bound) = (first.measure, self.bound(&model, first));
            let strained = model.pose_alone(&first.specimen, &model.weights(measure, &first.strained.error), TINY)?;
            let value = model.value(measure, &strained);
            let (contribution, elastic) = self.shares(&model, measure, &first.specimen, &strained);
            if climbs == 0 {
                let parameters = self.deviations.parameters(&first.specimen);
                height = Some(Height { value, parameters, error: strained.error });
            }
            Some(Found { value, bound, contribution, elastic, height })
        };
        Some(found.into_par_iter().map(of).collect())
    }

    /// What a first-order figure does not exceed: that of a size.
    fn bound(&self, model: &Model<'_>, climb: &Climb) -> f64 {
        let (size, translations) = (self.mechanism.size(), self.mechanism.n_translations());
        match climb.measure {
            Measure::Position => model.bound(&(0..translations)),
            Measure::Rotation => model.bound(&(translations..size)),
            Measure::Component { .. } | Measure::Along(_) => climb.value,
        }
    }

    /// The parts of all sources, and of the joints' deformations, in a first-order figure.
    fn shares(
        &self,
        model: &Model<'_>,
        measure: Measure,
        specimen: &[f64],
        strained: &Strained,
    ) -> (Vec<f64>, Vec<f64>) {
        let weights = DVector::from_vec(self.mechanism.weights(measure, &strained.error));
        let c = model.compatibility;
        let map = DMatrix::from_rows(&[c.output.parameters.tr_mul(&weights).transpose()]);
        let map = self.system.derivatives(c, &map, &strained.balance, NOTHING);
        self.system.parts(&map, &self.deviations.parameters(specimen), &strained.balance)
    }

    /// Whether two specimens are the same.
    fn is_same(&self, a: &[f64], b: &[f64]) -> bool {
        let widths = self.deviations.half_widths();
        a.iter().zip(b).zip(widths).all(|((a, b), width)| (a - b).abs() <= SAME * width)
    }

    /// The basis closed with given displacements, where that can be reached.
    fn closed(&self, own: &[f64]) -> Option<State> {
        let inputs = Inputs { drives: self.case.drives.to_vec(), parameters: own.to_vec() };
        self.solver.follow(self.nominal, &inputs).ok()
    }

    /// Specimens with the error where their energy is least on the exact closure, which first order may be far from.
    fn settled(&self, specimens: &[Vec<f64>]) -> Vec<(Vec<f64>, Vec<f64>)> {
        let of = |specimen: &Vec<f64>| {
            let own = self.mechanism.displacements(&self.deviations.parameters(specimen));
            let start = self.closed(&own)?;
            let settled = self.system.settle(self.solver, start, &own, |_, _| Ask::Stress).ok()?;
            Some((specimen.clone(), self.system.basis.kept.error(&settled.state, self.nominal)))
        };
        specimens.par_iter().filter_map(of).collect()
    }

    /// The exact extreme near a specimen: it is settled, everything linearised there, and climbed on.
    fn summit(&self, measure: Measure, specimen: &[f64], strain: f64) -> Option<Height> {
        let (m, basis) = (self.mechanism, self.system.basis);
        let known = m.displacements(&m.centre);
        let mut specimen = specimen.to_vec();
        let mut best: Option<Height> = None;
        for _ in 0..ROUNDS {
            let built = Mechanism { centre: self.deviations.parameters(&specimen), ..m.clone() };
            let own = m.displacements(&built.centre);
            let start = self.closed(&own)?;
            let ask = |state: &State, c: &Compatibility| {
                let weights = m.weights(measure, &basis.kept.error(state, self.nominal));
                let at = Model {
                    right: c.right(&state.inputs.parameters, &known),
                    base: Vec::new(),
                    compatibility: c,
                    ..self.model(c, strain)
                };
                let strength = at.strength(&weights, SMALL);
                Ask::Along(weights.iter().map(|w| strength * w).collect())
            };
            let settled = self.system.settle(self.solver, start, &own, ask).ok()?;
            let parameters = built.offsets(&self.system, &settled.balance);
            let Some(height) = self.proved(measure, parameters) else { break };
            let gain = best.as_ref().map_or(f64::INFINITY, |best| height.value - best.value);
            let size = height.value.abs();
            if gain > 0.0 {
                best = Some(height);
            }
            if gain <= GAIN * size {
                break;
            }
            let (c, state) = (&settled.compatibility, &settled.state);
            let back = known.iter().zip(&state.inputs.parameters).map(|(k, own)| k - own);
            let back = &c.output.parameters * DVector::from_iterator(known.len(), back);
            let error = basis.kept.error(state, self.nominal);
            let model = Model {
                right: c.right(&state.inputs.parameters, &known),
                base: error.iter().zip(&back).map(|(a, b)| a + b).collect(),
                ..self.model(c, strain)
            };
            let mut on = model.begin(&[measure], std::slice::from_ref(&specimen)).pop()?;
            model.climb(&mut on);
            let next = on.pop()?.specimen;
            if self.is_same(&specimen, &next) {
                break;
            }
            specimen = next;
        }
        best
    }

    /// The exact pose for offsets and deviations: what is elastic takes up what they leave.
    fn proved(&self, measure: Measure, parameters: Vec<f64>) -> Option<Height> {
        let (m, basis) = (self.mechanism, self.system.basis);
        let known = m.displacements(&parameters);
        let springs: Vec<Element> = self.system.springs();
        let system = System { elements: springs, ..self.system.clone() };
        let start = self.closed(&known)?;
        let settled = system.settle(self.solver, start, &known, |_, _| Ask::Stress).ok()?;
        let error = basis.kept.error(&settled.state, self.nominal);
        Some(Height { value: measure.value(&error, m.n_translations()), error, parameters })
    }
}
