//! How displacements open the play between the flanks of couplings.
//!
//! An offset u of a flank about the centre c of its play, of half-width h, displaces its row by
//!
//! ```text
//! w = c + (u - c) g,   g = 1 + E / h
//! ```
//!
//! with the opening E of [`crate::mechanism::coupling`], which follows from the poses. What play in bearings does to E is
//! of the order of h, so that the compatibility of the offsets u is not linear within the play. That of the displacements w is:
//! it is linearised with each of these flanks in the middle of its play, where the opening does nothing to its row, and
//!
//! ```text
//! g = g_0 + sum of rates x (displacements - those of the state)
//! ```

use std::ops::AddAssign as _;

use nalgebra::{DMatrix, DVector};

use crate::closure::newton::{Solver, State};
use crate::mechanism::Mechanism;
use crate::mechanism::coupling::Play;
use crate::redundancy::compatibility::Ties;
use crate::redundancy::system::{Element, System};

/// What a clearance changes of a gap at most is rounding where it is a smaller part of it.
const OPENS: f64 = 1e-12;

/// A flank whose play opens.
#[derive(Clone, Debug)]
struct Opening {
    row: usize,
    play: Play,
    /// The play as a part of what it is between wheels in their places.
    gap: f64,
}

/// The linearisation in the displacements of the rows at a state, for some flanks.
#[derive(Clone, Debug)]
pub(crate) struct Openings {
    /// Coefficients of all displacements.
    pub equations: DMatrix<f64>,
    flanks: Vec<Opening>,
    rates: DMatrix<f64>,
    /// The displacements of the state.
    at: DVector<f64>,
}

impl Openings {
    /// For those elements, by number, that are flanks with play; `None` where none is, or where the basis is singular.
    pub fn at(system: &System<'_>, solver: &Solver<'_>, state: &State, elements: &[usize]) -> Option<Self> {
        let (basis, rows) = (system.basis, &system.mechanism.rows);
        let flank = |&g: &usize| {
            let row = system.elements[g].flank(system.mechanism)?;
            Some((row, rows[row].play?))
        };
        let flanks: Vec<(usize, Play)> = elements.iter().filter_map(flank).collect();
        if flanks.is_empty() {
            return None;
        }
        let mut centred = state.clone();
        for &(row, play) in &flanks {
            centred.inputs.parameters[row] = play.centre;
        }
        let linearised = solver.linearise(&centred)?;
        let (poses, parameters) = (&linearised.poses, &centred.inputs.parameters);
        let mut equations = Ties::of(basis, &linearised, &centred).equations;
        let mut rates = DMatrix::zeros(flanks.len(), equations.ncols());
        let mut openings = Vec::with_capacity(flanks.len());
        for (f, &(row, play)) in flanks.iter().enumerate() {
            let cost = basis.all.opening_cost(&basis.all.rows[row], poses, parameters);
            let gradient = basis.kept.gradient(&linearised, cost).inputs.parameters;
            rates.row_mut(f).iter_mut().zip(&gradient).for_each(|(rate, along)| *rate = along / play.half);
            let gap = basis.all.coupled_row(&basis.all.rows[row], poses, parameters, &[]).gap;
            openings.push(Opening { row, play, gap });
        }
        // Of what a flank's own parameter counts to what its displacement does.
        for &(row, _) in &flanks {
            let slope = basis.all.slope(&basis.all.rows[row], poses, parameters);
            equations.column_mut(row).unscale_mut(slope);
            rates.column_mut(row).unscale_mut(slope);
        }
        let mut at = DVector::from_column_slice(&state.inputs.parameters);
        for own in &openings {
            at[own.row] = own.displacement(state.inputs.parameters[own.row], own.gap);
        }
        Some(Self { equations, flanks: openings, rates, at })
    }

    /// What all displacements do to the gaps, one row each.
    pub const fn rates(&self) -> &DMatrix<f64> {
        &self.rates
    }

    /// The gaps of all flanks for offsets, deviations and deformations, as the basis takes them.
    pub fn gaps(&self, offsets: &[f64]) -> Vec<f64> {
        self.gaps_at(&self.moved(offsets))
    }

    /// The gaps for displacements beside those of the state.
    fn gaps_at(&self, moved: &DVector<f64>) -> Vec<f64> {
        let opened = &self.rates * moved;
        self.flanks.iter().zip(opened.iter()).map(|(own, opened)| own.gap + opened).collect()
    }

    /// The displacements that offsets are, beside those of the state.
    fn moved(&self, offsets: &[f64]) -> DVector<f64> {
        let mut moved = DVector::from_column_slice(offsets) - &self.at;
        for own in &self.flanks {
            moved[own.row] = 0.0;
        }
        // Flanks may open themselves and one another: their displacements solve (1 - X B) w = what they are for the gaps
        // that all else leaves. Some correction of the offsets depends on the last digits of it.
        let n = self.flanks.len();
        let gaps = self.gaps_at(&moved);
        let right =
            |f: usize| self.flanks[f].displacement(offsets[self.flanks[f].row], gaps[f]) - self.at[self.flanks[f].row];
        let entry = |f: usize, k: usize| {
            let Opening { row, play, .. } = self.flanks[f];
            f64::from(u8::from(f == k)) - (offsets[row] - play.centre) * self.rates[(f, self.flanks[k].row)]
        };
        let right = DVector::from_fn(n, |f, _| right(f));
        let solved = DMatrix::from_fn(n, n, entry).lu().solve(&right).unwrap_or(right);
        self.flanks.iter().zip(solved.iter()).for_each(|(own, w)| moved[own.row] = *w);
        moved
    }

    /// What a change of the displacements of the rows changes in offsets and deformations.
    pub fn change(&self, offsets: &[f64], mut change: DVector<f64>) -> DVector<f64> {
        let mut moved = self.moved(offsets);
        moved.rows_mut(0, change.len()).add_assign(&change);
        for (own, gap) in self.flanks.iter().zip(self.gaps_at(&moved)) {
            let displacement = self.at[own.row] + moved[own.row];
            change[own.row] = own.offset(displacement, gap) - offsets[own.row];
        }
        change
    }
}

impl System<'_> {
    /// The clearances that scatter together at a state, by the numbers of their elements: those that the equations tie,
    /// and those that do nothing but open the flanks among these. With what opens them.
    pub fn scattering(&self, c: &Ties, solver: &Solver<'_>, state: &State) -> (Vec<usize>, Option<Openings>) {
        let clearances = || (0..self.elements.len()).filter(|&g| self.elements[g].source.is_some());
        let tied: Vec<usize> = clearances().filter(|&g| Self::is_tied(&self.elements[g], c)).collect();
        let Some(openings) = Openings::at(self, solver, state, &tied) else { return (tied, None) };
        let opens = |g: &usize| openings.are_opened_by(&self.elements[*g]);
        (clearances().filter(|g| tied.contains(g) || opens(g)).collect(), Some(openings))
    }
}

impl Openings {
    /// Whether any flank is opened by a clearance.
    fn are_opened_by(&self, element: &Element) -> bool {
        let Some(set) = element.kind.set() else { return false };
        let by_row = |rates: Vec<f64>| set.support(&rates) > OPENS;
        self.rates.row_iter().any(|row| by_row(element.columns.iter().map(|&column| row[column]).collect()))
    }
}

impl Opening {
    fn displacement(&self, offset: f64, gap: f64) -> f64 {
        self.play.centre + (offset - self.play.centre) * gap
    }

    fn offset(&self, displacement: f64, gap: f64) -> f64 {
        self.play.centre + (displacement - self.play.centre) / gap
    }
}

impl Element {
    /// Its row where it is the play between flanks.
    pub fn flank(&self, mechanism: &Mechanism) -> Option<usize> {
        let row = *self.columns.first()?;
        (self.source.is_some() && mechanism.rows.get(row)?.play.is_some()).then_some(row)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::closure::equations::Inputs;
    use crate::mechanism::case::Case;

    /// Two wheels in bearings with play, both driven, so that one constraint is redundant.
    fn driven_pair(internal: bool) -> Mechanism {
        let (radii, at) = if internal { ([0.01, 0.03], -0.02) } else { ([0.01, 0.02], 0.03) };
        let axis = [1.0, 0.0, 0.0];
        let joint = |kind: &str, first: usize| json!({"kind": kind, "first": first, "second": first + 1, "axis_first": axis, "axis_second": axis});
        let mut gear = joint("gear", 4);
        gear["coupling"] = json!({"radii": radii, "teeth": [20, if internal { 60 } else { 40 }], "internal": internal,
            "pressure_angle": 0.349});
        let play = |joint: usize, set: serde_json::Value, centre: &[f64]| json!({"kind": "clearance", "joint": joint, "set": set, "centre": centre, "law": "uniform"});
        let disc = json!({"disc": {"radius": 2e-4}});
        let place = |body: i32, x: f64| json!({"body": body, "at": [x, 0.0, 0.0]});
        let spec = json!({
            "space": "planar", "n_bodies": 2, "length": 0.03, "singular_value": 1e-6,
            "guess": [[0.0, 0.0, 0.0], [at, 0.0, 0.0]],
            "points": [place(-1, 0.0), place(0, 0.0), place(-1, at), place(1, 0.0), place(0, 0.0), place(1, 0.0)],
            "joints": [joint("revolute", 0), joint("revolute", 2), gear],
            "drives": [{"joint": 0}, {"joint": 1}],
            "output": {"point": 3},
            "sources": [play(0, disc.clone(), &[0.0, 0.0]), play(1, disc, &[3e-5, -2e-5]),
                play(2, json!({"interval": {"low": -1e-4, "high": 2e-4}}), &[1e-5])],
        });
        Mechanism::new(&serde_json::from_value(spec).unwrap()).unwrap()
    }

    #[test]
    fn gaps_are_those_of_the_closed_mechanism_to_first_order() {
        for internal in [false, true] {
            let m = driven_pair(internal);
            let trace = m.trace(1, &[0.0, 0.0]);
            let cases = [Case { drives: &[0.0, 0.0], coordinates: &trace.coordinates }];
            let errors = m.each_on_basis(
                &cases,
                |system, solver, _, case, nominal| {
                    let inputs = |parameters| Inputs { drives: case.drives.to_vec(), parameters };
                    let known = m.displacements(&m.centre);
                    let built = solver.follow(&nominal, &inputs(known.clone())).unwrap();
                    let all: Vec<usize> = (0..system.elements.len()).collect();
                    let openings = Openings::at(system, solver, &built, &all).unwrap();
                    let flank = openings.flanks[0].row;
                    let error = |size: f64| {
                        let mut offsets = known.clone();
                        let noise = |k: usize| (k as f64 * 0.618_034).fract() - 0.5;
                        (0..m.n_rows()).for_each(|k| offsets[k] += size * noise(k + 1));
                        let state = solver.follow(&built, &inputs(offsets.clone())).unwrap();
                        let row = &system.basis.all.rows[flank];
                        let poses = m.poses(&state.coordinates);
                        let gap = system.basis.all.coupled_row(row, &poses, &offsets, &[]).gap;
                        // The way there and back.
                        let change = DVector::from_fn(m.n_rows(), |k, _| 1e-5 * noise(k + 9));
                        let there = openings.change(&offsets, change.clone());
                        let moved: Vec<f64> =
                            offsets.iter().enumerate().map(|(k, d)| d + there.get(k).unwrap_or(&0.0)).collect();
                        let back = openings.change(&moved, -change);
                        assert!((there + back).amax() < 1e-17);
                        [(openings.gaps(&offsets)[0] - gap).abs(), (openings.flanks[0].gap - gap).abs()]
                    };
                    [error(1e-4), error(1e-5)]
                },
                |status| panic!("{status:?}"),
            );
            let [[far, opened], [near, _]] = errors[0];
            // The gap changes by a twentieth; what is missing is of second order: a tenth of the change leaves a hundredth.
            assert!(opened > 0.05 && far < 0.02 * opened && near < 0.015 * far, "{errors:?}");
        }
    }
}
