//! Many units of one over-constrained or elastic mechanism: the same case, each with deviations of its own.

use super::settle::is_apart;
use super::system::{Ask, System};
use crate::closure::Inputs;
use crate::loaded::Case;
use crate::mechanism::Mechanism;
use crate::solver::{Solver, State};
use crate::status::Status;

/// What is asked of every unit, column by column, row after row.
#[derive(Clone, Debug, Default)]
pub struct UnitTable {
    /// The smallest factor on the clearances with which the rigid unit goes together.
    pub clearance_factor: Vec<f64>,
    /// Coordinates of all bodies.
    pub coordinates: Vec<f64>,
    /// Force on every row.
    pub force: Vec<f64>,
    /// Force and moment on the second body of every joint at its joint point, ground axes.
    pub reaction: Vec<f64>,
    /// The values of all parameters.
    pub offset: Vec<f64>,
    /// Outcome.
    pub status: Vec<Status>,
}

struct Unit {
    clearance_factor: f64,
    coordinates: Vec<f64>,
    force: Vec<f64>,
    reaction: Vec<f64>,
    offset: Vec<f64>,
    status: Status,
}

impl Mechanism {
    /// The exact pose under load, and what it strains, of units whose parameters have their own values in the
    /// middle of their sets. What the load leaves open is in its middle.
    #[must_use]
    pub fn strained_units(&self, case: Case<'_>, centres: &[Vec<f64>]) -> UnitTable {
        let cases = vec![case; centres.len()];
        let found: Vec<Unit> = self.each_on_basis(
            &cases,
            |system, solver, number, case, nominal| {
                let unit = Self { centre: centres[number].clone(), ..self.clone() };
                unit.unit_at(&System::new(&unit, system.basis), solver, case, &nominal)
            },
            |status| self.no_unit(status, f64::NAN),
        );
        let mut table = UnitTable::default();
        for unit in found {
            table.clearance_factor.push(unit.clearance_factor);
            table.coordinates.extend(unit.coordinates);
            table.force.extend(unit.force);
            table.reaction.extend(unit.reaction);
            table.offset.extend(unit.offset);
            table.status.push(unit.status);
        }
        table
    }

    fn no_unit(&self, status: Status, clearance_factor: f64) -> Unit {
        let nan = |n: usize| vec![f64::NAN; n];
        Unit {
            clearance_factor,
            coordinates: nan(self.n_coordinates()),
            force: nan(self.n_rows()),
            reaction: nan(self.n_joints() * self.size()),
            offset: nan(self.n_parameters()),
            status,
        }
    }

    fn unit_at(&self, system: &System<'_>, solver: &Solver<'_>, case: &Case<'_>, nominal: &State) -> Unit {
        let known = self.displacements(&self.centre);
        let built = Inputs { drives: case.drives.to_vec(), parameters: known.clone() };
        let Ok(start) = solver.follow(nominal, &built) else { return self.no_unit(Status::NotAssembled, f64::NAN) };
        let factor = match system.assembly_factor(solver, start.clone(), &known) {
            Ok(factor) => factor,
            Err(failure) => return self.no_unit(failure.status(), f64::NAN),
        };
        let settled = match system.settle(solver, start, &known, |_, _| Ask::Load) {
            Ok(settled) => settled,
            Err(failure) => return self.no_unit(failure.status(), factor),
        };
        let (c, balance) = (&settled.compatibility, &settled.balance);
        let unknown = system.unknown_reactions(c);
        Unit {
            clearance_factor: factor,
            force: self.known(&balance.forces, &unknown),
            reaction: self.bearable(c, &balance.forces, &unknown),
            offset: self.offsets(system, balance),
            status: if is_apart(factor) { Status::Strained } else { Status::Ok },
            coordinates: settled.state.coordinates,
        }
    }
}
