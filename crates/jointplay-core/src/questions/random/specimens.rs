//! Many specimens of one over-constrained or elastic mechanism: the same case, each with deviations of its own.

use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::closure::recorded::program::Newton;
use crate::closure::recorded::self_stress::SelfStress;
use crate::cone::scheduler::Rounds;
use crate::math::lanes::block::LANES;
use crate::mechanism::Mechanism;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row;
use crate::mechanism::dim::Wanted;
use crate::mechanism::status::Status;
use crate::questions::columns::{Loaded, Specimen};
use crate::questions::random::decided::Decided;
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::{Compatibility, Ties};
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::sequence::is_apart;
use crate::redundancy::specimen_batch::sequence::SpecimenSolution;
use crate::redundancy::specimen_batch::{Nominal, Together};
use crate::redundancy::system::System;

/// Specimens that one task solves together.
const CHUNK: usize = 256;

impl Mechanism {
    /// The exact pose under load, and what it strains, of specimens whose parameters have their own values in the
    /// middle of their sets. What the load leaves open is in its middle.
    #[must_use]
    pub fn loaded_specimens(&self, case: Case<'_>, centres: &[Vec<f64>]) -> Answer {
        let none = |status| centres.iter().map(|_| self.no_specimen(status, f64::NAN)).collect();
        let found: Vec<Vec<Specimen>> = self.each_on_basis(
            &[case],
            |system, solver, _, case, nominal| {
                self.specimens_at(system, solver, case, &nominal, centres).unwrap_or_else(none)
            },
            none,
        );
        Answer::of_rows(found.concat().iter(), &Wanted::all(self))
    }

    fn no_specimen(&self, status: Status, clearance_factor: f64) -> Specimen {
        Specimen { clearance_factor, status, ..Specimen::unknown(&Wanted::all(self)) }
    }

    fn specimens_at(
        &self,
        system: &System<'_>,
        solver: &Solver<'_>,
        case: &Case<'_>,
        nominal: &State,
        centres: &[Vec<f64>],
    ) -> Result<Vec<Specimen>, Status> {
        let c = Compatibility::at(system.basis, solver, nominal).ok_or(Status::Singular)?;
        let right = self.first_order_right(&c, &vec![0.0; c.load.len()], case, nominal);
        let at_drives = Inputs { drives: case.drives.to_vec(), parameters: nominal.inputs.parameters.clone() };
        let built = solver.follow(nominal, &at_drives)?;
        let nominal = Nominal { state: nominal, compatibility: &c, right };
        let beside = SelfStress { all: &system.basis.all, redundant: &system.basis.redundant, statics: true };
        // A few specimens are solved before an iteration is recorded.
        let record = || Newton::record_beside(solver, self.largest_angle(), Some(&beside));
        let newton = (centres.len() >= LANES).then(record).flatten();
        let bound = newton.as_ref().map(|newton| newton.bind(&system.basis.kept, nominal.state, case.drives));
        let decided = Decided::new(self, *case);
        let chunk = |centres: &[Vec<f64>]| {
            let together = Together::new(system, solver, &nominal, &built, bound.clone());
            together.each(centres.iter(), async |rounds, centre| {
                self.specimen(rounds, &together, case, &decided, centre).await
            })
        };
        Ok(centres.par_chunks(CHUNK).map(chunk).collect::<Vec<_>>().into_iter().flatten().collect())
    }

    async fn specimen(
        &self,
        rounds: &Rounds,
        together: &Together<'_>,
        case: &Case<'_>,
        decided: &Decided<'_>,
        centre: &[f64],
    ) -> Specimen {
        let known = self.displacements(centre);
        let own = together.system.of_specimen(centre);
        let system = own.as_ref().unwrap_or(together.system);
        let factor = match together.settle(rounds, system, &known, &Ask::Factor).await {
            Ok(assembled) => assembled.balance.factor,
            Err(Status::NotAssemblable | Status::NotAssembled) => f64::INFINITY,
            Err(status) => return self.no_specimen(status, f64::NAN),
        };
        let settled = together.settle(rounds, system, &known, &Ask::Load).await;
        let found = settled.and_then(|settled| {
            let is_elsewhere = decided.any(&system.open_sources(&settled.ties, &settled.balance.forces));
            let alone = if is_elsewhere { self.pressed_alone(together, system, case, centre, &settled) } else { None };
            self.reported_of(together, system, centre, factor, &alone.unwrap_or(settled))
        });
        found.unwrap_or_else(|status| self.no_specimen(status, factor))
    }

    /// A specimen as [`Mechanism::loaded`] has it; `None` where that does not tell its place.
    fn pressed_alone(
        &self,
        at: &Together<'_>,
        system: &System<'_>,
        case: &Case<'_>,
        centre: &[f64],
        settled: &SpecimenSolution,
    ) -> Option<SpecimenSolution> {
        let Loaded { offset, status, .. } = self.loaded_specimen(centre, case)?;
        let displacements = (status == Status::Ok).then(|| self.displacements(&offset))?;
        let ties = Ties::at(at.system.basis, at.solver, &at.close_plainly(&displacements).ok()?)?;
        let own = |source: usize| self.sources[source].range().map(|p| offset[p] - centre[p]).collect();
        let given = system.elements.iter().map(|element| element.source.map_or_else(Vec::new, own)).collect();
        let balance = Balance::free(given, ties.load.clone());
        Some(SpecimenSolution { displacements, balance, ties, ..settled.clone() })
    }

    fn reported_of(
        &self,
        at: &Together<'_>,
        system: &System<'_>,
        centre: &[f64],
        factor: f64,
        settled: &SpecimenSolution,
    ) -> Result<Specimen, Status> {
        let state = at.close_plainly(&settled.displacements)?;
        let forces = &settled.balance.forces;
        let unknown = system.unknown_reactions(&settled.ties);
        let mut offset = centre.to_vec();
        for (element, given) in system.elements.iter().zip(&settled.balance.given) {
            let Some(source) = element.source else { continue };
            self.sources[source].range().zip(given).for_each(|(p, d)| offset[p] += d);
        }
        Ok(Specimen {
            clearance_factor: factor,
            force: self.known(forces, &unknown),
            reaction: self.bearable(at.system.basis, &state, forces, &unknown),
            offset,
            status: if is_apart(factor) { Status::Strained } else { Status::Ok },
            poses: state.coordinates,
        })
    }
}
