//! One equation and no load: everything lies on a line, and the program has a closed form.
//!
//! The clearances take up what they reach, `H = sum_j h_j(+-A_j)`, and what is elastic the rest with the force
//! `y = +-max(0, |b| - H) / (A F A')`. Rigid bodies can be assembled with clearances `max(0, |b| - H_0) / H` times as
//! large, where `H_0` is what sets reach that the factor does not scale.

use crate::clearance::offset::inner;
use crate::cone::answer::{Answer, Outcome};
use crate::cone::lanes::layout::Question;
use crate::cone::{Kind, Program};

/// Where a unit of self-stress leads everything, and how far that goes in the equation.
#[derive(Default)]
struct Pushed {
    moved: Vec<Vec<f64>>,
    scaled: f64,
    fixed: f64,
    flexibility: f64,
}

impl Program {
    /// The answer, where there is one equation and no load that the question cares for.
    #[must_use]
    pub fn on_a_line(&self, question: Question) -> Option<Answer> {
        let [right] = self.right[..] else { return None };
        let is_free = || self.blocks.iter().all(|block| block.force.iter().all(|f| *f == 0.0));
        let blocks = self.blocks.iter().map(|block| (&block.kind, block.row(0).iter().copied()));
        (question == Question::Assembly || is_free()).then(|| on_a_line(right, question, blocks))
    }
}

/// The answer for blocks without a load, each with its coefficients in the equation.
pub(crate) fn on_a_line<'k>(
    right: f64,
    question: Question,
    blocks: impl Iterator<Item = (&'k Kind, impl Iterator<Item = f64>)> + Clone,
) -> Answer {
    let mut pushed = Pushed::default();
    let mut stress = Vec::new();
    for (kind, row) in blocks.clone() {
        stress.clear();
        stress.extend(row.map(|a| a * right.signum()));
        let (moved, reach): (Vec<f64>, _) = match kind {
            Kind::Clearance(set) => (set.face(&stress, 0.0).centre[..stress.len()].to_vec(), &mut pushed.scaled),
            Kind::Fixed(set) => (set.face(&stress, 0.0).centre[..stress.len()].to_vec(), &mut pushed.fixed),
            Kind::Spring(compliance) => {
                let moved = compliance.chunks_exact(stress.len()).map(|row| inner(row, &stress));
                (moved.collect(), &mut pushed.flexibility)
            }
        };
        *reach += inner(&stress, &moved);
        pushed.moved.push(moved);
    }
    let kinds = blocks.map(|(kind, _)| kind);
    match question {
        Question::Pose => pushed.pose(right, kinds),
        Question::Assembly => pushed.assembly(right, kinds),
    }
}

impl Pushed {
    /// Everything moved as far as a self-stress of one leads it times a size for each kind.
    fn answer<'k>(
        mut self,
        kinds: impl Iterator<Item = &'k Kind>,
        size: impl Fn(&Kind) -> f64,
        multiplier: f64,
    ) -> Answer {
        for (kind, moved) in kinds.zip(&mut self.moved) {
            let size = size(kind);
            for d in moved.iter_mut() {
                *d *= size;
            }
        }
        Answer {
            outcome: if multiplier.is_finite() { Outcome::Solved } else { Outcome::Infeasible },
            displacements: self.moved,
            multipliers: vec![multiplier],
            factor: 1.0,
            value: 0.0,
            dual_value: 0.0,
            gap: 0.0,
            unit: 0.0,
            residual: 0.0,
        }
    }

    fn pose<'k>(self, right: f64, kinds: impl Iterator<Item = &'k Kind>) -> Answer {
        let reach = self.scaled + self.fixed;
        let left = right.abs() - reach;
        let within = if reach > 0.0 { (right.abs() / reach).min(1.0) } else { 0.0 };
        let force = if left > 0.0 { left / self.flexibility } else { 0.0 };
        let size = |kind: &Kind| if matches!(kind, Kind::Spring(_)) { force } else { within };
        let value = if force > 0.0 { 0.5 * force * left } else { 0.0 };
        let answer = self.answer(kinds, size, right.signum() * force);
        Answer { value, dual_value: value, unit: value, ..answer }
    }

    fn assembly<'k>(self, right: f64, kinds: impl Iterator<Item = &'k Kind>) -> Answer {
        let left = right.abs() - self.fixed;
        let within = if self.fixed > 0.0 { (right.abs() / self.fixed).min(1.0) } else { 0.0 };
        let factor = if left > 0.0 { left / self.scaled } else { 0.0 };
        let size = |kind: &Kind| match kind {
            Kind::Clearance(_) => factor,
            Kind::Fixed(_) => within,
            Kind::Spring(_) => 0.0,
        };
        // The self-stress that does one unit of work in the clearances.
        let multiplier = if left > 0.0 { right.signum() / self.scaled } else { 0.0 };
        let answer = self.answer(kinds, size, multiplier);
        Answer { factor, value: factor, dual_value: factor, unit: factor, ..answer }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clearance::Set;
    use crate::cone::{Block, Springs};

    #[test]
    fn the_closed_form_is_the_solvers_answer() {
        let block = |kind: Kind, map: &[f64]| Block { kind, map: map.to_vec(), force: vec![0.0; map.len()] };
        // Not 0.3, where the dead band ends: the energy is so flat there that 1e-13 of it leaves 1e-5 of the force.
        for right in [-0.9, -0.31, 0.25, 0.32, 2.0] {
            let program = Program {
                right: vec![right],
                blocks: vec![
                    block(Kind::Clearance(Set::Disc { radius: 0.1 }), &[0.6, -0.8]),
                    block(Kind::Clearance(Set::Diamond { gap: 0.2, half_length: 2.0 }), &[1.0, 0.5]),
                    block(Kind::Spring(vec![0.02, 0.01, 0.01, 0.03]), &[0.5, -1.0]),
                ],
            };
            let (line, solved) = (program.on_a_line(Question::Pose).unwrap(), program.pose());
            assert_eq!((line.outcome, solved.outcome), (Outcome::Solved, Outcome::Solved));
            assert!((line.multipliers[0] - solved.multipliers[0]).abs() < 1e-6, "{right} {line:?} {solved:?}");
            assert!((line.value - solved.value).abs() < 1e-8);
            let sum: f64 = program.blocks.iter().zip(&line.displacements).map(|(b, d)| inner(b.row(0), d)).sum();
            assert!((sum - right).abs() < 1e-14);
            if right.abs() > 0.3 {
                for (a, b) in line.displacements.iter().flatten().zip(solved.displacements.iter().flatten()) {
                    assert!((a - b).abs() < 1e-6, "{right} {line:?} {solved:?}");
                }
            }
        }
        let rigid =
            Program { right: vec![0.2], blocks: vec![block(Kind::Clearance(Set::Disc { radius: 0.1 }), &[1.0, 0.0])] };
        assert_eq!(rigid.on_a_line(Question::Pose).unwrap().outcome, Outcome::Infeasible);
    }

    #[test]
    fn the_smallest_factor_on_a_line_is_the_solvers() {
        let block = |kind: Kind, map: &[f64]| Block { kind, map: map.to_vec(), force: vec![3.0; map.len()] };
        for right in [-0.9, -0.05, 0.02, 0.25, 2.0] {
            let program = Program {
                right: vec![right],
                blocks: vec![
                    block(Kind::Clearance(Set::Disc { radius: 0.1 }), &[0.6, -0.8]),
                    block(Kind::Clearance(Set::Interval { low: -0.1, high: 0.3 }), &[0.7]),
                    block(Kind::Fixed(Set::Interval { low: -0.1, high: 0.03 }), &[1.0]),
                    block(Kind::Spring(vec![0.02, 0.01, 0.01, 0.03]), &[0.5, -1.0]),
                ],
            };
            let line = program.on_a_line(Question::Assembly).unwrap();
            let solved = program.assembly(Springs::Rigid);
            assert_eq!((line.outcome, solved.outcome), (Outcome::Solved, Outcome::Solved));
            assert!((line.factor - solved.factor).abs() < 1e-8, "{right} {line:?} {solved:?}");
            assert!((line.multipliers[0] - solved.multipliers[0]).abs() < 1e-6, "{right} {line:?} {solved:?}");
            let sum: f64 = program.blocks.iter().zip(&line.displacements).map(|(b, d)| inner(b.row(0), d)).sum();
            assert!((sum - right).abs() < 1e-14);
        }
        let stiff = Program { right: vec![0.2], blocks: vec![block(Kind::Spring(vec![0.1]), &[1.0])] };
        assert_eq!(stiff.on_a_line(Question::Assembly).unwrap().outcome, Outcome::Infeasible);
    }
}
