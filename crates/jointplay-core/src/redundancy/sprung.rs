//! Springs of the mechanism as stiffness of its forces.
//!
//! The forces of springs change with the displacements d of the rows, `w(d) = w(d_0) - sum_j k_j a_j (a_j . (d - d_0))`
//! to first order, with `a_j` the gradient of what spring j resists. A program that takes the forces as constant runs away
//! where a spring is stiffer than what is elastic. With an equation and a block for every spring,
//!
//! ```text
//! a_j . d - s_j = a_j . d_0,   energy 1/2 k_j s_j^2
//! ```
//!
//! it is Newton's method. Where it has converged all s are zero.

use nalgebra::DVector;

use crate::closure::newton::{Solver, State};
use crate::cone::scheduler::Rounds;
use crate::cone::{Block, Kind, Program, Question};
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::Ties;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::system::{Element, System};

/// A gradient below this part of the largest one is rounding.
const ROUNDING: f64 = 1e-12;

/// What resists a combination of displacements.
#[derive(Clone, Debug)]
pub(crate) struct Sprung {
    stiffness: f64,
    /// The combination: coefficients of all displacements.
    along: DVector<f64>,
    /// How far it has gone already.
    gone: f64,
}

impl System<'_> {
    /// Whether the forces that are asked for change with deformations. Within clearances they change by as little as the
    /// play is of the springs' lengths.
    pub(crate) fn is_sprung(&self, ask: &Ask) -> bool {
        matches!(ask, Ask::Load) && self.mechanism.has_springs() && !self.is_rigid()
    }

    /// The springs at a state that is closed for displacements beside the known ones; `None` where it is singular.
    pub(crate) fn sprung(&self, solver: &Solver<'_>, state: &State, known: &[f64]) -> Option<Vec<Sprung>> {
        let linearised = solver.linearise(state)?;
        let own = &state.inputs.parameters;
        let found = self.basis.kept.spring_stiffness(&linearised.poses, own).into_iter().map(|(stiffness, work)| {
            let along = DVector::from_vec(self.basis.kept.gradient(&linearised, work).inputs.parameters);
            let gone = along.iter().zip(own.iter().zip(known)).map(|(a, (own, known))| a * (own - known)).sum();
            Sprung { stiffness, along, gone }
        });
        let found: Vec<Sprung> = found.collect();
        // What the bodies do not let it do needs no equation.
        let size = |spring: &Sprung| {
            let columns = self.elements.iter().flat_map(|element| &element.columns);
            columns.fold(0.0, |size: f64, &k| size.max((spring.along[k] * self.basis.unit(k)).abs()))
        };
        let least = ROUNDING * self.mechanism.length;
        Some(found.into_iter().filter(|spring| size(spring) > least).collect())
    }

    /// Where the load holds the displacements, its forces changing by springs; `drawn` tells where every offset is, to be
    /// drawn there as [`Self::balance_near`] does, and by which stiffness.
    pub(crate) async fn balance_sprung(
        &self,
        rounds: &Rounds,
        c: &Ties,
        right: &DVector<f64>,
        forces: &DVector<f64>,
        springs: &[Sprung],
        drawn: Option<(&[Vec<f64>], f64)>,
    ) -> Option<Balance> {
        let block = |element: &Element| Block {
            kind: element.kind.clone(),
            map: Self::map(element, &c.equations),
            force: Self::along(element, forces),
        };
        let mut program = match drawn {
            Some((at, stiffness)) => self.program_near(c, right, forces, at, stiffness),
            None => Program { right: self.cleaned(right), blocks: self.elements.iter().map(block).collect() },
        };
        self.add(&mut program, springs);
        let answer = rounds.solve(Question::Pose, &program, None).await;
        self.held(c, forces, answer)
    }

    /// Adds springs to a program whose first blocks are the elements.
    fn add(&self, program: &mut Program, springs: &[Sprung]) {
        let n = program.right.len();
        for (number, block) in program.blocks.iter_mut().enumerate() {
            for spring in springs {
                match self.elements.get(number) {
                    Some(element) => block.map.extend(element.columns.iter().map(|&k| spring.along[k])),
                    None => block.map.resize(block.map.len() + block.size(), 0.0),
                }
            }
        }
        for (number, spring) in springs.iter().enumerate() {
            let mut map = vec![0.0; n + springs.len()];
            map[n + number] = -1.0;
            program.blocks.push(Block { kind: Kind::Spring(vec![1.0 / spring.stiffness]), map, force: vec![0.0] });
            program.right.push(spring.gone);
        }
    }
}
