//! What the load leaves open: offsets that nothing pushes, and reactions that nothing decides.

use std::cell::OnceCell;

use nalgebra::{DMatrix, DVector};

use crate::clearance::face::Face;
use crate::clearance::undecided::UNDECIDED;
use crate::closure::sensitivity::UNOBSERVABLE;
use crate::cone::Kind;
use crate::cone::answer::Outcome;
use crate::cone::scheduler::Rounds;
use crate::math::decomposition::singular_values;
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::{Compatibility, Ties};
use crate::redundancy::system::{Element, System, UNDECIDED_TOGETHER};

/// Pivots that differ by less are no matter of rounding.
const CLEARLY: f64 = 1e-4;

impl System<'_> {
    /// Whether forces leave anything open.
    pub fn leaves_open(&self, c: &Ties, forces: &DVector<f64>) -> bool {
        !self.open_sources(c, forces).is_empty()
    }

    /// The sources that forces leave open.
    pub fn open_sources(&self, c: &Ties, forces: &DVector<f64>) -> Vec<usize> {
        let face = self.faces(c, forces);
        let open = |element: &&Element| face(element).is_some_and(|face| !face.is_point());
        self.elements.iter().filter(open).filter_map(|element| element.source).collect()
    }

    /// Widens what every source leaves open in the output, source by source where that is wanted, tells which sources
    /// the load does not decide, and gives how far all together reach from where they are.
    pub async fn leave_open(
        &self,
        rounds: &Rounds,
        c: &Compatibility,
        right: &DVector<f64>,
        balance: &Balance,
        mut open: Option<&mut [f64]>,
        decided: &mut [bool],
    ) -> Vec<f64> {
        let size = self.mechanism.size();
        let map = &c.output.parameters;
        let mut widths = vec![0.0; size];
        let mut together = false;
        let face = self.faces(c, &balance.forces);
        for element in &self.elements {
            let (Some(face), Some(source)) = (face(element), element.source) else { continue };
            decided[source] &= face.is_point();
            if Self::is_tied(element, c) {
                together |= !face.is_point();
                continue;
            }
            for k in 0..size {
                let width = face.half_width(&row_of(element, map, k));
                if let Some(open) = &mut open {
                    open[source * size + k] = width.max(open[source * size + k]);
                }
                widths[k] += width;
            }
        }
        if together {
            self.widen(rounds, c, right, balance, open, &mut widths).await;
        }
        widths
    }

    /// What the tied clearances leave open: how far they reach from where they are, together in `widths`, each
    /// by itself in `open` where that is wanted.
    async fn widen(
        &self,
        rounds: &Rounds,
        c: &Compatibility,
        right: &DVector<f64>,
        balance: &Balance,
        mut open: Option<&mut [f64]>,
        widths: &mut [f64],
    ) {
        let Some(answer) = &balance.answer else { return };
        let size = widths.len();
        let program = self.program(c, right, &c.load);
        let all = self.elements.iter().zip(&balance.given);
        let tied: Vec<(&Element, &Vec<f64>)> = all.filter(|(element, _)| Self::is_tied(element, c)).collect();
        let face = self.faces(c, &balance.forces);
        let open_faces: Vec<Option<Face>> =
            tied.iter().map(|(element, _)| face(element).filter(|face| !face.is_point())).collect();
        let optimal = OnceCell::new();
        for k in 0..size {
            let row = |element: &Element| row_of(element, &c.output.parameters, k);
            let observable = UNOBSERVABLE * self.mechanism.play(c, k);
            // How far the output moves from where it is when only some of them count, the others giving way.
            let reach = async |counts: &dyn Fn(usize) -> bool| {
                // Each face by itself leaves at least half as much open, to both sides.
                let alone = |(g, (element, _)): (usize, &(&Element, &Vec<f64>))| match &open_faces[g] {
                    Some(face) if counts(g) => 2.0 * face.half_width(&row(element)),
                    _ => 0.0,
                };
                let most: f64 = tied.iter().enumerate().map(alone).sum();
                if most <= observable {
                    return 0.0;
                }
                let optimal = optimal.get_or_init(|| program.optimal_face(answer, UNDECIDED_TOGETHER));
                let along = |sign: f64| -> Vec<Vec<f64>> {
                    let of = |(g, (element, _)): (usize, &(&Element, &Vec<f64>))| {
                        row(element).iter().map(|m| if counts(g) { sign * m } else { 0.0 }).collect()
                    };
                    tied.iter().enumerate().map(of).collect()
                };
                let high = optimal.extreme_in(rounds, &along(1.0)).await;
                let low = optimal.extreme_in(rounds, &along(-1.0)).await;
                if high.outcome == Outcome::Solved && low.outcome == Outcome::Solved {
                    let given: Vec<Vec<f64>> = tied.iter().map(|(_, given)| (*given).clone()).collect();
                    let at = optimal.value(&along(1.0), &given);
                    return (high.value - at).max(low.value + at).max(0.0);
                }
                most
            };
            widths[k] += reach(&|_| true).await;
            let Some(open) = &mut open else { continue };
            for (g, (element, _)) in tied.iter().enumerate() {
                let (Some(source), Some(_)) = (element.source, &open_faces[g]) else { continue };
                let slot = &mut open[source * size + k];
                *slot = slot.max(reach(&|other| other == g).await);
            }
        }
    }

    /// The joints whose reactions nothing decides.
    pub fn unknown_reactions(&self, c: &Ties) -> Vec<bool> {
        self.joints_of(&self.unknown_rows(c))
    }

    /// The joints that have one of some rows.
    pub fn joints_of(&self, rows: &[bool]) -> Vec<bool> {
        let mut joints = vec![false; self.mechanism.n_joints()];
        self.mechanism.rows.iter().zip(rows).for_each(|(row, is_one)| joints[row.joint] |= is_one);
        joints
    }

    /// The rows whose forces nothing decides: they take part in a self-stress that no clearance and no compliance
    /// feels.
    pub fn unknown_rows(&self, c: &Ties) -> Vec<bool> {
        let m = self.mechanism;
        let mut unknown = vec![false; m.n_rows()];
        let s = c.equations.nrows();
        if s == 0 {
            return unknown;
        }
        // What every give can do in the equations, both in units of the redundant rows.
        let mut observable = DMatrix::<f64>::zeros(s, m.n_rows());
        for element in &self.elements {
            for (k, &row) in element.columns.iter().enumerate() {
                let moves = match &element.kind {
                    Kind::Clearance(set) | Kind::Fixed(set) => set.half_width(k) > 0.0,
                    Kind::Spring(compliance) => compliance[k * (element.columns.len() + 1)] > 0.0,
                };
                if moves {
                    for equation in 0..s {
                        let unit = self.basis.unit(self.basis.redundant[equation]);
                        observable[(equation, row)] = c.equations[(equation, row)] * self.basis.unit(row) / unit;
                    }
                }
            }
        }
        // Mostly every equation is observable by itself.
        if (&observable * observable.transpose()).cholesky().is_some_and(|factors| is_clear(factors.l_dirty())) {
            return unknown;
        }
        let Some(svd) = singular_values(observable, true, false) else { return unknown };
        let Some(directions) = svd.u else { return unknown };
        let smallest = UNDECIDED * svd.singular_values.max();
        // The left null space: what is orthogonal to every direction that is observable.
        let mut null = DMatrix::<f64>::identity(s, s);
        for (k, value) in svd.singular_values.iter().enumerate() {
            if *value > smallest {
                let direction = directions.column(k);
                null -= direction * direction.transpose();
            }
        }
        for (number, unknown) in unknown.iter_mut().enumerate() {
            let stress = (0..s).map(|k| {
                let along: f64 = (0..s)
                    .map(|e| null[(k, e)] * c.equations[(e, number)] / self.basis.unit(self.basis.redundant[e]))
                    .sum();
                (along * self.basis.unit(number)).abs()
            });
            *unknown = stress.fold(0.0, f64::max) > UNDECIDED;
        }
        unknown
    }
}

/// What the displacements of an element do to one component of the output.
fn row_of(element: &Element, map: &DMatrix<f64>, component: usize) -> Vec<f64> {
    element.columns.iter().map(|&row| map[(component, row)]).collect()
}

/// Whether the least pivot of a factored matrix is not small beside the largest one.
fn is_clear(factors: &DMatrix<f64>) -> bool {
    let pivots = factors.diagonal();
    pivots.min() > CLEARLY * pivots.max()
}
