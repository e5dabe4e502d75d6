//! A determinate mechanism inside an over-constrained one.
//!
//! Of the N closure rows on n unknowns, n independent ones are chosen: drives first, then joints in the
//! order of the file, flanks with play last of them. A row counts as independent when the part of it
//! (length-scaled, of unit size) that is not spanned by those before is above a threshold; rows that add little
//! are taken only where too few remain. The chosen rows, the basis, are an ordinary mechanism; the displacements
//! of the others are functions of its inputs.
//!
//! The line of action of a flank is another one at each end of its play. Two flanks between the same wheels,
//! independent here, may be nearly the same or open each other without bound there, so that a basis that rests on
//! them instead of the bearings does not close for offsets that are compatible.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::closure::newton::{Solver, State};
use crate::math::space::Pose;
use crate::mechanism::status::Status;
use crate::mechanism::{Elastic, Mechanism, Row};

/// What a row must add to those chosen before it: as much as this at first, less where rows are wanting.
const INDEPENDENT: [f64; 3] = [0.1, 1e-3, 1e-6];
/// How far the guess is moved (in characteristic lengths and radians) to find a generic configuration.
const PERTURBATIONS: [f64; 3] = [0.02, 0.1, 0.3];

/// A basis. Its mechanisms are displaced row by row: parameter k is the displacement of row k of the whole
/// mechanism, clearance offset, deviation and deformation together, and parameter N + p its parameter p, as
/// far as that moves points or shifts rows beside their own.
#[derive(Clone, Debug)]
pub struct Basis {
    /// All rows.
    pub(crate) all: Mechanism,
    /// The independent rows.
    pub(crate) kept: Mechanism,
    /// Which rows those are.
    pub(crate) rows: Vec<usize>,
    /// The other rows, and what they are by themselves.
    pub(crate) redundant: Vec<usize>,
    pub(crate) rest: Mechanism,
    /// Units of the displacements; those that no row has displace points, or turn the axes there.
    units: Vec<f64>,
}

impl Mechanism {
    /// The mechanism with some of its rows, each displaced by a parameter of its own, starting from given
    /// coordinates.
    fn displaced(&self, keep: &[usize], coordinates: &[f64]) -> Self {
        let mut points = self.points.clone();
        let displacements = points.iter_mut().flat_map(|point| &mut point.displaced_by);
        for way in displacements.flat_map(|displacement| &mut displacement.ways) {
            way.parameter += self.n_rows();
        }
        let moved = |(p, coefficient)| (self.n_rows() + p, coefficient);
        let displaced = |&k: &usize| Row { parameter: Some(k), shift: self.rows[k].shift.map(moved), ..self.rows[k] };
        let rows: Vec<Row> = keep.iter().map(displaced).collect();
        let driven = |d: usize| rows.iter().position(|row| row.drive.is_some_and(|by| by.drive == d));
        Self {
            guess: coordinates.chunks_exact(self.n_body_coordinates()).map(<[f64]>::to_vec).collect(),
            points,
            driven_rows: (0..self.n_drives).map(|d| driven(d).unwrap_or_default()).collect(),
            n_driven: rows.iter().filter(|row| row.drive.is_some()).count(),
            rows,
            sources: Vec::new(),
            scores: Vec::new(),
            elastic: Vec::new(),
            centre: vec![0.0; self.n_rows() + self.n_parameters()],
            ..self.clone()
        }
    }

    /// The displacements that parameter values stand for, as [`Basis`] orders them.
    pub(crate) fn displacements(&self, parameters: &[f64]) -> Vec<f64> {
        let of_row = |row: &Row| row.parameter.map_or(0.0, |p| parameters[p]);
        self.rows.iter().map(of_row).chain(parameters.iter().copied()).collect()
    }

    /// The basis, chosen where the joints close nearest to the guess.
    ///
    /// # Errors
    /// `Underconstrained` where the rows leave a motion free in every configuration nearby, `Singular`
    /// where drives contradict each other or the joints.
    pub(crate) fn basis(&self) -> Result<Arc<Basis>, Status> {
        self.memo.get("basis", || self.choose().map(Arc::new))
    }

    fn choose(&self) -> Result<Basis, Status> {
        // The values of drives that are not held do not matter.
        let drives = vec![0.0; self.n_drives];
        let near = self.assemble(&drives, false);
        let generic = |size: &f64| {
            let moved = self.assemble_from(self.perturbed(&near.coordinates, *size), &drives, false);
            self.independent(&moved.coordinates)
        };
        let chosen = self.independent(&near.coordinates).or_else(|| PERTURBATIONS.iter().find_map(generic));
        self.basis_of(chosen.ok_or(Status::Underconstrained)?, &near.coordinates)
    }

    /// The basis that suits a state.
    pub(crate) fn basis_at(&self, coordinates: &[f64]) -> Result<Basis, Status> {
        let rows = self.independent(coordinates).ok_or(Status::Singular)?;
        self.basis_of(rows, coordinates)
    }

    fn basis_of(&self, rows: Vec<usize>, coordinates: &[f64]) -> Result<Basis, Status> {
        // Drives that command what others decide contradict these, unless they give way.
        let gives_way = self.yielding();
        if (self.n_rows() - self.n_driven..self.n_rows()).any(|row| !rows.contains(&row) && !gives_way[row]) {
            return Err(Status::Singular);
        }
        let every: Vec<usize> = (0..self.n_rows()).collect();
        let redundant: Vec<usize> = every.iter().copied().filter(|k| !rows.contains(k)).collect();
        let rest = self.displaced(&redundant, coordinates);
        let all = self.displaced(&every, coordinates);
        let of_points = |displacement: usize| {
            let turned = all.points.iter().map(|point| point.turned_by(displacement)).fold(0.0, f64::max);
            if turned > 0.0 { 1.0 } else { all.length }
        };
        let unit = |displacement: usize| {
            all.rows.get(displacement).map_or_else(|| of_points(displacement), |row| all.unit(row.component))
        };
        Ok(Basis {
            units: (0..all.n_parameters()).map(unit).collect(),
            all,
            kept: Self { left_out: rest.rows.clone(), ..self.displaced(&rows, coordinates) },
            rest,
            rows,
            redundant,
        })
    }

    /// As many independent rows as there are unknowns, in ascending order; `None` where there are fewer.
    fn independent(&self, coordinates: &[f64]) -> Option<Vec<usize>> {
        let matrix = self.scaled(coordinates, &vec![0.0; self.n_drives]);
        let (rows, unknowns) = (self.n_rows(), self.n_unknowns());
        let joints = rows - self.n_driven;
        let (flanks, others): (Vec<usize>, Vec<usize>) = (0..joints).partition(|&row| self.rows[row].play.is_some());
        // Of several drives on one motion the first one decides the nominal pose, and all joints are closed there.
        let gives_way = self.yielding();
        let (soft, stiff): (Vec<usize>, Vec<usize>) = (joints..rows).partition(|&row| gives_way[row]);
        let order: Vec<usize> = [stiff, others, flanks, soft].concat();
        // Orthonormal directions of the rows chosen, one per column.
        let mut span = DMatrix::<f64>::zeros(unknowns, unknowns);
        let mut chosen = Vec::with_capacity(unknowns);
        for threshold in INDEPENDENT {
            for &row in &order {
                if chosen.len() == unknowns {
                    break;
                }
                if chosen.contains(&row) {
                    continue;
                }
                let mut rest: DVector<f64> = matrix.row(row).transpose();
                let size = rest.norm();
                let before = span.columns(0, chosen.len());
                // Twice is enough: the second pass takes away what rounding left.
                for _ in 0..2 {
                    rest -= before * (before.transpose() * &rest);
                }
                let left = rest.norm();
                if left > threshold * size {
                    span.set_column(chosen.len(), &(rest / left));
                    chosen.push(row);
                }
            }
        }
        chosen.sort_unstable();
        (chosen.len() == unknowns).then_some(chosen)
    }

    /// Which rows give way elastically.
    fn yielding(&self) -> Vec<bool> {
        let mut gives_way = vec![false; self.n_rows()];
        self.elastic.iter().flat_map(Elastic::yielding).for_each(|row| gives_way[row] = true);
        gives_way
    }

    /// Coordinates moved without a pattern.
    fn perturbed(&self, coordinates: &[f64], size: f64) -> Vec<f64> {
        let mut moved = coordinates.to_vec();
        let unit = |j: usize| self.unit(self.space.components()[j % self.size()]);
        let twist = |j: usize| size * unit(j) * (2.0 * (j as f64 * 0.618_034 + size).fract() - 1.0);
        let twists: Vec<f64> = (0..self.n_unknowns()).map(twist).collect();
        self.retract(&mut moved, &twists);
        moved
    }
}

impl Basis {
    /// How many rows are redundant.
    pub(crate) const fn redundancy(&self) -> usize {
        self.redundant.len()
    }

    /// What the redundant rows lack to be closed at a state of the basis.
    pub(crate) fn misfit(&self, state: &State) -> DVector<f64> {
        self.redundant_at(&self.all.poses(&state.coordinates), state).0
    }

    /// The same with their derivatives along the twists of all bodies, one row per column.
    pub(crate) fn redundant_at(&self, poses: &[Pose<f64>], state: &State) -> (DVector<f64>, DMatrix<f64>) {
        let m = &self.rest;
        let size = m.size();
        let (mut residual, mut derivatives) = (vec![0.0; m.n_rows()], vec![0.0; m.n_derivatives()]);
        m.evaluate(poses, &state.inputs.commands(m), &mut residual, &mut derivatives);
        let mut columns = DMatrix::zeros(m.n_unknowns(), m.n_rows());
        for row in 0..m.n_rows() {
            for (side, body) in m.row_bodies(row).into_iter().enumerate() {
                let Some(b) = body else { continue };
                for c in 0..size {
                    columns[(b * size + c, row)] += derivatives[m.side(row, side) * size + c];
                }
            }
        }
        (DVector::from_vec(residual), columns)
    }

    /// The largest misfit, in characteristic lengths and radians.
    pub(crate) fn scaled_misfit(&self, misfit: &DVector<f64>) -> f64 {
        self.redundant
            .iter()
            .zip(misfit.iter())
            .fold(0.0, |largest: f64, (&k, gap)| largest.max(gap.abs() / self.units[k]))
    }

    /// A solver of the basis, planned at given coordinates.
    pub(crate) fn solver(&self, coordinates: &[f64]) -> Solver<'_> {
        Solver::new(&self.kept, coordinates)
    }

    /// The unit of a displacement.
    pub(crate) fn unit(&self, displacement: usize) -> f64 {
        self.units[displacement]
    }
}
