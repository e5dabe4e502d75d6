//! Where the load pushes an over-constrained or elastic mechanism.

use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::DVector;

use crate::closure::equations::Inputs;
use crate::closure::newton::State;
use crate::cone::scheduler::{CHUNK, Rounds};
use crate::contact::flanks::FLANKS;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row as _;
use crate::mechanism::dim::{Keep, Wanted};
use crate::mechanism::status::Status;
use crate::mechanism::{Elastic, Mechanism, Row, Source};
use crate::questions::columns::{Loaded, Strain};
use crate::questions::loaded::FALLBACKS;
use crate::redundancy::balance::Balance;
use crate::redundancy::basis::Basis;
use crate::redundancy::compatibility::Compatibility;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::placed::Placed;
use crate::redundancy::sequence::{Failure, Rest, is_apart};
use crate::redundancy::system::{System, UNDECIDED_TOGETHER};

/// What is left open is observable when it moves the output by more than this part of what all play together
/// could. Below is rounding: cone programs give offsets in round sets to about 1e-7 of the clearance.
const OBSERVABLE: f64 = 1e-6;
/// What is known at the nominal pose to first order.
struct FirstOrder {
    factor: Option<Balance>,
    stress: Option<Balance>,
    load: Balance,
}

impl Mechanism {
    /// Where the load pushes the output of an over-constrained or elastic mechanism, for every case; without details the
    /// parts of the first-order error are not computed. A determinate rigid one is welcome, too.
    pub(crate) fn loaded_over_constrained(&self, cases: &[Case<'_>], exact: bool, keep: Keep) -> Answer {
        let fallbacks = AtomicU64::new(0);
        let found: Vec<(Loaded, Strain)> = self.chunks_on_basis(
            cases,
            CHUNK,
            |placed| {
                let alone = Cell::new(0);
                let rows = Rounds::each(placed.iter(), async |rounds, at| {
                    let found = self.strain_at(rounds, at, exact, keep.details).await;
                    // All share the rounds, so that the last one to end knows of all.
                    alone.set(rounds.alone_so_far());
                    found
                });
                fallbacks.fetch_add(alone.get(), Ordering::Relaxed);
                rows
            },
            |status| self.no_strain(status),
        );
        let wanted = Wanted { keep, ..Wanted::all(self) };
        Answer::of_pairs(&found, &wanted).total(FALLBACKS, fallbacks.into_inner())
    }

    fn no_strain(&self, status: Status) -> (Loaded, Strain) {
        (self.no_load_result(status), Strain::unknown(&Wanted::all(self)))
    }

    #[allow(clippy::too_many_lines)] // the way from the nominal pose to the displaced one, in order
    async fn strain_at(&self, rounds: &Rounds, at: &Placed<'_>, exact: bool, details: bool) -> (Loaded, Strain) {
        let Placed { system, solver, case, nominal, .. } = at;
        let basis = system.basis;
        let known = self.displacements(&self.centre);
        let Some((c, flanks)) = self.tied_at_flanks(rounds, at, &known).await else {
            return self.no_strain(Status::Singular);
        };
        let status = at.nominal_status();
        let lack_of_fit = self.length * basis.scaled_misfit(&c.misfit);
        let right = self.first_order_right(&c, &known, case, nominal);
        let loosest = system.balance_in(rounds, &c, &right, &Ask::Factor, None).await;
        let factor = loosest.as_ref().map_or(f64::INFINITY, |balance| balance.factor);
        let apart = |status, clearance_factor| {
            let (loaded, strain) = self.no_strain(status);
            (loaded, Strain { clearance_factor, lack_of_fit, ..strain })
        };
        if is_apart(factor) && system.is_rigid() {
            return apart(Status::NotAssemblable, factor);
        }
        let Some(balance) = system.balance_in(rounds, &c, &right, &Ask::Load, None).await else {
            return apart(Status::NotAssemblable, factor);
        };
        let unknown_rows = system.unknown_rows(&c);
        let unknown = system.joints_of(&unknown_rows);
        let of_drives = |forces: &DVector<f64>| self.known_drive_forces(forces, &unknown_rows);
        let (contribution, contribution_elastic) = if details {
            let map = system.derivatives(&c, &c.output.parameters, &balance, UNDECIDED_TOGETHER);
            system.parts(&map, &self.centre, &balance)
        } else {
            (nan(self.sources.len() * self.size()), nan(self.n_joints() * self.size()))
        };
        let error_first_order = self.first_order_error(system, &c, &known, case, nominal, &balance);
        let mut open = details.then(|| vec![0.0; self.sources.len() * self.size()]);
        let mut decided = vec![true; self.sources.len()];
        let widths = system.leave_open(rounds, &c, &right, &balance, open.as_deref_mut(), &mut decided).await;
        let mut widths = self.observable(&c, widths);
        let mut loaded = Loaded {
            error: error_first_order.clone(),
            error_first_order,
            reaction: self.bearable(basis, &flanks, &balance.forces, &unknown),
            drive_force: of_drives(&balance.forces),
            offset: self.offsets(system, &balance),
            contribution,
            equilibria: 1,
            ..self.no_load_result(status)
        };
        let mut strain = Strain {
            clearance_factor: factor,
            prestress: vec![0.0; self.n_joints() * self.size()],
            force: self.known(&balance.forces, &unknown),
            deformation: self.deformation(system, &balance),
            contribution_elastic,
            gap: balance.gap,
            lack_of_fit,
        };
        let mut settled_all = balance.solved;
        let stress =
            if is_apart(factor) { system.balance_in(rounds, &c, &right, &Ask::Stress, None).await } else { None };
        if exact {
            let first = FirstOrder { factor: loosest, stress, load: balance };
            let (rest, stress) = match self.rest_exactly(rounds, at, &first, &mut strain.clearance_factor).await {
                Ok(found) => found,
                Err(failure) => return apart(failure.status(), strain.clearance_factor),
            };
            let (rest, seen) = if rest.still {
                let noticed = widths.iter().all(|width| *width == 0.0).then(|| self.noticed(&c));
                Box::pin(system.most_work_in(rounds, solver, rest, &first.load.forces, &known, noticed)).await
            } else {
                (rest, 1)
            };
            loaded.equilibria = seen as u64;
            let Rest { state, balance, .. } = &rest;
            if system.leaves_open(&c, &balance.forces) {
                let Some(c) = Compatibility::at(basis, solver, state) else {
                    return apart(Status::Singular, strain.clearance_factor);
                };
                let right = c.right(&state.inputs.parameters, &known);
                let wider = system.leave_open(rounds, &c, &right, balance, open.as_deref_mut(), &mut decided).await;
                let wider = self.observable(&c, wider);
                widths.iter_mut().zip(wider).for_each(|(width, wider)| *width = width.max(wider));
            }
            loaded.error = basis.kept.error(state, nominal);
            loaded.reaction = self.bearable(basis, state, &balance.forces, &unknown);
            loaded.drive_force = of_drives(&balance.forces);
            loaded.offset = self.offsets(system, balance);
            loaded.iterations = rest.steps as u64;
            strain.force = self.known(&balance.forces, &unknown);
            strain.deformation = self.deformation(system, balance);
            strain.gap = balance.gap;
            settled_all = balance.solved && (rest.still || self.rests_unobservably(at, &rest, &known));
            if let Some(stress) = stress {
                strain.prestress = self.bearable(basis, &stress.state, &stress.balance.forces, &unknown);
            }
        } else if let Some(stress) = stress {
            strain.prestress = self.bearable(basis, &flanks, &stress.forces, &unknown);
        }
        let observable = widths.iter().any(|width| *width > 0.0);
        loaded.undetermined = widths;
        (loaded.undetermined_contribution, loaded.decided) = (open.unwrap_or_default(), decided);
        loaded.status = match status {
            Status::Ok if is_apart(strain.clearance_factor) => Status::Strained,
            Status::Ok if observable || !settled_all => Status::Undetermined,
            other => other,
        };
        (loaded, strain)
    }

    /// The linearisation at the nominal pose, for the flanks of couplings that the load closes, and the displacements
    /// that tell these; `None` where the basis is singular.
    async fn tied_at_flanks(&self, rounds: &Rounds, at: &Placed<'_>, known: &[f64]) -> Option<(Compatibility, State)> {
        let Placed { system, solver, case, nominal, .. } = at;
        let mut flanks = State::clone(nominal);
        let mut c = Compatibility::at(system.basis, solver, nominal)?;
        let rows: Vec<usize> = (0..self.n_rows()).filter(|&k| self.rows[k].play.is_some()).collect();
        for _ in 0..if rows.is_empty() { 0 } else { FLANKS } {
            let right = self.first_order_right(&c, known, case, nominal);
            let Some(balance) = system.balance_in(rounds, &c, &right, &Ask::Load, None).await else { break };
            let given = system.displacements(&balance);
            let before = flanks.inputs.parameters.clone();
            for &k in &rows {
                flanks.inputs.parameters[k] = known[k] + given[k];
            }
            if system.difference(&before, &flanks.inputs.parameters) <= self.still() {
                break;
            }
            c = c.at_flanks(system.basis, solver, &flanks)?;
        }
        Some((c, flanks))
    }

    /// The exact pose, and the prestress where members have to be strained; puts the factor on the clearances.
    async fn rest_exactly(
        &self,
        rounds: &Rounds,
        at: &Placed<'_>,
        first: &FirstOrder,
        factor: &mut f64,
    ) -> Result<(Rest, Option<Rest>), Failure> {
        let Placed { system, solver, case, nominal, .. } = at;
        let known = self.displacements(&self.centre);
        let built = Inputs { drives: case.drives.to_vec(), parameters: known.clone() };
        let start = solver.follow(nominal, &built).map_err(|_| Failure::Unreachable)?;
        *factor = system.assembly_factor_in(rounds, solver, start.clone(), &known, first.factor.as_ref()).await?;
        let mut stress = None;
        if is_apart(*factor) {
            let first = first.stress.as_ref();
            stress = Some(system.rest_in(rounds, solver, start.clone(), &known, first, Ask::Stress).await?);
        }
        let load = system.rest_in(rounds, solver, start, &known, Some(&first.load), Ask::Load).await?;
        Ok((load, stress))
    }

    /// What displacements must add up to at the nominal pose beside the known ones, with drive values near the
    /// nominal ones.
    pub(crate) fn first_order_right(
        &self,
        c: &Compatibility,
        known: &[f64],
        case: &Case<'_>,
        nominal: &State,
    ) -> DVector<f64> {
        let drives = case.drives.iter().zip(&nominal.inputs.drives).map(|(q, q0)| q - q0);
        &c.misfit
            - &c.equations * DVector::from_column_slice(known)
            - &c.drives * DVector::from_iterator(self.n_drives, drives)
    }

    /// The error to first order at the nominal pose, for known displacements and those that the balance gives.
    pub(crate) fn first_order_error(
        &self,
        system: &System<'_>,
        c: &Compatibility,
        known: &[f64],
        case: &Case<'_>,
        nominal: &State,
        balance: &Balance,
    ) -> Vec<f64> {
        let mut displacements = DVector::from_column_slice(known);
        displacements += DVector::from_vec(system.displacements(balance));
        let moved = &c.output.parameters * displacements - &c.shared * &c.misfit;
        self.drive_shift(&c.output, case, nominal).iter().zip(moved.iter()).map(|(a, b)| a + b).collect()
    }

    /// Whether what has not settled moves the output no more: a shaft that floats finds no place of its own.
    fn rests_unobservably(&self, at: &Placed<'_>, rest: &Rest, known: &[f64]) -> bool {
        let Some(c) = Compatibility::at(at.system.basis, at.solver, &rest.state) else { return false };
        let own = DVector::from_column_slice(&rest.state.inputs.parameters);
        let next = DVector::from_column_slice(known) + DVector::from_vec(at.system.displacements(&rest.balance));
        let moved = &c.output.parameters * (next - own);
        moved.iter().zip(self.least_observable(&c)).all(|(moved, least)| moved.abs() <= least)
    }

    /// The half-widths of what the load leaves open, zero where they do not move the output.
    fn observable(&self, c: &Compatibility, mut widths: Vec<f64>) -> Vec<f64> {
        for (width, least) in widths.iter_mut().zip(self.least_observable(c)) {
            if !(*width > least) {
                *width = 0.0;
            }
        }
        widths
    }

    /// How far what is left open moves the output at least where that is observable, component by component.
    pub(crate) fn least_observable(&self, c: &Compatibility) -> Vec<f64> {
        let least = |k: usize| OBSERVABLE * self.play(c, k) + self.rounding_of_output(k);
        (0..self.size()).map(least).collect()
    }

    /// How far the output moves at least where that is noticed beside what moves it to first order, component by component.
    fn noticed(&self, c: &Compatibility) -> Vec<f64> {
        (0..self.size()).map(|k| self.least_noticed(k, self.play(c, k))).collect()
    }

    /// What all play together can do to a component of the output.
    pub(crate) fn play(&self, c: &Compatibility, component: usize) -> f64 {
        let reach = |source: &Source| {
            let row: Vec<f64> = source.range().map(|p| c.output.parameters[(component, self.place_of(p))]).collect();
            source.set.reach(&row)
        };
        self.sources.iter().filter(|source| source.is_clearance).map(reach).sum()
    }

    /// Reactions of forces on the rows' displacements at a state of the basis, unknown where nothing decides them.
    pub(crate) fn bearable(&self, basis: &Basis, at: &State, forces: &DVector<f64>, unknown: &[bool]) -> Vec<f64> {
        let (poses, displacements) = (self.poses(&at.coordinates), &at.inputs.parameters);
        let multipliers = basis.all.multipliers_of(forces, &poses, displacements);
        let mut reactions = basis.all.reactions(&poses, displacements, &multipliers);
        for (wrench, unknown) in reactions.chunks_exact_mut(self.size()).zip(unknown) {
            if *unknown {
                wrench.fill(f64::NAN);
            }
        }
        reactions
    }

    /// Forces on the rows, unknown where nothing decides them.
    pub(crate) fn known(&self, forces: &DVector<f64>, unknown: &[bool]) -> Vec<f64> {
        let known = |(row, force): (&Row, &f64)| if unknown[row.joint] { f64::NAN } else { *force };
        self.rows.iter().zip(forces.iter()).map(known).collect()
    }

    /// What the drives do, unknown where nothing decides the force on one of their rows.
    fn known_drive_forces(&self, forces: &DVector<f64>, unknown: &[bool]) -> Vec<f64> {
        let known = |(unknown, force): (&bool, &f64)| if *unknown { f64::NAN } else { *force };
        self.drive_forces(&unknown.iter().zip(forces.iter()).map(known).collect::<Vec<f64>>())
    }

    /// The values of all parameters.
    pub(crate) fn offsets(&self, system: &System<'_>, balance: &Balance) -> Vec<f64> {
        let mut offsets = self.centre.clone();
        for (element, given) in system.elements.iter().zip(&balance.given) {
            let Some(source) = element.source else { continue };
            self.sources[source].range().zip(given).for_each(|(p, d)| offsets[p] += d);
        }
        offsets
    }

    /// Deformation of every component that is elastic.
    pub(crate) fn deformation(&self, system: &System<'_>, balance: &Balance) -> Vec<f64> {
        let mut by_row = vec![0.0; self.n_rows()];
        for (element, given) in
            system.elements.iter().zip(&balance.given).filter(|(element, _)| element.source.is_none())
        {
            element.columns.iter().zip(given).for_each(|(&row, v)| by_row[row] = *v);
        }
        self.elastic.iter().flat_map(Elastic::yielding).map(|row| by_row[row]).collect()
    }
}

/// As many numbers that are unknown.
fn nan(n: usize) -> Vec<f64> {
    vec![f64::NAN; n]
}
