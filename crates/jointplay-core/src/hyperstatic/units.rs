//! Many units of one over-constrained or elastic mechanism: the same case, each with deviations of its own.

use super::placed::{CHUNK, Placed};
use super::settle::is_apart;
use super::system::{Ask, System};
use crate::closure::Inputs;
use crate::cone::Rounds;
use crate::loaded::Case;
use crate::mechanism::Mechanism;
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
        let found: Vec<Unit> = self.chunks_on_basis(
            &cases,
            CHUNK,
            |placed| {
                Rounds::each(placed.iter(), async |rounds, at| {
                    let unit = Self { centre: centres[at.number].clone(), ..self.clone() };
                    let system = System::new(&unit, at.system.basis);
                    unit.unit_at(rounds, &Placed { system: &system, nominal: at.nominal.clone(), ..*at }).await
                })
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

    async fn unit_at(&self, rounds: &Rounds, at: &Placed<'_>) -> Unit {
        let Placed { system, solver, case, nominal, .. } = at;
        let known = self.displacements(&self.centre);
        let built = Inputs { drives: case.drives.to_vec(), parameters: known.clone() };
        let Ok(start) = solver.follow(nominal, &built) else { return self.no_unit(Status::NotAssembled, f64::NAN) };
        let factor = match system.assembly_factor_in(rounds, solver, start.clone(), &known, None).await {
            Ok(factor) => factor,
            Err(failure) => return self.no_unit(failure.status(), f64::NAN),
        };
        let settled = match system.settle_in(rounds, solver, start, &known, None, |_, _| Ask::Load).await {
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
