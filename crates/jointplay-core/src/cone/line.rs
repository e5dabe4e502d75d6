//! One equation and no load: everything lies on a line, and the program has a closed form.
//!
//! The clearances take up what they reach, `H = sum_j h_j(+-A_j)`, and what is elastic the rest with the force
//! `y = +-max(0, |b| - H) / (A F A')`.

use super::{Answer, Kind, Outcome, Program};
use crate::clearance::inner;

impl Program {
    /// The pose when no load acts.
    #[must_use]
    pub fn unloaded(&self) -> Answer {
        let is_free = self.blocks.iter().all(|block| block.force.iter().all(|f| *f == 0.0));
        match self.right[..] {
            [right] if is_free => self.on_a_line(right),
            _ => self.pose(),
        }
    }

    fn on_a_line(&self, right: f64) -> Answer {
        let side = [right.signum()];
        // What a unit of self-stress makes everything do, and how far that goes in the equation.
        let pushed = self.blocks.iter().map(|block| {
            let stress = block.stress(&side);
            match &block.kind {
                Kind::Clearance(set) | Kind::Fixed(set) => set.face(&stress, 0.0).centre[..block.size()].to_vec(),
                Kind::Spring(compliance) => {
                    compliance.chunks_exact(block.size()).map(|row| inner(row, &stress)).collect()
                }
            }
        });
        let pushed: Vec<Vec<f64>> = pushed.collect();
        let (mut reach, mut flexibility) = (0.0, 0.0);
        for (block, moved) in self.blocks.iter().zip(&pushed) {
            let part = inner(&block.stress(&side), moved);
            *(if matches!(block.kind, Kind::Spring(_)) { &mut flexibility } else { &mut reach }) += part;
        }
        let left = right.abs() - reach;
        let within = if reach > 0.0 { (right.abs() / reach).min(1.0) } else { 0.0 };
        let force = if left > 0.0 { left / flexibility } else { 0.0 };
        let outcome = if force.is_finite() { Outcome::Solved } else { Outcome::Infeasible };
        let size = |kind: &Kind| if matches!(kind, Kind::Spring(_)) { force } else { within };
        let value = if force > 0.0 { 0.5 * force * left } else { 0.0 };
        Answer {
            outcome,
            displacements: self
                .blocks
                .iter()
                .zip(&pushed)
                .map(|(block, moved)| moved.iter().map(|d| size(&block.kind) * d).collect())
                .collect(),
            multipliers: vec![side[0] * force],
            factor: 1.0,
            value,
            dual_value: value,
            gap: 0.0,
            unit: value,
            residual: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Block;
    use super::*;
    use crate::clearance::Set;

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
            let (line, solved) = (program.unloaded(), program.pose());
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
        assert_eq!(rigid.unloaded().outcome, Outcome::Infeasible);
    }
}
