//! Whether what the load leaves open moves the output: a yes or no for one of many units.

use nalgebra::{DMatrix, DVector};

use crate::clearance::face::Face;
use crate::cone::answer::Outcome;
use crate::math::decomposition::pseudo_inverse;
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::Ties;
use crate::redundancy::system::{Element, System, UNDECIDED_TOGETHER};

/// Directions in which open offsets do less than this part of the most in the equations are not tied.
const TIED: f64 = 1e-9;

/// What the load leaves open of a clearance, and what its offsets do to a component of the output.
struct Open<'a> {
    element: &'a Element,
    face: Face,
}

impl System<'_> {
    /// Whether any component of the output moves by more than its limit; `output` is what displacements do to it.
    pub fn is_observable(
        &self,
        c: &Ties,
        output: &DMatrix<f64>,
        right: &DVector<f64>,
        balance: &Balance,
        limits: &[f64],
    ) -> bool {
        let face = self.faces(c, &balance.forces);
        let faces = self.elements.iter().filter_map(|element| Some(Open { element, face: face(element)? }));
        let open: Vec<Open<'_>> = faces.filter(|open| !open.face.is_point()).collect();
        if open.is_empty() {
            return false;
        }
        let (tied, free): (Vec<_>, Vec<_>) = open.into_iter().partition(|open| Self::is_tied(open.element, c));
        let bounds = bounds(&tied, c, output);
        limits.iter().enumerate().any(|(k, limit)| {
            let row = |element: &Element| element.columns.iter().map(|&row| output[(k, row)]).collect::<Vec<f64>>();
            let alone: f64 = free.iter().map(|open| open.face.half_width(&row(open.element))).sum();
            let reach = || self.reach_together(c, output, right, balance, k).unwrap_or(bounds[k]);
            alone > *limit || alone + bounds[k] > *limit && alone + reach() > *limit
        })
    }

    /// Half of the range in which all tied clearances together take a component of the output.
    fn reach_together(
        &self,
        c: &Ties,
        output: &DMatrix<f64>,
        right: &DVector<f64>,
        balance: &Balance,
        component: usize,
    ) -> Option<f64> {
        let answer = balance.answer.as_ref()?;
        let program = self.program(c, right, &c.load);
        let optimal = program.optimal_face(answer, UNDECIDED_TOGETHER);
        let end = |sign: f64| {
            let row = |element: &Element| element.columns.iter().map(|&row| sign * output[(component, row)]).collect();
            let tied = self.elements.iter().filter(|element| Self::is_tied(element, c));
            let extreme = optimal.extreme(&tied.map(row).collect::<Vec<Vec<f64>>>());
            (extreme.outcome == Outcome::Solved).then_some(extreme.value)
        };
        // Between the ends, since where the offsets are is known to the programs' rounding only.
        Some(0.5 * (end(1.0)? + end(-1.0)?))
    }
}

/// How far open offsets at most take each component of the output from where it is.
///
/// Changes of offsets that keep compatible fulfil `A d = 0`, and do `(m + A' y) d` for any y: taken is the one
/// that makes it least in size, which is nothing where the equations alone hold the output.
fn bounds(open: &[Open<'_>], c: &Ties, output: &DMatrix<f64>) -> Vec<f64> {
    if open.is_empty() {
        return vec![0.0; output.nrows()];
    }
    let columns: Vec<(usize, f64)> = open
        .iter()
        .filter_map(|open| Some((open.element, open.element.kind.set()?)))
        .flat_map(|(element, set)| element.columns.iter().enumerate().map(|(k, &row)| (row, set.half_width(k))))
        .collect();
    let scaled = |matrix: &DMatrix<f64>| {
        DMatrix::from_fn(matrix.nrows(), columns.len(), |i, k| columns[k].1 * matrix[(i, columns[k].0)])
    };
    let (ties, map) = (scaled(&c.equations), scaled(output));
    let normal = &ties * ties.transpose();
    let smallest = TIED * TIED * normal.norm();
    let inverse = pseudo_inverse(&normal, smallest).unwrap_or_else(|| DMatrix::zeros(ties.nrows(), ties.nrows()));
    let multipliers = -inverse * &ties * map.transpose();
    let bound = |k: usize| {
        let moved = |open: &Open<'_>| {
            let of = |&row: &usize| output[(k, row)] + c.equations.column(row).dot(&multipliers.column(k));
            // From one end of the face to the other.
            2.0 * open.face.half_width(&open.element.columns.iter().map(of).collect::<Vec<f64>>())
        };
        open.iter().map(moved).sum()
    };
    (0..output.nrows()).map(bound).collect()
}
