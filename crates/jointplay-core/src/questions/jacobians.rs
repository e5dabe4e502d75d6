//! Derivatives of the output's pose with respect to all that is given, with every clearance held.
//!
//! The twists x of all bodies, the displacements of all rows and the forces l on them obey
//!
//! ```text
//! r(x, u) = F l,   J^T l = c(x, u)
//! ```
//!
//! with deviations u, compliances F and the gradient c of the loads' work. Let `T du` be the twists that displacements
//! make on the linearised closure where what is elastic gives way to their self-stress ([`crate::redundancy::parts`]),
//! so that `D = T F T^T` is what wrenches on the bodies make of them. What the loads and the forces of the joints do when
//! the bodies move is such a wrench, too:
//!
//! ```text
//! dx = T du + D (dc - K dx - H du),   [K, H] = d(J^T l - c) / d(x, u)
//! ```
//!
//! Where nothing is elastic D is zero. With `T` of the output in the first place the same holds for its pose.

use nalgebra::{DMatrix, DVector};

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::closure::sensitivity::Cost;
use crate::cone::Kind;
use crate::cone::scheduler::Rounds;
use crate::math::space::{Component, Pose};
use crate::math::vector::Vec3;
use crate::mechanism::answer::Answer;
use crate::mechanism::case::Case;
use crate::mechanism::columns::Row as _;
use crate::mechanism::dim::Wanted;
use crate::mechanism::status::Status;
use crate::mechanism::{Mechanism, Row};
use crate::questions::columns::Jacobians;
use crate::redundancy::compatibility::Ties;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::sequence::Failure;
use crate::redundancy::system::System;

impl Mechanism {
    /// The derivatives for every case, at its nominal coordinates as the loads deform them.
    #[must_use]
    pub fn output_jacobians(&self, cases: &[Case<'_>]) -> Answer {
        let held = self.with_flanks_held();
        let m = held.as_ref().unwrap_or(self);
        let missing = |status| Jacobians { status, ..Jacobians::unknown(&Wanted::all(m)) };
        let found = m.each_on_basis(
            cases,
            |system, solver, _, _, nominal| m.jacobians_at(system, solver, &nominal).unwrap_or_else(missing),
            missing,
        );
        Answer::of_rows(found.iter(), &Wanted::all(m))
    }

    /// The same mechanism without play between flanks, where any of it deforms: the deformation of teeth that are held in the
    /// middle of their play would be taken for a part of that, which grows with the distance of the centres.
    fn with_flanks_held(&self) -> Option<Self> {
        if self.elastic.is_empty() || self.plays().next().is_none() {
            return None;
        }
        let mut held = self.clone();
        held.rows.iter_mut().for_each(|row| row.play = None);
        Some(held)
    }

    fn jacobians_at(&self, system: &System<'_>, solver: &Solver<'_>, nominal: &State) -> Result<Jacobians, Status> {
        match self.nominal_status(nominal) {
            Status::Ok => {}
            other => return Err(other),
        }
        let (basis, size, n) = (system.basis, self.size(), self.n_unknowns());
        let (state, forces) = system.deformed(solver, nominal)?;
        let linearised = solver.linearise(&state).ok_or(Status::Singular)?;
        let (poses, parameters) = (&linearised.poses, &linearised.parameters);
        let ties = Ties::of(basis, &linearised, &state);
        let seen: Vec<Cost<f64>> = (0..size).map(|i| basis.kept.component_cost(i, poses, parameters)).collect();
        let outputs = DMatrix::from_fn(n, size, |k, i| seen[i].twists[k]);
        let unit = |k: usize| {
            let mut cost = basis.kept.no_cost();
            cost.twists[k] = 1.0;
            cost
        };
        let mut map = DMatrix::zeros(size + n, basis.all.n_parameters());
        for (i, cost) in seen.into_iter().chain((0..n).map(unit)).enumerate() {
            let row = basis.kept.gradient(&linearised, cost).inputs.parameters;
            map.set_row(i, &DVector::from_vec(row).transpose());
        }
        let (map, defined) = system.derivatives_of(&ties.equations, &map);
        let response = system.response(&map, size);
        let [mut slopes, mut wrenches] = [map.rows(0, size).into_owned(), response.rows(0, size).into_owned()];
        if response.iter().any(|r| *r != 0.0) {
            let multipliers = basis.all.multipliers_of(&forces, poses, parameters);
            let [k, h] = basis.all.balance_along(&state, &multipliers);
            let [twists, flexible] = [map.rows(size, n), response.rows(size, n)];
            let solve = (DMatrix::identity(n, n) + flexible * &k).lu();
            let moved = solve.solve(&(twists - flexible * &h)).ok_or(Status::Singular)?;
            let pushed = solve.solve(&flexible.into_owned()).ok_or(Status::Singular)?;
            slopes -= &wrenches * (&k * moved + h);
            wrenches -= &wrenches * (&k * pushed);
        }
        let by_rows = |m: DMatrix<f64>| m.transpose().as_slice().to_vec();
        let column = |place: usize| {
            let known = |slope: &f64| if defined[place] { *slope } else { f64::NAN };
            slopes.column(place).iter().map(known).collect::<Vec<f64>>()
        };
        let places: Vec<usize> = (0..self.n_parameters()).map(|p| self.place_of(p)).collect();
        let mut drive = DMatrix::zeros(size, self.n_drives());
        for (row, _, by) in self.rows_of_drives() {
            drive.column_mut(by.drive).axpy(by.coefficient, &DVector::from_vec(column(row)), 1.0);
        }
        let mut acting = DMatrix::zeros(n, self.loads.len() * size);
        for (number, mut wrench) in acting.column_iter_mut().enumerate() {
            let cost = basis.kept.unit_load(number / size, number % size, poses, parameters);
            wrench.copy_from_slice(&cost.twists);
        }
        Ok(Jacobians {
            error: basis.kept.error(&state, nominal),
            parameter: by_rows(DMatrix::from_fn(size, places.len(), |i, p| column(places[p])[i])),
            drive: by_rows(drive),
            load: by_rows(&wrenches * acting),
            compliance: by_rows(wrenches * outputs),
            defined: places.iter().map(|&place| defined[place]).collect(),
            status: Status::Ok,
        })
    }

    /// The work of a force or a moment of one, along an axis of a load.
    fn unit_load(&self, load: usize, component: usize, poses: &[Pose<f64>], parameters: &[f64]) -> Cost<f64> {
        let load = &self.loads[load];
        let (mut force, mut moment): (Vec3<f64>, Vec3<f64>) = ([0.0; 3], [0.0; 3]);
        match self.space.components()[component] {
            Component::Along(i) => force[i] = 1.0,
            Component::About(i) => moment[i] = 1.0,
        }
        let [force, moment] = load.axes.map_or([force, moment], |b| [force, moment].map(|v| poses[b].turn(v)));
        let mut cost = self.no_cost();
        self.add_wrench(load.point, force, moment, poses, parameters, &mut cost);
        cost
    }

    /// The multipliers of the rows as they are at a pose, by the forces on their displacements.
    pub(crate) fn multipliers_of(&self, forces: &DVector<f64>, poses: &[Pose<f64>], displacements: &[f64]) -> Vec<f64> {
        let of_row = |(row, force): (&Row, &f64)| force / self.slope(row, poses, displacements);
        self.rows.iter().zip(forces.iter()).map(of_row).collect()
    }
}

impl System<'_> {
    /// The nominal pose as the loads deform it with every clearance held, and the forces on all displacements there.
    fn deformed(&self, solver: &Solver<'_>, nominal: &State) -> Result<(State, DVector<f64>), Status> {
        let parameters = vec![0.0; self.basis.all.n_parameters()];
        let held = System { elements: self.springs(), ..self.clone() };
        if held.elements.is_empty() {
            return Ok((nominal.clone(), DVector::zeros(parameters.len())));
        }
        let inputs = Inputs { drives: nominal.inputs.drives.clone(), parameters: parameters.clone() };
        let start = solver.follow(nominal, &inputs)?;
        let rest =
            Rounds::alone(async |rounds| held.rest_in(rounds, solver, start, &parameters, None, Ask::Load).await);
        let rest = rest.map_err(Failure::status)?;
        if rest.still { Ok((rest.state, rest.balance.forces)) } else { Err(Status::Undetermined) }
    }

    /// What wrenches on the bodies make of the rows of a map of the displacements, by what is elastic; the first rows
    /// of the map are of the output, the others the twists of all bodies.
    fn response(&self, map: &DMatrix<f64>, outputs: usize) -> DMatrix<f64> {
        let mut deforms = DMatrix::zeros(map.nrows(), map.ncols());
        for element in &self.elements {
            let Kind::Spring(compliance) = &element.kind else { continue };
            for (a, row) in element.columns.iter().zip(compliance.chunks_exact(element.columns.len())) {
                for (b, part) in element.columns.iter().zip(row).filter(|(_, part)| **part != 0.0) {
                    deforms.column_mut(*a).axpy(*part, &map.column(*b), 1.0);
                }
            }
        }
        deforms * map.rows(outputs, map.nrows() - outputs).transpose()
    }
}
