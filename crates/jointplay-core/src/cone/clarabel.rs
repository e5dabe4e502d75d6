//! One program at a time, by Clarabel (Goulart and Chen, arXiv 2405.12762).

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus, SupportedConeT,
    ZeroConeT,
};

use crate::cone::answer::{Answer, Judge, Outcome};
use crate::cone::sets::Condition;
use crate::cone::standard::{Body, Standard};
use crate::cone::{Program, Springs};
use crate::interrupt;

/// What Clarabel is asked to reach. Where it comes to a halt before, the answer is judged by its own
/// primal and dual value.
const TOLERANCE: f64 = 1e-12;

/// What Clarabel gives in coordinates without units.
pub(super) struct Raw {
    pub x: Vec<f64>,
    /// Multipliers of the equations.
    pub y: Vec<f64>,
    pub value: f64,
    pub dual_value: f64,
    pub infeasible: bool,
}

/// Conditions as Clarabel has them: `bounds - rows x` in a product of cones.
#[derive(Default)]
struct Rows {
    entries: Vec<(usize, usize, f64)>,
    bounds: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

impl Rows {
    fn push(&mut self, entries: impl Iterator<Item = (usize, f64)>, bound: f64) {
        let i = self.bounds.len();
        self.entries.extend(entries.filter(|(_, a)| *a != 0.0).map(|(j, a)| (i, j, a)));
        self.bounds.push(bound);
    }
}

impl Standard {
    /// Minimises `1/2 |deformations|^2 + cost . x`, or, if `factor` is variable, the factor on
    /// the clearances.
    pub(super) fn solve(&self, cost: &[f64], factor: Option<f64>) -> Raw {
        interrupt::check();
        // With a variable factor everything is divided by the unit of the right sides.
        let unit = factor.unwrap_or(1.0);
        let n = self.n + usize::from(factor.is_some());
        let mut rows = Rows::default();
        for (row, b) in self.matrix.iter().zip(&self.right) {
            rows.push(row.iter().copied().enumerate(), b / unit);
        }
        if !self.rows.is_empty() {
            rows.cones.push(ZeroConeT(self.rows.len()));
        }
        self.push_sets(&mut rows, factor);
        let mut quadratic = Vec::new();
        if self.central {
            quadratic.extend((0..n).map(|k| (k, k, 1.0)));
        } else if factor.is_none() {
            for part in &self.parts {
                if let Body::Deformation(columns) = &part.body {
                    quadratic.extend((part.first..part.first + columns.len()).map(|k| (k, k, 1.0)));
                }
            }
        }
        let matrix = |m: usize, entries: &[(usize, usize, f64)]| {
            let column = |k: fn(&(usize, usize, f64)) -> usize| entries.iter().map(k).collect();
            CscMatrix::new_from_triplets(m, n, column(|e| e.0), column(|e| e.1), entries.iter().map(|e| e.2).collect())
        };
        let mut linear = cost.to_vec();
        linear.resize(n, 1.0);
        let settings = DefaultSettings {
            verbose: false,
            max_threads: 1,
            tol_gap_abs: TOLERANCE,
            tol_gap_rel: TOLERANCE,
            tol_feas: TOLERANCE,
            ..DefaultSettings::default()
        };
        let m = rows.bounds.len();
        let solver = DefaultSolver::new(
            &matrix(n, &quadratic),
            &linear,
            &matrix(m, &rows.entries),
            &rows.bounds,
            &rows.cones,
            settings,
        );
        // It refuses inconsistent dimensions only.
        let Ok(mut solver) = solver else { return Raw::none(n, self.rows.len()) };
        solver.solve();
        let solution = &solver.solution;
        Raw {
            x: solution.x.iter().map(|x| unit * x).collect(),
            y: solution.z[..self.rows.len()].iter().map(|z| -z).collect(),
            value: unit * solution.obj_val,
            dual_value: unit * solution.obj_val_dual,
            infeasible: matches!(
                solution.status,
                SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible
            ),
        }
    }

    /// The coordinates of least size that fulfil the equations within the sets; `None` where rounding leaves none.
    pub(super) fn nearest_to_middle(&self) -> Option<Vec<f64>> {
        if let Some(x) = self.least().filter(|x| self.is_within(x)) {
            return Some(x);
        }
        let central = Self { central: true, ..self.clone() };
        let raw = central.solve(&vec![0.0; self.n], None);
        let solved = !raw.infeasible && Outcome::judged((raw.value - raw.dual_value).abs(), 0.0) == Outcome::Solved;
        solved.then_some(raw.x)
    }

    fn push_sets(&self, rows: &mut Rows, factor: Option<f64>) {
        let unit = factor.unwrap_or(1.0);
        let mut lengths = Vec::new();
        let equations = rows.bounds.len();
        for part in &self.parts {
            let Body::Offsets { region, scaled } = &part.body else { continue };
            let variable = factor.is_some() && *scaled;
            let bounded = move |bound: f64| {
                if variable { (Some((self.n, -bound)), 0.0) } else { (None, bound / unit) }
            };
            for condition in &region.conditions {
                match condition {
                    Condition::Half { form, bound } => {
                        let (slack, bound) = bounded(*bound);
                        rows.push(
                            form.iter().take(part.count()).enumerate().map(|(k, f)| (part.first + k, *f)).chain(slack),
                            bound,
                        );
                    }
                    Condition::Length { forms, shift, bound } => {
                        lengths.push((part.first, forms, shift, bounded(*bound)));
                    }
                }
            }
        }
        if factor.is_some() {
            rows.push([(self.n, -1.0)].into_iter(), 0.0);
        }
        if rows.bounds.len() > equations {
            rows.cones.push(NonnegativeConeT(rows.bounds.len() - equations));
        }
        for (first, forms, shift, (slack, bound)) in lengths {
            rows.push(slack.into_iter(), bound);
            for (form, shift) in forms.iter().zip(shift) {
                rows.push(form.iter().enumerate().map(|(k, f)| (first + k, -f)), *shift);
            }
            rows.cones.push(SecondOrderConeT(forms.len() + 1));
        }
    }
}

impl Raw {
    fn none(n: usize, m: usize) -> Self {
        Self { x: vec![0.0; n], y: vec![0.0; m], value: f64::NAN, dual_value: f64::NAN, infeasible: false }
    }
}

impl Program {
    /// The displacements where the load holds the mechanism.
    #[must_use]
    pub fn pose(&self) -> Answer {
        let standard = Standard::pose(self);
        let judge = Judge::new(self, &standard);
        if !standard.consistent {
            return judge.infeasible(1.0);
        }
        let cost = standard.cost(self);
        if standard.rows.is_empty() {
            return judge.unconstrained_pose(&cost);
        }
        let raw = standard.solve(&cost, None);
        if raw.infeasible { judge.infeasible(1.0) } else { judge.pose(&raw.x, &cost, &raw.y) }
    }

    /// The smallest factor on the clearances with which the mechanism can be assembled.
    #[must_use]
    pub fn assembly(&self, springs: Springs) -> Answer {
        let standard = Standard::assembly(self, springs);
        let judge = Judge::new(self, &standard);
        if !standard.consistent {
            return judge.infeasible(f64::INFINITY);
        }
        let unit = standard.unit_of_factor();
        if unit == 0.0 {
            return judge.assembly(&vec![0.0; standard.n + 1], &vec![0.0; standard.rows.len()]);
        }
        let raw = standard.solve(&vec![0.0; standard.n], Some(unit));
        if raw.infeasible { judge.infeasible(f64::INFINITY) } else { judge.assembly(&raw.x, &raw.y) }
    }
}
