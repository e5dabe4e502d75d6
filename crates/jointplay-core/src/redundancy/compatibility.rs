//! Compatibility of the joints' displacements, and the statics that goes with it.
//!
//! With the rows `r = value(x) - d` of all joints, split into basis B and redundant rows R, the poses follow
//! from the basis, `dx = J_B^-1 dd_B`, and the redundant rows say
//!
//! ```text
//! A d = b,   A = [-J_R J_B^-1, 1],   b = A d_0 + r_R(d_0)
//! ```
//!
//! for the displacements d of all rows, linearised at `d_0`. `A J = 0`: the rows of A are the self-stresses, and
//! every system of forces on the rows in equilibrium with the load is `W = W_0 + A^T y` with the statics `W_0` of
//! the basis. Dimensions and drives enter as their part of `-dr/du` says.
//!
//! What a displacement does to the output depends on what the others do to keep compatible; of all maps that
//! agree on compatible displacements, the one of least size (length-scaled) is kept here, whichever rows were
//! chosen as the basis; derivatives are those of [`super::parts`].

use std::ops::Deref;

use nalgebra::{DMatrix, DVector};

use crate::closure::equations::Inputs;
use crate::closure::newton::{Linearised, Solver, State};
use crate::closure::recorded::program::Bound;
use crate::closure::recorded::self_stress::Borne;
use crate::closure::sensitivity::Output;
use crate::redundancy::basis::Basis;

/// A coefficient below this part of the largest one (length-scaled) is rounding.
const ROUNDING: f64 = 1e-13;
/// A misfit (in characteristic lengths and radians) that an assembled mechanism may have.
pub(crate) const FITS: f64 = 1e-11;

/// The equations between displacements at one state, and the forces on them.
#[derive(Clone, Debug)]
pub(crate) struct Ties {
    /// Coefficients of all displacements, those of the rows first: one equation per redundant row.
    pub equations: DMatrix<f64>,
    /// What the redundant rows lack at the state.
    pub misfit: DVector<f64>,
    /// The load's forces on all displacements, as the basis alone would bear them.
    pub load: DVector<f64>,
}

/// The same with what it does to the output.
#[derive(Clone, Debug)]
pub(crate) struct Compatibility {
    pub ties: Ties,
    /// Coefficients of the drives.
    pub drives: DMatrix<f64>,
    /// What displacements and drives do to the output, by the map of least size.
    pub output: Output,
    /// What the misfit itself does to the output by that map.
    pub shared: DMatrix<f64>,
}

impl Compatibility {
    /// Linearises at a state of the basis; `None` where the basis is singular.
    pub fn at(basis: &Basis, solver: &Solver<'_>, state: &State) -> Option<Self> {
        let linearised = solver.linearise(state)?;
        let (ties, drives) = tie(basis, &linearised, state);
        let mut output = basis.kept.output_sensitivity(&linearised, state);
        let shared = share(basis, &ties.equations, &output.parameters);
        output.parameters += &shared * &ties.equations;
        output.drives += &shared * &drives;
        Some(Self { ties, drives, output, shared })
    }
}

impl Compatibility {
    /// The linearisation at the same nominal pose for other flanks of couplings: what the rows lack there stays.
    pub fn at_flanks(&self, basis: &Basis, solver: &Solver<'_>, flanks: &State) -> Option<Self> {
        let mut other = Self::at(basis, solver, flanks)?;
        other.ties.misfit.clone_from(&self.ties.misfit);
        Some(other)
    }
}

impl Deref for Compatibility {
    type Target = Ties;

    fn deref(&self) -> &Ties {
        &self.ties
    }
}

impl Ties {
    /// Those at a state of the basis; `None` where the basis is singular.
    pub fn at(basis: &Basis, solver: &Solver<'_>, state: &State) -> Option<Self> {
        Some(Self::of(basis, &solver.linearise(state)?, state))
    }

    /// Those of a linearisation at a state.
    pub fn of(basis: &Basis, linearised: &Linearised<'_>, state: &State) -> Self {
        tie(basis, linearised, state).0
    }

    /// Those at one lane of a block that is closed and whose multipliers are solved.
    pub fn of_lane(basis: &Basis, bound: &Bound<'_>, lane: usize) -> Self {
        let n = basis.all.n_parameters();
        let mut equations = DMatrix::zeros(basis.redundancy(), n);
        for (k, &row) in basis.redundant.iter().enumerate() {
            let multipliers = bound.multipliers(Borne::Redundant(k)).map(|block| block.0[lane]);
            put_stress(basis, row, multipliers, |r, stress| equations[(k, r)] = stress);
        }
        let mut load = DVector::zeros(n);
        Self::put_load(basis, bound, lane, &mut load);
        bound.slopes().for_each(|(row, slope)| equations.column_mut(row).scale_mut(slope.0[lane]));
        let misfit = DVector::from_fn(basis.redundancy(), |k, _| bound.left(k).0[lane]);
        Self { equations, misfit, load }
    }

    /// Puts the load's forces at such a lane; those on no row of the basis stay zero.
    pub fn put_load(basis: &Basis, bound: &Bound<'_>, lane: usize, load: &mut DVector<f64>) {
        basis.rows.iter().zip(bound.multipliers(Borne::Load)).for_each(|(&r, block)| load[r] = block.0[lane]);
        bound.slopes().for_each(|(row, slope)| load[row] *= slope.0[lane]);
    }

    /// What displacements beside the known ones must add up to, the state being closed for others, its own.
    pub fn right(&self, own: &[f64], known: &[f64]) -> DVector<f64> {
        &self.misfit + self.sum(own.iter().zip(known).map(|(own, known)| own - known))
    }

    /// What all displacements add up to.
    pub fn sum(&self, displacements: impl Iterator<Item = f64>) -> DVector<f64> {
        let mut sum = DVector::zeros(self.equations.nrows());
        if !sum.is_empty() {
            for (column, d) in self.equations.as_slice().chunks_exact(sum.len()).zip(displacements) {
                sum.iter_mut().zip(column).for_each(|(sum, a)| *sum += a * d);
            }
        }
        sum
    }

    /// Forces on all displacements with a self-stress.
    pub fn with_stress(&self, forces: &DVector<f64>, multipliers: &[f64]) -> DVector<f64> {
        forces + self.equations.tr_mul(&DVector::from_column_slice(multipliers))
    }
}

/// The self-stresses, one per row, as coefficients of all displacements and, apart from them, of the drives; misfit
/// and load.
fn tie(basis: &Basis, linearised: &Linearised<'_>, state: &State) -> (Ties, DMatrix<f64>) {
    let (all, kept) = (&basis.all, &basis.kept);
    let (misfit, redundant) = basis.redundant_at(&linearised.poses, state);
    let mut equations = DMatrix::zeros(basis.redundancy(), all.n_parameters());
    let mut drives = DMatrix::zeros(basis.redundancy(), all.n_drives());
    let mut reaction = vec![0.0; basis.rows.len()];
    for (k, &row) in basis.redundant.iter().enumerate() {
        let mut twists: Vec<f64> = redundant.column(k).iter().copied().collect();
        linearised.factors.solve_transposed(&mut twists, &mut reaction);
        let mut stress = vec![0.0; all.n_rows()];
        put_stress(basis, row, reaction.iter().copied(), |r, along| stress[r] = along);
        let mut along = Inputs { drives: vec![0.0; all.n_drives()], parameters: vec![0.0; all.n_parameters()] };
        all.pull_back(&linearised.poses, &linearised.parameters, &stress, &mut along);
        equations.row_mut(k).iter_mut().zip(&along.parameters).for_each(|(e, p)| *e = *p);
        drives.row_mut(k).iter_mut().zip(&along.drives).for_each(|(e, d)| *e = *d);
    }
    let load = kept.gradient(linearised, kept.load_cost(&linearised.poses, &state.inputs.parameters));
    (Ties { equations, misfit, load: DVector::from_vec(load.inputs.parameters) }, drives)
}

/// The self-stress with one on a redundant row, on the rows where it is more than rounding, from the multipliers
/// of the basis.
fn put_stress(
    basis: &Basis,
    row: usize,
    multipliers: impl Iterator<Item = f64> + Clone,
    mut put: impl FnMut(usize, f64),
) {
    let along = basis.rows.iter().copied().zip(multipliers);
    let size = |(r, t): (usize, f64)| t.abs() * basis.unit(r);
    let largest = along.clone().map(size).fold(basis.unit(row), f64::max);
    put(row, 1.0);
    along.filter(|&at| size(at) > ROUNDING * largest).for_each(|(r, t)| put(r, -t));
}

/// The multiples of the equations which, added to the basis' map, make it least in size.
fn share(basis: &Basis, equations: &DMatrix<f64>, map: &DMatrix<f64>) -> DMatrix<f64> {
    let rows = basis.all.n_rows();
    let mut scaled = equations.columns(0, rows).into_owned();
    let mut given = map.columns(0, rows).into_owned();
    for row in 0..rows {
        scaled.column_mut(row).scale_mut(basis.unit(row));
        given.column_mut(row).scale_mut(basis.unit(row));
    }
    // The redundant rows have the coefficient 1, so that the equations are independent.
    let normal = &scaled * scaled.transpose();
    let right = &scaled * given.transpose();
    normal
        .cholesky()
        .map_or_else(|| DMatrix::zeros(map.nrows(), equations.nrows()), |factors| -factors.solve(&right).transpose())
}
