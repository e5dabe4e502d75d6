//! Many programs of one structure, eight at a time.
//!
//! Programs of different configurations or samples of one mechanism differ in their numbers only. They
//! are solved by an interior-point method written for this one form ([`kernel`](self)), in which all
//! eight do the same operations. Every answer is proved by its own primal and dual value; a program that
//! these do not prove is solved by itself, and counted, and a sample of all is solved by itself as well
//! and compared.

mod cones;
mod group;
mod kernel;
pub(crate) mod layout;
mod normal;
pub(crate) mod programs;
mod round;
mod start;
mod state;
mod unload;
mod vector;

pub use programs::Programs;

use std::borrow::Borrow;

use rayon::prelude::*;

use crate::cone::answer::{Answer, Outcome};
use crate::cone::bodies::Own;
use crate::cone::lanes::group::{Group, Memory};
use crate::cone::lanes::layout::{Layout, Question};
use crate::cone::lanes::vector::LANES;
use crate::cone::standard::ROUNDING;
use crate::cone::{Block, Kind, Program, Springs};
use crate::interrupt;
use crate::math::lanes::simd::dispatch;

/// Relative gap and residual up to which an answer needs no other.
const PROVED: f64 = 1e-9;
/// One program among so many is solved by itself for comparison.
const SAMPLED: usize = 2048;

/// Answers in the order of the programs.
#[derive(Clone, Debug, Default)]
pub struct Answers {
    /// What became of each program.
    pub outcomes: Vec<Outcome>,
    /// Displacements, by program and component.
    pub displacements: Vec<f64>,
    /// Multipliers, by program and equation.
    pub multipliers: Vec<f64>,
    /// Factor on the clearances.
    pub factors: Vec<f64>,
    /// Value of the displacements.
    pub values: Vec<f64>,
    /// Value of the multipliers.
    pub dual_values: Vec<f64>,
    /// Relative difference of the two.
    pub gaps: Vec<f64>,
    /// What the gaps are parts of.
    pub units: Vec<f64>,
    /// The largest violation of an equation, as a part of what the clearances reach.
    pub residuals: Vec<f64>,
    /// Programs that were solved by themselves, because eight at a time did not prove their answers.
    pub alone: usize,
    /// Programs that were solved by themselves for comparison.
    pub compared: usize,
    /// The largest difference of the value among these, relative as the gap is.
    pub difference: f64,
}

impl Programs<'_> {
    /// Kinds of the blocks of one program.
    #[must_use]
    pub fn kinds(&self, number: usize) -> &[Kind] {
        let first = if self.share_kinds() { 0 } else { number * self.n_blocks };
        &self.kinds[first..first + self.n_blocks]
    }

    /// Whether all programs have the same kinds.
    #[must_use]
    pub const fn share_kinds(&self) -> bool {
        self.kinds.len() == self.n_blocks
    }

    /// Number of components of all blocks.
    #[must_use]
    pub fn width(&self) -> usize {
        self.forces.len().checked_div(self.n).unwrap_or(0)
    }

    /// One of the programs.
    #[must_use]
    pub fn program(&self, number: usize) -> Program {
        let (s, width) = (self.n_equations, self.width());
        let forces = &self.forces[number * width..(number + 1) * width];
        let mut first = 0;
        let blocks = self.kinds(number).iter().map(|kind| {
            let size = kind.size();
            let at = first..first + size;
            first += size;
            let rows = (0..s).map(|i| (number * s + i) * width);
            Block {
                kind: kind.clone(),
                map: rows.flat_map(|row| &self.maps[row + at.start..row + at.end]).copied().collect(),
                force: forces[at.clone()].to_vec(),
            }
        });
        Program { blocks: blocks.collect(), right: self.rights[number * s..(number + 1) * s].to_vec() }
    }

    /// Programs with the same numbers of equations and of blocks, and of components of these.
    #[must_use]
    pub fn of<P: Borrow<Program>>(programs: &[P]) -> Self {
        let programs: Vec<&Program> = programs.iter().map(Borrow::borrow).collect();
        let mut all = Self { n: programs.len(), ..Self::default() };
        let (mut maps, mut forces, mut rights) = (Vec::new(), Vec::new(), Vec::new());
        if let Some(first) = programs.first() {
            (all.n_equations, all.n_blocks) = (first.n_equations(), first.blocks.len());
        }
        let same =
            programs.windows(2).all(|two| two[0].blocks.iter().zip(&two[1].blocks).all(|(a, b)| a.kind == b.kind));
        for (number, program) in programs.into_iter().enumerate() {
            if !same || number == 0 {
                all.kinds.extend(program.blocks.iter().map(|block| block.kind.clone()));
            }
            for i in 0..program.n_equations() {
                program.blocks.iter().for_each(|block| maps.extend_from_slice(block.row(i)));
            }
            program.blocks.iter().for_each(|block| forces.extend_from_slice(&block.force));
            rights.extend(&program.right);
        }
        (all.maps, all.forces, all.rights) = (maps.into(), forces.into(), rights.into());
        all
    }

    /// Solves all programs, and a sample of them by itself as well.
    #[must_use]
    pub fn solve(&self, question: Question) -> Answers {
        let mut all = self.solve_all(question);
        self.compare(question, &mut all);
        all
    }

    /// Solves all programs.
    #[must_use]
    pub(crate) fn solve_all(&self, question: Question) -> Answers {
        let layout = self.layout(question);
        let groups: Vec<usize> = (0..self.n).step_by(LANES).collect();
        let solved = groups.into_par_iter().map_init(Memory::default, |memory, first| {
            let count = LANES.min(self.n - first);
            self.solve_group(layout.as_ref(), question, first, count, memory)
        });
        let mut all = Answers::default();
        for part in solved.collect::<Vec<_>>() {
            all.append(part);
        }
        all
    }

    /// Solves all programs on this thread, and none of them again for comparison.
    #[must_use]
    pub fn solve_here(&self, question: Question) -> Answers {
        let layout = self.layout(question);
        let (mut memory, mut all) = (Memory::default(), Answers::default());
        for first in (0..self.n).step_by(LANES) {
            let count = LANES.min(self.n - first);
            all.append(self.solve_group(layout.as_ref(), question, first, count, &mut memory));
        }
        all
    }

    fn layout(&self, question: Question) -> Option<Layout> {
        if self.n == 0 { None } else { Layout::of(&self.program(0), question) }
    }

    /// Solves every program by itself.
    #[must_use]
    pub fn solve_alone(&self, question: Question) -> Answers {
        let each = (0..self.n).into_par_iter().map(|number| self.alone(question, number));
        let mut all = Answers { alone: self.n, ..Answers::default() };
        for answer in each.collect::<Vec<_>>() {
            all.push(&answer);
        }
        all
    }

    /// Solves one of the programs by itself.
    #[must_use]
    pub fn alone(&self, question: Question, number: usize) -> Answer {
        let program = self.program(number);
        match question {
            Question::Pose => program.pose(),
            Question::Assembly => program.assembly(Springs::Rigid),
        }
    }

    fn solve_group(
        &self,
        layout: Option<&Layout>,
        question: Question,
        first: usize,
        count: usize,
        memory: &mut Memory,
    ) -> Answers {
        interrupt::check();
        let mut answers = Answers::default();
        let fits = |layout: &Layout, number: usize| {
            let blocks = self.kinds(number).iter().zip(self.kinds(0)).zip(&layout.places);
            blocks.into_iter().all(|((kind, first), place)| {
                std::mem::discriminant(kind) == std::mem::discriminant(first)
                    && kind.size() == place.size
                    && kind.set().is_none_or(|set| layout.fits(&Own::of(set), place))
            })
        };
        let mut proved = [false; LANES];
        if let Some(layout) = layout {
            // The last programs fill up the lanes, and one that does not fit leaves its lane to another.
            let fitting = |lane: usize| lane < count && (self.share_kinds() || fits(layout, first + lane));
            if let Some(other) = (0..count).find(|lane| fitting(*lane)) {
                let lanes: [bool; LANES] = std::array::from_fn(fitting);
                let numbers = std::array::from_fn(|lane| first + if lanes[lane] { lane } else { other });
                dispatch(Group { layout, programs: self, numbers, memory });
                for lane in 0..count {
                    proved[lane] = lanes[lane] && self.proved(layout, first + lane, lane, memory);
                }
            }
        }
        for lane in 0..count {
            if proved[lane] {
                if let Some(layout) = layout {
                    answers.push_lane(layout, self.n_equations, lane, memory);
                }
            } else {
                answers.alone += usize::from(layout.is_some());
                answers.push(&self.alone(question, first + lane));
            }
        }
        answers
    }

    /// Whether primal and dual value prove the answer of a lane, the implied equations included.
    fn proved(&self, layout: &Layout, number: usize, lane: usize, memory: &Memory) -> bool {
        // Written so that what is no number proves nothing.
        if !(memory.gap.0[lane] <= PROVED && memory.residual.0[lane] <= PROVED) {
            return false;
        }
        layout.implied.iter().all(|i| {
            let at = number * self.n_equations + i;
            let row = &self.maps[at * layout.width..(at + 1) * layout.width];
            let (mut left, mut allowed) = (-self.rights[at], PROVED * self.rights[at].abs());
            for (a, d) in row.iter().zip(&memory.displacements) {
                left += a * d.0[lane];
                allowed += a.abs() * (PROVED * d.0[lane].abs() + ROUNDING);
            }
            left.abs() <= allowed
        })
    }

    /// Solves a sample by itself.
    fn compare(&self, question: Question, answers: &mut Answers) {
        let sample: Vec<usize> = (0..self.n).step_by(SAMPLED).collect();
        let differences = sample.par_iter().map(|number| {
            let alone = self.alone(question, *number);
            let difference = (alone.value - answers.values[*number]).abs();
            if alone.outcome == Outcome::Solved && alone.unit > 0.0 { difference / alone.unit } else { 0.0 }
        });
        answers.difference = differences.collect::<Vec<_>>().into_iter().fold(0.0, f64::max);
        answers.compared = sample.len();
    }
}

impl Answers {
    fn append(&mut self, other: Self) {
        self.outcomes.extend(other.outcomes);
        self.displacements.extend(other.displacements);
        self.multipliers.extend(other.multipliers);
        self.factors.extend(other.factors);
        self.values.extend(other.values);
        self.dual_values.extend(other.dual_values);
        self.gaps.extend(other.gaps);
        self.units.extend(other.units);
        self.residuals.extend(other.residuals);
        self.alone += other.alone;
    }

    fn push(&mut self, answer: &Answer) {
        self.outcomes.push(answer.outcome);
        self.displacements.extend(answer.displacements.iter().flatten());
        self.multipliers.extend(&answer.multipliers);
        self.factors.push(answer.factor);
        self.values.push(answer.value);
        self.dual_values.push(answer.dual_value);
        self.gaps.push(answer.gap);
        self.units.push(answer.unit);
        self.residuals.push(answer.residual);
    }

    fn push_lane(&mut self, layout: &Layout, n_equations: usize, lane: usize, memory: &Memory) {
        self.outcomes.push(Outcome::Solved);
        self.displacements.extend(memory.displacements.iter().map(|d| d.0[lane]));
        let first = self.multipliers.len();
        self.multipliers.resize(first + n_equations, 0.0);
        for (i, y) in layout.rows.iter().zip(&memory.multipliers) {
            self.multipliers[first + i] = y.0[lane];
        }
        self.factors.push(memory.factor.0[lane]);
        self.values.push(memory.value.0[lane]);
        self.dual_values.push(memory.dual_value.0[lane]);
        self.gaps.push(memory.gap.0[lane]);
        let unit = match layout.question {
            Question::Pose => memory.energy.0[lane],
            Question::Assembly => memory.unit.0[lane].min(1.0),
        };
        self.units.push(memory.value.0[lane].abs().max(memory.dual_value.0[lane].abs()).max(unit));
        self.residuals.push(memory.residual.0[lane]);
    }

    /// One of the answers, to one of the programs.
    #[must_use]
    pub fn answer(&self, programs: &Programs<'_>, number: usize) -> Answer {
        let (s, width) = (programs.n_equations, programs.width());
        let mut rest = &self.displacements[number * width..(number + 1) * width];
        let block = |kind: &Kind| {
            let (own, others) = rest.split_at(kind.size());
            rest = others;
            own.to_vec()
        };
        Answer {
            outcome: self.outcomes[number],
            displacements: programs.kinds(number).iter().map(block).collect(),
            multipliers: self.multipliers[number * s..(number + 1) * s].to_vec(),
            factor: self.factors[number],
            value: self.values[number],
            dual_value: self.dual_values[number],
            gap: self.gaps[number],
            unit: self.units[number],
            residual: self.residuals[number],
        }
    }
}
