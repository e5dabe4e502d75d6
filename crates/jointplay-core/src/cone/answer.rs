//! What a program gives, measured by the program as it was given.

use crate::clearance::Set;
use crate::clearance::offset::inner;
use crate::cone::standard::{Body, Standard};
use crate::cone::{Block, Kind, Program};

/// Relative gap and residual up to which an answer is a solution.
const SOLVED: f64 = 1e-8;

/// What became of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Solved: primal and dual value agree.
    Solved,
    /// No displacements fulfil the equations within the sets.
    Infeasible,
    /// The solver came to a halt before primal and dual value agreed.
    Stalled,
}

impl Outcome {
    pub(super) fn judged(gap: f64, residual: f64) -> Self {
        if gap <= SOLVED && residual <= SOLVED { Self::Solved } else { Self::Stalled }
    }
}

/// Displacements, self-stresses and how well they prove each other right.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// What became of the program; of an infeasible one nothing else has a meaning.
    pub outcome: Outcome,
    /// Offset or deformation, for every block.
    pub displacements: Vec<Vec<f64>>,
    /// Multipliers of the equations: the self-stresses. Equations that others imply have zero.
    pub multipliers: Vec<f64>,
    /// Factor on the clearances: 1 for the pose; for assemblability the smallest one, infinite where
    /// there is none.
    pub factor: f64,
    /// Value of the displacements.
    pub value: f64,
    /// Value of the multipliers: no displacements reach less.
    pub dual_value: f64,
    /// Difference of the two, as a part of `unit`.
    pub gap: f64,
    /// The larger one of the two or, where they are small beside it, what the load can do within the sets;
    /// of a factor, one or the lack of fit as a part of what the clearances reach.
    pub unit: f64,
    /// The largest violation of an equation or of a set, as a part of what the clearances reach.
    pub residual: f64,
}

impl Answer {
    /// Where the load alone would push everything, in the middle where it does not: a start for the search of an
    /// answer.
    pub(super) fn pushed(program: &Program) -> Self {
        let push = |block: &Block| match &block.kind {
            Kind::Clearance(set) | Kind::Fixed(set) if block.force.iter().any(|f| *f != 0.0) => {
                set.face(&block.force, 0.0).centre[..block.size()].to_vec()
            }
            _ => vec![0.0; block.size()],
        };
        let multipliers = vec![0.0; program.n_equations()];
        Self { multipliers, ..Self::at(program.blocks.iter().map(push).collect()) }
    }

    /// Displacements of which nothing else is known.
    pub(crate) const fn at(displacements: Vec<Vec<f64>>) -> Self {
        Self {
            outcome: Outcome::Stalled,
            displacements,
            multipliers: Vec::new(),
            factor: 1.0,
            value: f64::INFINITY,
            dual_value: f64::NEG_INFINITY,
            gap: f64::INFINITY,
            unit: f64::INFINITY,
            residual: f64::INFINITY,
        }
    }
}

/// How far a linear function goes on the face of optimal displacements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extreme {
    /// What became of the program.
    pub outcome: Outcome,
    /// The largest value.
    pub value: f64,
    /// Difference from the dual value, as a part of what the function reaches on the face.
    pub gap: f64,
}

/// Makes answers of coordinates.
pub(super) struct Judge<'a> {
    program: &'a Program,
    standard: &'a Standard,
}

impl<'a> Judge<'a> {
    pub const fn new(program: &'a Program, standard: &'a Standard) -> Self {
        Self { program, standard }
    }

    pub fn infeasible(&self, factor: f64) -> Answer {
        Answer {
            outcome: Outcome::Infeasible,
            displacements: self.program.blocks.iter().map(|block| vec![0.0; block.size()]).collect(),
            multipliers: vec![0.0; self.program.n_equations()],
            factor,
            value: f64::INFINITY,
            dual_value: f64::INFINITY,
            gap: f64::INFINITY,
            unit: f64::INFINITY,
            residual: f64::INFINITY,
        }
    }

    /// The blocks with sets: the set, whether the factor scales it, and the number of the block.
    fn sets(&self) -> impl Iterator<Item = (&Set, bool, usize)> {
        self.program.blocks.iter().enumerate().filter_map(|(k, block)| match &block.kind {
            Kind::Clearance(set) => Some((set, true, k)),
            Kind::Fixed(set) => Some((set, false, k)),
            Kind::Spring(_) => None,
        })
    }

    /// Without equations every block goes where its own force pushes it.
    pub fn unconstrained_pose(&self, cost: &[f64]) -> Answer {
        let mut x: Vec<f64> = cost.iter().map(|c| -c).collect();
        for (set, _, k) in self.sets() {
            let part = &self.standard.parts[k];
            if let Body::Offsets { region, .. } = &part.body {
                let pushed = region.coordinates(&set.face(&self.program.blocks[k].force, 0.0).centre);
                x[part.first..part.first + part.count()].copy_from_slice(&pushed);
            }
        }
        self.pose(&x, cost, &[])
    }

    /// The pose at coordinates and scaled multipliers.
    pub fn pose(&self, x: &[f64], cost: &[f64], y: &[f64]) -> Answer {
        let energy = self.standard.energy;
        let multipliers = self.standard.multipliers(y);
        let mut stored = 0.0;
        let mut dual_value = inner(&multipliers, &self.program.right);
        for (k, block) in self.program.blocks.iter().enumerate() {
            let part = &self.standard.parts[k];
            let reaction = block.reaction(&multipliers);
            match &block.kind {
                Kind::Clearance(set) | Kind::Fixed(set) => {
                    dual_value -= set.support(&reaction);
                }
                Kind::Spring(compliance) => {
                    let give = |w: &[f64]| -> f64 {
                        let rows = compliance.chunks_exact(w.len().max(1));
                        0.5 * rows.zip(w).map(|(row, force)| force * inner(row, w)).sum::<f64>()
                    };
                    dual_value -= give(&reaction);
                    stored += 0.5 * x[part.first..part.first + part.count()].iter().map(|z| z * z).sum::<f64>();
                }
            }
        }
        let value = energy * (stored + inner(cost, x));
        self.answer(x, 1.0, multipliers, [value, dual_value], energy)
    }

    /// The smallest factor at coordinates, of which it is the last, and scaled multipliers.
    pub fn assembly(&self, x: &[f64], y: &[f64]) -> Answer {
        let mut multipliers = self.standard.multipliers(y);
        let (mut scaled, mut fixed) = (0.0, 0.0);
        for (set, scales, k) in self.sets() {
            let support = set.support(&self.program.blocks[k].stress(&multipliers));
            *(if scales { &mut scaled } else { &mut fixed }) += support;
        }
        // Any self-stress bounds the factor by its work on the equations beyond what it does in the
        // fixed sets, over what it does in the clearances.
        let work = inner(&multipliers, &self.program.right) - fixed;
        let dual_value = if work > 0.0 && scaled > 0.0 {
            for y in &mut multipliers {
                *y /= scaled;
            }
            work / scaled
        } else {
            multipliers.fill(0.0);
            0.0
        };
        let factor = x[self.standard.n].max(0.0);
        // Where fixed sets take all of the lack of fit, the factor is zero.
        let unit = self.standard.unit_of_factor().min(1.0);
        self.answer(x, factor, multipliers, [factor, dual_value], unit)
    }

    fn answer(
        &self,
        x: &[f64],
        factor: f64,
        multipliers: Vec<f64>,
        [value, dual_value]: [f64; 2],
        unit: f64,
    ) -> Answer {
        let unit = value.abs().max(dual_value.abs()).max(unit);
        let gap = if unit > 0.0 { (value - dual_value).abs() / unit } else { 0.0 };
        let residual = self.residual(x, factor);
        Answer {
            outcome: Outcome::judged(gap, residual),
            displacements: self.standard.displacements(self.program, x),
            multipliers,
            factor,
            value,
            dual_value,
            gap,
            unit,
            residual,
        }
    }

    fn residual(&self, x: &[f64], factor: f64) -> f64 {
        let standard = self.standard;
        let size = standard.right.iter().fold(1.0_f64, |size, b| size.max(b.abs()));
        let equations = standard.matrix.iter().zip(&standard.right);
        let mut most = equations.fold(0.0_f64, |most, (row, b)| most.max((inner(row, x) - b).abs() / size));
        for part in &standard.parts {
            if let Body::Offsets { region, scaled } = &part.body {
                let t = if *scaled { factor } else { 1.0 };
                most = most.max(region.violation(&x[part.first..part.first + part.count()], t) / t.max(1.0));
            }
        }
        most
    }
}
